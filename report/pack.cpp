#include "report/pack.hpp"

#include <algorithm>
#include <boost/iostreams/filter/zlib.hpp>
#include <boost/iostreams/filtering_stream.hpp>
#include <cmath>
#include <sstream>

namespace vstent::report {
namespace {

constexpr double kSteps = 65535;
constexpr std::uint32_t kNoValue = 65535;

nlohmann::ordered_json to_json(const Vec3& p) { return {p[0], p[1], p[2]}; }

std::vector<std::uint32_t> rounded(std::span<const Vec3> points, const Box& box) {
  std::vector<std::uint32_t> values;
  values.reserve(3 * points.size());
  for (const Vec3& p : points) {
    for (int k = 0; k < 3; ++k) {
      const double size = box.upper[k] - box.lower[k];
      const double share = size > 0 ? std::clamp((p[k] - box.lower[k]) / size, 0.0, 1.0) : 0.0;
      values.push_back(static_cast<std::uint32_t>(std::lround(share * kSteps)));
    }
  }
  return values;
}

std::string deflated(const std::string& bytes) {
  namespace io = boost::iostreams;
  std::ostringstream compressed;
  {
    io::filtering_ostream stream;
    stream.push(io::zlib_compressor(io::zlib::best_compression));
    stream.push(compressed);
    stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  }
  return compressed.str();
}

}  // namespace

double rounding(const Box& box) { return 0.5 * (box.upper - box.lower).maxCoeff() / kSteps; }

std::string base64(std::string_view bytes) {
  constexpr const char* kLetters =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      group = group << 8 | (k < count ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      text += k <= count ? kLetters[group >> (18 - 6 * k) & 63] : '=';
    }
  }
  return text;
}

nlohmann::ordered_json& Pack::append(const std::string& name, std::span<const std::uint32_t> values,
                                     int components, int bytes) {
  const std::uint32_t mask = bytes == 2 ? 0xffffu : 0xffffffffu;
  const int top_bit = 8 * bytes - 1;
  const auto stride = static_cast<std::size_t>(components);
  std::vector<std::uint32_t> filtered(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    const std::uint32_t before = i < stride ? 0 : values[i - stride];
    const std::uint32_t difference = (values[i] - before) & mask;
    const std::uint32_t sign = difference >> top_bit ? mask : 0u;
    filtered[i] = ((difference << 1) ^ sign) & mask;
  }
  const std::size_t offset = bytes_.size();
  for (int b = 0; b < bytes; ++b) {
    for (const std::uint32_t value : filtered)
      bytes_ += static_cast<char>(static_cast<unsigned char>(value >> (8 * b)));
  }
  arrays_.push_back({{"name", name},
                     {"offset", offset},
                     {"length", values.size()},
                     {"components", components},
                     {"bytes", bytes}});
  return arrays_.back();
}

void Pack::points(const std::string& name, std::span<const Vec3> points, const Box& box) {
  nlohmann::ordered_json& entry = append(name, rounded(points, box), 3, 2);
  entry["box"] = {to_json(box.lower), to_json(box.upper)};
}

void Pack::points(const std::string& name, std::span<const Vec3> points, const Box& box,
                  const std::string& reference, std::span<const Vec3> reference_points) {
  std::vector<std::uint32_t> values = rounded(points, box);
  const std::vector<std::uint32_t> subtracted = rounded(reference_points, box);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = (values[i] - subtracted[i]) & 0xffffu;
  nlohmann::ordered_json& entry = append(name, values, 3, 2);
  entry["box"] = {to_json(box.lower), to_json(box.upper)};
  entry["reference"] = reference;
}

void Pack::triangles(const std::string& name, std::span<const Triangle> triangles) {
  std::vector<std::uint32_t> values;
  values.reserve(3 * triangles.size());
  for (const Triangle& t : triangles) {
    for (const int v : t) values.push_back(static_cast<std::uint32_t>(v));
  }
  append(name, values, 3, 4);
}

void Pack::field(const std::string& name, std::span<const double> values) {
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (const double v : values) {
    if (!std::isfinite(v)) continue;
    low = std::min(low, v);
    high = std::max(high, v);
  }
  const double scale = high > low ? (kSteps - 1) / (high - low) : 0;
  std::vector<std::uint32_t> steps;
  steps.reserve(values.size());
  for (const double v : values) {
    steps.push_back(std::isfinite(v) ? static_cast<std::uint32_t>(std::lround((v - low) * scale))
                                     : kNoValue);
  }
  nlohmann::ordered_json& entry = append(name, steps, 1, 2);
  if (high >= low) {
    entry["low"] = low;
    entry["high"] = high;
  }
}

void Pack::counts(const std::string& name, std::span<const std::size_t> counts) {
  std::vector<std::uint32_t> values;
  for (const std::size_t count : counts) values.push_back(static_cast<std::uint32_t>(count));
  append(name, values, 1, 4);
}

nlohmann::ordered_json Pack::json() const {
  return {{"arrays", arrays_}, {"data", base64(deflated(bytes_))}};
}

}  // namespace vstent::report

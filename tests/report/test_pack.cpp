// What is packed comes out again: decoded here as the format says, value by value.
#include <gtest/gtest.h>

#include <boost/iostreams/filter/zlib.hpp>
#include <boost/iostreams/filtering_stream.hpp>
#include <random>
#include <sstream>

#include "report/pack.hpp"
#include "report/simplify.hpp"

namespace vstent::report {
namespace {

using nlohmann::ordered_json;

std::string from_base64(const std::string& text) {
  static const std::string kLetters =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    if (c == '=') break;
    bits = bits << 6 | static_cast<std::uint32_t>(kLetters.find(c));
    count += 6;
    if (count >= 8) {
      count -= 8;
      bytes += static_cast<char>(bits >> count & 255u);
    }
  }
  return bytes;
}

std::string inflated(const std::string& bytes) {
  boost::iostreams::filtering_istream stream;
  stream.push(boost::iostreams::zlib_decompressor());
  std::istringstream source(bytes);
  stream.push(source);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// The integers of the array called `name`.
std::vector<std::uint32_t> unpacked(const ordered_json& pack, const std::string& name) {
  const std::string bytes = inflated(from_base64(pack.at("data")));
  for (const ordered_json& entry : pack.at("arrays")) {
    if (entry.at("name") != name) continue;
    const std::size_t offset = entry.at("offset"), length = entry.at("length");
    const std::size_t width = entry.at("bytes"), components = entry.at("components");
    std::vector<std::uint32_t> values(length);
    for (std::size_t i = 0; i < length; ++i) {
      std::uint32_t z = 0;
      for (std::size_t b = 0; b < width; ++b)
        z |= std::uint32_t{static_cast<unsigned char>(bytes[offset + b * length + i])} << (8 * b);
      const std::uint32_t difference = (z >> 1) ^ (~(z & 1) + 1);
      values[i] = difference + (i < components ? 0 : values[i - components]);
      if (width == 2) values[i] &= 0xffffu;
    }
    return values;
  }
  ADD_FAILURE() << "no array " << name;
  return {};
}

std::vector<Vec3> random_points(std::size_t count, const Box& box, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> share(0, 1);
  std::vector<Vec3> points(count);
  for (Vec3& p : points) {
    for (int k = 0; k < 3; ++k) p[k] = box.lower[k] + share(random) * (box.upper[k] - box.lower[k]);
  }
  points.front() = box.lower;
  points.back() = box.upper;
  return points;
}

const Box kBox{Vec3(-3, 10, 0), Vec3(200, 11, 40)};

TEST(Pack, PointsComeBackWithinHalfAStepOfTheBox) {
  const std::vector<Vec3> points = random_points(1000, kBox, 1);
  const std::vector<Vec3> others = random_points(1000, kBox, 2);
  Pack pack;
  pack.points("p", points, kBox);
  pack.points("q", others, kBox, "p", points);
  const ordered_json json = pack.json();
  const std::vector<std::uint32_t> p = unpacked(json, "p");
  const std::vector<std::uint32_t> offsets = unpacked(json, "q");
  ASSERT_EQ(p.size(), 3000u);
  for (std::size_t i = 0; i < p.size(); ++i) {
    const int k = static_cast<int>(i % 3);
    const double step = (kBox.upper[k] - kBox.lower[k]) / 65535;
    const double slack = 1e-9 * step;
    EXPECT_NEAR(kBox.lower[k] + p[i] * step, points[i / 3][k], 0.5 * step + slack);
    const std::uint32_t q = (p[i] + offsets[i]) & 0xffffu;
    EXPECT_NEAR(kBox.lower[k] + q * step, others[i / 3][k], 0.5 * step + slack);
    EXPECT_LE(0.5 * step, rounding(kBox) + slack);
  }
}

TEST(Pack, ABoxWithoutWidthHoldsItsOnePlace) {
  Pack pack;
  const std::vector<Vec3> points(3, Vec3(1, 2, 3));
  pack.points("p", points, {points[0], points[0]});
  EXPECT_EQ(unpacked(pack.json(), "p"), std::vector<std::uint32_t>(9, 0));
}

TEST(Pack, TrianglesAndCountsComeBackAsTheyWere) {
  std::mt19937 random(3);
  std::vector<Triangle> triangles(500);
  for (Triangle& t : triangles) {
    for (int& v : t) v = static_cast<int>(random() % 2'000'000'000u);
  }
  const std::vector<std::size_t> counts{0, 5, 70000, 1};
  Pack pack;
  pack.triangles("t", triangles);
  pack.counts("c", counts);
  const ordered_json json = pack.json();
  const std::vector<std::uint32_t> corners = unpacked(json, "t");
  for (std::size_t i = 0; i < corners.size(); ++i)
    EXPECT_EQ(corners[i], static_cast<std::uint32_t>(triangles[i / 3][i % 3]));
  EXPECT_EQ(unpacked(json, "c"), (std::vector<std::uint32_t>{0, 5, 70000, 1}));
}

TEST(Pack, FieldsComeBackWithinHalfAStepAndGapsStayGaps) {
  std::vector<double> values{-1.5, 0.25, std::nan(""), 7, 3.3, INFINITY};
  Pack pack;
  pack.field("f", values);
  pack.field("gaps", std::vector<double>(4, std::nan("")));
  pack.field("constant", std::vector<double>(4, 2.5));
  const ordered_json json = pack.json();
  const std::vector<std::uint32_t> steps = unpacked(json, "f");
  const ordered_json& entry = json.at("arrays")[0];
  EXPECT_EQ(entry.at("low"), -1.5);
  EXPECT_EQ(entry.at("high"), 7.0);
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values[i])) {
      EXPECT_EQ(steps[i], 65535u);
    } else {
      EXPECT_NEAR(-1.5 + steps[i] * 8.5 / 65534, values[i], 0.5 * 8.5 / 65534 + 1e-12);
    }
  }
  EXPECT_FALSE(json.at("arrays")[1].contains("low"));
  EXPECT_EQ(unpacked(json, "gaps"), std::vector<std::uint32_t>(4, 65535));
  EXPECT_EQ(unpacked(json, "constant"), std::vector<std::uint32_t>(4, 0));
}

TEST(Pack, Base64AsRfc4648Has) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64("foob"), "Zm9vYg==");
  EXPECT_EQ(base64("\xff\xfe\xfd"), "//79");
}

TEST(Simplify, APlaneNeedsFewTrianglesAndKeepsItsRim) {
  constexpr int kSide = 20;
  TriangleMesh mesh;
  for (int y = 0; y <= kSide; ++y) {
    for (int x = 0; x <= kSide; ++x) mesh.points.emplace_back(x, y, 0.0);
  }
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const int a = y * (kSide + 1) + x;
      mesh.triangles.push_back({a, a + 1, a + kSide + 2});
      mesh.triangles.push_back({a, a + kSide + 2, a + kSide + 1});
    }
  }
  const Simplified result = simplify(mesh, 0.01);
  EXPECT_EQ(result.triangles_before, 800u);
  EXPECT_LT(result.mesh.triangles.size(), 100u);
  EXPECT_LE(result.error, 0.01);
  double area = 0;
  for (const Triangle& t : result.mesh.triangles) {
    const auto p = [&](int k) { return result.mesh.points[static_cast<std::size_t>(t[k])]; };
    area += 0.5 * (p(1) - p(0)).cross(p(2) - p(0)).z();
  }
  EXPECT_NEAR(area, kSide * kSide, 1e-9 * kSide * kSide);
}

}  // namespace
}  // namespace vstent::report

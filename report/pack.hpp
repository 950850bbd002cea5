// Geometry and fields as the page carries them: quantised, filtered, deflated, base64.
#pragma once

#include <nlohmann/json.hpp>
#include <span>
#include <string>

#include "sdf/geometry.hpp"

namespace vstent::report {

/// Arrays of small integers, one after the other. Each is stored as the difference to the tuple
/// before (mod 2^bits, zigzag), lowest bytes of all values first: neighbours are alike, so most
/// bytes are zero. The page undoes this in page/unpack.js.
class Pack {
 public:
  /// Points inside `box`, rounded to 1/65535 of it per axis.
  void points(const std::string& name, std::span<const Vec3> points, const Box& box);
  /// As offsets from equally many points of an array with the same box, which the page has unpacked
  /// before.
  void points(const std::string& name, std::span<const Vec3> points, const Box& box,
              const std::string& reference, std::span<const Vec3> reference_points);
  void triangles(const std::string& name, std::span<const Triangle> triangles);
  /// Rounded to 1/65534 of their range; what is not finite is marked as no value.
  void field(const std::string& name, std::span<const double> values);
  void counts(const std::string& name, std::span<const std::size_t> counts);

  /// {"arrays": [...], "data": base64 of zlib}
  nlohmann::ordered_json json() const;

 private:
  nlohmann::ordered_json& append(const std::string& name, std::span<const std::uint32_t> values,
                                 int components, int bytes);

  nlohmann::ordered_json arrays_ = nlohmann::ordered_json::array();
  std::string bytes_;
};

/// The largest rounding of a coordinate in this box, mm.
double rounding(const Box& box);

std::string base64(std::string_view bytes);

}  // namespace vstent::report

#include "sdf/prepared_solid.hpp"

#include <cmath>
#include <stdexcept>
#include <string>

namespace vstent::sdf {
namespace {

[[noreturn]] void refuse(const char* kind, std::size_t index, const std::string& what) {
  throw std::invalid_argument("solid: " + std::string(kind) + " " + std::to_string(index) + " " +
                              what);
}

void check(const Segment& segment, std::size_t index, int caps, Joints joints) {
  if (!segment.a.allFinite() || !segment.b.allFinite())
    refuse("segment", index, "has a coordinate that is not finite");
  if (!std::isfinite(segment.radius_a) || !std::isfinite(segment.radius_b) ||
      segment.radius_a < 0 || segment.radius_b < 0) {
    refuse("segment", index,
           "has radii " + std::to_string(segment.radius_a) + " and " +
               std::to_string(segment.radius_b) + " mm; they must be finite and not negative");
  }
  if (segment.start_cap >= caps || segment.end_cap >= caps)
    refuse("segment", index, "names an end cap that does not exist");
  if (joints == Joints::flat && !((segment.b - segment.a).norm() > 0))
    refuse("segment", index, "has no length, so a flat-capped cylinder has no direction");
}

void check(const Strut& strut, std::size_t index) {
  if (!strut.a.allFinite() || !strut.b.allFinite() || !strut.normal.allFinite())
    refuse("strut", index, "has a coordinate that is not finite");
  if (!(strut.width > 0) || !(strut.thickness > 0) || !std::isfinite(strut.width) ||
      !std::isfinite(strut.thickness)) {
    refuse("strut", index,
           "is " + std::to_string(strut.width) + " mm wide and " + std::to_string(strut.thickness) +
               " mm thick; both must be positive and finite");
  }
  constexpr double kRounding = 1e-9;
  const double roundest = 0.5 * std::min(strut.width, strut.thickness);
  if (!(strut.edge_radius >= 0) || !(strut.edge_radius <= roundest * (1 + kRounding))) {
    refuse("strut", index,
           "has an edge radius of " + std::to_string(strut.edge_radius) + " mm; it may be 0 to " +
               std::to_string(roundest) + " mm, half of its width or thickness");
  }
  constexpr double kSkew = 1e-6;
  const Vec3 along = strut.b - strut.a;
  if (std::abs(strut.normal.norm() - 1) > kSkew ||
      std::abs(strut.normal.dot(along)) > kSkew * along.norm()) {
    refuse("strut", index, "has a normal that is not unit and perpendicular to its axis");
  }
}

}  // namespace

double PreparedStrut::outer_radius() const {
  return std::hypot(half_width, half_thickness) + edge_radius;
}

PreparedSegment prepare(const Segment& segment, Joints joints) {
  const Vec3 axis = segment.b - segment.a;
  const double length = axis.norm();
  const double drop = segment.radius_a - segment.radius_b;
  PreparedSegment prepared{.a = segment.a,
                           .axis = Vec3::Zero(),
                           .length = 0,
                           .radius = segment.radius_a,
                           .sine = 0,
                           .tangent = 0,
                           .start_cap = segment.start_cap,
                           .end_cap = segment.end_cap};
  if (joints == Joints::flat) {
    prepared.axis = axis / length;
    prepared.length = length;
    prepared.radius = 0.5 * (segment.radius_a + segment.radius_b);
  } else if (std::abs(drop) < length) {
    prepared.axis = axis / length;
    prepared.length = length;
    prepared.sine = drop / length;
    prepared.tangent = prepared.sine / std::sqrt((1 - prepared.sine) * (1 + prepared.sine));
  } else if (drop < 0) {
    prepared.a = segment.b;
    prepared.radius = segment.radius_b;
  }
  return prepared;
}

PreparedStrut prepare(const Strut& strut) {
  const Vec3 along = strut.b - strut.a;
  const double length = along.norm();
  const Vec3 axis = length > 0 ? Vec3(along / length) : Vec3(Vec3::Zero());
  return {.a = strut.a,
          .axis = axis,
          .normal = (strut.normal - strut.normal.dot(axis) * axis).normalized(),
          .length = length,
          .half_width = std::max(0.0, 0.5 * strut.width - strut.edge_radius),
          .half_thickness = std::max(0.0, 0.5 * strut.thickness - strut.edge_radius),
          .edge_radius = strut.edge_radius};
}

PreparedSolid::PreparedSolid(const Solid& solid) : caps_(solid.caps), joints_(solid.joints) {
  check(solid);
  segments_.reserve(solid.segments.size());
  for (const Segment& segment : solid.segments) segments_.push_back(prepare(segment, joints_));
  struts_.reserve(solid.struts.size());
  for (const Strut& strut : solid.struts) struts_.push_back(prepare(strut));
}

void check(const Solid& solid) {
  if (solid.segments.empty() && solid.struts.empty())
    throw std::invalid_argument("solid: neither segments nor struts");
  const int caps = static_cast<int>(solid.caps.size());
  for (std::size_t i = 0; i < solid.segments.size(); ++i)
    check(solid.segments[i], i, caps, solid.joints);
  for (std::size_t i = 0; i < solid.struts.size(); ++i) check(solid.struts[i], i);
}

}  // namespace vstent::sdf

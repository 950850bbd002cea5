#include "deployment/strut_solid.hpp"

namespace vstent::deployment {

sdf::Solid strut_solid(const stents::PlacedStent& stent) {
  const stents::CrossSection& section = stent.section;
  sdf::Solid solid;
  for (const stents::PlacedMember& member : stent.members) {
    const std::size_t points = member.points.size();
    const std::size_t pieces = member.closed ? points : points - 1;
    for (std::size_t i = 0; i < pieces; ++i) {
      const std::size_t next = (i + 1) % points;
      const Vec3& a = member.points[i];
      const Vec3& b = member.points[next];
      const Vec3 along = b - a;
      if (along.isZero()) continue;
      if (section.round) {
        const double radius = 0.5 * section.width;
        solid.segments.push_back({.a = a, .b = b, .radius_a = radius, .radius_b = radius});
      } else {
        const Vec3 outward = member.outward[i] + member.outward[next];
        const Vec3 normal = outward - outward.dot(along) / along.squaredNorm() * along;
        solid.struts.push_back({.a = a,
                                .b = b,
                                .normal = normal.normalized(),
                                .width = section.width,
                                .thickness = section.thickness,
                                .edge_radius = section.edge_radius});
      }
    }
  }
  return solid;
}

}  // namespace vstent::deployment

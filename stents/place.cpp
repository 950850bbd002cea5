#include "stents/place.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "sdf/polyline.hpp"
#include "stents/bent_tube.hpp"
#include "stents/strut_network.hpp"

namespace vstent::stents {
namespace {

double outer_radius_of(const Pattern& pattern) {
  double radius = 0;
  for (const Member& member : pattern.members)
    for (const PatternPoint& p : member.points) radius = std::max(radius, p.radius);
  return radius + 0.5 * pattern.section.thickness;
}

PlacedMember placed_on(const BentTube& tube, const Member& member) {
  PlacedMember placed{member.kind, member.closed, member.ring, member.next_ring, {}, {}};
  for (const PatternPoint& p : member.points) {
    const BentTube::Place place = tube.at(p.z);
    placed.outward.push_back(place.outward(p.angle));
    placed.points.push_back(place.centre + p.radius * placed.outward.back());
  }
  return placed;
}

/// The frame of the ring's middle serves all of it.
PlacedMember placed_rigidly(const BentTube& tube, const Ring& ring, const Member& member) {
  PlacedMember placed{member.kind, member.closed, member.ring, member.next_ring, {}, {}};
  const BentTube::Place middle = tube.at(ring.z);
  for (const PatternPoint& p : member.points) {
    placed.outward.push_back(middle.outward(p.angle));
    placed.points.push_back(middle.centre + p.radius * placed.outward.back() +
                            (p.z - ring.z) * middle.frame.tangent);
  }
  return placed;
}

/// A connector between two ends in the tube's coordinates: its course from end to end moves with
/// them, and its bulges, the departures from that course, grow or shrink together until it has its
/// length again. One without bulges, or too short for the distance, becomes straight.
Member reconnected(const BentTube& tube, const Member& connector, const PatternPoint& from,
                   const PatternPoint& to) {
  const std::vector<PatternPoint>& old = connector.points;
  const std::size_t n = old.size();
  std::vector<double> arc(n, 0.0);
  for (std::size_t i = 1; i < n; ++i)
    arc[i] = arc[i - 1] + (straight_point(old[i]) - straight_point(old[i - 1])).norm();
  const auto between = [](const PatternPoint& a, const PatternPoint& b, double t) {
    return PatternPoint{a.radius + t * (b.radius - a.radius), a.angle + t * (b.angle - a.angle),
                        a.z + t * (b.z - a.z)};
  };
  // Shares of the way by projection on the chord, so that what is straight has no bulge.
  const double r = 0.5 * (old.front().radius + old.back().radius);
  const double chord_x = r * (old.back().angle - old.front().angle);
  const double chord_z = old.back().z - old.front().z;
  const double chord2 = chord_x * chord_x + chord_z * chord_z;
  std::vector<double> share(n);
  std::vector<PatternPoint> bulge(n);
  for (std::size_t i = 0; i < n; ++i) {
    const double along =
        r * (old[i].angle - old.front().angle) * chord_x + (old[i].z - old.front().z) * chord_z;
    share[i] = chord2 > 0 ? along / chord2 : arc[i] / arc.back();
    const PatternPoint course = between(old.front(), old.back(), share[i]);
    bulge[i] = {old[i].radius - course.radius, old[i].angle - course.angle, old[i].z - course.z};
  }
  bulge.front() = bulge.back() = {};
  share.front() = 0;
  share.back() = 1;
  const auto shaped = [&](double factor) {
    Member result = connector;
    for (std::size_t i = 0; i < n; ++i) {
      PatternPoint& p = result.points[i];
      p = between(from, to, share[i]);
      p.radius += bulge[i].radius;
      p.angle += factor * bulge[i].angle;
      p.z += factor * bulge[i].z;
    }
    return result;
  };
  const auto excess = [&](double factor) {
    const Member member = shaped(factor);
    double sum = 0;
    for (std::size_t i = 1; i < n; ++i)
      sum += (tube.point(member.points[i]) - tube.point(member.points[i - 1])).norm();
    return sum - arc.back();
  };
  const double tolerance = 1e-12 * arc.back();
  if (std::abs(excess(1)) <= tolerance) return shaped(1);
  double flattest_bulge = 0;
  for (const PatternPoint& b : bulge)
    flattest_bulge = std::max(flattest_bulge, std::hypot(r * b.angle, b.z));
  if (flattest_bulge < 1e-6 * arc.back() || excess(0) >= 0) return shaped(0);
  double low = 0, high = 1;
  for (int i = 0; excess(high) < 0 && i < 6; ++i) high *= 2;
  if (excess(high) < 0) return shaped(high);
  for (int i = 0; i < 60 && high - low > 1e-14; ++i) {
    const double middle = 0.5 * (low + high);
    (excess(middle) < 0 ? low : high) = middle;
  }
  return shaped(0.5 * (low + high));
}

/// An end of a connector where rigid rings have taken it.
PatternPoint rigid_end(const BentTube& tube, const Pattern& pattern, int ring,
                       const PatternPoint& p) {
  if (ring < 0) return p;
  const Ring& owner = pattern.rings[static_cast<std::size_t>(ring)];
  const BentTube::Place middle = tube.at(owner.z);
  const Vec3 x =
      middle.centre + p.radius * middle.outward(p.angle) + (p.z - owner.z) * middle.frame.tangent;
  return tube.coordinates(x, p);
}

double piece_length(const Polyline& points, const Piece& piece) {
  const int n = static_cast<int>(points.size());
  double sum = 0;
  for (int i = piece.first; i < piece.last; ++i)
    sum += (points[static_cast<std::size_t>((i + 1) % n)] - points[static_cast<std::size_t>(i % n)])
               .norm();
  return sum;
}

void measure_strains(const StrutNetwork& network, PlacedStent& stent) {
  for (const Piece& piece : network.pieces) {
    const PlacedMember& member = stent.members[static_cast<std::size_t>(piece.member)];
    const double strain = std::abs(piece_length(member.points, piece) / piece.length - 1);
    double& largest = member.kind == Member::Kind::connector ? stent.largest_connector_strain
                                                             : stent.largest_strut_strain;
    largest = std::max(largest, strain);
  }
}

/// How far joined places move apart. Wires that cross are joined across the weave.
void measure_gaps(const Pattern& pattern, const StrutNetwork& network, PlacedStent& stent) {
  struct End {
    int member, point;
  };
  std::vector<std::vector<End>> ends(static_cast<std::size_t>(network.joints));
  for (const Piece& piece : network.pieces) {
    const auto n =
        static_cast<int>(pattern.members[static_cast<std::size_t>(piece.member)].points.size());
    ends[static_cast<std::size_t>(piece.joint_a)].push_back({piece.member, piece.first});
    ends[static_cast<std::size_t>(piece.joint_b)].push_back({piece.member, piece.last % n});
  }
  const auto placed = [&](const End& end) -> const Vec3& {
    return stent.members[static_cast<std::size_t>(end.member)]
        .points[static_cast<std::size_t>(end.point)];
  };
  const auto straight = [&](const End& end) {
    return straight_point(pattern.members[static_cast<std::size_t>(end.member)]
                              .points[static_cast<std::size_t>(end.point)]);
  };
  for (const std::vector<End>& joint : ends)
    for (std::size_t i = 1; i < joint.size(); ++i)
      stent.largest_gap =
          std::max(stent.largest_gap, (placed(joint[0]) - placed(joint[i])).norm() -
                                          (straight(joint[0]) - straight(joint[i])).norm());
}

double segment_distance(const Vec3& a0, const Vec3& a1, const Vec3& b0, const Vec3& b1) {
  const Vec3 u = a1 - a0, v = b1 - b0, w = a0 - b0;
  const double uu = u.squaredNorm(), vv = v.squaredNorm(), uv = u.dot(v);
  const double uw = u.dot(w), vw = v.dot(w), det = uu * vv - uv * uv;
  double s = det > 1e-14 * uu * vv ? std::clamp((uv * vw - vv * uw) / det, 0.0, 1.0) : 0.0;
  double t = vv > 0 ? (uv * s + vw) / vv : 0.0;
  t = std::clamp(t, 0.0, 1.0);
  if (uu > 0) s = std::clamp((uv * t - uw) / uu, 0.0, 1.0);
  return (a0 + s * u - b0 - t * v).norm();
}

/// Whether two members come closer than `width` where the straight stent kept them apart. Places
/// that touch on the straight stent are joined there.
bool meets(const Pattern& pattern, const PlacedStent& stent, std::size_t first, std::size_t second,
           double width) {
  const auto pieces = [](const PlacedMember& member) {
    return member.points.size() - (member.closed ? 0 : 1);
  };
  const PlacedMember& a = stent.members[first];
  const PlacedMember& b = stent.members[second];
  Box near_b;
  for (const Vec3& p : b.points) near_b.include(p);
  near_b.pad(width);
  for (std::size_t i = 0; i < pieces(a); ++i) {
    const std::size_t i1 = (i + 1) % a.points.size();
    Box box_a;
    box_a.include(a.points[i]);
    box_a.include(a.points[i1]);
    if (!box_a.overlaps(near_b)) continue;
    box_a.pad(width);
    for (std::size_t j = 0; j < pieces(b); ++j) {
      const std::size_t j1 = (j + 1) % b.points.size();
      Box box_b;
      box_b.include(b.points[j]);
      box_b.include(b.points[j1]);
      if (!box_a.overlaps(box_b) ||
          segment_distance(a.points[i], a.points[i1], b.points[j], b.points[j1]) >= width)
        continue;
      const auto straight_a = [&](std::size_t k) {
        return straight_point(pattern.members[first].points[k]);
      };
      const auto straight_b = [&](std::size_t k) {
        return straight_point(pattern.members[second].points[k]);
      };
      if (segment_distance(straight_a(i), straight_a(i1), straight_b(j), straight_b(j1)) >= width)
        return true;
    }
  }
  return false;
}

void find_overlapping_rings(const Pattern& pattern, PlacedStent& stent) {
  const double width = pattern.section.width;
  for (int ring = 0; ring + 1 < static_cast<int>(pattern.rings.size()); ++ring) {
    bool overlap = false;
    for (std::size_t i = 0; i < stent.members.size() && !overlap; ++i) {
      if (stent.members[i].kind != Member::Kind::strut || stent.members[i].ring != ring) continue;
      for (std::size_t j = 0; j < stent.members.size() && !overlap; ++j)
        if (stent.members[j].kind == Member::Kind::strut && stent.members[j].ring == ring + 1)
          overlap = meets(pattern, stent, i, j, width);
    }
    if (overlap) stent.overlapping_rings.emplace_back(ring, ring + 1);
  }
}

std::vector<PlacedMember> place_rigid_rings(const Pattern& pattern, const BentTube& tube) {
  std::vector<PlacedMember> placed;
  for (const Member& member : pattern.members) {
    if (member.kind == Member::Kind::connector && (member.ring >= 0 || member.next_ring >= 0))
      placed.push_back(placed_on(
          tube,
          reconnected(tube, member, rigid_end(tube, pattern, member.ring, member.points.front()),
                      rigid_end(tube, pattern, member.next_ring, member.points.back()))));
    else if (member.ring >= 0)
      placed.push_back(
          placed_rigidly(tube, pattern.rings[static_cast<std::size_t>(member.ring)], member));
    else
      placed.push_back(placed_on(tube, member));
  }
  return placed;
}

std::vector<PlacedMember> place_conforming(const Pattern& pattern, const StrutNetwork& network,
                                           const BentTube& tube) {
  std::vector<Member> members = conformed(pattern, network, tube);
  std::vector<PlacedMember> placed;
  std::vector<bool> flexible(members.size(), false);
  for (const Piece& piece : network.pieces)
    if (piece.flexible) flexible[static_cast<std::size_t>(piece.member)] = true;
  for (std::size_t i = 0; i < members.size(); ++i) {
    if (flexible[i])
      placed.push_back(
          placed_on(tube, reconnected(tube, pattern.members[i], members[i].points.front(),
                                      members[i].points.back())));
    else
      placed.push_back(placed_on(tube, members[i]));
  }
  return placed;
}

}  // namespace

AxisWithFrames with_frames(Polyline axis, const Vec3& start_normal) {
  AxisWithFrames result;
  result.arc = arc_lengths(axis);
  if (axis.size() < 2 || std::adjacent_find(result.arc.begin(), result.arc.end(),
                                            std::greater_equal<>()) != result.arc.end())
    throw std::invalid_argument("an axis needs two points or more, none repeated");
  result.frames = rotation_minimising_frames(axis);
  result.points = std::move(axis);
  const Frame& first = result.frames.front();
  const double x = start_normal.dot(first.normal);
  const double y = start_normal.dot(first.binormal());
  if (!(std::hypot(x, y) > 1e-9 * start_normal.norm()))
    throw std::invalid_argument("the start normal lies along the axis");
  // Turning every frame by one angle keeps them free of spin.
  const double c = x / std::hypot(x, y), s = y / std::hypot(x, y);
  for (Frame& frame : result.frames)
    frame.normal = (c * frame.normal + s * frame.binormal()).normalized();
  return result;
}

double tightest_bend(const Pattern& pattern) {
  const double limit = 1 / outer_radius_of(pattern);
  const double curvature = largest_feasible_curvature(pattern, strut_network(pattern), limit);
  return curvature < limit ? 1 / curvature : 0;
}

PlacedStent place(const Pattern& pattern, const AxisWithFrames& axis, double start,
                  Bending bending) {
  const BentTube tube(axis, start);
  const double radius = outer_radius_of(pattern);
  const double curvature = tube.largest_curvature(0, pattern.length);
  if (curvature * radius >= 1) {
    std::ostringstream message;
    message << "the axis bends with a radius of " << 1 / curvature
            << " mm, tighter than the stent's own radius of " << radius << " mm";
    throw std::invalid_argument(message.str());
  }
  const StrutNetwork network = strut_network(pattern);
  PlacedStent stent;
  stent.section = pattern.section;
  // Without rings nothing is rigid: a helix or a coil follows the bend with all of its wire.
  if (bending == Bending::rigid_rings && !pattern.rings.empty()) {
    stent.members = place_rigid_rings(pattern, tube);
  } else if (bending != Bending::affine) {
    try {
      stent.members = place_conforming(pattern, network, tube);
    } catch (const Infeasible& infeasible) {
      std::ostringstream message;
      message << infeasible.what() << ": on this axis (bend radius " << 1 / curvature
              << " mm at its tightest) the cells cannot conform; they follow bends of radius "
              << tightest_bend(pattern) << " mm or more";
      throw std::invalid_argument(message.str());
    }
  } else {
    for (const Member& member : pattern.members) stent.members.push_back(placed_on(tube, member));
  }
  measure_strains(network, stent);
  measure_gaps(pattern, network, stent);
  find_overlapping_rings(pattern, stent);
  return stent;
}

}  // namespace vstent::stents

#include "measure/profile.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "measure/corners.hpp"
#include "measure/loop.hpp"
#include "sdf/polyline.hpp"

namespace vstent::measure {
namespace {

using vessels::Section;

constexpr double kFirstReach = 3;                // inscribed radii
constexpr int kCentrings = 2, kRecentrings = 3;  // before, after

/// Curvature (1/mm) at the points: the turn over half of both segments; the ends take their
/// neighbour's.
std::vector<double> curvatures(const Polyline& line) {
  std::vector<double> result(line.size(), 0.0);
  for (std::size_t i = 1; i + 1 < line.size(); ++i) {
    const Vec3 a = line[i] - line[i - 1], b = line[i + 1] - line[i];
    result[i] = 2 * std::atan2(a.cross(b).norm(), a.dot(b)) / (a.norm() + b.norm());
  }
  if (line.size() > 2) {
    result.front() = result[1];
    result.back() = result[line.size() - 2];
  }
  return result;
}

bool runs_into_branch(const Section& section, const Vec3& centre, const Vec3& normal,
                      std::span<const SideBranchPoint> branches) {
  double inscribed = std::numeric_limits<double>::infinity(), farthest = 0;
  for (const Vec3& x : section.outline) {
    inscribed = std::min(inscribed, (x - centre).squaredNorm());
    farthest = std::max(farthest, (x - centre).norm());
  }
  for (const SideBranchPoint& b : branches) {
    const Vec3 off = b.centre - centre;
    constexpr double kNear = 1.5;
    if (off.squaredNorm() <= inscribed || std::abs(off.dot(normal)) > kNear * b.radius ||
        off.norm() > farthest + kNear * b.radius)
      continue;
    for (const Vec3& x : section.outline) {
      const double squared = (x - b.centre).squaredNorm(), radius = b.radius * b.radius;
      if (squared < kNear * kNear * radius &&
          squared - radius < (x - centre).squaredNorm() - inscribed)
        return true;
    }
  }
  return false;
}

/// The same of a place where the surface did not close: a branch within the plane and reach.
bool branch_in_plane(const Vec3& centre, const Vec3& normal, double radius,
                     std::span<const SideBranchPoint> branches) {
  return std::any_of(branches.begin(), branches.end(), [&](const SideBranchPoint& b) {
    const Vec3 off = b.centre - centre;
    return off.norm() > radius && off.norm() < kFirstReach * radius + b.radius &&
           std::abs(off.dot(normal)) < b.radius;
  });
}

/// Offsets that are known at some stations, linear between them and constant beyond.
std::vector<Vec3> filled(const std::vector<std::optional<Vec3>>& known) {
  std::vector<Vec3> result(known.size(), Vec3::Zero());
  std::optional<std::size_t> last;
  for (std::size_t i = 0; i < known.size(); ++i) {
    if (!known[i]) continue;
    result[i] = *known[i];
    for (std::size_t j = last ? *last + 1 : 0; j < i; ++j) {
      const double share =
          last ? static_cast<double>(j - *last) / static_cast<double>(i - *last) : 1.0;
      result[j] = (1 - share) * (last ? *known[*last] : *known[i]) + share * *known[i];
    }
    last = i;
  }
  if (last)
    for (std::size_t j = *last + 1; j < known.size(); ++j) result[j] = *known[*last];
  return result;
}

/// The axis with its offsets, smoothed alike; where nothing moved it stays bit by bit.
Polyline shifted(const Polyline& axis, const std::vector<Vec3>& offsets, double width) {
  Polyline moved(axis);
  for (std::size_t i = 0; i < axis.size(); ++i) moved[i] += offsets[i];
  const Polyline from = smooth_keeping_bends(axis, width), to = smooth_keeping_bends(moved, width);
  Polyline result(axis);
  for (std::size_t i = 0; i < axis.size(); ++i) result[i] += to[i] - from[i];
  return result;
}

Vec3 sideways(const Vec3& x, const Vec3& along) { return x - x.dot(along) * along; }

class Sampler {
 public:
  Sampler(const CutSurface& before, const CutSurface& after, std::vector<SideBranchPoint> branches,
          const vessels::CenterlinePath& way, Profile& profile)
      : before_(before),
        after_(after),
        branches_(std::move(branches)),
        way_(way),
        profile_(profile) {}

  void cut_before() {
    const std::vector<Vec3> along = tangents(profile_.axis_before);
    for_each([&](std::size_t i, Station& s) {
      std::tie(s.before, s.branch_before) = cut(before_, profile_.axis_before[i], along[i], i);
    });
  }

  void cut_after() {
    const std::vector<Vec3> along = tangents(profile_.axis_after);
    for_each([&](std::size_t i, Station& s) {
      std::tie(s.after, s.branch_after) = cut(after_, profile_.axis_after[i], along[i], i);
    });
  }

  /// `from` moved sideways by `shift(station, its point)`, at the stations whose section before is
  /// whole.
  template <class Shift>
  Polyline moved(const Polyline& from, double width, Shift&& shift) {
    const std::vector<Vec3> along = tangents(from);
    std::vector<std::optional<Vec3>> known(along.size());
    for_each([&](std::size_t i, const Station& s) {
      if (!s.whole_before()) return;
      if (const std::optional<Vec3> by = shift(s, from[i])) known[i] = sideways(*by, along[i]);
    });
    return shifted(from, filled(known), width);
  }

 private:
  template <class Visit>
  void for_each(Visit&& visit) {
    tbb::parallel_for(std::size_t{0}, profile_.stations.size(),
                      [&](std::size_t i) { visit(i, profile_.stations[i]); });
  }

  std::pair<std::optional<Section>, bool> cut(const CutSurface& surface, const Vec3& centre,
                                              const Vec3& along, std::size_t i) const {
    const double radius = value_at(way_.radii, way_.arc_length, profile_.stations[i].arc_length);
    auto section = surface.section(centre, along, kFirstReach * radius);
    const bool branch = section ? runs_into_branch(*section, centre, along, branches_)
                                : branch_in_plane(centre, along, radius, branches_);
    return {std::move(section), branch};
  }

  const CutSurface& before_;
  const CutSurface& after_;
  const std::vector<SideBranchPoint> branches_;
  const vessels::CenterlinePath& way_;
  Profile& profile_;
};

}  // namespace

CutSurface::CutSurface(const vessels::Surface& of)
    : surface(of), ends(vessels::find_lumen_ends(of)), sections(of.mesh) {}

std::optional<Section> CutSurface::section(const Vec3& centre, const Vec3& normal,
                                           double reach) const {
  auto section = sections.cut_within_growing_reach(centre, normal, reach);
  const auto on_cap = [&](const vessels::EdgeCrossing& c) {
    return ends.is_cap[at(c.triangle)] != 0;
  };
  if (section && std::any_of(section->crossings.begin(), section->crossings.end(), on_cap))
    section.reset();
  return section;
}

std::vector<SideBranchPoint> side_branch_points(const vessels::Centerline& centerline,
                                                const vessels::CenterlinePath& way) {
  const std::set<int> own(way.branch_of_point.begin(), way.branch_of_point.end());
  std::vector<SideBranchPoint> points;
  for (const vessels::CenterlineBranch& branch : centerline.branches) {
    if (own.contains(branch.id)) continue;
    for (std::size_t i = 0; i < branch.points.size(); ++i)
      points.push_back({branch.points[i], branch.radii[i]});
  }
  return points;
}

Profile sample_profile(const CutSurface& before, const CutSurface& after, bool same_triangles,
                       const vessels::Centerline& centerline, const vessels::CenterlinePath& way,
                       double from, double to, double spacing) {
  Profile profile;
  const Polyline raw = resample(way.points, from, to, spacing);
  const std::size_t count = raw.size();
  profile.spacing = (to - from) / static_cast<double>(count - 1);
  double width = 0;
  for (std::size_t i = 0; i < count; ++i) {
    Station& station = profile.stations.emplace_back();
    station.arc_length = from + profile.spacing * static_cast<double>(i);
    width += 0.5 * value_at(way.radii, way.arc_length, station.arc_length);
  }
  width /= static_cast<double>(count);
  profile.axis_before = smooth_keeping_bends(raw, width);

  using Shift = std::optional<Vec3>;
  Sampler sampler(before, after, side_branch_points(centerline, way), way, profile);
  sampler.cut_before();
  for (int k = 0; k < kCentrings; ++k) {
    profile.axis_before = sampler.moved(
        profile.axis_before, width,
        [](const Station& s, const Vec3& axis) -> Shift { return s.before->centroid - axis; });
    sampler.cut_before();
  }
  profile.axis_after = profile.axis_before;
  if (same_triangles) {
    profile.axis_after =
        sampler.moved(profile.axis_before, width, [&](const Station& s, const Vec3&) -> Shift {
          return loop(carried(*s.before, after.surface.mesh.points)).centroid -
                 loop(carried(*s.before, before.surface.mesh.points)).centroid;
        });
  } else {
    for (int k = 0; k < kRecentrings; ++k) {
      sampler.cut_after();
      profile.axis_after =
          sampler.moved(profile.axis_before, width, [](const Station& s, const Vec3&) -> Shift {
            if (!s.whole_after()) return std::nullopt;
            return s.after->centroid - s.before->centroid;
          });
    }
  }
  sampler.cut_after();
  const std::vector<double> bends_before = curvatures(profile.axis_before);
  const std::vector<double> bends_after = curvatures(profile.axis_after);
  for (std::size_t i = 0; i < count; ++i) {
    profile.stations[i].curvature_before = bends_before[i];
    profile.stations[i].curvature_after = bends_after[i];
  }
  return profile;
}

}  // namespace vstent::measure

#include "measure/measure.hpp"

#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "measure/corners.hpp"
#include "sdf/polyline.hpp"
#include "vessels/error.hpp"
#include "vessels/text.hpp"

namespace vstent::measure {
namespace {

using vessels::CenterlinePath;
using vessels::mm;
using vessels::number;

Box bounds(const std::vector<Vec3>& points) {
  Box box;
  for (const Vec3& x : points) box.include(x);
  return box;
}

void require_same_vessel(const Comparison& c) {
  for (const vessels::Surface* surface : {&c.before, &c.after}) {
    if (surface->mesh.triangles.empty())
      throw Error(ExitCode::geometry, surface->path + ": has no triangles");
  }
  const Box before = bounds(c.before.mesh.points), after = bounds(c.after.mesh.points);
  const double sizes = (after.upper - after.lower).norm() / (before.upper - before.lower).norm();
  const std::string than = " than " + c.before.path + "; ";
  if (sizes > 2 || sizes < 0.5) {
    const bool larger = sizes > 1;
    throw Error(ExitCode::geometry, c.after.path + ": is " + number(larger ? sizes : 1 / sizes) +
                                        " times " + (larger ? "larger" : "smaller") + than +
                                        "both must be the same vessel in the same length unit");
  }
  if (!before.overlaps(after)) {
    throw Error(ExitCode::geometry, c.after.path + ": lies beside " + c.before.path +
                                        "; both must be the same vessel in the same place");
  }
}

/// The vertex after that lies farthest from the surface before.
std::pair<Vec3, double> largest_change(const Comparison& c) {
  const sdf::MeshDistance before(c.before.mesh);
  const std::vector<Vec3>& points = c.after.mesh.points;
  std::vector<double> distance(points.size());
  tbb::parallel_for(std::size_t{0}, points.size(),
                    [&](std::size_t v) { distance[v] = before.closest(points[v]).distance; });
  const auto largest = std::max_element(distance.begin(), distance.end());
  return {points[static_cast<std::size_t>(largest - distance.begin())], *largest};
}

struct Interval {
  double from = 0, to = 0;
};

/// Where on the line a body begins and ends, seen from twelve sides and averaged: an end that is
/// cut across a little obliquely lies where its middle does.
Interval extent(const std::vector<Vec3>& points, const Polyline& line) {
  constexpr std::size_t kSides = 12, kEnough = 20000;
  const std::vector<double> arc = arc_lengths(line);
  const Vec3 u = (line.back() - line.front()).unitOrthogonal();
  const std::size_t stride = points.size() / kEnough + 1;
  std::vector<PolylinePlace> places((points.size() + stride - 1) / stride);
  tbb::parallel_for(std::size_t{0}, places.size(), [&](std::size_t i) {
    places[i] = nearest_place(line, arc, points[i * stride]);
  });
  const Interval none{std::numeric_limits<double>::infinity(), 0};
  std::array<Interval, kSides> sides;
  sides.fill(none);
  for (std::size_t i = 0; i < places.size(); ++i) {
    const double s = places[i].arc_length;
    const Vec3 along = tangent_at(line, arc, s), out = points[i * stride] - point_at(line, arc, s);
    const Vec3 a = (u - u.dot(along) * along).normalized();
    const double turn = std::atan2(out.dot(along.cross(a)), out.dot(a)) / (2 * std::numbers::pi);
    Interval& side = sides[static_cast<std::size_t>((turn + 1) * kSides) % kSides];
    side = {std::min(side.from, s), std::max(side.to, s)};
  }
  Interval mean;
  double seen = 0;
  for (const Interval& side : sides) {
    if (side.from > side.to) continue;
    mean = {mean.from + side.from, mean.to + side.to};
    seen += 1;
  }
  return {mean.from / seen, mean.to / seen};
}

class Measurer {
 public:
  explicit Measurer(const Comparison& c) : c_(c) {}

  Measurement run() {
    tbb::parallel_invoke(
        [&] { cut_before_.emplace(c_.before); }, [&] { cut_after_.emplace(c_.after); },
        [&] {
          static_cast<MeshMetrics&>(m_) = certify(c_.before.mesh, c_.after.mesh, c_.movable);
        });
    m_.has_stent = c_.stent != nullptr;
    find_way();
    take_profile();
    mark_treated();
    set_targets();
    static_cast<ShapeMetrics&>(m_) =
        measure_shape(profile_, c_.stent_axis_before, c_.stent_axis_after);
    static_cast<LumenMetrics&>(m_) = measure_lumen(profile_.stations);
    m_.branches =
        measure_side_branches(*cut_before_, *cut_after_, m_.same_triangles, profile_, c_.centerline,
                              way_, c_.stent ? c_.stent->surface() : TriangleMesh());
    measure_the_wall();
    if (c_.stent) measure_the_stent();
    if (m_.same_triangles) add_displacement();
    return {std::move(m_), std::move(vertex_fields_), std::move(triangle_fields_)};
  }

 private:
  void find_way() {
    way_ = c_.way;
    if (!way_.points.empty()) return;
    if (c_.centerline.branches.empty())
      throw Error(ExitCode::geometry, c_.before.path + ": the centerline is empty");
    std::vector<Vec3> places;
    if (c_.stent) {
      places = c_.stent->surface().points;
      require_stent_inside();
    } else {
      const auto [place, distance] = largest_change(c_);
      const Box box = bounds(c_.before.mesh.points);
      if (distance > 1e-6 * (box.upper - box.lower).norm()) places = {place};
    }
    way_ = way_past(places);
  }

  void require_stent_inside() const {
    const Box box = bounds(c_.stent->surface().points);
    const Vec3 middle = 0.5 * (box.lower + box.upper);
    const double half = 0.5 * (box.upper - box.lower).norm();
    const vessels::CenterlinePlace place = vessels::nearest_place(c_.centerline, middle);
    if (place.distance <= half + place.radius) return;
    throw Error(ExitCode::geometry,
                "the stent: lies " + mm(place.distance) + " from the vessel's centerline, at " +
                    vessels::place(middle) +
                    " mm; level sets are in mm, whatever the unit of the surfaces");
  }

  /// The way whose branches are the nearest to most of the places; the widest where several are.
  CenterlinePath way_past(const std::vector<Vec3>& places) const {
    constexpr std::size_t kEnough = 500;
    std::map<int, std::size_t> votes;
    for (std::size_t i = 0; i < places.size(); i += places.size() / kEnough + 1)
      ++votes[vessels::nearest_place(c_.centerline, places[i]).branch];
    std::vector<CenterlinePath> ways = vessels::paths(c_.centerline);
    std::size_t best = 0, most = 0;
    for (std::size_t w = 0; w < ways.size(); ++w) {
      std::size_t sum = 0;
      for (const int branch :
           std::set<int>(ways[w].branch_of_point.begin(), ways[w].branch_of_point.end())) {
        const auto found = votes.find(branch);
        sum += found == votes.end() ? 0 : found->second;
      }
      if (sum > most) {
        best = w;
        most = sum;
      }
    }
    return std::move(ways[best]);
  }

  void take_profile() {
    const double total = way_.arc_length.back();
    Interval window{0, total};
    double spacing = 0;
    if (c_.stent) {
      const std::vector<double>& arc = way_.arc_length;
      Interval stent;
      if (c_.stent_axis_before.empty()) {
        stent = extent(c_.stent->surface().points, way_.points);
      } else {
        stent = {nearest_place(way_.points, arc, c_.stent_axis_before.front()).arc_length,
                 nearest_place(way_.points, arc, c_.stent_axis_before.back()).arc_length};
      }
      const double radius =
          std::max({value_at(way_.radii, arc, stent.from), value_at(way_.radii, arc, stent.to),
                    0.5 * c_.nominal_diameter});
      const double margin = std::max(10.0, 4 * radius);
      window = {std::max(0.0, stent.from - margin), std::min(total, stent.to + margin)};
      spacing = 0.1 * radius;
    } else {
      std::vector<double> radii(way_.radii);
      const auto middle = radii.begin() + static_cast<std::ptrdiff_t>(radii.size() / 2);
      std::nth_element(radii.begin(), middle, radii.end());
      spacing = 0.1 * *middle;
    }
    constexpr double kMostStations = 1000;
    spacing = std::max(spacing, (window.to - window.from) / kMostStations);
    if (!(spacing > 0) || !(window.to > window.from)) {
      throw Error(ExitCode::geometry,
                  c_.before.path + ": the centerline has no length or no radii at the stent");
    }
    profile_ = sample_profile(*cut_before_, *cut_after_, m_.same_triangles, c_.centerline, way_,
                              window.from, window.to, spacing);
    require_centerline_inside();
    require_sections();
  }

  /// A line of another vessel may well cross this one here and there.
  void require_centerline_inside() const {
    constexpr std::size_t kPlaces = 16;
    const Polyline& axis = profile_.axis_before;
    std::array<char, kPlaces> inside{};
    tbb::parallel_for(std::size_t{0}, kPlaces, [&](std::size_t k) {
      const Vec3& x = axis[(2 * k + 1) * axis.size() / (2 * kPlaces)];
      inside[k] = cut_before_->ends.wall->winding_number(x) > 0.5;
    });
    if (2 * std::count(inside.begin(), inside.end(), 1) > static_cast<int>(kPlaces)) return;
    throw Error(ExitCode::geometry, c_.before.path +
                                        ": the centerline runs outside of it; is it of this "
                                        "vessel, in the same unit?");
  }

  void require_sections() const {
    std::size_t closed_before = 0, closed_after = 0;
    for (const Station& s : profile_.stations) {
      closed_before += s.before.has_value();
      closed_after += s.before && s.after;
    }
    if (closed_before == 0) {
      throw Error(ExitCode::geometry,
                  c_.before.path + ": nowhere closed around its centerline; check it first");
    }
    if (2 * closed_after < closed_before) {
      throw Error(ExitCode::geometry, c_.after.path + ": closed around the vessel's axis at only " +
                                          std::to_string(closed_after) + " of " +
                                          std::to_string(closed_before) + " places where " +
                                          c_.before.path + " is; is it the same vessel?");
    }
  }

  void mark_treated() {
    std::vector<Station>& stations = profile_.stations;
    if (c_.stent) {
      const Polyline& axis = profile_.axis_after;
      const std::vector<double> arc = arc_lengths(axis);
      Interval stent;
      if (c_.stent_axis_after.empty()) {
        stent = extent(c_.stent->surface().points, axis);
      } else {
        stent = {nearest_place(axis, arc, c_.stent_axis_after.front()).arc_length,
                 nearest_place(axis, arc, c_.stent_axis_after.back()).arc_length};
      }
      for (std::size_t i = 0; i < stations.size(); ++i)
        stations[i].in_stent = arc[i] >= stent.from && arc[i] <= stent.to;
      m_.changed = true;
      return;
    }
    constexpr double kNotable = 0.02;
    std::size_t first = stations.size(), last = 0;
    for (std::size_t i = 0; i < stations.size(); ++i) {
      const Station& s = stations[i];
      if (!s.whole_before() || !s.whole_after() ||
          std::abs(s.after->equivalent_diameter / s.before->equivalent_diameter - 1) <= kNotable)
        continue;
      first = std::min(first, i);
      last = i;
    }
    m_.changed = first < last;
    for (std::size_t i = 0; i < stations.size(); ++i)
      stations[i].in_stent = !m_.changed || (i >= first && i <= last);
  }

  void set_targets() {
    const std::vector<double> arc = arc_lengths(c_.stent_axis_after);
    for (std::size_t i = 0; i < profile_.stations.size(); ++i) {
      Station& s = profile_.stations[i];
      if (!s.in_stent) continue;
      s.target = c_.nominal_diameter;
      if (c_.target.empty()) continue;
      const double place =
          nearest_place(c_.stent_axis_after, arc, profile_.axis_after[i]).arc_length;
      s.target = value_at(c_.target, arc, place);
    }
  }

  void measure_the_wall() {
    const std::vector<SideBranchPoint> branches = side_branch_points(c_.centerline, way_);
    const std::vector<char> stented_before =
        stented_triangles(c_.before.mesh, profile_.axis_before, profile_.stations, false, branches);
    const std::vector<char> stented_after =
        m_.same_triangles ? stented_before
                          : stented_triangles(c_.after.mesh, profile_.axis_after, profile_.stations,
                                              true, branches);
    if (m_.same_triangles) {
      WallStretch stretch =
          wall_stretch(c_.before.mesh, c_.after.mesh.points, profile_.axis_before);
      m_.wall = measure_wall(c_.before.mesh, stretch, stented_before);
      triangle_fields_["StretchCircumferential"] = std::move(stretch.circumferential);
      triangle_fields_["StretchAxial"] = std::move(stretch.axial);
      triangle_fields_["AreaRatio"] = std::move(stretch.area_ratio);
    }
    for (const Station& s : profile_.stations) {
      if (s.in_stent && s.whole_after())
        m_.neighbours_within = std::max(m_.neighbours_within, s.after->equivalent_diameter);
    }
    m_.neighbours_before =
        distance_to_neighbours(c_.before.mesh, stented_before, m_.neighbours_within);
    m_.neighbours_after =
        distance_to_neighbours(c_.after.mesh, stented_after, m_.neighbours_within);
  }

  void measure_the_stent() {
    std::vector<double> distances = c_.stent->distances(c_.after.mesh.points);
    m_.apposition = measure_apposition(*c_.stent, *cut_after_, profile_.axis_after, distances);
    if (!(m_.apposition->area > 0)) {
      throw Error(ExitCode::geometry,
                  "the stent: no wall of " + c_.after.path +
                      " lies within its radius; level sets are in mm, whatever the unit of the "
                      "surfaces");
    }
    m_.deepest_penetration = m_.apposition->deepest_penetration;
    m_.stent.length = m_.treated_to - m_.treated_from;
    if (!c_.stent_axis_after.empty()) m_.stent.length = length(c_.stent_axis_after);
    vertex_fields_["StentDistance"] = std::move(distances);
  }

  void add_displacement() {
    std::vector<double>& displacement = vertex_fields_["Displacement"];
    for (std::size_t v = 0; v < c_.before.mesh.points.size(); ++v) {
      const Vec3 moved = c_.after.mesh.points[v] - c_.before.mesh.points[v];
      displacement.insert(displacement.end(), moved.data(), moved.data() + 3);
    }
  }

  const Comparison& c_;
  std::optional<CutSurface> cut_before_, cut_after_;
  CenterlinePath way_;
  Profile profile_;
  Metrics m_;
  vessels::Fields vertex_fields_, triangle_fields_;
};

}  // namespace

Measurement measure(const Comparison& comparison) {
  require_same_vessel(comparison);
  return Measurer(comparison).run();
}

}  // namespace vstent::measure

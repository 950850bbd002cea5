#include "measure/measure.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "measure/corners.hpp"
#include "sdf/polyline.hpp"
#include "vessels/error.hpp"
#include "vessels/text.hpp"

namespace vstent::measure {
namespace {

using vessels::CenterlinePath;
using vessels::number;

std::string mm(double value) { return number(value) + " mm"; }

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

/// Points of the stent's surface, enough to say where it is.
std::vector<Vec3> thinned(const std::vector<Vec3>& points) {
  constexpr std::size_t kEnough = 2000;
  const std::size_t stride = points.size() / kEnough + 1;
  std::vector<Vec3> result;
  for (std::size_t i = 0; i < points.size(); i += stride) result.push_back(points[i]);
  return result;
}

struct Interval {
  double from = 0, to = 0;
};

/// Arc lengths between which a stent of these points lies, but for a hundredth at either end.
Interval extent(const std::vector<Vec3>& points, const Polyline& line,
                std::span<const double> arc) {
  std::vector<double> places;
  for (const Vec3& x : points) places.push_back(nearest_place(line, arc, x).arc_length);
  std::sort(places.begin(), places.end());
  const std::size_t cut = places.size() / 100;
  return {places[cut], places[places.size() - 1 - cut]};
}

class Measurer {
 public:
  explicit Measurer(const Comparison& c) : c_(c), before_(c.before), after_(c.after) {}

  Measurement run() {
    static_cast<MeshMetrics&>(m_) = certify(c_.before.mesh, c_.after.mesh, c_.movable);
    m_.has_stent = c_.stent != nullptr;
    find_way();
    take_profile();
    mark_treated();
    set_targets();
    static_cast<ShapeMetrics&>(m_) =
        measure_shape(profile_, c_.stent_axis_before, c_.stent_axis_after);
    static_cast<LumenMetrics&>(m_) = measure_lumen(profile_.stations);
    m_.branches = measure_side_branches(before_, after_, m_.same_triangles, profile_, c_.centerline,
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
    std::optional<Vec3> treated;
    if (c_.stent) {
      Box box = bounds(c_.stent->surface().points);
      treated = 0.5 * (box.lower + box.upper);
      const double half = 0.5 * (box.upper - box.lower).norm();
      const vessels::CenterlinePlace place = vessels::nearest_place(c_.centerline, *treated);
      if (!(place.distance <= half + place.radius)) {
        throw Error(ExitCode::geometry,
                    "the stent: lies " + mm(place.distance) + " from the vessel's centerline, at " +
                        vessels::place(*treated) +
                        " mm; level sets are in mm, whatever the unit of the surfaces");
      }
    } else {
      const auto [place, distance] = largest_change(c_);
      const Box box = bounds(c_.before.mesh.points);
      if (distance > 1e-6 * (box.upper - box.lower).norm()) treated = place;
    }
    const int branch = treated ? vessels::nearest_place(c_.centerline, *treated).branch : -1;
    way_ = vessels::paths(c_.centerline, branch).front();
  }

  void take_profile() {
    const double total = way_.arc_length.back();
    Interval window{0, total};
    double spacing = 0;
    if (c_.stent) {
      const std::vector<double>& arc = way_.arc_length;
      Interval stent;
      if (c_.stent_axis_before.empty()) {
        stent = extent(thinned(c_.stent->surface().points), way_.points, arc);
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
    profile_ = sample_profile(before_, after_, m_.same_triangles, c_.centerline, way_, window.from,
                              window.to, spacing);
    require_sections();
  }

  void require_sections() const {
    std::size_t closed_before = 0, closed_after = 0;
    for (const Station& s : profile_.stations) {
      closed_before += s.before.has_value();
      closed_after += s.before && s.after;
    }
    if (closed_before == 0) {
      throw Error(ExitCode::geometry, c_.before.path +
                                          ": nowhere closed around the centerline; is the "
                                          "centerline of this vessel, in the same unit?");
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
        stent = extent(thinned(c_.stent->surface().points), axis, arc);
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
    m_.apposition = measure_apposition(*c_.stent, after_, profile_.axis_after, distances);
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
  CutSurface before_, after_;
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

#include "measure/strut_metrics.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "measure/corners.hpp"
#include "measure/triangle_tree.hpp"
#include "sdf/exact_field.hpp"
#include "sdf/polyline.hpp"

namespace vstent::measure {
namespace {

/// The triangles of the wall that may have moved.
class Wall {
 public:
  Wall(const TriangleMesh& mesh, std::span<const char> chosen)
      : mesh_(mesh), chosen_(chosen), tree_(mesh, chosen) {}

  /// Distance along `direction` (unit) to the first triangle within `limit` of x; infinity: none.
  double ahead(const Vec3& x, const Vec3& direction, double limit) const {
    return tree_.ahead(x, direction, limit);
  }

  /// Points no further than `spacing` apart on every triangle, corners included.
  std::vector<Vec3> sampled(double spacing) const {
    std::vector<Vec3> points;
    for (std::size_t t = 0; t < chosen_.size(); ++t) {
      if (!chosen_[t]) continue;
      const auto [a, b, c] = corners(mesh_, t);
      const double size = std::max({(a - b).norm(), (b - c).norm(), (c - a).norm()});
      const int parts = std::max(1, static_cast<int>(std::ceil(size / spacing)));
      for (int i = 0; i <= parts; ++i) {
        for (int j = 0; i + j <= parts; ++j)
          points.push_back(a + (b - a) * i / parts + (c - a) * j / parts);
      }
    }
    return points;
  }

 private:
  const TriangleMesh& mesh_;
  std::span<const char> chosen_;
  TriangleTree tree_;
};

struct Place {
  Vec3 point, outward;
  double length;  // of the strut that it stands for
};

std::vector<Place> along_struts(const stents::PlacedStent& struts) {
  std::vector<Place> places;
  for (const stents::PlacedMember& member : struts.members) {
    const std::size_t count = member.points.size();
    for (std::size_t i = 0; i + (member.closed ? 0 : 1) < count; ++i) {
      const std::size_t next = (i + 1) % count;
      const double length = (member.points[next] - member.points[i]).norm();
      const int parts = std::max(1, static_cast<int>(std::ceil(length / struts.section.width)));
      for (int k = 0; k < parts; ++k) {
        const double share = (k + 0.5) / parts;
        const Vec3 out = (1 - share) * member.outward[i] + share * member.outward[next];
        places.push_back({(1 - share) * member.points[i] + share * member.points[next],
                          out.normalized(), length / parts});
      }
    }
  }
  return places;
}

void measure_gaps(const Wall& wall, const stents::PlacedStent& struts, double radius,
                  StrutMetrics& metrics) {
  const std::vector<Place> places = along_struts(struts);
  const double face = 0.5 * struts.section.thickness;
  std::vector<double> gaps(places.size());
  tbb::parallel_for(std::size_t{0}, places.size(), [&](std::size_t i) {
    const auto& [point, outward, length] = places[i];
    double ahead = wall.ahead(point, outward, 3 * face);
    if (!std::isfinite(ahead)) ahead = wall.ahead(point, outward, radius + face);
    gaps[i] = ahead - face;
  });
  double in_vessel = 0, over_openings = 0, sum = 0;
  std::array<double, kGaps.size()> with_gap{};
  for (std::size_t i = 0; i < places.size(); ++i) {
    const double length = places[i].length;
    metrics.strut_length += length;
    if (!std::isfinite(gaps[i])) {
      over_openings += length;
      continue;
    }
    in_vessel += length;
    sum += length * std::max(0.0, gaps[i]);
    metrics.largest_gap = std::max(metrics.largest_gap, gaps[i]);
    for (std::size_t k = 0; k < kGaps.size(); ++k) with_gap[k] += gaps[i] > kGaps[k] ? length : 0;
  }
  if (metrics.strut_length > 0) metrics.share_over_openings = over_openings / metrics.strut_length;
  if (!(in_vessel > 0)) return;
  metrics.mean_gap = sum / in_vessel;
  for (std::size_t k = 0; k < kGaps.size(); ++k)
    metrics.share_with_gap[k] = with_gap[k] / in_vessel;
}

/// Depths of the sampled wall inside the stent's outer surface, and in its metal.
void measure_wall(std::span<const Vec3> samples, const sdf::Solid& metal,
                  const StentEnvelope& envelope, double strut, StrutMetrics& metrics) {
  const std::vector<double> arc = arc_lengths(envelope.axis);
  const std::vector<Vec3> directions = tangents(envelope.axis);
  std::vector<double> depth(samples.size(), -std::numeric_limits<double>::infinity());
  tbb::parallel_for(std::size_t{0}, samples.size(), [&](std::size_t i) {
    const PolylinePlace place = nearest_place(envelope.axis, arc, samples[i]);
    depth[i] = value_at(envelope.radii, arc, place.arc_length) - std::sqrt(place.squared_distance);
    const bool beyond_end = place.arc_length <= 0 || place.arc_length >= arc.back();
    if (beyond_end) depth[i] = std::min(depth[i], 0.0);
  });
  std::vector<Vec3> near;
  double sum = 0, inside = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (depth[i] > 0) {
      sum += depth[i];
      inside += 1;
      metrics.largest_prolapse = std::max(metrics.largest_prolapse, depth[i]);
    }
    if (depth[i] > -2 * strut) near.push_back(samples[i]);
  }
  if (inside > 0) metrics.mean_prolapse = sum / inside;
  std::vector<sdf::Sample> exact(near.size());
  sdf::ExactField(metal).sample(near, exact);
  for (const sdf::Sample& sample : exact)
    metrics.deepest_penetration = std::max(metrics.deepest_penetration, -sample.distance);
}

}  // namespace

StrutMetrics measure_struts(const TriangleMesh& wall_mesh, std::span<const char> wall_triangles,
                            const stents::PlacedStent& struts, const sdf::Solid& metal,
                            const StentEnvelope& envelope) {
  StrutMetrics metrics;
  const Wall wall(wall_mesh, wall_triangles);
  const double radius = *std::max_element(envelope.radii.begin(), envelope.radii.end());
  measure_gaps(wall, struts, radius, metrics);
  const double strut = std::min(struts.section.width, struts.section.thickness);
  measure_wall(wall.sampled(0.25 * strut), metal, envelope, strut, metrics);
  return metrics;
}

nlohmann::ordered_json to_json(const StrutMetrics& m) {
  nlohmann::ordered_json gaps = nlohmann::ordered_json::array();
  for (std::size_t k = 0; k < kGaps.size(); ++k)
    gaps.push_back({{"gap_above_mm", kGaps[k]}, {"percent_of_struts", 100 * m.share_with_gap[k]}});
  return {{"strut_length_mm", m.strut_length},
          {"mean_gap_mm", m.mean_gap},
          {"largest_gap_mm", m.largest_gap},
          {"malapposed", std::move(gaps)},
          {"percent_over_openings", 100 * m.share_over_openings},
          {"mean_prolapse_mm", m.mean_prolapse},
          {"largest_prolapse_mm", m.largest_prolapse},
          {"deepest_penetration_mm", m.deepest_penetration}};
}

}  // namespace vstent::measure

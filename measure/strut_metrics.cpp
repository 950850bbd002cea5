#include "measure/strut_metrics.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "measure/moved_wall.hpp"
#include "sdf/exact_field.hpp"

namespace vstent::measure {
namespace {

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

void measure_gaps(const MovedWall& wall, const stents::PlacedStent& struts, double radius,
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
  GapSums sums;
  for (std::size_t i = 0; i < places.size(); ++i) sums.add(gaps[i], places[i].length);
  metrics.strut_length = sums.all;
  sums.put_into(metrics);
}

/// Depths of the sampled wall inside the stent's outer surface, and in its metal.
void measure_wall(std::span<const Vec3> samples, const sdf::Solid& metal,
                  const StentEnvelope& envelope, double strut, StrutMetrics& metrics) {
  const std::vector<double> depth = depths(samples, envelope.axis, envelope.radii);
  const std::vector<Vec3> near = put_prolapse(samples, depth, 2 * strut, metrics);
  std::vector<sdf::Sample> exact(near.size());
  sdf::ExactField(metal).sample(near, exact);
  for (const sdf::Sample& sample : exact)
    metrics.deepest_penetration = std::max(metrics.deepest_penetration, -sample.distance);
}

}  // namespace

void GapSums::add(double gap, double weight) {
  all += weight;
  if (!std::isfinite(gap)) {
    over_openings += weight;
    return;
  }
  in_vessel += weight;
  sum += weight * std::max(0.0, gap);
  largest = std::max(largest, gap);
  for (std::size_t k = 0; k < kGaps.size(); ++k) above[k] += gap > kGaps[k] ? weight : 0;
}

void GapSums::put_into(StrutMetrics& metrics) const {
  if (all > 0) metrics.share_over_openings = over_openings / all;
  if (!(in_vessel > 0)) return;
  metrics.mean_gap = sum / in_vessel;
  metrics.largest_gap = largest;
  for (std::size_t k = 0; k < kGaps.size(); ++k) metrics.share_with_gap[k] = above[k] / in_vessel;
}

std::vector<Vec3> put_prolapse(std::span<const Vec3> samples, std::span<const double> depths,
                               double near, StrutMetrics& metrics) {
  std::vector<Vec3> close;
  double sum = 0, inside = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (depths[i] > 0) {
      sum += depths[i];
      inside += 1;
      metrics.largest_prolapse = std::max(metrics.largest_prolapse, depths[i]);
    }
    if (depths[i] > -near) close.push_back(samples[i]);
  }
  if (inside > 0) metrics.mean_prolapse = sum / inside;
  return close;
}

StrutMetrics measure_struts(const TriangleMesh& wall_mesh, std::span<const char> wall_triangles,
                            const stents::PlacedStent& struts, const sdf::Solid& metal,
                            const StentEnvelope& envelope) {
  StrutMetrics metrics;
  const MovedWall wall(wall_mesh, wall_triangles);
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
  const bool of_surface = m.outer_area > 0;
  return {{of_surface ? "outer_surface_mm2" : "strut_length_mm",
           of_surface ? m.outer_area : m.strut_length},
          {"mean_gap_mm", m.mean_gap},
          {"largest_gap_mm", m.largest_gap},
          {"malapposed", std::move(gaps)},
          {"percent_over_openings", 100 * m.share_over_openings},
          {"mean_prolapse_mm", m.mean_prolapse},
          {"largest_prolapse_mm", m.largest_prolapse},
          {"deepest_penetration_mm", m.deepest_penetration}};
}

}  // namespace vstent::measure

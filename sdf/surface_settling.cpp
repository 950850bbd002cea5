#include "sdf/surface_settling.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace vstent::sdf {
namespace {

/// Moves each point along its gradient by what step(point number, sample there) asks for.
template <class Step>
void move_points(std::vector<Vec3>& points, const LeafField& field, Step&& step) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, points.size(), 512), [&](const auto& range) {
    LeafCursor cursor(field);
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      const Sample sample = cursor.sample_closely(points[i]);
      points[i] -= step(i, sample) * sample.gradient;
    }
  });
}

}  // namespace

void settle(TriangleMesh& mesh, const LeafField& field) {
  for (int i = 0; i < 2; ++i)
    move_points(mesh.points, field, [](std::size_t, const Sample& s) { return s.distance; });
  std::vector<double> means(mesh.triangles.size());
  const auto corner = [&](const Triangle& t, std::size_t n) -> const Vec3& {
    return mesh.points[static_cast<std::size_t>(t[n % 3])];
  };
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, means.size(), 512), [&](const auto& range) {
    LeafCursor cursor(field);
    for (std::size_t i = range.begin(); i != range.end(); ++i) {
      const Triangle& t = mesh.triangles[i];
      for (std::size_t n = 0; n < 3; ++n)  // exact for a quadratic distance
        means[i] += cursor.sample_closely(0.5 * (corner(t, n) + corner(t, n + 1))).distance / 3;
    }
  });
  std::vector<double> weighted(mesh.points.size()), weights(mesh.points.size());
  for (std::size_t i = 0; i < means.size(); ++i) {
    const Triangle& t = mesh.triangles[i];
    const Vec3& a = corner(t, 0);
    const double area = (corner(t, 1) - a).cross(corner(t, 2) - a).norm();
    for (const int point : t) {
      weighted[static_cast<std::size_t>(point)] += area * means[i];
      weights[static_cast<std::size_t>(point)] += area;
    }
  }
  move_points(mesh.points, field, [&](std::size_t i, const Sample&) {
    return weights[i] > 0 ? weighted[i] / weights[i] : 0.0;
  });
}

}  // namespace vstent::sdf

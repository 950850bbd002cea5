// Random vessels as bad as segmentations get, and worse. The same numbers from the same seed on
// every machine.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "sdf/polyline.hpp"
#include "vessels/idealised.hpp"

namespace vstent::tests {

/// std's distributions differ between libraries; its engines do not.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : engine_(seed) {}
  double uniform(double from, double to) {
    return from + (to - from) * static_cast<double>(engine_() >> 11) * 0x1p-53;
  }
  double over_decades(double from, double to) {
    return std::exp(uniform(std::log(from), std::log(to)));
  }
  bool chance(double p) { return uniform(0, 1) < p; }
  std::size_t below(std::size_t n) {
    return std::min(n - 1, static_cast<std::size_t>(uniform(0, static_cast<double>(n))));
  }
  template <class Value>
  const Value& one_of(const std::vector<Value>& values) {
    return values[below(values.size())];
  }
  Vec3 vector() { return {uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)}; }

 private:
  std::mt19937_64 engine_;
};

inline vessels::IdealisedVessel random_vessel(Dice& dice, double radius) {
  vessels::IdealisedVessel v;
  v.radius = radius;
  v.length = radius * dice.uniform(7, 16);
  // Curved with at least 1.3 radii to the middle of the bend.
  if (dice.chance(0.6))
    v.bend_angle = dice.uniform(0, std::min(2.5, 0.5 * v.length / (1.3 * radius)));
  v.stenosis = dice.chance(0.15) ? 0 : dice.uniform(0.1, 0.9);
  v.stenosis_length = radius * dice.uniform(1, 6);
  v.eccentricity = dice.chance(0.5) ? dice.uniform(0, 1) : 0;
  const double vertices = dice.over_decades(600, 1600);
  v.edge_length =
      std::sqrt(2 * std::numbers::pi * radius * v.length / (0.5 * std::sqrt(3.0) * vertices));
  return v;
}

inline void taper(TriangleMesh& mesh, const vessels::IdealisedVessel& vessel, double share) {
  const Polyline axis = vessels::idealised_axis(vessel, 0.1 * vessel.radius);
  const std::vector<double> arc = arc_lengths(axis);
  for (Vec3& x : mesh.points) {
    const double s = nearest_place(axis, arc, x).arc_length;
    const Vec3 centre = point_at(axis, arc, s);
    x = centre + (1 - share * s / vessel.length) * (x - centre);
  }
}

/// Moves vertices along the surface, by up to `most` (mm).
inline void jitter(TriangleMesh& mesh, double most, Dice& dice) {
  std::vector<Vec3> normals(mesh.points.size(), Vec3::Zero());
  const auto at = [&](int v) { return static_cast<std::size_t>(v); };
  for (const auto& t : mesh.triangles) {
    const Vec3 n = (mesh.points[at(t[1])] - mesh.points[at(t[0])])
                       .cross(mesh.points[at(t[2])] - mesh.points[at(t[0])]);
    for (const int v : t) normals[at(v)] += n;
  }
  for (std::size_t v = 0; v < mesh.points.size(); ++v) {
    const Vec3 n = normals[v].normalized();
    const Vec3 way = dice.vector();
    mesh.points[v] += most / std::sqrt(3.0) * (way - way.dot(n) * n);
  }
}

/// Puts a vertex at `share` of an edge of triangle t. Both triangles of the edge are cut in two,
/// or, `one_side`, only t; a triangle of no area then closes the gap.
inline void cut_edge(TriangleMesh& mesh, std::size_t t, double share, bool one_side) {
  const auto [a, b, c] = mesh.triangles[t];
  const int middle = static_cast<int>(mesh.points.size());
  mesh.points.push_back((1 - share) * mesh.points[static_cast<std::size_t>(a)] +
                        share * mesh.points[static_cast<std::size_t>(b)]);
  mesh.triangles[t] = {a, middle, c};
  mesh.triangles.push_back({middle, b, c});
  if (one_side) {
    mesh.triangles.push_back({a, b, middle});
    return;
  }
  for (std::size_t other = 0; other < mesh.triangles.size(); ++other) {
    for (std::size_t k = 0; k < 3; ++k) {
      auto& o = mesh.triangles[other];
      if (o[k] != b || o[(k + 1) % 3] != a) continue;
      const int opposite = o[(k + 2) % 3];
      o = {b, middle, opposite};
      mesh.triangles.push_back({middle, a, opposite});
      return;
    }
  }
}

/// What segmentation and file handling do to a surface; now and then what nothing can be made of.
inline void damage(TriangleMesh& mesh, const vessels::IdealisedVessel& vessel, Dice& dice) {
  const auto some_triangle = [&] { return dice.below(mesh.triangles.size()); };
  if (dice.chance(0.3)) taper(mesh, vessel, dice.uniform(0, 0.5));
  if (dice.chance(0.6)) jitter(mesh, dice.uniform(0, 0.3) * vessel.edge_length, dice);
  if (dice.chance(0.4)) {
    for (std::size_t n = 1 + dice.below(4); n > 0; --n)
      cut_edge(mesh, some_triangle(), dice.over_decades(1e-3, 0.3), false);
  }
  if (dice.chance(0.05)) cut_edge(mesh, some_triangle(), dice.uniform(0, 1), true);
  if (dice.chance(0.15)) {
    const auto t = mesh.triangles[some_triangle()];
    mesh.triangles.push_back({t[0], t[1], t[1]});
  }
  if (dice.chance(0.03)) mesh.triangles.push_back(mesh.triangles[some_triangle()]);
  if (dice.chance(0.1)) {
    auto& turned = mesh.triangles[some_triangle()];
    std::swap(turned[0], turned[1]);
  }
  if (dice.chance(0.1)) {
    for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
  }
  if (dice.chance(0.03))
    mesh.triangles.erase(mesh.triangles.begin() + static_cast<std::ptrdiff_t>(some_triangle()));
  if (dice.chance(0.03))
    mesh.points[dice.below(mesh.points.size())] += vessel.radius * dice.vector();
  if (dice.chance(0.02))
    mesh.points[dice.below(mesh.points.size())].x() = std::numeric_limits<double>::quiet_NaN();
}

inline void write_obj(const TriangleMesh& mesh, const std::filesystem::path& path) {
  std::ofstream file(path);
  file.precision(17);
  for (const Vec3& p : mesh.points) file << "v " << p.x() << ' ' << p.y() << ' ' << p.z() << '\n';
  for (const auto& t : mesh.triangles)
    file << "f " << t[0] + 1 << ' ' << t[1] + 1 << ' ' << t[2] + 1 << '\n';
}

}  // namespace vstent::tests

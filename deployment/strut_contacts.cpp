#include "deployment/strut_contacts.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "vessels/error.hpp"
#include "vessels/text.hpp"

namespace vstent::deployment {
namespace {

std::size_t at(int index) { return static_cast<std::size_t>(index); }

}  // namespace

StrutContacts::StrutContacts(std::span<const Triangle> triangles, std::span<const char> pinned,
                             const StrutContactOptions& options)
    : options_(options) {
  const auto may_move = [&](std::initializer_list<int> corners) {
    return std::any_of(corners.begin(), corners.end(), [&](int v) { return !pinned[at(v)]; });
  };
  std::set<std::pair<int, int>> edges;
  for (const Triangle& t : triangles) {
    for (std::size_t k = 0; k < 3; ++k)
      edges.emplace(std::min(t[k], t[(k + 1) % 3]), std::max(t[k], t[(k + 1) % 3]));
  }
  const auto add = [&](std::array<int, 3> corners, int dimension) {
    Feature feature{};
    feature.corners = corners;
    feature.dimension = dimension;
    feature.looked_at = -1;
    features_.push_back(feature);
  };
  for (int v = 0; v < static_cast<int>(pinned.size()); ++v)
    if (may_move({v})) add({v, v, v}, 0);
  for (const auto& [a, b] : edges)
    if (may_move({a, b})) add({a, b, a}, 1);
  for (const Triangle& t : triangles)
    if (may_move({t[0], t[1], t[2]})) add({t[0], t[1], t[2]}, 2);
}

void StrutContacts::look_at(Feature& feature, const sdf::LevelSet& stent,
                            std::span<const Vec3> positions) const {
  const auto [i, j, k] = feature.corners;
  const Vec3 &a = positions[at(i)], &b = positions[at(j)], &c = positions[at(k)];
  const double size = std::max({(a - b).norm(), (b - c).norm(), (c - a).norm()});
  const double sink = feature.dimension > 0 ? options_.sink : 0;
  double nearest = std::numeric_limits<double>::infinity();
  const auto metal_at = [&](const Vec3& place) {
    const sdf::Sample sample = stent.sample(place);
    if (!sample.gradient.isZero()) {
      nearest = std::min(nearest, sample.distance);
    } else if (sample.distance > 0) {
      // Where a node around the place lies outside the band, all that is known is the band's width
      // less the nodes' distance.
      nearest = std::min(nearest, sample.distance - 2.5 * stent.voxel_size());
    } else {
      throw Error(ExitCode::numerical, "the wall at " + vessels::place(place) +
                                           " mm lies deeper inside a strut than its level set "
                                           "reaches; try a smaller patch edge_length");
    }
    return sample;
  };
  feature.touches = false;
  // No corner is further from the centroid than two thirds of the longest side.
  const double radius = feature.dimension == 0 ? 0 : 2.0 / 3 * size;
  metal_at(feature.dimension == 1 ? Vec3(0.5 * (a + b)) : Vec3((a + b + c) / 3));
  feature.clearance = nearest - radius - options_.reach;
  if (feature.clearance > 0) return;
  feature.lift = -std::numeric_limits<double>::infinity();
  const auto look = [&](double wa, double wb, double wc) {
    const sdf::Sample sample = metal_at(wa * a + wb * b + wc * c);
    const double lift = -sink - sample.distance;
    if (sample.gradient.isZero() || lift <= feature.lift) return;
    feature.lift = lift;
    feature.weights = {wa, wb, wc};
    feature.normal = sample.gradient;
  };
  // An edge is looked at in its middle at least, a triangle in its centroid.
  const int parts =
      std::max(1 + feature.dimension, static_cast<int>(std::ceil(size / options_.spacing)));
  if (feature.dimension == 0) look(1, 0, 0);
  if (feature.dimension == 1)
    for (int m = 1; m < parts; ++m) {
      const double w = static_cast<double>(m) / parts;
      look(1 - w, w, 0);
    }
  if (feature.dimension == 2)
    for (int m = 1; m < parts; ++m) {
      for (int n = 1; m + n < parts; ++n) {
        const double wb = static_cast<double>(m) / parts, wc = static_cast<double>(n) / parts;
        look(1 - wb - wc, wb, wc);
      }
    }
  feature.touches = feature.lift > -options_.reach;
  feature.clearance = std::max(0.0, nearest - options_.reach);
}

void StrutContacts::update(const sdf::LevelSet& stent, std::span<const Vec3> positions,
                           double push) {
  if (last_positions_.size() == positions.size()) {
    double moved = 0;
    for (std::size_t v = 0; v < positions.size(); ++v)
      moved = std::max(moved, (positions[v] - last_positions_[v]).squaredNorm());
    travel_ += std::sqrt(moved);
  }
  last_positions_.assign(positions.begin(), positions.end());
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, features_.size(), 256),
      [&](const tbb::blocked_range<std::size_t>& range) {
        for (std::size_t f = range.begin(); f < range.end(); ++f) {
          Feature& feature = features_[f];
          if (feature.looked_at >= 0 && travel_ < feature.looked_at + feature.clearance) continue;
          look_at(feature, stent, positions);
          feature.looked_at = travel_;
        }
      });

  contacts_.clear();
  for (std::size_t f = 0; f < features_.size(); ++f) {
    const Feature& feature = features_[f];
    if (!feature.touches) continue;
    Vec3 place = Vec3::Zero();
    for (std::size_t k = 0; k < 3; ++k)
      place += feature.weights[k] * positions[at(feature.corners[k])];
    const double offset = feature.normal.dot(place) + std::min(feature.lift, push);
    contacts_.push_back(
        {feature.corners, feature.weights, feature.normal, offset, static_cast<std::int64_t>(f)});
  }
}

double StrutContacts::deepest() const {
  double deepest = 0;
  for (const Feature& feature : features_)
    if (feature.touches) deepest = std::max(deepest, feature.lift);
  return deepest;
}

}  // namespace vstent::deployment

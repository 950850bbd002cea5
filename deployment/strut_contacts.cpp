#include "deployment/strut_contacts.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace vstent::deployment {
namespace {

std::size_t at(int index) { return static_cast<std::size_t>(index); }

}  // namespace

StrutContacts::StrutContacts(std::span<const Triangle> triangles, std::span<const char> pinned,
                             const StrutContactOptions& options)
    : options_(options), pinned_(pinned.begin(), pinned.end()) {
  const auto may_move = [&](std::initializer_list<int> corners) {
    return std::any_of(corners.begin(), corners.end(), [&](int v) { return !pinned_[at(v)]; });
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
  for (int v = 0; v < static_cast<int>(pinned_.size()); ++v)
    if (may_move({v})) add({v, v, v}, 0);
  for (const auto& [a, b] : edges)
    if (may_move({a, b})) add({a, b, a}, 1);
  for (const Triangle& t : triangles)
    if (may_move({t[0], t[1], t[2]})) add({t[0], t[1], t[2]}, 2);
}

void StrutContacts::find_ways_out(const Envelope& envelope, std::span<const Vec3> positions) {
  const std::span<const Vec3> axis = envelope.axis;
  const auto count = static_cast<int>(axis.size());
  if (nearest_point_.size() != positions.size()) {
    nearest_point_.assign(positions.size(), -1);
    outward_.resize(positions.size());
    radial_gap_.resize(positions.size());
  }
  arc_.assign(axis.size(), 0.0);
  for (std::size_t i = 1; i < axis.size(); ++i)
    arc_[i] = arc_[i - 1] + (axis[i] - axis[i - 1]).norm();
  tbb::parallel_for(std::size_t{0}, positions.size(), [&](std::size_t v) {
    const Vec3& x = positions[v];
    const auto squared = [&](int i) { return (x - axis[at(i)]).squaredNorm(); };
    int nearest = nearest_point_[v];
    if (nearest < 0 || nearest >= count) {
      nearest = 0;
      for (int i = 1; i < count; ++i)
        if (squared(i) < squared(nearest)) nearest = i;
    } else {
      while (nearest + 1 < count && squared(nearest + 1) < squared(nearest)) ++nearest;
      while (nearest > 0 && squared(nearest - 1) < squared(nearest)) --nearest;
    }
    nearest_point_[v] = nearest;
    const Vec3 tangent =
        (axis[at(std::min(nearest + 1, count - 1))] - axis[at(std::max(nearest - 1, 0))])
            .normalized();
    const Vec3 from_axis = x - axis[at(nearest)];
    outward_[v] = (from_axis - from_axis.dot(tangent) * tangent).normalized();
    radial_gap_[v] = from_axis.norm() - envelope.radius[at(nearest)];
  });
}

void StrutContacts::look_at(Feature& feature, const MetalField& stent,
                            std::span<const Vec3> positions) const {
  const auto [i, j, k] = feature.corners;
  const Vec3 &a = positions[at(i)], &b = positions[at(j)], &c = positions[at(k)];
  const double size = std::max({(a - b).norm(), (b - c).norm(), (c - a).norm()});
  const double gap = std::min({radial_gap_[at(i)], radial_gap_[at(j)], radial_gap_[at(k)]});
  feature.touches = false;
  feature.height = -std::numeric_limits<double>::infinity();
  // Beyond the envelope nothing needs to be looked at.
  feature.clearance = gap - size - options_.reach;
  if (feature.clearance > 0) return;
  feature.clearance = std::numeric_limits<double>::infinity();
  const auto look = [&](double wa, double wb, double wc) {
    const Vec3 outward =
        (wa * outward_[at(i)] + wb * outward_[at(j)] + wc * outward_[at(k)]).normalized();
    const MetalHit hit =
        stent.outermost({wa * a + wb * b + wc * c, outward, arc_[at(nearest_point_[at(i)])]},
                        options_.depth, options_.reach);
    feature.clearance = std::min(feature.clearance, hit.clearance);
    if (!hit.found || hit.height <= feature.height) return;
    if (feature.dimension > 0 && near_support(feature, positions, wa * a + wb * b + wc * c)) return;
    feature.touches = true;
    feature.height = hit.height;
    feature.weights = {wa, wb, wc};
    feature.outward = hit.outward;
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
}

bool StrutContacts::near_support(const Feature& feature, std::span<const Vec3> positions,
                                 const Vec3& place) const {
  return std::any_of(feature.corners.begin(), feature.corners.end(), [&](int v) {
    return supported_[at(v)] && (positions[at(v)] - place).norm() <= options_.support;
  });
}

void StrutContacts::update(const MetalField& stent, const Envelope& envelope,
                           std::span<const Vec3> positions, double stent_moved, double push) {
  if (last_positions_.size() != positions.size() || !std::isfinite(stent_moved)) {
    for (Feature& feature : features_) feature.looked_at = -1;
    travel_ = 0;
  } else {
    double moved = 0;
    for (std::size_t v = 0; v < positions.size(); ++v)
      moved = std::max(moved, (positions[v] - last_positions_[v]).squaredNorm());
    travel_ += std::sqrt(moved) + stent_moved;
  }
  last_positions_.assign(positions.begin(), positions.end());
  find_ways_out(envelope, positions);
  const auto look_at_those = [&](bool vertices) {
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, features_.size(), 256),
        [&](const tbb::blocked_range<std::size_t>& range) {
          for (std::size_t f = range.begin(); f < range.end(); ++f) {
            Feature& feature = features_[f];
            if ((feature.dimension == 0) != vertices) continue;
            if (feature.looked_at >= 0 && travel_ < feature.looked_at + feature.clearance) {
              continue;
            }
            look_at(feature, stent, positions);
            feature.looked_at = travel_;
          }
        });
  };
  look_at_those(true);
  supported_.assign(positions.size(), 0);
  for (const Feature& feature : features_)
    if (feature.dimension == 0) supported_[at(feature.corners[0])] = feature.touches;
  look_at_those(false);

  contacts_.clear();
  for (std::size_t f = 0; f < features_.size(); ++f) {
    const Feature& feature = features_[f];
    if (!feature.touches) continue;
    Vec3 place = Vec3::Zero();
    for (std::size_t k = 0; k < 3; ++k)
      place += feature.weights[k] * positions[at(feature.corners[k])];
    const double offset = feature.outward.dot(place) + std::min(feature.height, push);
    contacts_.push_back(
        {feature.corners, feature.weights, feature.outward, offset, static_cast<std::int64_t>(f)});
  }
}

}  // namespace vstent::deployment

#include "sdf/exact_field.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>

namespace vstent::sdf {

namespace {

/// Without the radius.
template <class Piece>
Box axis_box(const Piece& piece) {
  Box box;
  box.include(piece.a);
  box.include(piece.b);
  return box;
}

}  // namespace

ExactField::ExactField(Solid solid) : solid_(std::move(solid)), pieces_(solid_) {
  std::vector<Box> boxes;
  for (const Segment& segment : solid_.segments) boxes.push_back(axis_box(segment));
  for (const Strut& strut : solid_.struts) boxes.push_back(axis_box(strut));
  double largest_coordinate = 0;
  for (int piece = 0; piece < pieces_.size(); ++piece) {
    const Box& box = boxes[static_cast<std::size_t>(piece)];
    reach_ = std::max(reach_, pieces_.outer_radius(piece));
    largest_coordinate = std::max(
        {largest_coordinate, box.lower.cwiseAbs().maxCoeff(), box.upper.cwiseAbs().maxCoeff()});
  }
  tree_ = BoxTree(boxes);
  reach_ += 1e-9 * (largest_coordinate + reach_);  // rounding must not prune a tie
}

Sample ExactField::sample(const Vec3& x) const {
  int piece = -1;
  return sample(x, piece);
}

Sample ExactField::sample(const Vec3& x, int& piece) const {
  Sample best{std::numeric_limits<double>::infinity(), Vec3::Zero()};
  // A piece's distance is at least |x - its axis| - its outer radius, so one whose axis box is
  // farther than best + reach cannot win: the tree is searched by (distance + reach)^2, and the
  // winner is kept here, where ties are exact.
  const auto limit = [&] {
    const double bound = (best.distance + reach_) * (1 + 1e-9);
    return bound * bound;
  };
  const int guess = piece;
  if (guess >= 0) best = pieces_.distance(guess, x);
  tree_.nearest(
      x,
      [&](int item) {
        if (item == guess) return limit();
        const Sample sample = pieces_.distance(item, x);
        if (sample.distance < best.distance || (sample.distance == best.distance && item < piece)) {
          best = sample;
          piece = item;
        }
        return limit();
      },
      limit());
  return best;
}

void ExactField::sample(std::span<const Vec3> points, std::span<Sample> samples) const {
  assert(points.size() == samples.size());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, points.size(), 256), [&](const auto& range) {
    int piece = -1;
    for (std::size_t i = range.begin(); i != range.end(); ++i)
      samples[i] = sample(points[i], piece);
  });
}

}  // namespace vstent::sdf

// A bounding-volume hierarchy over boxes: which items overlap a box, which is nearest to a point?
#pragma once

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

#include "sdf/geometry.hpp"

namespace vstent::sdf {

/// Binary tree over item boxes, split at the median of the widest axis. Built once, read by any
/// number of threads.
class BoxTree {
 public:
  struct Nearest {
    int item = -1;  ///< -1: nothing within the limit
    double squared_distance = std::numeric_limits<double>::infinity();
  };

  BoxTree() = default;
  explicit BoxTree(std::span<const Box> boxes)
      : items_(boxes.size()), boxes_(boxes.begin(), boxes.end()) {
    std::iota(items_.begin(), items_.end(), 0);
    if (!items_.empty()) build(0, static_cast<int>(items_.size()));
  }

  /// Calls visit(item) for every item whose box overlaps `query`, in a fixed order.
  template <class Visit>
  void overlapping(const Box& query, Visit&& visit) const {
    if (nodes_.empty()) return;
    int stack[64];
    int depth = 0;
    stack[depth++] = 0;
    while (depth > 0) {
      const int index = stack[--depth];
      const Node& node = nodes_[static_cast<std::size_t>(index)];
      if (!node.box.overlaps(query)) continue;
      if (node.second_child < 0) {
        for (int i = node.begin; i < node.end; ++i) {
          const int item = items_[static_cast<std::size_t>(i)];
          if (boxes_[static_cast<std::size_t>(item)].overlaps(query)) visit(item);
        }
      } else {
        stack[depth++] = node.second_child;
        stack[depth++] = index + 1;
      }
    }
  }

  /// The item with the smallest squared_distance_to(item), looking no further than sqrt(limit);
  /// ties go to the lower item.
  template <class SquaredDistanceTo>
  Nearest nearest(const Vec3& point, SquaredDistanceTo&& squared_distance_to,
                  double limit = std::numeric_limits<double>::infinity()) const {
    Nearest best;
    best.squared_distance = limit;
    if (!nodes_.empty()) visit_nearest(0, point, squared_distance_to, best);
    return best;
  }

 private:
  struct Node {
    Box box;
    int begin = 0, end = 0;
    int second_child = -1;  // the first child follows its parent; -1 marks a leaf
  };
  static constexpr int kLeafSize = 4;

  int build(int begin, int end) {
    const int index = static_cast<int>(nodes_.size());
    nodes_.emplace_back();
    Box box;
    Box centres;
    for (int i = begin; i < end; ++i) {
      const Box& item = boxes_[static_cast<std::size_t>(items_[static_cast<std::size_t>(i)])];
      box.include(item);
      centres.include(Vec3(0.5 * (item.lower + item.upper)));
    }
    int second_child = -1;
    if (end - begin > kLeafSize) {
      int axis = 0;
      (centres.upper - centres.lower).maxCoeff(&axis);
      const int middle = begin + (end - begin) / 2;
      std::nth_element(items_.begin() + begin, items_.begin() + middle, items_.begin() + end,
                       [&](int a, int b) {
                         const Box& box_a = boxes_[static_cast<std::size_t>(a)];
                         const Box& box_b = boxes_[static_cast<std::size_t>(b)];
                         const double centre_a = box_a.lower[axis] + box_a.upper[axis];
                         const double centre_b = box_b.lower[axis] + box_b.upper[axis];
                         return centre_a != centre_b ? centre_a < centre_b : a < b;
                       });
      build(begin, middle);
      second_child = build(middle, end);
    }
    Node& node = nodes_[static_cast<std::size_t>(index)];
    node.box = box;
    node.begin = begin;
    node.end = end;
    node.second_child = second_child;
    return index;
  }

  template <class SquaredDistanceTo>
  void visit_nearest(int index, const Vec3& point, SquaredDistanceTo&& squared_distance_to,
                     Nearest& best) const {
    const Node& node = nodes_[static_cast<std::size_t>(index)];
    if (node.second_child < 0) {
      for (int i = node.begin; i < node.end; ++i) {
        const int item = items_[static_cast<std::size_t>(i)];
        if (boxes_[static_cast<std::size_t>(item)].squared_distance(point) > best.squared_distance)
          continue;
        const double d = squared_distance_to(item);
        if (d < best.squared_distance || (d == best.squared_distance && item < best.item))
          best = {item, d};
      }
      return;
    }
    int near_child = index + 1;
    int far_child = node.second_child;
    double near_bound = nodes_[static_cast<std::size_t>(near_child)].box.squared_distance(point);
    double far_bound = nodes_[static_cast<std::size_t>(far_child)].box.squared_distance(point);
    if (far_bound < near_bound) {
      std::swap(near_child, far_child);
      std::swap(near_bound, far_bound);
    }
    if (near_bound <= best.squared_distance)
      visit_nearest(near_child, point, squared_distance_to, best);
    if (far_bound <= best.squared_distance)
      visit_nearest(far_child, point, squared_distance_to, best);
  }

  std::vector<int> items_;
  std::vector<Box> boxes_;
  std::vector<Node> nodes_;
};

}  // namespace vstent::sdf

#include "sdf/box_tree.hpp"

#include <gtest/gtest.h>

#include <set>

#include "tests/sdf/shapes.hpp"

namespace vstent::sdf {
namespace {

std::vector<Box> random_boxes(int count, double largest_side, std::uint64_t seed) {
  tests::Random random(seed);
  std::vector<Box> boxes;
  for (int i = 0; i < count; ++i) {
    Box box;
    const Vec3 corner = random.in_cube(5);
    box.include(corner);
    box.include(Vec3(corner + random.in_box(Vec3::Zero(), Vec3::Constant(largest_side))));
    boxes.push_back(box);
  }
  return boxes;
}

class BoxTreeOf : public testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Sizes, BoxTreeOf, testing::Values(0, 1, 4, 5, 9, 1000));

TEST_P(BoxTreeOf, FindsTheSameOverlapsAsTryingEveryBox) {
  const auto boxes = random_boxes(GetParam(), 1.0, 1);
  const BoxTree tree(boxes);
  for (const Box& query : random_boxes(200, 3.0, 2)) {
    std::multiset<int> expected, found;
    for (int i = 0; i < GetParam(); ++i) {
      if (boxes[static_cast<std::size_t>(i)].overlaps(query)) expected.insert(i);
    }
    tree.overlapping(query, [&](int item) { found.insert(item); });
    EXPECT_EQ(found, expected);
  }
}

TEST_P(BoxTreeOf, FindsTheSameNearestAsTryingEveryBox) {
  const auto boxes = random_boxes(GetParam(), 0.3, 3);
  const BoxTree tree(boxes);
  tests::Random random(4);
  for (int n = 0; n < 500; ++n) {
    const Vec3 x = random.in_cube(7);
    const auto squared_distance = [&](int i) {
      return boxes[static_cast<std::size_t>(i)].squared_distance(x);
    };
    const double limit = n % 2 ? std::numeric_limits<double>::infinity() : 0.25;
    BoxTree::Nearest expected{.item = -1, .squared_distance = limit};
    for (int i = 0; i < GetParam(); ++i) {
      if (squared_distance(i) < expected.squared_distance) expected = {i, squared_distance(i)};
    }
    const auto found = tree.nearest(x, squared_distance, limit);
    EXPECT_EQ(found.item, expected.item);
    EXPECT_EQ(found.squared_distance, expected.squared_distance);
  }
}

TEST(BoxTree, GivesTiesToTheLowerItem) {
  std::vector<Box> boxes = random_boxes(1, 1.0, 5);
  boxes.resize(50, boxes.front());
  const BoxTree tree(boxes);
  EXPECT_EQ(tree.nearest(Vec3(9, 9, 9),
                         [&](int) {
                           return boxes[0].squared_distance({9, 9, 9});
                         })
                .item,
            0);
}

TEST(BoxTree, SurvivesIdenticalCentres) {
  std::vector<Box> boxes(10000);
  for (Box& box : boxes) box.include(Vec3(Vec3::Zero()));
  int visited = 0;
  BoxTree(boxes).overlapping(boxes.front(), [&](int) { ++visited; });
  EXPECT_EQ(visited, 10000);
}

}  // namespace
}  // namespace vstent::sdf

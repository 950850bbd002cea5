// The kernels for wide registers give the same bits as those for any machine.
#include "sdf/leaf_kernels.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "sdf/leaf_directory.hpp"
#include "tests/sdf/shapes.hpp"

namespace vstent::sdf {
namespace {

constexpr double kStep = 0.05;  // mm between nodes

struct InstructionSet {
  const char* name;
  const LeafKernels* (*kernels)();
};

class LeafKernelsOf : public testing::TestWithParam<InstructionSet> {
 protected:
  void SetUp() override {
    if (!GetParam().kernels()) GTEST_SKIP() << "no " << GetParam().name << " here";
  }
  const LeafKernels& wide_kernels() { return *GetParam().kernels(); }

  float number(double from, double to) { return static_cast<float>(random_(from, to)); }
  Affine affine() {
    const Vec3 slope = kStep * random_.direction();
    return {number(-0.5, 0.5), static_cast<float>(slope.x()), static_cast<float>(slope.y()),
            static_cast<float>(slope.z())};
  }
  LeafRows some_rows() {
    const auto first = [&] { return static_cast<int>(random_(0, 8)); };
    const auto end = [&](int begin) { return begin + 1 + static_cast<int>(random_(0, 8 - begin)); };
    LeafRows rows{.first_i = first(), .first_j = first()};
    rows.end_i = end(rows.first_i);
    rows.end_j = end(rows.first_j);
    return rows;
  }
  LeafCapsule capsule(const LeafRows& reached) {
    return {.across = affine(),
            .aside = affine(),
            .past_b = affine(),
            .before_a = number(-0.5, 0.1),
            .reached = reached};
  }
  LeafVector vector(double scale) {
    const Vec3 v = scale * random_.direction();
    return {v.x(), v.y(), v.z()};
  }

  /// lower(kernels, values) with both, from the same start.
  template <class Lower>
  void expect_same_bits(Lower&& lower) {
    LeafValues wide, narrow;
    for (float& value : wide.at) value = number(-0.3, 0.6);
    narrow = wide;
    lower(wide_kernels(), wide);
    lower(baseline_leaf_kernels(), narrow);
    EXPECT_EQ(std::memcmp(&wide, &narrow, sizeof wide), 0);
    LeafValues stored, stored_narrow;
    const int active = wide_kernels().store(wide, 0.15f, stored.at.data());
    EXPECT_EQ(active, baseline_leaf_kernels().store(narrow, 0.15f, stored_narrow.at.data()));
    EXPECT_EQ(std::memcmp(&stored, &stored_narrow, sizeof stored), 0);
    EXPECT_EQ(active, std::count_if(narrow.at.begin(), narrow.at.end(),
                                    [](float value) { return std::abs(value) < 0.15f; }));
    for (std::size_t n = 0; n < kLeafNodes; ++n)
      ASSERT_EQ(stored.at[n], std::clamp(narrow.at[n], -0.15f, 0.15f));
  }

  tests::Random random_{71};
};

TEST_P(LeafKernelsOf, GiveTheBitsOfTheBaseline) {
  for (int round = 0; round < 50; ++round) {
    const std::vector<LeafCapsule> thin{capsule(some_rows()), capsule({}), capsule(some_rows())};
    const std::vector<LeafCapsule> thick{capsule({}), capsule({})};
    const LeafStrut strut{.sideways = affine(),
                          .height = affine(),
                          .past_b = affine(),
                          .before_a = number(-0.5, 0.1),
                          .half_width = number(0, 0.2),
                          .half_thickness = number(0, 0.2),
                          .edge_radius = number(0, 0.1),
                          .reached = some_rows()};
    const LeafCutCapsule cut{.capsule = capsule({}),
                             .radius = number(1, 3),
                             .length = number(0.1, 1),
                             .beyond = affine(),
                             .across = affine(),
                             .aside = affine(),
                             .cap_radius = number(1, 3),
                             .cap_from_a = number(-1, 1),
                             .slope = number(-1, 1)};
    const Affine plane = affine();
    LeafValues uncut;
    for (float& value : uncut.at) value = number(-0.3, 0.6);
    expect_same_bits([&](const auto& k, auto& v) { k.lower_to_thin(thin, 0.1f, v); });
    LeafValues stored, lowered;
    lowered.at.fill(std::numeric_limits<float>::infinity());
    wide_kernels().lower_to_thin(thin, 0.1f, lowered);
    const int active = wide_kernels().store(lowered, 0.15f, stored.at.data());
    expect_same_bits([&](const auto& k, auto& v) {
      EXPECT_EQ(k.store_thin(thin, 0.1f, 0.15f, v.at.data()), active);
      EXPECT_EQ(std::memcmp(&v, &stored, sizeof v), 0);
    });
    expect_same_bits([&](const auto& k, auto& v) { k.lower_to_thick(thick, 2.0f, v); });
    expect_same_bits([&](const auto& k, auto& v) { k.lower_to_struts({&strut, 1}, v); });
    expect_same_bits([&](const auto& k, auto& v) { k.lower_to_cut_capsules({&cut, 1}, v); });
    expect_same_bits([&](const auto& k, auto& v) { k.lower_to_larger(uncut, plane, v); });
    for (int caps = 0; caps <= 3; ++caps) {
      const LeafCone cone{.from_a = vector(0.3),
                          .axis = vector(1),
                          .length = random_(0.1, 0.5),
                          .radius = random_(0.1, 0.5),
                          .sine = 0.2,
                          .tangent = 0.2 / std::sqrt(0.96),
                          .flat = caps == 3,
                          .caps = caps % 3,
                          .cap = {LeafCone::Cap{vector(0.3), vector(1), 0.2},
                                  LeafCone::Cap{vector(0.3), vector(1), 0.3}}};
      expect_same_bits([&](const auto& k, auto& v) { k.lower_to_cone(cone, kStep, v); });
    }
  }
}

TEST_P(LeafKernelsOf, FindNearLeavesWithTheBitsOfTheBaseline) {
  // By definition: a leaf is near where one of its nodes is, and is not where its middle is farther
  // off than the farthest node could make up for.
  constexpr double kHalf = 3.5 * kStep;
  LeafMiddles middles;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t n = 0; n < 4; ++n)
      middles[axis][n] = kStep * (8 * static_cast<double>(n + 4 * axis) + 3.5);
  }
  int near = 0, far = 0, left_out = 0;
  for (int round = 0; round < 120; ++round) {
    const Vec3 axis = random_.direction();
    const Vec3 a(random_(-0.3, 1.9), random_(1.3, 3.5), random_(2.9, 5.1));
    const BlockCapsule capsule{.a = {a.x(), a.y(), a.z()},
                               .axis = {axis.x(), axis.y(), axis.z()},
                               .length = round % 10 == 0 ? 0 : random_(0.1, 2),
                               .thickness = random_(0.1, 0.4),
                               .half = kHalf,
                               .reach = kHalf * axis.cwiseAbs().sum(),
                               .last_along = random_(0.1, 2),
                               .first = {round % 3 == 0 ? 1 : 0, 0},
                               .last = {3, round % 4 == 0 ? 2 : 3}};
    NearLeaves wide, narrow;
    const std::uint64_t which = wide_kernels().find_near(capsule, middles, wide);
    ASSERT_EQ(baseline_leaf_kernels().find_near(capsule, middles, narrow), which);
    for (std::size_t n = 0; n < 64; ++n) {
      const std::array<int, 2> at{static_cast<int>(n >> 4), static_cast<int>(n >> 2 & 3)};
      const bool is_near = which >> n & 1;
      if (at[0] < capsule.first[0] || at[1] > capsule.last[1]) {
        ASSERT_FALSE(is_near);
        continue;
      }
      const Vec3 middle(middles[0][n >> 4], middles[1][n >> 2 & 3], middles[2][n & 3]);
      const auto away_of = [&](const Vec3& x) -> Vec3 {
        return x - a - std::clamp((x - a).dot(axis), 0.0, capsule.length) * axis;
      };
      if ((middle - a).dot(axis) - capsule.reach >= capsule.last_along) {
        ASSERT_FALSE(is_near);
        ++left_out;
        continue;
      }
      if (is_near) {
        ++near;
        ASSERT_LE(away_of(middle).norm(), capsule.thickness + std::sqrt(3.0) * kHalf + 1e-12);
        ASSERT_NEAR(wide.along[n], (middle - a).dot(axis), 1e-13);
        ASSERT_LT((Vec3(wide.x[n], wide.y[n], wide.z[n]) - away_of(middle)).norm(), 1e-13);
        ASSERT_NEAR(wide.squared[n], away_of(middle).squaredNorm(), 1e-12);
        for (const auto& numbers : {&NearLeaves::along, &NearLeaves::x, &NearLeaves::y,
                                    &NearLeaves::z, &NearLeaves::squared})
          ASSERT_EQ((wide.*numbers)[n], (narrow.*numbers)[n]);
        continue;
      }
      ++far;
      for (int node = 0; node < kLeafNodes; ++node) {
        const Vec3 from_middle(node >> 6, node >> 3 & 7, node & 7);
        ASSERT_GT(away_of(middle + kStep * from_middle - Vec3::Constant(kHalf)).norm(),
                  capsule.thickness - 1e-12);
      }
    }
  }
  EXPECT_GT(near, 200);
  EXPECT_GT(far, 200);
  EXPECT_GT(left_out, 100);
}

TEST_P(LeafKernelsOf, LocateTheNodesOfTheBaseline) {
  // By definition: the node before the one that comes before a point along each axis.
  constexpr double kPerMm = 12.5;
  const LeafLattice lattice{{0.3, -700, 0}, kPerMm};
  for (std::size_t points = 1; points <= kPlaces; ++points) {
    std::vector<double> coordinates;
    for (std::size_t n = 0; n < 3 * points; ++n) coordinates.push_back(random_(-900, 900));
    coordinates[points] = lattice.origin[points % 3] + 7 / kPerMm;
    LeafPlaces wide, narrow;
    wide_kernels().locate(coordinates, lattice, wide);
    baseline_leaf_kernels().locate(coordinates, lattice, narrow);
    for (std::size_t n = 0; n < points; ++n) {
      const auto leaf = LeafPage::indices(wide.leaf[n]);
      ASSERT_EQ(narrow.leaf[n], wide.leaf[n]);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double index = (coordinates[3 * n + axis] - lattice.origin[axis]) * kPerMm;
        const int node = wide.node[axis][n] + 8 * leaf[axis] + 32 * wide.block[axis][n];
        ASSERT_EQ(node, static_cast<int>(std::floor(index)) - 1);
        ASSERT_EQ(wide.fraction[axis][n], static_cast<float>(index - std::floor(index)));
        ASSERT_EQ(narrow.block[axis][n], wide.block[axis][n]);
        ASSERT_EQ(narrow.node[axis][n], wide.node[axis][n]);
        ASSERT_EQ(narrow.fraction[axis][n], wide.fraction[axis][n]);
      }
    }
  }
}

TEST_P(LeafKernelsOf, PutWhatIsBeyondAllNodesThere) {
  constexpr double kBeyond = std::numeric_limits<double>::infinity();
  const std::vector<double> coordinates{kBeyond, -kBeyond, std::nan(""), 1e11, -1e11, 0};
  const int far = static_cast<int>(kFarthestNode / 32);
  for (const LeafKernels* kernels : {&wide_kernels(), &baseline_leaf_kernels()}) {
    LeafPlaces places;
    kernels->locate(coordinates, {{0, 0, 0}, 1}, places);
    std::vector<int> blocks;
    for (std::size_t n = 0; n < 6; ++n) blocks.push_back(places.block[n % 3][n / 3]);
    EXPECT_EQ(blocks, (std::vector{far - 1, -far - 1, far - 1, far - 1, -far - 1, -1}));
  }
}

TEST_P(LeafKernelsOf, SampleTheBitsOfTheBaseline) {
  // Eight leaves around a corner, some values of which lie beyond the band.
  std::array<LeafValues, 8> leaves;
  std::array<const float*, 32> pointers{};
  int beyond = 0, within = 0;
  for (int round = 0; round < 400; ++round) {
    const float largest = round % 2 == 0 ? 0.99f : 1.01f;
    for (std::size_t n = 0; n < 8; ++n) {
      for (float& value : leaves[n].at) value = std::clamp(number(-largest, largest), -1.0f, 1.0f);
      pointers[25 * (n >> 2) + 5 * (n >> 1 & 1) + (n & 1)] = leaves[n].at.data();
    }
    LeafPlaces places;
    places.leaves.fill(pointers.data());
    for (auto& nodes : places.node)
      for (int& node : nodes) node = static_cast<int>(random_(0, 8));
    for (auto& fractions : places.fraction)
      for (float& fraction : fractions) fraction = number(0, 1);
    const LeafRange range{.inside = -1, .outside = 1, .innermost = -0.9f, .outermost = 0.9f};
    std::vector<std::array<double, 4>> wide(1 + static_cast<std::size_t>(round) % kPlaces),
        narrow = wide;
    wide_kernels().sample(places, range, wide);
    baseline_leaf_kernels().sample(places, range, narrow);
    ASSERT_EQ(std::memcmp(wide.data(), narrow.data(), sizeof wide[0] * wide.size()), 0);
    for (const auto& [value, x, y, z] : wide) (Vec3(x, y, z).isZero() ? beyond : within) += 1;
  }
  EXPECT_GT(beyond, 100);
  EXPECT_GT(within, 100);
}

INSTANTIATE_TEST_SUITE_P(WideRegisters, LeafKernelsOf,
                         testing::Values(InstructionSet{"AVX2", avx2_leaf_kernels},
                                         InstructionSet{"AVX512", avx512_leaf_kernels}),
                         [](const auto& set) { return set.param.name; });

}  // namespace
}  // namespace vstent::sdf

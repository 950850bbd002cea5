// The kernels for wide registers give the same bits as those for any machine.
#include "sdf/leaf_kernels.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <limits>

#include "tests/sdf/shapes.hpp"

namespace vstent::sdf {
namespace {

constexpr double kStep = 0.05;  // mm between nodes

class LeafKernelsOf : public testing::Test {
 protected:
  void SetUp() override {
    if (!avx2_leaf_kernels()) GTEST_SKIP() << "no AVX2 here";
  }

  float number(double from, double to) { return static_cast<float>(random_(from, to)); }
  Affine affine() {
    const Vec3 slope = kStep * random_.direction();
    return {number(-0.5, 0.5), static_cast<float>(slope.x()), static_cast<float>(slope.y()),
            static_cast<float>(slope.z())};
  }
  LeafRows some_rows() {
    const auto end = [&] { return 5 + static_cast<int>(random_(0, 4)); };
    const auto first = [&] { return static_cast<int>(random_(0, 4)); };
    return {first(), end(), first(), end()};
  }
  LeafCapsule capsule(const LeafRows& rows) {
    return {.across = affine(),
            .aside = affine(),
            .past_b = affine(),
            .before_a = number(-0.5, 0.1),
            .rows = rows};
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
    lower(*avx2_leaf_kernels(), wide);
    lower(baseline_leaf_kernels(), narrow);
    EXPECT_EQ(std::memcmp(&wide, &narrow, sizeof wide), 0);
    LeafValues stored, stored_narrow;
    const int active = avx2_leaf_kernels()->store(wide, 0.15f, stored.at.data());
    EXPECT_EQ(active, baseline_leaf_kernels().store(narrow, 0.15f, stored_narrow.at.data()));
    EXPECT_EQ(std::memcmp(&stored, &stored_narrow, sizeof stored), 0);
    EXPECT_EQ(active, std::count_if(narrow.at.begin(), narrow.at.end(),
                                    [](float value) { return std::abs(value) < 0.15f; }));
    for (std::size_t n = 0; n < kLeafNodes; ++n)
      ASSERT_EQ(stored.at[n], std::clamp(narrow.at[n], -0.15f, 0.15f));
  }

  tests::Random random_{71};
};

TEST_F(LeafKernelsOf, BothInstructionSetsGiveTheSameBits) {
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
                          .rows = some_rows()};
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

}  // namespace
}  // namespace vstent::sdf

// Body of the kernel that finds the leaves near a capsule: included by one .cpp per instruction
// set. Everything here has internal linkage.
#include <cstddef>
#include <cstdint>

#include "sdf/leaf_kernels.hpp"
#include "sdf/wide.hpp"

namespace vstent::sdf {
namespace {

/// Four leaves at a time, those that differ in k. The distance d from the axis falls by at most
/// half |g|_1 within a leaf, g = away / d being its gradient; so the leaf is out of reach where d -
/// half |away|_1 / d > thickness, or, times d, where excess > thickness d.
std::uint64_t find_near(const BlockCapsule& capsule, const LeafMiddles& middles, NearLeaves& near) {
  const auto four = [](double a) { return Four{a, a, a, a}; };
  const auto magnitude = [](Four a) { return a > -a ? a : -a; };
  const Four zero{}, axis_x = four(capsule.axis.x), axis_y = four(capsule.axis.y),
                     axis_z = four(capsule.axis.z);
  const Four length = four(capsule.length), half = four(capsule.half), reach = four(capsule.reach),
             last = four(capsule.last_along),
             squared_thickness = four(capsule.thickness * capsule.thickness);
  Four middle_z;
  __builtin_memcpy(&middle_z, middles[2].data(), sizeof middle_z);
  const Four z = middle_z - four(capsule.a.z);
  std::uint64_t which = 0;
  for (int i = capsule.first[0]; i <= capsule.last[0]; ++i) {
    const Four x = four(middles[0][static_cast<std::size_t>(i)] - capsule.a.x);
    for (int j = capsule.first[1]; j <= capsule.last[1]; ++j) {
      const Four y = four(middles[1][static_cast<std::size_t>(j)] - capsule.a.y);
      const Four along = x * axis_x + y * axis_y + z * axis_z;
      Four s = along > zero ? along : zero;
      s = s < length ? s : length;
      const Four away_x = x - s * axis_x, away_y = y - s * axis_y, away_z = z - s * axis_z;
      const Four squared = away_x * away_x + away_y * away_y + away_z * away_z;
      const Four excess =
          squared - half * (magnitude(away_x) + magnitude(away_y) + magnitude(away_z));
      const auto is_far = (excess > zero) & (excess * excess > squared_thickness * squared);
      const auto is_left_out = along - reach >= last;
      const int n = 16 * i + 4 * j;
      const auto put = [n](auto& numbers, Four a) {
        __builtin_memcpy(numbers.data() + n, &a, sizeof a);
      };
      put(near.along, along), put(near.squared, squared);
      put(near.x, away_x), put(near.y, away_y), put(near.z, away_z);
      which |= std::uint64_t{0xF & ~bits(is_far | is_left_out)} << n;
    }
  }
  return which;
}

}  // namespace
}  // namespace vstent::sdf

// Body of the sampling kernels: included by one .cpp per instruction set. Everything here has
// internal linkage.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "sdf/leaf_kernels.hpp"
#include "sdf/wide.hpp"

namespace vstent::sdf {
namespace {

typedef int RowPick __attribute__((vector_size(16)));
typedef int WidePick __attribute__((vector_size(32)));
typedef std::int64_t Addresses __attribute__((vector_size(32), may_alias));

#ifdef __AVX512F__
constexpr std::size_t kDoubles = 8;
#else
constexpr std::size_t kDoubles = 4;
#endif
typedef double Doubles __attribute__((vector_size(8 * kDoubles), may_alias));
typedef std::int64_t Picks __attribute__((vector_size(8 * kDoubles)));
typedef int Ints __attribute__((vector_size(4 * kDoubles), may_alias));
typedef float Floats __attribute__((vector_size(4 * kDoubles), may_alias));

template <class Vector, class Number>
inline Vector load(const Number* from) {
  Vector loaded;
  __builtin_memcpy(&loaded, from, sizeof loaded);
  return loaded;
}

template <class Number, class Vector>
inline void put(const Vector& several, Number* to) {
  __builtin_memcpy(to, &several, sizeof several);
}

inline Doubles same(double a) { return Doubles{} + a; }

inline Doubles rounded_down(Doubles a) {
#ifdef __AVX512F__
  return (Doubles)_mm512_floor_pd((__m512d)a);
#else
  return floor(a);
#endif
}

/// The coordinates along one axis of points x, y, z, x, ...
template <int kAxis>
inline Doubles along(const Doubles (&interleaved)[3]) {
  constexpr int kCount = kDoubles;
  constexpr auto first = [](int n) { return 3 * n + kAxis < 2 * kCount ? 3 * n + kAxis : n; };
  constexpr auto last = [](int n) {
    return 3 * n + kAxis < 2 * kCount ? n : 3 * n + kAxis - kCount;
  };
#ifdef __AVX512F__
  constexpr Picks kFirst{first(0), first(1), first(2), first(3),
                         first(4), first(5), first(6), first(7)},
      kLast{last(0), last(1), last(2), last(3), last(4), last(5), last(6), last(7)};
#else
  constexpr Picks kFirst{first(0), first(1), first(2), first(3)},
      kLast{last(0), last(1), last(2), last(3)};
#endif
  return __builtin_shuffle(__builtin_shuffle(interleaved[0], interleaved[1], kFirst),
                           interleaved[2], kLast);
}

void locate(std::span<const double> coordinates, const LeafLattice& lattice, LeafPlaces& places) {
  constexpr std::size_t kAtOnce = 3 * kDoubles;
  const Doubles far = same(kFarthestNode), nodes_per_mm = same(lattice.nodes_per_mm);
  for (std::size_t n = 0; n < coordinates.size(); n += kAtOnce) {
    const double* points = coordinates.data() + n;
    double rest[kAtOnce]{};
    if (coordinates.size() - n < kAtOnce) {
      std::copy(points, points + (coordinates.size() - n), rest);
      points = rest;
    }
    const Doubles interleaved[3]{load<Doubles>(points), load<Doubles>(points + kDoubles),
                                 load<Doubles>(points + 2 * kDoubles)};
    const Doubles apart[3]{along<0>(interleaved), along<1>(interleaved), along<2>(interleaved)};
    Ints leaf{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      Doubles index = (apart[axis] - same(lattice.origin[axis])) * nodes_per_mm;
      index = index < far ? index : far;  // nor is "not a number" smaller
      index = index > -far ? index : -far;
      const Doubles before = rounded_down(index);
      const Ints first = __builtin_convertvector(before, Ints) - 1;
      put(first >> 5, &places.block[axis][n / 3]);
      put(first & 7, &places.node[axis][n / 3]);
      put(__builtin_convertvector(index - before, Floats), &places.fraction[axis][n / 3]);
      leaf += (first >> 3 & 3) * LeafPlaces::kStep[axis];
    }
    put(leaf, &places.leaf[n / 3]);
  }
}

constexpr std::int64_t kNode = sizeof(float), kRow = kLeafSide * kNode, kPlane = kLeafSide * kRow;

/// Row (i, j) of the 4^2 rows of four nodes around a point begins kPlane i + kRow j bytes after
/// at[leaf][j], where `leaf` counts along i. Where a leaf ends there, at[][] are its last four
/// nodes and next[][], likewise, the first four of the leaf that follows.
struct Rows {
  Addresses at[2], next[2];
};

class RowReader {
 public:
  RowReader(const Rows& rows, unsigned first_i)
      : rows_(reinterpret_cast<const char*>(&rows)), leaf_(kLeafOf[first_i]) {}
  const char* at(int i, int j) const { return address(offsetof(Rows, at), i, j); }
  const char* next(int i, int j) const { return address(offsetof(Rows, next), i, j); }

 private:
  const char* address(std::size_t part, int i, int j) const {
    const char* begin;
    __builtin_memcpy(&begin, rows_ + leaf_[i] + part + sizeof begin * static_cast<unsigned>(j),
                     sizeof begin);
    return begin + i * kPlane + j * kRow;
  }

  static constexpr unsigned kNext = sizeof(Addresses);
  static constexpr unsigned kLeafOf[8][4]{
      {}, {}, {}, {}, {}, {0, 0, 0, kNext}, {0, 0, kNext, kNext}, {0, kNext, kNext, kNext}};

  const char* rows_;
  const unsigned* leaf_;
};

inline Addresses all(std::int64_t a) { return Addresses{a, a, a, a}; }
inline Addresses address(const float* node) { return all(reinterpret_cast<std::int64_t>(node)); }

/// And fetches what the sample needs.
template <int kBefore>
inline void find_rows(const LeafPlaces& places, std::size_t n, Rows& rows) {
  alignas(32) static constexpr std::int64_t kIsNext[8][4]{
      {}, {}, {}, {}, {}, {0, 0, 0, -1}, {0, 0, -1, -1}, {0, -1, -1, -1}};
  const auto [step_i, step_j, step_k] = LeafPlaces::kStep;
  const float* const* leaves = places.leaves[n];
  const auto node = [&](std::size_t axis) { return static_cast<unsigned>(places.node[axis][n]); };
  const unsigned i = node(0), j = node(1), k = kBefore == 4 ? node(2) : 4;
  const Addresses is_next = load<Addresses>(kIsNext[j]);
  const auto find = [&, step = step_j](const float* const* from) {
    return (address(from[0]) & ~is_next) | (address(from[step]) & is_next);
  };
  const Addresses offset = all(i * kPlane + j * kRow) - (is_next & (kLeafSide * kRow));
  const Addresses offset_beyond = offset - kLeafSide * kPlane;
  rows.at[0] = find(leaves) + (offset + k * kNode);
  rows.at[1] = find(leaves + step_i) + (offset_beyond + k * kNode);
  if constexpr (kBefore < 4) {
    rows.next[0] = find(leaves + step_k) + offset;
    rows.next[1] = find(leaves + step_i + step_k) + offset_beyond;
  }
  const RowReader reader(rows, i);
  const auto fetch = [&](int plane, int row) {
    _mm_prefetch(reader.at(plane, row), _MM_HINT_T0);
    if constexpr (kBefore < 4) _mm_prefetch(reader.next(plane, row), _MM_HINT_T0);
  };
  fetch(0, 1), fetch(0, 2);
  fetch(1, 0), fetch(1, 1), fetch(1, 2), fetch(1, 3);
  fetch(2, 0), fetch(2, 1), fetch(2, 2), fetch(2, 3);
  fetch(3, 1), fetch(3, 2);
}

/// Row (i, j) and the other one. Where a leaf ends there, kBefore of the nodes are its own.
template <int kBefore>
inline Wide two_rows(const RowReader& rows, int i, int j, int other_i, int other_j) {
  const Wide loaded = join(load<Row>(rows.at(i, j)), load<Row>(rows.at(other_i, other_j)));
  if constexpr (kBefore == 4) {
    return loaded;
  } else {
    constexpr int s = 4 - kBefore;
    constexpr auto pick = [](int n) { return n < 4 ? n : n + 4; };
    constexpr WidePick kPick{pick(s),     pick(s + 1),     pick(s + 2),     pick(s + 3),
                             pick(s) + 4, pick(s + 1) + 4, pick(s + 2) + 4, pick(s + 3) + 4};
    return __builtin_shuffle(
        loaded, join(load<Row>(rows.next(i, j)), load<Row>(rows.next(other_i, other_j))), kPick);
  }
}

inline Wide mix(Wide f, Wide a, Wide b) { return a + f * (b - a); }
inline Row mix(Row f, Row a, Row b) { return a + f * (b - a); }

struct Range {
  Wide inside, outside;
  float innermost, outermost;
};

/// Of the 4^3 nodes around a point, value and nodal gradient need all but those on the cube's
/// edges.
template <int kBefore>
inline void sample_one(const LeafPlaces& places, std::size_t n, const Rows& table,
                       const Range& range, std::array<double, 4>& sample) {
  const RowReader rows(table, static_cast<unsigned>(places.node[0][n]));
  const auto two = [&](int i, int j, int other_i, int other_j) {
    return two_rows<kBefore>(rows, i, j, other_i, other_j);
  };
  const Wide inner[4]{two(0, 1, 0, 2), two(1, 1, 1, 2), two(2, 1, 2, 2), two(3, 1, 3, 2)};
  const Wide outer[2]{two(1, 0, 1, 3), two(2, 0, 2, 3)};

  const Wide x = wide(places.fraction[0][n]);
  const Wide middle = mix(x, inner[1], inner[2]), beside = mix(x, outer[0], outer[1]);
  const Wide along_x = mix(x, inner[2] - inner[0], inner[3] - inner[1]);
  const Row y = row(places.fraction[1][n]), z = row(places.fraction[2][n]);
  const Row value = mix(y, low(middle), high(middle));
  const Row dx = mix(y, low(along_x), high(along_x));
  const Row dy = mix(y, high(middle) - low(beside), high(beside) - low(middle));
  const Row dz = __builtin_shuffle(value, RowPick{2, 3, 2, 3}) - value;
  const Row front = __builtin_shuffle(value, dx, RowPick{1, 2, 5, 6});
  const Row back = __builtin_shuffle(dy, dz, RowPick{1, 2, 4, 5});
  const Row found = mix(z, __builtin_shuffle(front, back, RowPick{0, 2, 4, 6}),
                        __builtin_shuffle(front, back, RowPick{1, 3, 5, 7}));

  // The first and the last node of the outer rows lie on the cube's edges.
  constexpr WidePick kMiddle{8, 1, 2, 11, 12, 5, 6, 15};
  const Wide least = smaller(inner[1], inner[2]), most = larger(inner[1], inner[2]);
  const Wide outer_least = smaller(smaller(inner[0], inner[3]), smaller(outer[0], outer[1]));
  const Wide outer_most = larger(larger(inner[0], inner[3]), larger(outer[0], outer[1]));
  const auto are_within = [&](Wide smallest, Wide largest) {
    return all_of((range.inside < smallest) & (largest < range.outside));
  };
  const float distance = found[0];
  if (!are_within(smaller(least, __builtin_shuffle(outer_least, least, kMiddle)),
                  larger(most, __builtin_shuffle(outer_most, most, kMiddle))) ||
      distance >= range.outermost || distance <= range.innermost) {
    const bool is_inside = are_within(least, most) ? distance < 0 : inner[1][1] < 0;
    sample = {static_cast<double>(is_inside ? range.inside[0] : range.outside[0]), 0, 0, 0};
    return;
  }
  const Four slopes = doubles(found);
  const Four squares = slopes * slopes;
  const double norm = std::sqrt(squares[1] + squares[2] + squares[3]);
  const double scale = norm > 0 ? 1 / norm : 0;
  const Four result = slopes * Four{1, scale, scale, scale};
  __builtin_memcpy(&sample, &result, sizeof result);
}

/// Rows that end one leaf and begin the next come in turn, so that no branch on it is guessed
/// wrongly; and all are found and fetched before any is read, for the leaves of fine struts fill
/// more than the caches. (Gathers, a point per lane, are slower there: they wait for every node.)
void sample(const LeafPlaces& places, const LeafRange& given,
            std::span<std::array<double, 4>> samples) {
  std::array<std::array<unsigned, kPlaces>, 4> of_kind;
  std::array<std::size_t, 4> count{};
  for (unsigned n = 0; n < samples.size(); ++n) {
    const auto kind = static_cast<std::size_t>(std::max(places.node[2][n] - 4, 0));
    of_kind[kind][count[kind]++] = n;
  }
  Rows rows[kPlaces];
  const auto for_all = [&]<class Visit>(const Visit& visit) {
    const auto of = [&]<int kBefore>(std::integral_constant<int, kBefore> before) {
      for (std::size_t n = 0; n < count[4 - kBefore]; ++n) visit(before, of_kind[4 - kBefore][n]);
    };
    of(std::integral_constant<int, 4>{});
    of(std::integral_constant<int, 3>{});
    of(std::integral_constant<int, 2>{});
    of(std::integral_constant<int, 1>{});
  };
  const Range range{wide(given.inside), wide(given.outside), given.innermost, given.outermost};
  for_all([&](auto before, std::size_t n) { find_rows<before()>(places, n, rows[n]); });
  for_all([&](auto before, std::size_t n) {
    sample_one<before()>(places, n, rows[n], range, samples[n]);
  });
}

}  // namespace
}  // namespace vstent::sdf

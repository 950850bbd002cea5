// Loops over particles and tasks that give the same bits for any number of threads.
#pragma once

#include <tbb/parallel_for.h>

#include <algorithm>

#include "sdf/geometry.hpp"
#include "xpbd/batches.hpp"

namespace vstent::xpbd {

// Particles per task in loops over particles; fixed, so that partial sums are the same for any
// number of threads.
inline constexpr std::size_t kChunk = 1024;

inline std::size_t chunks_of(std::size_t count) { return (count + kChunk - 1) / kChunk; }

inline std::size_t at(int index) { return static_cast<std::size_t>(index); }

template <class Real>
Vec3 place(const SlotOf<Real>& s) {
  return {static_cast<double>(s.x), static_cast<double>(s.y), static_cast<double>(s.z)};
}

template <class Real>
void put(SlotOf<Real>& s, const Vec3& place) {
  s.x = static_cast<Real>(place.x());
  s.y = static_cast<Real>(place.y());
  s.z = static_cast<Real>(place.z());
}

template <class Run>
void side_by_side(std::size_t tasks, const Run& run) {
  tbb::parallel_for(
      tbb::blocked_range<std::size_t>(0, tasks),
      [&](const tbb::blocked_range<std::size_t>& range) {
        for (std::size_t k = range.begin(); k < range.end(); ++k) run(k);
      },
      tbb::static_partitioner());
}

/// run(k, chunk) for every k, chunks side by side: a sum kept per chunk is added up in order
/// afterwards.
template <class Run>
void for_each_particle(std::size_t count, const Run& run) {
  side_by_side(chunks_of(count), [&](std::size_t chunk) {
    for (std::size_t k = chunk * kChunk; k < std::min(count, (chunk + 1) * kChunk); ++k)
      run(k, chunk);
  });
}

}  // namespace vstent::xpbd

// Contacts of points between vertices while a sheet moves: taken one after the other, for they
// share particles.
#pragma once

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "xpbd/parallel.hpp"

namespace vstent::xpbd {

/// A SpanContact by particles, and what it pushes with.
struct ClosableSpan {
  std::array<std::size_t, 3> particles;
  std::array<double, 3> weights;
  Vec3 normal;
  double offset;  // from the solver's own origin
  double force;   // N, never negative
  std::int64_t key;
};

template <class Real>
Vec3 point(const ClosableSpan& c, const std::vector<SlotOf<Real>>& slots) {
  return c.weights[0] * place(slots[c.particles[0]]) + c.weights[1] * place(slots[c.particles[1]]) +
         c.weights[2] * place(slots[c.particles[2]]);
}

/// By particle, N.
template <class Real>
void add_span_forces(std::span<const ClosableSpan> spans, std::vector<SlotOf<Real>>& to) {
  for (const ClosableSpan& c : spans) {
    for (std::size_t i = 0; i < 3; ++i) {
      SlotOf<Real>& slot = to[c.particles[i]];
      put(slot, place(slot) + c.weights[i] * c.force * c.normal);
    }
  }
}

/// One pass over the spans, one after the other: they share particles. `yielding(k, push)` is how
/// far particle k gives way to a push, which sets the force; the places themselves are corrected
/// along the normal, where `mobile(k)`. `moved(k, by)` hears of it.
template <class Real, class Yielding, class Mobile, class Moved>
void project_spans(std::span<ClosableSpan> spans, std::vector<SlotOf<Real>>& slots,
                   const Yielding& yielding, const Mobile& mobile, const Moved& moved) {
  for (ClosableSpan& c : spans) {
    double squares = 0;
    for (std::size_t i = 0; i < 3; ++i)
      if (mobile(c.particles[i])) squares += c.weights[i] * c.weights[i];
    if (!(squares > 0)) continue;
    double give = 0;
    for (std::size_t i = 0; i < 3; ++i)
      if (c.weights[i] > 0 && mobile(c.particles[i]))
        give += c.weights[i] * c.weights[i] * c.normal.dot(yielding(c.particles[i], c.normal));
    const double change = std::max(-c.force, -(c.normal.dot(point(c, slots)) - c.offset) / give);
    c.force += change;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t k = c.particles[i];
      if (c.weights[i] == 0 || !mobile(k)) continue;
      const Vec3 by = change * give / squares * c.weights[i] * c.normal;
      put(slots[k], place(slots[k]) + by);
      moved(k, by);
    }
  }
}

}  // namespace vstent::xpbd

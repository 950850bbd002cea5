// The neo-Hookean law of a thin sheet, for one triangle (double) or several at a time.
#pragma once

#include <cmath>

namespace vstent::xpbd {

/// What the law needs of its numbers.
struct OneTriangle {
  using Number = double;
  static double larger(double a, double b) { return a > b ? a : b; }
  static double smaller(double a, double b) { return a < b ? a : b; }
  static bool are_within(double a, double bound) { return std::abs(a) < bound; }
};

/// With C = F^T F of the sheet's deformation and J of the volume's, the energy over the shear
/// modulus is, per volume at rest,
///     (tr C + (J / sqrt(det C))^2) J^(-2/3) / 2 - 3/2 + k/2 (J - 1)^2,
/// k bulk over shear modulus, for the J that makes it least: nothing presses on the sheet.
template <class Of>
struct SheetStretch {
  using T = typename Of::Number;
  T trace;           ///< tr C - 2
  T area;            ///< det C - 1
  T swell;           ///< J^(1/3) - 1
  T energy;          ///< per shear modulus and volume; no cancelling terms of first order near rest
  T inverse_square;  ///< J^(-2/3): twice the energy's derivative by tr C
  T pressure;        ///< J^2 / det C^2: less that by det C, over the one by tr C
};

/// `trace` as above; `beyond`: det C - tr C + 1.
template <class Of>
[[gnu::always_inline]] inline SheetStretch<Of> stretch_of_sheet(const typename Of::Number& trace,
                                                                const typename Of::Number& beyond,
                                                                const typename Of::Number& bulk) {
  using T = typename Of::Number;
  const T one = trace * 0.0 + 1.0;
  // A triangle squeezed flat has no area, but for rounding.
  const T area = Of::larger(trace + beyond, one * (1e-9 - 1));
  const T inverse_area = one / (one + area);
  const T given = trace + 2.0 * area + trace * area;
  // Halley's method, from beyond the root of a function that curves upwards there.
  T q = Of::smaller(given / (9.0 * bulk + 12.0), (trace + 2.0) / (9.0 * bulk));
  T u = one, a = one;
  constexpr double kSettled = 2e-6;  // what is left after one more step is about ten times its cube
  for (int k = 0; k < 60; ++k) {
    u = one + q;
    const T u2 = u * u, u3 = u2 * u, u4 = u2 * u2, bulk_u3 = bulk * u3;
    a = q * (2.0 + q);
    const T value = bulk_u3 * u2 * q * (3.0 + q * (3.0 + q)) +
                    (a * (6.0 + a * (6.0 + 2.0 * a)) - given) * inverse_area * (1.0 / 3);
    const T slope = bulk * u4 * (8.0 * u3 - 5.0) + 4.0 * u4 * u * inverse_area;
    const T half_curvature = bulk_u3 * (28.0 * u3 - 10.0) + 10.0 * u4 * inverse_area;
    const T change = value * slope / (slope * slope - value * half_curvature);
    q = q - change;
    if (Of::are_within(change, kSettled)) break;
  }
  u = one + q;
  a = q * (2.0 + q);
  SheetStretch<Of> s;
  s.trace = trace;
  s.area = area;
  s.swell = q;
  s.inverse_square = one / (u * u);
  const T volume = q * (3.0 + q * (3.0 + q));
  s.energy = 0.5 * (s.inverse_square * inverse_area *
                        (trace * area - beyond + a * (a * (3.0 + a) - 3.0 * area)) +
                    bulk * volume * volume);
  const T cube = u * u * u * inverse_area;
  s.pressure = cube * cube;
  return s;
}

}  // namespace vstent::xpbd

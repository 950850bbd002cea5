// Where pressure is lost along one branch of a lumen. cgs.
#pragma once

#include <cstddef>
#include <vector>

#include "flow/boundary_conditions.hpp"

namespace vstent::flow {

/// Cross-sections along a branch, at two points or more; between them the diameter is linear.
struct Lumen {
  std::vector<double> arc;   ///< cm from the branch's start, rising
  std::vector<double> area;  ///< cm2
};

/// What the pressure lost where flow separates behind a narrowing depends on.
struct LossModel {
  double separation = 1.52;  ///< K_t of Young and Tsai 1973; 1: Borda and Carnot
  /// Poiseuille flow at the throat over as many throat diameters is lost besides: 1.64 for blunt
  /// plugs (Seeley and Young 1976); 0: the profile is smooth.
  double entrance = 0;
};

/// A widening by 5 % in diameter or more, and the narrowing before it. Indices into the lumen.
struct Stenosis {
  std::size_t start = 0;   ///< the widest place before
  std::size_t throat = 0;  ///< the narrowest, the last where several are
  std::size_t end = 0;     ///< the widest after, within 10 throat diameters
  double percent = 0;      ///< of the smaller of the diameters at `start` and `end`
};

std::vector<Stenosis> find_stenoses(const Lumen& lumen);

/// Per point, summed up from the branch's start: the loss of total pressure is
/// viscous q + separation q|q| + inertance dq/dt.
struct Losses {
  std::vector<double> viscous;  ///< dyn s/cm5: integral of 8 pi mu / A^2
  std::vector<double>
      separation;  ///< dyn s2/cm8: K_t rho/2 (1/A_throat - 1/A_end)^2, behind throats
  std::vector<double> inertance;  ///< dyn s2/cm5: integral of rho / A
  std::vector<Stenosis> stenoses;
};

Losses losses_along(const Lumen& lumen, const Blood& blood, const LossModel& model = {});

/// Pressure drop (dyn/cm2) of a stenosis in a straight vessel of `diameter`, `length` long with a
/// throat of `throat` (cm), by Young and Tsai's formula with the coefficients of Seeley and Young
/// 1976: K_v mu u / D + K_t rho/2 (A/A_throat - 1)^2 u^2, K_v = 32 (0.83 length + 1.64 throat) / D
/// (A/A_throat)^2, K_t = 1.52.
struct YoungTsai {
  double viscous = 0, separation = 0;
};
YoungTsai young_tsai(double diameter, double throat, double length, double flow,
                     const Blood& blood);

}  // namespace vstent::flow

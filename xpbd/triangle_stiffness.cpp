#include "xpbd/triangle_stiffness.hpp"

#include <algorithm>
#include <cmath>

#include "xpbd/membrane_law.hpp"

namespace vstent::xpbd {
namespace {

/// R with R^T R = M, rows of zeros where M is not positive.
Eigen::Matrix3d root(Eigen::Matrix3d m) {
  Eigen::Matrix3d factor = Eigen::Matrix3d::Zero();
  const double least = 1e-12 * m.diagonal().cwiseAbs().maxCoeff();
  for (int k = 0; k < 3; ++k) {
    if (!(m(k, k) > least)) continue;
    factor.row(k) = m.row(k) / std::sqrt(m(k, k));
    m -= factor.row(k).transpose() * factor.row(k);
  }
  return factor;
}

}  // namespace

TriangleStiffness measure_stiffness(const TriangleBatch& batch, std::size_t lane,
                                    const std::array<Vec3, 3>& corners) {
  const double along = batch.along[lane], skew = batch.skew[lane], across = batch.across[lane];
  const double weight = batch.weight[lane], bulk = batch.bulk[lane];
  const std::array<double, 3> by_f{-along, along, 0}, by_g{skew - across, -skew, across};
  Vec3 f = Vec3::Zero(), g = Vec3::Zero();
  for (std::size_t v = 0; v < 3; ++v) {
    f += by_f[v] * corners[v];
    g += by_g[v] * corners[v];
  }
  const double ff = f.squaredNorm(), gg = g.squaredNorm(), fg = f.dot(g);
  const auto law =
      stretch_of_sheet<OneTriangle>((ff - 1) + (gg - 1), (ff - 1) * (gg - 1) - fg * fg, bulk);

  // The energy's second derivatives by tr C and det C, the volume giving way.
  const double u = 1 + law.swell, area = 1 + law.area, u3 = u * u * u, u5 = u3 * u * u;
  const double yielding = 5 * (2 + law.trace) / (3 * u5 * u) + 2 / (3 * area) + 3 * bulk * u * u;
  const double u_trace = 1 / (3 * u5 * yielding), u_area = 2 * u / (3 * area * area * yielding);
  const double by_trace_trace = -u_trace / u3, by_trace_area = -u_area / u3;
  const double by_area = -0.5 * law.inverse_square * law.pressure;
  const double by_area_area = u3 / (area * area) * (u / area - 2 * u_area);

  TriangleStiffness stiffness;
  // In C, as (C_ff, C_gg, C_fg).
  const Vec3 trace(1, 1, 0), cofactor(gg, ff, -2 * fg);
  Eigen::Matrix3d in_strain =
      by_trace_trace * trace * trace.transpose() + by_trace_area * trace * cofactor.transpose() +
      by_trace_area * cofactor * trace.transpose() + by_area_area * cofactor * cofactor.transpose();
  in_strain(0, 1) += by_area;
  in_strain(1, 0) += by_area;
  in_strain(2, 2) -= 2 * by_area;
  const Eigen::Matrix3d factor = root(weight * in_strain);
  for (std::size_t v = 0; v < 3; ++v) {
    Eigen::Matrix3d strain;  // of C by this corner's motion
    strain << 2 * by_f[v] * f.transpose(), 2 * by_g[v] * g.transpose(),
        (by_g[v] * f + by_f[v] * g).transpose();
    stiffness.strains[v] = factor * strain;
  }
  // Stress, as (ff, gg, fg), and its two principal values.
  const double scale = weight * law.inverse_square;
  const double s_ff = scale * (1 - law.pressure * gg), s_gg = scale * (1 - law.pressure * ff);
  const double s_fg = scale * law.pressure * fg;
  const double middle = 0.5 * (s_ff + s_gg), apart = 0.5 * (s_ff - s_gg);
  const double spread = std::sqrt(apart * apart + s_fg * s_fg);
  // Of the first principal direction to f, by half of twice its angle.
  double cosine = 1, sine = 0;
  if (spread > 0) {
    const double larger = std::sqrt(0.5 * (1 + std::abs(apart) / spread));
    const double smaller = 0.5 * s_fg / (spread * larger);
    cosine = apart < 0 ? std::abs(smaller) : larger;
    sine = apart < 0 ? std::copysign(larger, s_fg) : smaller;
  }
  stiffness.stress = {middle + spread, middle - spread};
  for (std::size_t v = 0; v < 3; ++v) {
    stiffness.shares[0][v] = cosine * by_f[v] + sine * by_g[v];
    stiffness.shares[1][v] = cosine * by_g[v] - sine * by_f[v];
  }
  return stiffness;
}

}  // namespace vstent::xpbd

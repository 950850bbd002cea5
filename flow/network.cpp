#include "flow/network.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "vessels/error.hpp"
#include "vessels/text.hpp"

namespace vstent::flow {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

std::size_t at(int i) { return static_cast<std::size_t>(i); }

/// How a time derivative is had from a value and what came before: alpha x + history.
struct Scheme {
  double alpha = 0;  ///< 0: steady
  double newest = 0, older = 0;

  static Scheme steady() { return {}; }
  static Scheme backward_euler(double h) { return {1 / h, -1 / h, 0}; }
  static Scheme backward_second_order(double h) { return {1.5 / h, -2 / h, 0.5 / h}; }
  double history(double last, double before) const { return newest * last + older * before; }
};

/// What an outlet stores: pressures at its capacitors.
using Stored = std::array<double, 2>;

/// An outlet at one instant: p = a + b q, and its stored pressures likewise.
struct OutletLaw {
  double a = 0, b = 0;
  Stored stored_a{}, stored_b{};
};

struct Law {
  const Scheme& scheme;
  double time;
  Stored history;  ///< of the stored pressures' derivatives

  OutletLaw operator()(const Resistance& r) const {
    return {r.distal_pressure, r.resistance, {}, {}};
  }
  OutletLaw operator()(const Pressure& p) const { return {p.pressure, 0, {}, {}}; }
  OutletLaw operator()(const Inflow&) const { return {}; }

  /// C dP/dt = q - (P - P_d) / R_d
  OutletLaw operator()(const Rcr& r) const {
    const double g = r.capacitance * scheme.alpha + 1 / r.distal;
    const double stored_a = (r.distal_pressure / r.distal - r.capacitance * history[0]) / g;
    return {stored_a, r.proximal + 1 / g, {stored_a, 0}, {1 / g, 0}};
  }

  /// C_a dP_a/dt = q - (P_a - P_m) / R_m;  C_im d(P_m - P_im)/dt = (P_a - P_m) / R_m - (P_m - P_v)
  /// / R_v
  OutletLaw operator()(const Coronary& c) const {
    const double muscle = flow::at(c.intramyocardial_pressure, time);
    Eigen::Matrix2d m;
    m << c.arterial_compliance * scheme.alpha + 1 / c.micro, -1 / c.micro, -1 / c.micro,
        c.micro_compliance * scheme.alpha + 1 / c.micro + 1 / c.venous;
    const Eigen::Vector2d constant(
        -c.arterial_compliance * history[0],
        c.venous_pressure / c.venous + c.micro_compliance * (scheme.alpha * muscle - history[1]));
    const Eigen::Vector2d a = m.inverse() * constant, b = m.inverse() * Eigen::Vector2d(1, 0);
    return {a[0], c.arterial + b[0], {a[0], a[1] - muscle}, {b[0], b[1]}};
  }
};

class Solver {
 public:
  explicit Solver(const Network& network) : n_(network) {
    const std::size_t count = n_.branches.size();
    leaves_under_.resize(count);
    std::vector<char> is_parent(count, 0);
    for (const Branch& b : n_.branches)
      if (b.parent >= 0) is_parent[at(b.parent)] = 1;
    for (std::size_t b = 0; b < count; ++b) {
      if (is_parent[b]) continue;
      const auto outlet = n_.outlets.find(static_cast<int>(b));
      if (outlet == n_.outlets.end())
        throw Error(ExitCode::usage, "branch " + std::to_string(b) + " ends without a condition");
      const int leaf = static_cast<int>(leaves_.size());
      leaves_.push_back(b);
      conditions_.push_back(&outlet->second);
      for (int up = static_cast<int>(b); up >= 0; up = n_.branches[at(up)].parent)
        leaves_under_[at(up)].push_back(leaf);
    }
    stored_.assign(leaves_.size(), {});
    stored_before_ = stored_;
    flow_.assign(count, 0);
    flow_before_ = flow_;
    leaf_flow_ = VectorXd::Zero(static_cast<Eigen::Index>(leaves_.size()));
  }

  /// Solves at `time`, which becomes the newest instant.
  Instant step(const Scheme& scheme, double time, double inflow) {
    std::vector<OutletLaw> laws;
    for (std::size_t i = 0; i < leaves_.size(); ++i) {
      const Stored history{scheme.history(stored_[i][0], stored_before_[i][0]),
                           scheme.history(stored_[i][1], stored_before_[i][1])};
      laws.push_back(std::visit(Law{scheme, time, history}, *conditions_[i]));
    }
    std::vector<double> history(flow_.size());
    for (std::size_t b = 0; b < flow_.size(); ++b)
      history[b] = scheme.history(flow_[b], flow_before_[b]);
    newton(scheme, history, laws, inflow);
    Instant instant{time, inlet_pressure_, branch_flows(leaf_flow_), {}};
    for (std::size_t b = 0; b < flow_.size(); ++b)
      instant.rate.push_back(scheme.alpha * instant.flow[b] + history[b]);
    stored_before_ = stored_;
    flow_before_ = flow_;
    flow_ = instant.flow;
    for (std::size_t i = 0; i < leaves_.size(); ++i) {
      const double q = leaf_flow_[static_cast<Eigen::Index>(i)];
      for (std::size_t k = 0; k < 2; ++k)
        stored_[i][k] = laws[i].stored_a[k] + laws[i].stored_b[k] * q;
    }
    return instant;
  }

  std::vector<Stored>& stored() { return stored_; }
  std::vector<Stored>& stored_before() { return stored_before_; }
  double inlet_pressure() const { return inlet_pressure_; }

 private:
  std::vector<double> branch_flows(const VectorXd& leaf_flow) const {
    std::vector<double> flow(leaves_under_.size(), 0);
    for (std::size_t b = 0; b < flow.size(); ++b)
      for (const int leaf : leaves_under_[b]) flow[b] += leaf_flow[leaf];
    return flow;
  }

  struct Equations {
    VectorXd residual;
    MatrixXd jacobian;
  };

  /// Unknowns: the leaves' flows, then the inlet pressure. Equations: at each leaf the tree and the
  /// outlet have one pressure; flows sum to the inflow.
  Equations equations(const Scheme& scheme, const std::vector<double>& history,
                      const std::vector<OutletLaw>& laws, double inflow, const VectorXd& leaf_flow,
                      double inlet_pressure) const {
    const std::vector<double> flow = branch_flows(leaf_flow);
    const std::size_t count = flow.size();
    const double half_density = 0.5 * n_.blood.density;
    const auto dynamic = [&](double q, double area) {
      return half_density * (q / area) * (q / area);
    };
    const auto slope = [&](double q, double area) { return 2 * half_density * q / (area * area); };
    std::vector<double> head(count), own(count), of_parent(count, 0);  // and d head / d flows
    for (std::size_t b = 0; b < count; ++b) {
      const Branch& branch = n_.branches[b];
      const double q = flow[b], first = branch.lumen.area.front();
      if (branch.parent < 0) {
        head[b] = inlet_pressure + dynamic(q, first);
        own[b] = slope(q, first);
      } else {
        const std::size_t p = at(branch.parent);
        const double last = n_.branches[p].lumen.area.back();
        const double lost = dynamic(flow[p], last) - dynamic(q, first);
        head[b] = head[p] - std::max(0.0, lost);
        own[b] = lost > 0 ? slope(q, first) : 0;
        of_parent[b] = lost > 0 ? -slope(flow[p], last) : 0;
      }
      const double viscous = branch.losses.viscous.back(), s = branch.losses.separation.back();
      const double inertance = branch.losses.inertance.back();
      head[b] -= viscous * q + s * q * std::abs(q) + inertance * (scheme.alpha * q + history[b]);
      own[b] -= viscous + 2 * s * std::abs(q) + inertance * scheme.alpha;
    }
    const auto size = static_cast<Eigen::Index>(leaves_.size());
    Equations e{VectorXd::Zero(size + 1), MatrixXd::Zero(size + 1, size + 1)};
    for (Eigen::Index i = 0; i < size; ++i) {
      const std::size_t leaf = leaves_[static_cast<std::size_t>(i)];
      const OutletLaw& law = laws[static_cast<std::size_t>(i)];
      const double q = flow[leaf], last = n_.branches[leaf].lumen.area.back();
      e.residual[i] = head[leaf] - dynamic(q, last) - law.a - law.b * q;
      e.jacobian(i, i) = -slope(q, last) - law.b;
      e.jacobian(i, size) = 1;
      for (int b = static_cast<int>(leaf); b >= 0; b = n_.branches[at(b)].parent) {
        for (const int j : leaves_under_[at(b)]) e.jacobian(i, j) += own[at(b)];
        if (n_.branches[at(b)].parent < 0) continue;
        for (const int j : leaves_under_[at(n_.branches[at(b)].parent)])
          e.jacobian(i, j) += of_parent[at(b)];
      }
    }
    e.residual[size] = leaf_flow.sum() - inflow;
    e.jacobian.row(size).head(size).setOnes();
    return e;
  }

  void newton(const Scheme& scheme, const std::vector<double>& history,
              const std::vector<OutletLaw>& laws, double inflow) {
    constexpr int kIterations = 100;
    constexpr double kTolerance = 1e-10;
    const auto size = leaf_flow_.size();
    const auto norm = [&](const VectorXd& residual, double pressure, double flow) {
      return residual.head(size).cwiseAbs().maxCoeff() / pressure + std::abs(residual[size]) / flow;
    };
    if (leaf_flow_.sum() == 0) leaf_flow_.setConstant(inflow / static_cast<double>(size));
    const double flow_scale = std::max(std::abs(inflow), 1e-9 + leaf_flow_.cwiseAbs().maxCoeff());
    Equations e = equations(scheme, history, laws, inflow, leaf_flow_, inlet_pressure_);
    for (int k = 0; k < kIterations; ++k) {
      const double pressure_scale = std::max({std::abs(inlet_pressure_), kDynPerCm2PerMmHg,
                                              1e-3 * e.residual.head(size).cwiseAbs().maxCoeff()});
      const double now = norm(e.residual, pressure_scale, flow_scale);
      if (now < kTolerance) return;
      const VectorXd change = e.jacobian.partialPivLu().solve(-e.residual);
      if (!change.allFinite()) break;
      // Half the step while it makes things worse.
      double share = 1;
      for (int halvings = 0; halvings < 30; ++halvings, share *= 0.5) {
        const VectorXd flow = leaf_flow_ + share * change.head(size);
        const double pressure = inlet_pressure_ + share * change[size];
        Equations next = equations(scheme, history, laws, inflow, flow, pressure);
        if (norm(next.residual, pressure_scale, flow_scale) < (1 - 0.1 * share) * now ||
            halvings == 29) {
          leaf_flow_ = flow;
          inlet_pressure_ = pressure;
          e = std::move(next);
          break;
        }
      }
    }
    throw Error(ExitCode::numerical,
                "the reduced model finds no flows that meet the conditions at an inflow of " +
                    vessels::number(inflow) + " mL/s; are the conditions in the right units?");
  }

  const Network& n_;
  std::vector<std::size_t> leaves_;
  std::vector<const Condition*> conditions_;
  std::vector<std::vector<int>> leaves_under_;  ///< per branch
  std::vector<Stored> stored_, stored_before_;
  std::vector<double> flow_, flow_before_;
  VectorXd leaf_flow_;
  double inlet_pressure_ = 0;
};

/// Where a sequence that shrinks by the same factor from beat to beat is going.
void extrapolate(std::vector<Stored>& now, std::vector<Stored>& just_before,
                 const std::vector<Stored>& last, const std::vector<Stored>& older) {
  for (std::size_t i = 0; i < now.size(); ++i) {
    for (std::size_t k = 0; k < 2; ++k) {
      const double d = now[i][k] - last[i][k], e = last[i][k] - older[i][k];
      const double factor = e != 0 ? d / e : 0;
      if (!(factor > 0 && factor < 0.98)) continue;
      const double jump = d * factor / (1 - factor);
      now[i][k] += jump;
      just_before[i][k] += jump;
    }
  }
}

double largest_change(const std::vector<Stored>& a, const std::vector<Stored>& b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t k = 0; k < 2; ++k) largest = std::max(largest, std::abs(a[i][k] - b[i][k]));
  return largest;
}

}  // namespace

std::vector<std::vector<double>> pressures(const Network& network, const Instant& instant) {
  std::vector<std::vector<double>> result;
  std::vector<double> end_head;
  const auto dynamic = [&](double q, double area) {
    return 0.5 * network.blood.density * (q / area) * (q / area);
  };
  for (std::size_t b = 0; b < network.branches.size(); ++b) {
    const Branch& branch = network.branches[b];
    const double q = instant.flow[b], rate = instant.rate[b];
    double head = instant.inlet_pressure + dynamic(q, branch.lumen.area.front());
    if (branch.parent >= 0) {
      const std::size_t p = at(branch.parent);
      head = end_head[p] -
             std::max(0.0, dynamic(instant.flow[p], network.branches[p].lumen.area.back()) -
                               dynamic(q, branch.lumen.area.front()));
    }
    std::vector<double>& line = result.emplace_back();
    double here = head;
    for (std::size_t i = 0; i < branch.lumen.area.size(); ++i) {
      here = head - branch.losses.viscous[i] * q - branch.losses.separation[i] * q * std::abs(q) -
             branch.losses.inertance[i] * rate;
      line.push_back(here - dynamic(q, branch.lumen.area[i]));
    }
    end_head.push_back(here);
  }
  return result;
}

Instant solve_steady(const Network& network, double inflow) {
  return Solver(network).step(Scheme::steady(), 0, inflow);
}

Beat solve_beat(const Network& network, const Waveform& inflow, int steps) {
  constexpr int kBeats = 400;
  constexpr double kTolerance = 1e-6;  // of the inlet pressure
  const double h = inflow.period() / steps;
  Solver solver(network);
  solver.step(Scheme::steady(), 0, mean(inflow));
  std::vector<Stored> last, older;
  int quiet = 0;
  for (int k = 1; k <= kBeats; ++k) {
    older = std::exchange(last, solver.stored());
    Beat beat;
    for (int i = 1; i <= steps; ++i) {
      const Scheme scheme =
          k == 1 && i == 1 ? Scheme::backward_euler(h) : Scheme::backward_second_order(h);
      beat.instants.push_back(solver.step(scheme, i * h, flow::at(inflow, i * h)));
    }
    beat.beats = k;
    const double scale = std::max(std::abs(solver.inlet_pressure()), kDynPerCm2PerMmHg);
    quiet = largest_change(solver.stored(), last) < kTolerance * scale ? quiet + 1 : 0;
    if (quiet == 2) return beat;  // twice: nothing of an extrapolation is left
    if (quiet == 0 && k % 3 == 0) extrapolate(solver.stored(), solver.stored_before(), last, older);
  }
  throw Error(ExitCode::numerical, "the reduced model finds no beat that repeats itself within " +
                                       std::to_string(kBeats) +
                                       "; is a capacitance in the right unit?");
}

}  // namespace vstent::flow

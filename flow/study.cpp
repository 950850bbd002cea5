#include "flow/study.hpp"

#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sdf/polyline.hpp"
#include "vessels/error.hpp"
#include "vessels/text.hpp"

namespace vstent::flow {
namespace {

constexpr double kMmPerCm = 10;
constexpr double kHighestPressure = 400 * kDynPerCm2PerMmHg;  // no bed of vessels needs more
constexpr LossModel kLowest{1.0, 0}, kHighest{1.52, 1.64};

std::size_t at(int i) { return static_cast<std::size_t>(i); }

TreePlace nearest(const LumenTree& tree, const Vec3& point) {
  TreePlace best;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t b = 0; b < tree.branches.size(); ++b) {
    const Polyline& axis = tree.branches[b].axis_before;
    for (std::size_t i = 0; i < axis.size(); ++i) {
      const double distance = (axis[i] - point).squaredNorm();
      if (distance < least) least = distance, best = {static_cast<int>(b), i, 0};
    }
  }
  return best;
}

/// From the root through `branch`, then always on into the widest child.
TreePath path_through(const LumenTree& tree, int branch) {
  TreePath path;
  for (int b = branch; b >= 0; b = tree.branches[at(b)].parent)
    path.branches.insert(path.branches.begin(), b);
  for (bool more = true; more;) {
    more = false;
    double widest = 0;
    int next = -1;
    for (std::size_t b = 0; b < tree.branches.size(); ++b) {
      if (tree.branches[b].parent != path.branches.back()) continue;
      const double area = tree.branches[b].area[0].front();
      if (area > widest) widest = area, next = static_cast<int>(b), more = true;
    }
    if (more) path.branches.push_back(next);
  }
  double start = 0;
  for (const int b : path.branches) {
    path.start.push_back(start);
    start += tree.branches[at(b)].arc.back();
  }
  return path;
}

double along(const LumenTree& tree, const TreePath& path, const TreePlace& place) {
  const auto found = std::find(path.branches.begin(), path.branches.end(), place.branch);
  if (found == path.branches.end()) return -1;
  return path.start[static_cast<std::size_t>(found - path.branches.begin())] +
         tree.branches[at(place.branch)].arc[place.point];
}

TreePlace place_at(const LumenTree& tree, const TreePath& path, double along) {
  std::size_t k = path.branches.size() - 1;
  while (k > 0 && path.start[k] > along) --k;
  const std::vector<double>& arc = tree.branches[at(path.branches[k])].arc;
  std::size_t best = 0;
  for (std::size_t i = 0; i < arc.size(); ++i)
    if (std::abs(arc[i] + path.start[k] - along) < std::abs(arc[best] + path.start[k] - along))
      best = i;
  return {path.branches[k], best, path.start[k] + arc[best]};
}

/// The narrowing before that costs the most pressure at this flow; nothing below 10 %.
std::optional<Stretch> costliest(const LumenTree& tree, const Network& network,
                                 const std::vector<double>& flow) {
  double most = 0;
  std::optional<Stretch> found;
  for (std::size_t b = 0; b < network.branches.size(); ++b) {
    const Branch& branch = network.branches[b];
    for (const Stenosis& s : branch.losses.stenoses) {
      const double q = flow[b];
      const double cost =
          (branch.losses.separation[s.end] - branch.losses.separation[s.throat]) * q * q +
          (branch.losses.viscous[s.end] - branch.losses.viscous[s.start]) * q;
      if (s.percent < 10 || cost <= most) continue;
      most = cost;
      const double area = std::min(branch.lumen.area[s.start], branch.lumen.area[s.end]);
      found = Stretch{tree.branches[b].axis_before[s.start], tree.branches[b].axis_before[s.end],
                      kMmPerCm * std::sqrt(4 * area / std::numbers::pi)};
    }
  }
  return found;
}

/// From the inlet to the end of the widest way.
Stretch widest_way(const LumenTree& tree) {
  const BranchSections &first = tree.branches.front(),
                       &last = tree.branches[at(path_through(tree, 0).branches.back())];
  return {first.axis_before.front(), last.axis_before.back(),
          std::sqrt(4 * first.area[0].front() / std::numbers::pi)};
}

void require_possible(const BoundaryConditions& conditions, double inflow) {
  double conductance = 0, driven = 0;
  for (const FaceCondition& face : conditions.faces) {
    if (is_inflow(face.condition)) continue;
    const Resistance r = steady(face.condition);
    if (r.resistance == 0) return;  // a pressure is given
    conductance += 1 / r.resistance;
    driven += r.distal_pressure / r.resistance;
  }
  const double pressure = (inflow + driven) / conductance;
  if (pressure <= kHighestPressure) return;
  throw Error(ExitCode::usage,
              conditions.source + ": /faces: contradict each other: " + vessels::number(inflow) +
                  " mL/s through outlets of together " + vessels::number(1 / conductance) +
                  " dyn s/cm5 needs " + vessels::number(pressure / kDynPerCm2PerMmHg) +
                  " mmHg; is a unit wrong?");
}

struct Places {
  TreePlace proximal, distal;
};

/// Flow with these losses, and what it is beside the stretch.
Answer solve(Network network, const Waveform& inflow, const Places& places) {
  Answer a;
  a.network = std::move(network);
  a.mean_inflow = mean(inflow);
  const auto pressure_at = [](const std::vector<std::vector<double>>& p, const TreePlace& place) {
    return p[at(place.branch)][place.point];
  };
  if (inflow.constant()) {
    const Instant instant = solve_steady(a.network, a.mean_inflow);
    a.mean_flow = instant.flow;
    a.mean_pressure = pressures(a.network, instant);
  } else {
    a.beat = solve_beat(a.network, inflow);
    const double share = 1 / static_cast<double>(a.beat->instants.size());
    a.mean_flow.assign(a.network.branches.size(), 0);
    for (const Branch& branch : a.network.branches)
      a.mean_pressure.emplace_back(branch.lumen.area.size(), 0.0);
    double highest_proximal = 0, highest_distal = 0;
    for (const Instant& instant : a.beat->instants) {
      const auto p = pressures(a.network, instant);
      for (std::size_t b = 0; b < p.size(); ++b) {
        a.mean_flow[b] += share * instant.flow[b];
        for (std::size_t i = 0; i < p[b].size(); ++i) a.mean_pressure[b][i] += share * p[b][i];
      }
      const double proximal = pressure_at(p, places.proximal),
                   distal = pressure_at(p, places.distal);
      const bool first = &instant == &a.beat->instants.front();
      a.peak_drop = first ? proximal - distal : std::max(*a.peak_drop, proximal - distal);
      highest_proximal = first ? proximal : std::max(highest_proximal, proximal);
      highest_distal = first ? distal : std::max(highest_distal, distal);
    }
    a.peak_to_peak = highest_proximal - highest_distal;
  }
  a.proximal = pressure_at(a.mean_pressure, places.proximal);
  a.distal = pressure_at(a.mean_pressure, places.distal);
  a.drop = a.proximal - a.distal;
  a.inlet = a.mean_pressure.front().front();
  a.ratio = a.distal / a.inlet;
  return a;
}

class Student {
 public:
  Student(const Question& question, const BoundaryConditions& conditions)
      : q_(question), bc_(conditions) {}

  Study run() {
    std::optional<measure::CutSurface> one, other;
    tbb::parallel_invoke([&] { one.emplace(q_.before); },
                         [&] {
                           if (&q_.after != &q_.before) other.emplace(q_.after);
                         });
    const measure::CutSurface &before = *one, &after = other ? *other : before;
    name_faces(before);
    s_.tree = cut_tree(before, after, centerline_);
    s_.notes = bc_.notes;
    set_inflow();
    find_places();
    if (other) s_.before = answer(When::before);
    s_.after = answer(When::after);
    return std::move(s_);
  }

 private:
  void name_faces(const measure::CutSurface& before) {
    const auto centres = face_centres(bc_, q_.before);
    centerline_ = q_.centerline;
    const auto inlet = std::find_if(bc_.faces.begin(), bc_.faces.end(),
                                    [](const FaceCondition& f) { return is_inflow(f.condition); });
    if (inlet != bc_.faces.end() && centres.contains(inlet->name))
      centerline_ = rooted_at(centerline_, centres.at(inlet->name));
    s_.ends = tree_ends(centerline_, q_.before, before.ends);
    name_ends(s_.ends, bc_, centres, q_.before.path);
  }

  void set_inflow() {
    s_.inflow = std::get<Inflow>(bc_.find(s_.ends.front().name)->condition);
    const double radius = s_.ends.front().radius / kMmPerCm;
    s_.inlet_area = std::numbers::pi * radius * radius;
    s_.inflow_volume = flow_into(s_.inflow, s_.inlet_area);
    if (s_.inflow.velocity) {
      s_.notes.push_back("the inflow's velocity is multiplied by the area of the face " +
                         s_.ends.front().name + ", " + vessels::number(s_.inlet_area) + " cm2");
    }
    require_possible(bc_, mean(s_.inflow_volume));
  }

  Network network(When when, const LossModel& model = {}) const {
    Network n = network_of(s_.tree, when, bc_.blood, model);
    for (const TreeEnd& end : s_.ends)
      if (!end.root) n.outlets[end.branch] = bc_.find(end.name)->condition;
    return n;
  }

  Stretch costliest_before() {
    const Network n = network(When::before);
    const auto narrowing = costliest(s_.tree, n, solve_steady(n, mean(s_.inflow_volume)).flow);
    s_.stretch_is = narrowing ? "the narrowing that costs most" : "the widest way, as none narrows";
    return narrowing ? *narrowing : widest_way(s_.tree);
  }

  /// Takes the stretch if blood runs it from `from` to `to`.
  bool lies_along(const TreePlace& from, const TreePlace& to) {
    s_.path = path_through(s_.tree, to.branch);
    s_.stretch_from = along(s_.tree, s_.path, from);
    s_.stretch_to = along(s_.tree, s_.path, to);
    return s_.stretch_from >= 0 && s_.stretch_from < s_.stretch_to;
  }

  void find_places() {
    const Stretch stretch = q_.stretch ? *q_.stretch : costliest_before();
    const TreePlace one = nearest(s_.tree, stretch.from), other = nearest(s_.tree, stretch.to);
    // The blood may come from the end that the centerline did not begin at.
    if (!lies_along(one, other) && !lies_along(other, one)) {
      throw Error(ExitCode::geometry,
                  q_.before.path + ": the stretch from " + vessels::place(stretch.from) + " to " +
                      vessels::place(stretch.to) + " mm does not run along the blood's way");
    }
    s_.proximal = place_at(s_.tree, s_.path, s_.stretch_from - stretch.diameter);
    s_.distal = place_at(s_.tree, s_.path, s_.stretch_to + 2 * stretch.diameter);
  }

  Answer answer(When when) const {
    const Places places{s_.proximal, s_.distal};
    Answer a = solve(network(when), s_.inflow_volume, places);
    const double low = solve(network(when, kLowest), s_.inflow_volume, places).drop;
    const double high = solve(network(when, kHighest), s_.inflow_volume, places).drop;
    a.lowest_drop = std::min(low, a.drop);
    a.highest_drop = std::max(high, a.drop);
    return a;
  }

  const Question& q_;
  const BoundaryConditions& bc_;
  vessels::Centerline centerline_;
  Study s_;
};

}  // namespace

Study study(const Question& question, const BoundaryConditions& conditions) {
  return Student(question, conditions).run();
}

BoundaryConditions assumed_conditions(const Question& question, const Inflow& inflow,
                                      double pressure, const Blood& blood) {
  constexpr double kExponent = 7.0 / 3;
  BoundaryConditions result;
  result.source = "command line";
  result.blood = blood;
  const vessels::LumenEnds lumen_ends = vessels::find_lumen_ends(question.before);
  const std::vector<TreeEnd> ends = tree_ends(question.centerline, question.before, lumen_ends);
  const double radius = ends.front().radius / kMmPerCm;
  const double flow = mean(flow_into(inflow, std::numbers::pi * radius * radius));
  double sum = 0;
  for (const TreeEnd& end : ends)
    if (!end.root) sum += std::pow(end.radius, kExponent);
  for (const TreeEnd& end : ends) {
    if (end.root) {
      result.faces.push_back({end.name, inflow, {}, {}});
      continue;
    }
    const double share = std::pow(end.radius, kExponent) / sum;
    result.faces.push_back({end.name, Resistance{pressure / (share * flow), 0}, {}, {}});
  }
  result.notes.push_back(
      "outlets are assumed: " + vessels::number(pressure / kDynPerCm2PerMmHg) +
      " mmHg at each in mean, flow shared by diameter to the power 7/3 (Huo and Kassab 2009)");
  return result;
}

}  // namespace vstent::flow

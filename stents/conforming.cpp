// How cells shear on a bend: rows with planar ends first, then all lengths made exact.
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>

#include "stents/row_shear.hpp"
#include "stents/strut_network.hpp"

namespace vstent::stents {
namespace {

constexpr double two_pi = 2 * std::numbers::pi;

std::size_t index(int i) { return static_cast<std::size_t>(i); }

const PatternPoint& point_of(const Pattern& pattern, const Piece& piece, int i) {
  const std::vector<PatternPoint>& points = pattern.members[index(piece.member)].points;
  return points[index(i) % points.size()];
}

RowGeometry geometry_of(const Pattern& pattern, const StrutNetwork& network, const Row& row) {
  RowGeometry result;
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const int k : row) {
    const Piece& piece = network.pieces[index(k)];
    RowPiece scaled;
    scaled.length = piece.length;
    for (int i = piece.first; i < piece.last; ++i) {
      const PatternPoint& a = point_of(pattern, piece, i);
      const PatternPoint& b = point_of(pattern, piece, i + 1);
      const double s = std::sin(0.5 * (b.angle - a.angle));
      scaled.steps.push_back({4 * a.radius * b.radius * s * s, (b.z - a.z) * (b.z - a.z),
                              (b.radius - a.radius) * (b.radius - a.radius)});
    }
    const PatternPoint& a = point_of(pattern, piece, piece.first);
    const PatternPoint& b = point_of(pattern, piece, piece.last);
    const double turn = std::remainder(b.angle - a.angle, two_pi);
    scaled.span = std::abs(turn);
    scaled.angle = a.angle + 0.5 * turn;
    low = std::min({low, a.z, b.z});
    high = std::max({high, a.z, b.z});
    result.pieces.push_back(std::move(scaled));
  }
  result.low = low;
  result.height = high - low;
  return result;
}

/// Straight connectors keep their length on the outside of a bend too, so the struts next to them
/// make up for it. Half of each counts for the row on either side, where every crown has one.
void add_links(const Pattern& pattern, const StrutNetwork& network, const std::vector<Row>& rows,
               std::vector<RowGeometry>& geometry) {
  std::vector<double> link(index(network.joints), 0.0);
  for (const Piece& piece : network.pieces) {
    if (pattern.members[index(piece.member)].kind != Member::Kind::connector || piece.flexible)
      continue;
    const double along =
        std::abs(point_of(pattern, piece, piece.last).z - point_of(pattern, piece, piece.first).z);
    link[index(piece.joint_a)] = link[index(piece.joint_b)] = along;
  }
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const double middle = geometry[r].low + 0.5 * geometry[r].height;
    for (const bool upper : {false, true}) {
      double shortest = std::numeric_limits<double>::infinity();
      for (const int k : rows[r]) {
        const Piece& piece = network.pieces[index(k)];
        const bool a_is_upper = point_of(pattern, piece, piece.first).z > middle;
        shortest =
            std::min(shortest, link[index(a_is_upper == upper ? piece.joint_a : piece.joint_b)]);
      }
      geometry[r].links += 0.5 * shortest;
    }
  }
}

/// Where the joints go, relative to the straight stent.
struct Moves {
  std::vector<double> angle, z;
};

/// Rows one after the other along the axis, about the middle of the stent.
std::vector<double> row_shifts(const std::vector<RowGeometry>& rows,
                               const std::vector<RowSolution>& solutions) {
  std::vector<double> shift(rows.size(), 0.0);
  double mean = 0;
  for (std::size_t r = 1; r < rows.size(); ++r) {
    shift[r] = shift[r - 1];
    if (rows[r].low > rows[r - 1].low + rows[r - 1].height - 1e-6)
      shift[r] += 0.5 * ((solutions[r - 1].height - 1) * rows[r - 1].height +
                         (solutions[r].height - 1) * rows[r].height);
    mean += shift[r];
  }
  for (double& s : shift) s -= mean / static_cast<double>(rows.size());
  return shift;
}

Moves moves_of_rows(const Pattern& pattern, const StrutNetwork& network, const BentTube& tube) {
  Moves moves{std::vector<double>(index(network.joints), 0.0),
              std::vector<double>(index(network.joints), 0.0)};
  const std::vector<Row> rows = rows_of(pattern, network);
  if (rows.empty()) return moves;
  std::vector<RowGeometry> geometry;
  for (const Row& row : rows) geometry.push_back(geometry_of(pattern, network, row));
  add_links(pattern, network, rows, geometry);
  std::vector<RowSolution> solutions;
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const double radius = point_of(pattern, network.pieces[index(rows[r][0])],
                                   network.pieces[index(rows[r][0])].first)
                              .radius;
    const RowGeometry& row = geometry[r];
    const BentTube::Place a = tube.at(row.low), b = tube.at(row.low + row.height);
    const auto stretch = [&](double angle) {
      const Vec3 along = b.centre - a.centre + radius * (b.outward(angle) - a.outward(angle));
      return along.norm() / row.height;
    };
    const std::optional<RowSolution> solution = solve_row(row, stretch);
    if (!solution) {
      std::ostringstream message;
      message << "struts between " << row.low << " and " << row.low + row.height
              << " mm from the proximal end are too short for the outside of the bend";
      throw Infeasible(message.str());
    }
    solutions.push_back(*solution);
  }
  const std::vector<double> shift = row_shifts(geometry, solutions);
  std::vector<int> count(index(network.joints), 0);
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const RowGeometry& row = geometry[r];
    const std::size_t n = rows[r].size();
    for (std::size_t k = 0; k < n; ++k) {
      const Piece& piece = network.pieces[index(rows[r][k])];
      const PatternPoint& a = point_of(pattern, piece, piece.first);
      const PatternPoint& b = point_of(pattern, piece, piece.last);
      const bool a_first = std::remainder(b.angle - a.angle, two_pi) > 0;
      const double grown = 0.5 * (solutions[r].heights[k] - 1) * row.height;
      for (const bool at_a : {true, false}) {
        const int joint = at_a ? piece.joint_a : piece.joint_b;
        const double z = at_a ? a.z : b.z;
        moves.angle[index(joint)] += solutions[r].displacement[at_a == a_first ? k : (k + 1) % n];
        moves.z[index(joint)] += shift[r] + (z > row.low + 0.5 * row.height ? grown : -grown);
        ++count[index(joint)];
      }
    }
  }
  for (std::size_t j = 0; j < count.size(); ++j)
    if (count[j] > 0) moves.angle[j] /= count[j], moves.z[j] /= count[j];
  return moves;
}

/// How much of each end's move a point of the piece makes: its own share of the way between them in
/// either coordinate, so that a crown's tangent stays; of the arc where that is not defined.
struct Shares {
  std::vector<double> angle, z;
};

Shares shares_of(const Pattern& pattern, const Piece& piece) {
  const int n = piece.last - piece.first;
  std::vector<double> arc(1, 0.0);
  double widest = 0, tallest = 0;
  const PatternPoint& a = point_of(pattern, piece, piece.first);
  const PatternPoint& b = point_of(pattern, piece, piece.last);
  const auto turn = [&](int i) {
    double sum = 0;
    for (int j = 0; j < i; ++j)
      sum += std::remainder(point_of(pattern, piece, piece.first + j + 1).angle -
                                point_of(pattern, piece, piece.first + j).angle,
                            two_pi);
    return sum;
  };
  std::vector<double> turns;
  for (int i = 0; i <= n; ++i) {
    turns.push_back(turn(i));
    const PatternPoint& p = point_of(pattern, piece, piece.first + i);
    if (i > 0)
      arc.push_back(arc.back() + (straight_point(p) -
                                  straight_point(point_of(pattern, piece, piece.first + i - 1)))
                                     .norm());
    widest = std::max(widest, std::abs(turns.back()));
    tallest = std::max(tallest, std::abs(p.z - a.z));
  }
  Shares shares;
  for (int i = 0; i <= n; ++i) {
    const double t = arc[index(i)] / arc.back();
    const bool by_angle = std::abs(turns.back()) > 0.5 * widest && widest > 0;
    const bool by_z = std::abs(b.z - a.z) > 0.5 * tallest && tallest > 0;
    shares.angle.push_back(by_angle ? turns[index(i)] / turns.back() : t);
    shares.z.push_back(by_z ? (point_of(pattern, piece, piece.first + i).z - a.z) / (b.z - a.z)
                            : t);
  }
  return shares;
}

class LengthSolver {
 public:
  LengthSolver(const Pattern& pattern, const StrutNetwork& network, const BentTube& tube)
      : pattern_(pattern), network_(network), tube_(tube) {
    for (const Piece& piece : network.pieces) shares_.push_back(shares_of(pattern, piece));
    for (std::size_t k = 0; k < network.pieces.size(); ++k)
      if (!network.pieces[k].flexible) kept_.push_back(static_cast<int>(k));
  }

  /// Newton steps of least displacement until all lengths are kept. Returns the largest change of
  /// length that is left, of the length or, for shorter pieces, of the strut's width.
  double solve(Moves& moves) const {
    Eigen::VectorXd excess = excess_of(moves);
    for (int round = 0; round < 40 && worst(excess) > 1e-12; ++round) {
      const Eigen::VectorXd step = least_step(moves, excess);
      double best = excess.norm();
      bool better = false;
      for (double part = 1; part > 1e-3 && !better; part *= 0.5) {
        const Moves trial = moved_by(moves, step, part);
        const Eigen::VectorXd trial_excess = excess_of(trial);
        if (!(trial_excess.norm() < best)) continue;
        moves = trial;
        excess = trial_excess;
        better = true;
      }
      if (!better) break;
    }
    return worst(excess);
  }

  PatternPoint moved(std::size_t k, int i, const Moves& moves) const {
    const Piece& piece = network_.pieces[k];
    PatternPoint p = point_of(pattern_, piece, piece.first + i);
    const std::size_t a = index(piece.joint_a), b = index(piece.joint_b);
    const double t = shares_[k].angle[index(i)], u = shares_[k].z[index(i)];
    p.angle += (1 - t) * moves.angle[a] + t * moves.angle[b];
    p.z += (1 - u) * moves.z[a] + u * moves.z[b];
    return p;
  }

 private:
  Eigen::VectorXd excess_of(const Moves& moves) const {
    Eigen::VectorXd excess(static_cast<Eigen::Index>(kept_.size()));
    for (std::size_t row = 0; row < kept_.size(); ++row) {
      const std::size_t k = index(kept_[row]);
      const Piece& piece = network_.pieces[k];
      double sum = 0;
      Vec3 before = tube_.point(moved(k, 0, moves));
      for (int i = 1; i <= piece.last - piece.first; ++i) {
        const Vec3 x = tube_.point(moved(k, i, moves));
        sum += (x - before).norm();
        before = x;
      }
      excess[static_cast<Eigen::Index>(row)] = sum - piece.length;
    }
    return excess;
  }

  double worst(const Eigen::VectorXd& excess) const {
    double result = 0;
    for (std::size_t row = 0; row < kept_.size(); ++row)
      result = std::max(
          result, std::abs(excess[static_cast<Eigen::Index>(row)]) /
                      std::max(network_.pieces[index(kept_[row])].length, pattern_.section.width));
    return result;
  }

  /// Unknowns: per joint, mm around the axis at the largest radius, and mm along it.
  Eigen::VectorXd least_step(const Moves& moves, const Eigen::VectorXd& excess) const {
    std::vector<Eigen::Triplet<double>> entries;
    for (std::size_t row = 0; row < kept_.size(); ++row) {
      const std::size_t k = index(kept_[row]);
      const Piece& piece = network_.pieces[k];
      const int n = piece.last - piece.first;
      Polyline x;
      for (int i = 0; i <= n; ++i) x.push_back(tube_.point(moved(k, i, moves)));
      std::array<double, 4> slope{};
      for (int i = 0; i <= n; ++i) {
        Vec3 pull = Vec3::Zero();
        if (i > 0) pull += (x[index(i)] - x[index(i - 1)]).normalized();
        if (i < n) pull += (x[index(i)] - x[index(i + 1)]).normalized();
        PatternPoint p = moved(k, i, moves);
        const BentTube::Place place = tube_.at(p.z);
        const Vec3 around = place.frame.tangent.cross(place.outward(p.angle));
        constexpr double difference = 1e-5;
        PatternPoint above = p, below = p;
        above.z += difference;
        below.z -= difference;
        const Vec3 along = (tube_.point(above) - tube_.point(below)) / (2 * difference);
        const double t = shares_[k].angle[index(i)], u = shares_[k].z[index(i)];
        const double by_angle = pull.dot(around) * p.radius / reference_;
        slope[0] += (1 - t) * by_angle;
        slope[1] += t * by_angle;
        slope[2] += (1 - u) * pull.dot(along);
        slope[3] += u * pull.dot(along);
      }
      const int r = static_cast<int>(row);
      entries.emplace_back(r, 2 * piece.joint_a, slope[0]);
      entries.emplace_back(r, 2 * piece.joint_b, slope[1]);
      entries.emplace_back(r, 2 * piece.joint_a + 1, slope[2]);
      entries.emplace_back(r, 2 * piece.joint_b + 1, slope[3]);
    }
    Eigen::SparseMatrix<double> jacobian(static_cast<Eigen::Index>(kept_.size()),
                                         2 * network_.joints);
    jacobian.setFromTriplets(entries.begin(), entries.end());
    Eigen::SparseMatrix<double> normal = jacobian * jacobian.transpose();
    // Lengths that follow from each other make it singular; they then agree, too.
    for (Eigen::Index i = 0; i < normal.rows(); ++i) normal.coeffRef(i, i) += 1e-11;
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(normal);
    return -(jacobian.transpose() * solver.solve(excess));
  }

  Moves moved_by(const Moves& moves, const Eigen::VectorXd& step, double part) const {
    Moves result = moves;
    for (std::size_t j = 0; j < result.angle.size(); ++j) {
      const auto i = static_cast<Eigen::Index>(2 * j);
      result.angle[j] += part * step[i] / reference_;
      result.z[j] += part * step[i + 1];
    }
    return result;
  }

  const Pattern& pattern_;
  const StrutNetwork& network_;
  const BentTube& tube_;
  std::vector<Shares> shares_;
  std::vector<int> kept_;  ///< pieces whose length is kept
  double reference_ = largest_radius(pattern_);

  static double largest_radius(const Pattern& pattern) {
    double radius = 0;
    for (const Member& member : pattern.members)
      for (const PatternPoint& p : member.points) radius = std::max(radius, p.radius);
    return radius;
  }
};

}  // namespace

std::vector<Member> conformed(const Pattern& pattern, const StrutNetwork& network,
                              const BentTube& tube) {
  Moves moves = moves_of_rows(pattern, network, tube);
  const LengthSolver solver(pattern, network, tube);
  const double left = solver.solve(moves);
  if (!(left < 1e-9)) {
    std::ostringstream message;
    message << "struts would have to change their lengths by " << 100 * left << " %";
    throw Infeasible(message.str());
  }
  std::vector<Member> members = pattern.members;
  for (std::size_t k = 0; k < network.pieces.size(); ++k) {
    const Piece& piece = network.pieces[k];
    std::vector<PatternPoint>& points = members[index(piece.member)].points;
    for (int i = 0; i <= piece.last - piece.first; ++i)
      points[index(piece.first + i) % points.size()] = solver.moved(k, i, moves);
  }
  return members;
}

double largest_feasible_curvature(const Pattern& pattern, const StrutNetwork& network,
                                  double limit) {
  const std::vector<Row> rows = rows_of(pattern, network);
  std::vector<RowGeometry> geometry;
  for (const Row& row : rows) geometry.push_back(geometry_of(pattern, network, row));
  add_links(pattern, network, rows, geometry);
  double result = limit;
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const Piece& piece = network.pieces[index(rows[r][0])];
    const double radius = point_of(pattern, piece, piece.first).radius;
    // Worst with the middle of a strut outermost.
    const double outermost = geometry[r].pieces[0].angle;
    const auto feasible = [&](double curvature) {
      return solve_row(
                 geometry[r],
                 [&](double angle) { return 1 + curvature * radius * std::cos(angle - outermost); })
          .has_value();
    };
    if (feasible(result)) continue;
    double low = 0, high = result;
    for (int i = 0; i < 60 && high - low > 1e-12 * high; ++i) {
      const double middle = 0.5 * (low + high);
      (feasible(middle) ? low : high) = middle;
    }
    result = low;
  }
  return result;
}

}  // namespace vstent::stents

#include "stents/pattern_metrics.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <sstream>
#include <stdexcept>

#include "stents/strut_network.hpp"

namespace vstent::stents {
namespace {

constexpr double two_pi = 2 * std::numbers::pi;

/// A straight piece on the unrolled wall.
struct Stroke {
  double angle_a, z_a, angle_b, z_b;
};

/// The mean radius of centre lines along the stent, from as many bins as hold metal, linear
/// between.
class MeanRadius {
 public:
  explicit MeanRadius(const Pattern& pattern) {
    constexpr int bins = 64;
    std::vector<double> weight(bins, 0.0), sum(bins, 0.0), place(bins, 0.0);
    for (const Member& member : pattern.members)
      for (std::size_t i = 0; i + (member.closed ? 0 : 1) < member.points.size(); ++i) {
        const PatternPoint& a = member.points[i];
        const PatternPoint& b = member.points[(i + 1) % member.points.size()];
        const double w = (straight_point(b) - straight_point(a)).norm();
        const double z = 0.5 * (a.z + b.z);
        const auto bin = static_cast<std::size_t>(
            std::clamp(static_cast<int>(bins * z / pattern.length), 0, bins - 1));
        weight[bin] += w;
        sum[bin] += w * 0.5 * (a.radius + b.radius);
        place[bin] += w * z;
      }
    double total = 0, total_weight = 0;
    for (std::size_t k = 0; k < weight.size(); ++k) {
      if (weight[k] <= 0) continue;
      z_.push_back(place[k] / weight[k]);
      radius_.push_back(sum[k] / weight[k]);
      total += sum[k];
      total_weight += weight[k];
    }
    if (z_.empty()) throw std::invalid_argument("a pattern without metal has no measures");
    mean_ = total / total_weight;
    // Weaves average out but for rounding and the last bins' cut.
    double spread = 0;
    for (const double r : radius_) spread = std::max(spread, std::abs(r - mean_));
    if (spread < 1e-3 * mean_) z_.assign(1, 0.0), radius_.assign(1, mean_);
  }
  double operator()(double z) const {
    const auto upper = std::upper_bound(z_.begin(), z_.end(), z);
    if (upper == z_.begin()) return radius_.front();
    if (upper == z_.end()) return radius_.back();
    const auto i = static_cast<std::size_t>(upper - z_.begin());
    const double t = (z - z_[i - 1]) / (z_[i] - z_[i - 1]);
    return (1 - t) * radius_[i - 1] + t * radius_[i];
  }
  double mean() const { return mean_; }

 private:
  std::vector<double> z_, radius_;
  double mean_ = 0;
};

std::vector<Stroke> strokes_of(const Pattern& pattern) {
  std::vector<Stroke> strokes;
  for (const Member& member : pattern.members)
    for (std::size_t i = 0; i + (member.closed ? 0 : 1) < member.points.size(); ++i) {
      const PatternPoint& a = member.points[i];
      const PatternPoint& b = member.points[(i + 1) % member.points.size()];
      const double turn = std::remainder(b.angle - a.angle, two_pi);
      const double start = a.angle - two_pi * std::floor(a.angle / two_pi);
      strokes.push_back({start, a.z, start + turn, b.z});
    }
  return strokes;
}

/// Square of the distance (mm) on the wall from a place, its angle in [0, 2 pi), to a stroke that
/// starts there; the wall's radius is r.
double squared_distance(const Stroke& stroke, double angle, double z, double r) {
  double turn = angle - 0.5 * (stroke.angle_a + stroke.angle_b);
  if (turn > 0.5 * two_pi)
    turn -= two_pi;
  else if (turn < -0.5 * two_pi)
    turn += two_pi;
  const double spanned = stroke.angle_b - stroke.angle_a;
  const double ux = r * spanned, uz = stroke.z_b - stroke.z_a;
  const double px = r * (turn + 0.5 * spanned), pz = z - stroke.z_a;
  const double uu = ux * ux + uz * uz;
  const double t = uu > 0 ? std::clamp((px * ux + pz * uz) / uu, 0.0, 1.0) : 0.0;
  const double x = px - t * ux, y = pz - t * uz;
  return x * x + y * y;
}

/// Pixels of the unrolled wall with the stroke nearest to each.
class Raster {
 public:
  Raster(const Pattern& pattern, const MeanRadius& radius, std::vector<Stroke> strokes,
         double pixel)
      : radius_(radius), strokes_(std::move(strokes)), half_width_(0.5 * pattern.section.width) {
    double widest = 0;
    for (int i = 0; i <= 64; ++i) widest = std::max(widest, radius(pattern.length * i / 64));
    columns_ = std::max(3, static_cast<int>(std::ceil(two_pi * widest / pixel)));
    rows_ = std::max(3, static_cast<int>(std::ceil(pattern.length / pixel)));
    step_angle_ = two_pi / columns_;
    step_z_ = pattern.length / rows_;
    for (int row = 0; row < rows_; ++row) row_radius_.push_back(radius((row + 0.5) * step_z_));
    const std::size_t count = static_cast<std::size_t>(rows_) * static_cast<std::size_t>(columns_);
    squared_.assign(count, std::numeric_limits<float>::infinity());
    nearest_.assign(count, -1);
    // Out to this distance every stroke is drawn, so that distances there are exact.
    const double reach = half_width_ + 2 * std::max(step_z_, step_angle_ * widest);
    drawn_ = static_cast<float>(reach * reach);
    for (std::size_t k = 0; k < strokes_.size(); ++k) draw(static_cast<int>(k), reach);
    spread();
  }

  int rows() const { return rows_; }
  int columns() const { return columns_; }
  std::size_t at(int row, int column) const {
    const int wrapped = column < 0           ? column + columns_
                        : column >= columns_ ? column - columns_
                                             : column;
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(wrapped);
  }
  /// Distance (mm) of the pixel's centre from the metal's edge, negative inside.
  double edge(std::size_t i) const {
    return std::sqrt(static_cast<double>(squared_[i])) - half_width_;
  }
  /// Of the pixel's area, by the distance of the edge from its centre.
  double free_share(std::size_t i) const {
    const double size = std::sqrt(step_z_ * step_angle_ * row_radius(i));
    return std::clamp(0.5 + edge(i) / size, 0.0, 1.0);
  }
  double area(std::size_t i) const { return step_z_ * step_angle_ * row_radius(i); }
  double angle(std::size_t i) const {
    return (static_cast<double>(i % static_cast<std::size_t>(columns_)) + 0.5) * step_angle_;
  }
  double z(std::size_t i) const {
    return (static_cast<double>(i / static_cast<std::size_t>(columns_)) + 0.5) * step_z_;
  }
  double pixel() const { return std::max(step_z_, step_angle_ * radius_.mean()); }
  double half_width() const { return half_width_; }
  const std::vector<Stroke>& strokes() const { return strokes_; }
  int nearest(std::size_t i) const { return nearest_[i]; }

 private:
  double row_radius(std::size_t i) const {
    return row_radius_[i / static_cast<std::size_t>(columns_)];
  }

  void draw(int k, double reach) {
    const Stroke& s = strokes_[static_cast<std::size_t>(k)];
    const int first_row =
        std::max(0, static_cast<int>(std::floor((std::min(s.z_a, s.z_b) - reach) / step_z_ - 0.5)));
    const int last_row = std::min(
        rows_ - 1, static_cast<int>(std::ceil((std::max(s.z_a, s.z_b) + reach) / step_z_ - 0.5)));
    for (int row = first_row; row <= last_row; ++row) {
      const double r = row_radius_[static_cast<std::size_t>(row)];
      const double side = reach / r;
      int first =
          static_cast<int>(std::floor((std::min(s.angle_a, s.angle_b) - side) / step_angle_ - 0.5));
      int last =
          static_cast<int>(std::ceil((std::max(s.angle_a, s.angle_b) + side) / step_angle_ - 0.5));
      last = std::min(last, first + columns_ - 1);
      for (int column = first; column <= last; ++column) {
        const int wrapped = ((column % columns_) + columns_) % columns_;
        offer(at(row, wrapped), row, wrapped, k);
      }
    }
  }

  bool offer(std::size_t i, int row, int column, int k) {
    const auto d = static_cast<float>(
        squared_distance(strokes_[static_cast<std::size_t>(k)], (column + 0.5) * step_angle_,
                         (row + 0.5) * step_z_, row_radius_[static_cast<std::size_t>(row)]));
    if (!(d < squared_[i])) return false;
    squared_[i] = d;
    nearest_[i] = k;
    return true;
  }

  /// Every free pixel tries the strokes that are nearest to its neighbours, back and forth over the
  /// wall until nothing changes.
  void spread() {
    bool changed = true;
    const auto try_neighbours = [&](int row, int column, int before) {
      const std::size_t i = at(row, column);
      if (squared_[i] <= drawn_) return;
      const auto take = [&](std::size_t from) {
        if (nearest_[from] >= 0 && nearest_[from] != nearest_[i])
          changed = offer(i, row, column, nearest_[from]) || changed;
      };
      take(at(row, column + before));
      const int other = row + before;
      if (other < 0 || other >= rows_) return;
      for (const int side : {-1, 0, 1}) take(at(other, column + side));
    };
    const auto sweep_row = [&](int row, int before) {
      for (int k = 0; k < columns_; ++k)
        try_neighbours(row, before < 0 ? k : columns_ - 1 - k, before);
    };
    for (int round = 0; changed && round < 20; ++round) {
      changed = false;
      for (int row = 0; row < rows_; ++row)
        for (const int before : {-1, 1}) sweep_row(row, before);
      for (int k = 0; k < rows_; ++k)
        for (const int before : {1, -1}) sweep_row(rows_ - 1 - k, before);
    }
  }

  const MeanRadius& radius_;
  std::vector<Stroke> strokes_;
  double half_width_ = 0, step_angle_ = 0, step_z_ = 0;
  int rows_ = 0, columns_ = 0;
  std::vector<double> row_radius_;
  float drawn_ = 0;             ///< mm^2
  std::vector<float> squared_;  ///< distance to centre lines, mm^2
  std::vector<int> nearest_;
};

/// Strokes by the square of the wall that they pass.
class StrokeFinder {
 public:
  StrokeFinder(const std::vector<Stroke>& strokes, const MeanRadius& radius, double length,
               double size)
      : strokes_(strokes), radius_(radius), size_(size) {
    columns_ = std::max(1, static_cast<int>(two_pi * radius.mean() / size));
    rows_ = 1 + static_cast<int>(length / size);
    squares_.resize(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_));
    for (std::size_t k = 0; k < strokes.size(); ++k) {
      const Stroke& s = strokes[k];
      const double long_way = std::hypot(radius.mean() * (s.angle_b - s.angle_a), s.z_b - s.z_a);
      const int steps = 1 + static_cast<int>(2 * long_way / size);
      for (int i = 0; i <= steps; ++i) {
        const double t = static_cast<double>(i) / steps;
        std::vector<int>& square = squares_[index(column((1 - t) * s.angle_a + t * s.angle_b),
                                                  row((1 - t) * s.z_a + t * s.z_b))];
        if (square.empty() || square.back() != static_cast<int>(k))
          square.push_back(static_cast<int>(k));
      }
    }
  }
  /// All strokes within `reach` (mm) of a place, and some beyond.
  std::vector<int> near(double angle, double z, double reach) const {
    // A stroke passes within half a square of squares that it was entered in.
    const double thinnest = std::min(radius_(z - reach), radius_(z + reach)) / radius_.mean();
    const int steps = 1 + static_cast<int>(std::ceil(reach / (size_ * thinnest) + 0.5));
    const int around = std::min(steps, columns_ / 2);
    std::vector<int> found;
    for (int r = std::max(0, row(z) - steps); r <= std::min(rows_ - 1, row(z) + steps); ++r)
      for (int c = -around; c <= around; ++c) {
        const std::vector<int>& square =
            squares_[index(((column(angle) + c) % columns_ + columns_) % columns_, r)];
        found.insert(found.end(), square.begin(), square.end());
      }
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    return found;
  }
  double nearest(const std::vector<int>& among, double angle, double z) const {
    const double r = radius_(z);
    const double turned = angle - two_pi * std::floor(angle / two_pi);
    double best = std::numeric_limits<double>::infinity();
    for (const int k : among)
      best = std::min(best, squared_distance(strokes_[static_cast<std::size_t>(k)], turned, z, r));
    return std::sqrt(best);
  }

 private:
  int column(double angle) const {
    const double turned = angle / two_pi - std::floor(angle / two_pi);
    return std::min(columns_ - 1, static_cast<int>(turned * columns_));
  }
  int row(double z) const { return std::clamp(static_cast<int>(z / size_), 0, rows_ - 1); }
  std::size_t index(int c, int r) const {
    return static_cast<std::size_t>(r) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(c);
  }
  const std::vector<Stroke>& strokes_;
  const MeanRadius& radius_;
  double size_;
  int columns_ = 1, rows_ = 1;
  std::vector<std::vector<int>> squares_;
};

/// From the widest pixel of a cell uphill to the centre of its largest circle.
void refine_circle(const StrokeFinder& finder, const MeanRadius& radius, double half_width,
                   double pixel, MeshCell& cell) {
  const double r = radius(cell.z);
  double reach = 0, travelled = 0;
  std::vector<int> strokes;
  const auto gather = [&] {
    reach = 0.5 * cell.circle + half_width + 16 * pixel;
    strokes = finder.near(cell.angle, cell.z, reach);
    travelled = 0;
  };
  gather();
  double best = finder.nearest(strokes, cell.angle, cell.z);
  for (double step = pixel; step > 2e-4 * pixel;) {
    double angle = cell.angle, z = cell.z;
    bool better = false;
    for (int k = 0; k < 12; ++k) {
      const double a = cell.angle + step * std::cos(k * two_pi / 12) / r;
      const double at = cell.z + step * std::sin(k * two_pi / 12);
      const double d = finder.nearest(strokes, a, at);
      if (d > best + 1e-12) best = d, angle = a, z = at, better = true;
    }
    cell.angle = angle;
    cell.z = z;
    travelled += better ? step : 0;
    if (!better) step *= 0.5;
    if (travelled < 4 * pixel) continue;
    cell.circle = 2 * (best - half_width);
    gather();
  }
  cell.circle = 2 * (best - half_width);
}

/// Free pixels that hang together; those that reach an end are no cell.
std::vector<MeshCell> cells_of(const Raster& raster, double& metal, double& wall) {
  const std::size_t count =
      static_cast<std::size_t>(raster.rows()) * static_cast<std::size_t>(raster.columns());
  std::vector<int> label(count, -1);
  std::vector<MeshCell> cells;
  std::vector<bool> open;
  std::vector<std::size_t> todo;
  for (std::size_t seed = 0; seed < count; ++seed) {
    if (label[seed] >= 0 || raster.edge(seed) <= 0) continue;
    const int name = static_cast<int>(cells.size());
    cells.emplace_back();
    open.push_back(false);
    double widest = -1;
    label[seed] = name;
    todo.assign(1, seed);
    while (!todo.empty()) {
      const std::size_t i = todo.back();
      todo.pop_back();
      if (raster.edge(i) > widest) {
        widest = raster.edge(i);
        cells.back().angle = raster.angle(i);
        cells.back().z = raster.z(i);
        cells.back().circle = 2 * widest;
      }
      const int row = static_cast<int>(i / static_cast<std::size_t>(raster.columns()));
      const int column = static_cast<int>(i % static_cast<std::size_t>(raster.columns()));
      if (row == 0 || row + 1 == raster.rows()) open.back() = true;
      const auto visit = [&](std::size_t j) {
        if (label[j] >= 0 || raster.edge(j) <= 0) return;
        label[j] = name;
        todo.push_back(j);
      };
      visit(raster.at(row, column - 1));
      visit(raster.at(row, column + 1));
      if (row > 0) visit(raster.at(row - 1, column));
      if (row + 1 < raster.rows()) visit(raster.at(row + 1, column));
    }
  }
  // Pixels whose centre is metal but which reach into a cell give it their share.
  metal = wall = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double free = raster.free_share(i) * raster.area(i);
    metal += raster.area(i) - free;
    wall += raster.area(i);
    if (free <= 0) continue;
    int owner = label[i];
    if (owner < 0) {
      const int row = static_cast<int>(i / static_cast<std::size_t>(raster.columns()));
      const int column = static_cast<int>(i % static_cast<std::size_t>(raster.columns()));
      double widest = 0;
      for (int dr = -1; dr <= 1; ++dr)
        for (int dc = -1; dc <= 1; ++dc) {
          if (row + dr < 0 || row + dr >= raster.rows()) continue;
          const std::size_t j = raster.at(row + dr, column + dc);
          if (label[j] >= 0 && raster.edge(j) > widest) widest = raster.edge(j), owner = label[j];
        }
    }
    if (owner >= 0) cells[static_cast<std::size_t>(owner)].area += free;
  }
  std::vector<MeshCell> closed;
  for (std::size_t k = 0; k < cells.size(); ++k)
    if (!open[k] && cells[k].circle > raster.pixel()) closed.push_back(cells[k]);
  return closed;
}

void count_parts(const Pattern& pattern, PatternMetrics& metrics) {
  const StrutNetwork network = strut_network(pattern);
  std::map<int, std::set<int>> wires_at;
  for (const Piece& piece : network.pieces) {
    const Member& member = pattern.members[static_cast<std::size_t>(piece.member)];
    if (member.kind == Member::Kind::connector) continue;
    ++metrics.struts;
    if (member.kind != Member::Kind::wire) continue;
    wires_at[piece.joint_a].insert(piece.member);
    wires_at[piece.joint_b].insert(piece.member);
  }
  for (const auto& [joint, wires] : wires_at) metrics.crossings += wires.size() > 1 ? 1 : 0;
  for (const Member& member : pattern.members) {
    if (member.kind == Member::Kind::connector)
      ++metrics.connectors;
    else
      metrics.crowns += static_cast<int>(crowns_of(member).size());
  }
}

}  // namespace

PatternMetrics measure(const Pattern& pattern, double pixel) {
  PatternMetrics metrics;
  const MeanRadius radius(pattern);
  metrics.length = pattern.length;
  metrics.radius = radius.mean();
  metrics.strut_width = pattern.section.width;
  const double wall_area = two_pi * radius.mean() * pattern.length;
  if (pixel <= 0) pixel = std::max(pattern.section.width / 8, std::sqrt(wall_area / 1e7));
  if (pixel > pattern.section.width / 3) {
    std::ostringstream message;
    message << "a raster of " << pixel << " mm is too coarse for struts " << pattern.section.width
            << " mm wide; at a third of that it would have "
            << 9 * wall_area / (pattern.section.width * pattern.section.width) << " pixels";
    throw std::invalid_argument(message.str());
  }
  const Raster raster(pattern, radius, strokes_of(pattern), pixel);
  metrics.pixel = raster.pixel();
  double metal = 0, wall = 0;
  metrics.cells = cells_of(raster, metal, wall);
  metrics.metal_to_artery = metal / wall;
  double widest = 0;
  for (const MeshCell& cell : metrics.cells) widest = std::max(widest, cell.circle);
  const StrokeFinder finder(raster.strokes(), radius, pattern.length,
                            std::max(widest, 4 * pixel) / 2);
  for (MeshCell& cell : metrics.cells)
    refine_circle(finder, radius, raster.half_width(), metrics.pixel, cell);
  std::sort(metrics.cells.begin(), metrics.cells.end(), [](const MeshCell& a, const MeshCell& b) {
    return std::tie(a.area, a.z, a.angle) < std::tie(b.area, b.z, b.angle);
  });
  count_parts(pattern, metrics);
  if (metrics.cells.empty()) return metrics;
  const std::size_t n = metrics.cells.size();
  metrics.smallest_cell = metrics.cells.front().area;
  metrics.largest_cell = metrics.cells.back().area;
  metrics.median_cell = 0.5 * (metrics.cells[(n - 1) / 2].area + metrics.cells[n / 2].area);
  for (const MeshCell& cell : metrics.cells) {
    metrics.mean_cell += cell.area / static_cast<double>(n);
    metrics.largest_circle = std::max(metrics.largest_circle, cell.circle);
  }
  metrics.pores_per_mm2 = (wall - metal) / metrics.mean_cell / wall;
  return metrics;
}

}  // namespace vstent::stents

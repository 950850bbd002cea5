#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkPointData.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <numeric>
#include <tuple>

#include "sdf/box_tree.hpp"
#include "sdf/polyline.hpp"
#include "vessels/centerline.hpp"
#include "vessels/centerline_tree.hpp"
#include "vessels/error.hpp"
#include "vessels/polydata.hpp"
#include "vessels/text.hpp"

namespace vstent::vessels {
namespace {

constexpr double kSameLine = 0.15;  // of the local radius: nearer than this, two lines run as one

std::size_t at(int index) { return static_cast<std::size_t>(index); }

[[noreturn]] void fail(const std::string& name, const std::string& what) {
  throw Error(ExitCode::geometry, name + ": no centerline: " + what);
}

/// The file's points with coincident ones made one, and its lines as their ids, immediate
/// repetitions left out.
struct Lines {
  std::string name;
  std::vector<Vec3> points;
  std::vector<double> radii;
  std::vector<std::vector<int>> lines;
  double spacing = 0;  // median length of the segments, mm

  double tolerance(int point) const {
    return radii[at(point)] > 0 ? kSameLine * radii[at(point)] : 0.25 * spacing;
  }
};

vtkDataArray* radius_array(vtkPolyData* data) {
  vtkPointData* arrays = data->GetPointData();
  const auto usable = [&](vtkDataArray* array) {
    return array && array->GetNumberOfComponents() == 1 &&
           array->GetNumberOfTuples() == data->GetNumberOfPoints();
  };
  vtkDataArray* named = arrays->GetArray("MaximumInscribedSphereRadius");
  if (usable(named)) return named;
  for (int i = 0; i < arrays->GetNumberOfArrays(); ++i) {
    vtkDataArray* array = arrays->GetArray(i);
    if (!usable(array) || !array->GetName()) continue;
    std::string lower = array->GetName();
    std::transform(lower.begin(), lower.end(), lower.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (lower.find("radius") != std::string::npos) return array;
  }
  return nullptr;
}

Lines lines_of(vtkPolyData* data, const std::string& name, double scale) {
  Lines result;
  result.name = name;
  vtkDataArray* radii = radius_array(data);
  std::map<std::tuple<double, double, double>, int> ids;
  const auto id_of = [&](vtkIdType point) {
    double x[3];
    data->GetPoint(point, x);
    const auto [entry, is_new] =
        ids.try_emplace({x[0], x[1], x[2]}, static_cast<int>(result.points.size()));
    if (is_new) {
      const double radius = radii ? scale * radii->GetComponent(point, 0) : 0.0;
      if (!std::isfinite(radius) || radius < 0) {
        fail(name, "radius " + number(radius) + " at point " + std::to_string(point));
      }
      result.points.push_back(scale * Vec3(x[0], x[1], x[2]));
      result.radii.push_back(radius);
    }
    return entry->second;
  };
  std::vector<double> lengths;
  vtkCellArray* cells = data->GetLines();
  for (vtkIdType c = 0; c < cells->GetNumberOfCells(); ++c) {
    vtkIdType count = 0;
    const vtkIdType* points = nullptr;
    cells->GetCellAtId(c, count, points);
    std::vector<int> line;
    for (vtkIdType i = 0; i < count; ++i) {
      const int id = id_of(points[i]);
      if (!line.empty() && line.back() == id) continue;
      if (!line.empty()) {
        lengths.push_back((result.points[at(id)] - result.points[at(line.back())]).norm());
      }
      line.push_back(id);
    }
    if (line.size() > 1) result.lines.push_back(std::move(line));
  }
  if (lengths.empty()) fail(name, "fewer than two different points on its lines");
  const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
  std::nth_element(lengths.begin(), middle, lengths.end());
  result.spacing = *middle;
  return result;
}

/// Points and who touches whom, without direction.
struct Graph {
  std::vector<Vec3> points;
  std::vector<double> radii;
  std::vector<std::vector<int>> neighbours;

  int add(const Vec3& point, double radius) {
    points.push_back(point);
    radii.push_back(radius);
    neighbours.emplace_back();
    return static_cast<int>(points.size()) - 1;
  }
  void join(int a, int b) {
    auto& list = neighbours[at(a)];
    if (a == b || std::find(list.begin(), list.end(), b) != list.end()) return;
    list.push_back(b);
    neighbours[at(b)].push_back(a);
  }
  void part(int a, int b) {
    std::erase(neighbours[at(a)], b);
    std::erase(neighbours[at(b)], a);
  }
  std::size_t edges() const {
    std::size_t ends = 0;
    for (const auto& list : neighbours) ends += list.size();
    return ends / 2;
  }
};

/// Parents before children, from `root`; nodes that are not reached are left out.
AxisTree rooted(const Graph& graph, int root) {
  AxisTree tree;
  std::vector<std::pair<int, int>> queue{{root, -1}};  // node, its parent's place in the queue
  for (std::size_t q = 0; q < queue.size(); ++q) {
    const auto [node, parent_place] = queue[q];
    tree.add(graph.points[at(node)], graph.radii[at(node)], parent_place);
    const int from = parent_place < 0 ? -1 : queue[at(parent_place)].first;
    for (const int next : graph.neighbours[at(node)]) {
      if (next != from) queue.emplace_back(next, static_cast<int>(q));
    }
  }
  return tree;
}

std::vector<char> reached_from(const Graph& graph, int start) {
  std::vector<char> reached(graph.points.size(), 0);
  std::vector<int> stack{start};
  reached[at(start)] = 1;
  while (!stack.empty()) {
    const int node = stack.back();
    stack.pop_back();
    for (const int next : graph.neighbours[at(node)]) {
      if (!reached[at(next)]) {
        reached[at(next)] = 1;
        stack.push_back(next);
      }
    }
  }
  return reached;
}

Graph graph_of(const Lines& lines) {
  Graph graph;
  for (std::size_t i = 0; i < lines.points.size(); ++i) graph.add(lines.points[i], lines.radii[i]);
  for (const auto& line : lines.lines) {
    for (std::size_t i = 1; i < line.size(); ++i) graph.join(line[i - 1], line[i]);
  }
  return graph;
}

/// Two-point lines strung together between their ends and forks.
std::vector<std::vector<int>> strung(const Graph& graph) {
  std::vector<std::vector<int>> lines;
  std::map<std::pair<int, int>, bool> used;
  const auto walk = [&](int start, int next) {
    std::vector<int> line{start};
    int from = start;
    while (!used[{std::min(from, next), std::max(from, next)}]) {
      used[{std::min(from, next), std::max(from, next)}] = true;
      line.push_back(next);
      const auto& list = graph.neighbours[at(next)];
      if (list.size() != 2) break;
      const int onward = list[0] == from ? list[1] : list[0];
      from = next;
      next = onward;
    }
    if (line.size() > 1) lines.push_back(std::move(line));
  };
  for (const bool forks_and_ends : {true, false}) {  // then what is left: closed loops
    for (std::size_t n = 0; n < graph.points.size(); ++n) {
      if ((graph.neighbours[n].size() != 2) != forks_and_ends) continue;
      for (const int next : graph.neighbours[n]) walk(static_cast<int>(n), next);
    }
  }
  return lines;
}

/// The way from `node` through `next`, up to `reach` (mm), the next fork or the end.
Polyline walk(const Graph& graph, int node, int next, double reach) {
  Polyline way{graph.points[at(node)]};
  for (double walked = 0; walked < reach;) {
    walked += (graph.points[at(next)] - way.back()).norm();
    way.push_back(graph.points[at(next)]);
    const auto& list = graph.neighbours[at(next)];
    if (list.size() != 2) break;
    const int onward = list[0] == node ? list[1] : list[0];
    node = next;
    next = onward;
  }
  return way;
}

/// Do two lines that meet in a point run on side by side, as VMTK's do from the inlet?
bool has_overlaps(const Graph& graph, const Lines& lines) {
  for (std::size_t n = 0; n < graph.points.size(); ++n) {
    const auto& list = graph.neighbours[n];
    for (std::size_t i = 0; i < list.size(); ++i) {
      for (std::size_t j = i + 1; j < list.size(); ++j) {
        const Vec3 a = graph.points[at(list[i])] - graph.points[n];
        const Vec3 b = graph.points[at(list[j])] - graph.points[n];
        if (a.dot(b) < 0.5 * a.norm() * b.norm()) continue;
        const int node = static_cast<int>(n);
        const double reach = std::max(2.0 * graph.radii[n], 5.0 * lines.spacing);
        const Polyline one = walk(graph, node, list[i], reach);
        const Polyline other = walk(graph, node, list[j], 2.0 * reach);
        const double apart = std::sqrt(
            vstent::nearest_place(other, arc_lengths(other), one.back()).squared_distance);
        if (apart < lines.tolerance(node)) return true;
      }
    }
  }
  return false;
}

/// A tree grown line by line: where a line runs along what is there already it adds nothing.
class Merger {
 public:
  explicit Merger(const Lines& lines) : lines_(lines) {}

  /// False when the line touches the tree nowhere.
  bool add(const std::vector<int>& line) {
    refuse_loop(line);
    if (graph_.points.empty()) {
      append(line, 0, line.size(), -1);
      return true;
    }
    index_segments();
    std::vector<Place> places;
    places.reserve(line.size());
    for (const int point : line) places.push_back(nearest(lines_.points[at(point)]));
    const auto mapped = [&](std::size_t i) {
      return places[i].distance < lines_.tolerance(line[i]);
    };
    std::size_t first = 0;
    while (first < line.size() && !mapped(first)) ++first;
    if (first == line.size()) return false;
    std::size_t last = line.size() - 1;
    while (!mapped(last)) --last;
    for (std::size_t i = first; i < last; ++i) {
      const double apart = places[i].distance;
      const double radius = lines_.radii[at(line[i])];
      if (apart > (radius > 0 ? radius : 4.0 * lines_.spacing)) {
        fail(lines_.name, "a line leaves the others and comes back, " + number(apart) +
                              " mm apart at " + place(lines_.points[at(line[i])]) + " mm (a loop)");
      }
    }
    attach_ends(line, places, first, last);
    return true;
  }

  /// The distance (mm) and end of `line` nearest to the tree.
  std::pair<double, bool> gap(const std::vector<int>& line) {
    index_segments();
    const double front = nearest(lines_.points[at(line.front())]).distance;
    const double back = nearest(lines_.points[at(line.back())]).distance;
    return {std::min(front, back), back < front};
  }

  void bridge(const std::vector<int>& line, bool from_back) {
    index_segments();
    std::vector<Place> places(line.size());
    const std::size_t end = from_back ? line.size() - 1 : 0;
    places[end] = nearest(lines_.points[at(line[end])]);
    const int node = node_at(places[end]);
    std::vector<int> order = line;
    if (from_back) std::reverse(order.begin(), order.end());
    append(order, 0, order.size(), node);
  }

  Graph take() { return std::move(graph_); }

 private:
  struct Place {
    int a = -1, b = -1;
    double fraction = 0;
    double distance = std::numeric_limits<double>::infinity();
  };

  void refuse_loop(const std::vector<int>& line) const {
    std::vector<int> sorted = line;
    std::sort(sorted.begin(), sorted.end());
    const auto twice = std::adjacent_find(sorted.begin(), sorted.end());
    if (twice != sorted.end()) {
      fail(lines_.name, "a line passes " + place(lines_.points[at(*twice)]) + " mm twice (a loop)");
    }
  }

  void index_segments() {
    segments_.clear();
    std::vector<Box> boxes;
    for (std::size_t a = 0; a < graph_.points.size(); ++a) {
      for (const int b : graph_.neighbours[a]) {
        if (static_cast<int>(a) > b) continue;
        segments_.push_back({static_cast<int>(a), b});
        Box box;
        box.include(graph_.points[a]);
        box.include(graph_.points[at(b)]);
        boxes.push_back(box);
      }
    }
    tree_ = sdf::BoxTree(boxes);
  }

  double fraction_on(int segment, const Vec3& x) const {
    const Vec3& a = graph_.points[at(segments_[at(segment)][0])];
    const Vec3 edge = graph_.points[at(segments_[at(segment)][1])] - a;
    return std::clamp((x - a).dot(edge) / edge.squaredNorm(), 0.0, 1.0);
  }

  Place nearest(const Vec3& x) const {
    const auto point_on = [&](int segment) {
      const Vec3& a = graph_.points[at(segments_[at(segment)][0])];
      const Vec3& b = graph_.points[at(segments_[at(segment)][1])];
      return Vec3(a + fraction_on(segment, x) * (b - a));
    };
    const auto hit =
        tree_.nearest(x, [&](int segment) { return (x - point_on(segment)).squaredNorm(); });
    return {segments_[at(hit.item)][0], segments_[at(hit.item)][1], fraction_on(hit.item, x),
            std::sqrt(hit.squared_distance)};
  }

  /// The node at a place: an end of its segment when that is near, or a new one that splits it.
  int node_at(const Place& place) {
    constexpr double kNear = 0.3;
    if (place.fraction <= kNear) return place.a;
    if (place.fraction >= 1.0 - kNear) return place.b;
    const double t = place.fraction;
    const int node =
        graph_.add((1.0 - t) * graph_.points[at(place.a)] + t * graph_.points[at(place.b)],
                   (1.0 - t) * graph_.radii[at(place.a)] + t * graph_.radii[at(place.b)]);
    graph_.part(place.a, place.b);
    graph_.join(place.a, node);
    graph_.join(node, place.b);
    return node;
  }

  void append(const std::vector<int>& line, std::size_t from, std::size_t to, int node) {
    for (std::size_t i = from; i < to; ++i) {
      const Vec3& x = lines_.points[at(line[i])];
      if (node >= 0 && i == from && (graph_.points[at(node)] - x).norm() == 0) continue;
      const int next = graph_.add(x, lines_.radii[at(line[i])]);
      if (node >= 0) graph_.join(node, next);
      node = next;
    }
  }

  void attach_ends(const std::vector<int>& line, const std::vector<Place>& places,
                   std::size_t first, std::size_t last) {
    if (last + 1 < line.size()) append(line, last + 1, line.size(), node_at(places[last]));
    if (first == 0) return;
    std::vector<int> reversed(line.rend() - static_cast<std::ptrdiff_t>(first), line.rend());
    if (last + 1 < line.size()) {  // the first attachment may have split this place's segment
      index_segments();
      append(reversed, 0, reversed.size(), node_at(nearest(lines_.points[at(line[first])])));
    } else {
      append(reversed, 0, reversed.size(), node_at(places[first]));
    }
  }

  const Lines& lines_;
  Graph graph_;
  std::vector<std::array<int, 2>> segments_;
  sdf::BoxTree tree_;
};

Graph merged(const Lines& lines) {
  std::vector<std::vector<int>> waiting = lines.lines;
  if (std::all_of(waiting.begin(), waiting.end(), [](const auto& l) { return l.size() == 2; })) {
    waiting = strung(graph_of(lines));
  }
  std::stable_sort(waiting.begin(), waiting.end(), [&](const auto& a, const auto& b) {
    const auto length_of = [&](const std::vector<int>& line) {
      double sum = 0;
      for (std::size_t i = 1; i < line.size(); ++i) {
        sum += (lines.points[at(line[i])] - lines.points[at(line[i - 1])]).norm();
      }
      return sum;
    };
    return length_of(a) > length_of(b);
  });
  Merger merger(lines);
  while (!waiting.empty()) {
    std::vector<std::vector<int>> later;
    for (const auto& line : waiting) {
      if (!merger.add(line)) later.push_back(line);
    }
    if (later.size() == waiting.size()) {  // pieces that end near the tree without touching it
      std::size_t best = 0;
      double smallest = std::numeric_limits<double>::infinity();
      bool from_back = false;
      for (std::size_t i = 0; i < later.size(); ++i) {
        const auto [gap, back] = merger.gap(later[i]);
        if (gap >= smallest) continue;
        smallest = gap;
        best = i;
        from_back = back;
      }
      const int end = from_back ? later[best].back() : later[best].front();
      const double allowed = std::max(lines.radii[at(end)], 2.0 * lines.spacing);
      if (smallest > allowed) {
        fail(lines.name, counted(later.size(), "piece") +
                             " not connected to the rest; the nearest begins " + number(smallest) +
                             " mm away at " + place(lines.points[at(end)]) + " mm");
      }
      merger.bridge(later[best], from_back);
      later.erase(later.begin() + static_cast<std::ptrdiff_t>(best));
    }
    waiting = std::move(later);
  }
  return merger.take();
}

int root_of(const Graph& graph, const Lines& lines) {
  int root = -1;
  const bool has_radii =
      std::any_of(graph.radii.begin(), graph.radii.end(), [](double r) { return r > 0; });
  const Vec3 first = lines.points[at(lines.lines.front().front())];
  for (std::size_t n = 0; n < graph.points.size(); ++n) {
    if (graph.neighbours[n].size() != 1) continue;
    if (root < 0) {
      root = static_cast<int>(n);
    } else if (has_radii
                   ? graph.radii[n] > graph.radii[at(root)]
                   : (graph.points[n] - first).norm() < (graph.points[at(root)] - first).norm()) {
      root = static_cast<int>(n);
    }
  }
  return root;
}

/// Branches as write_centerline wrote them, when BranchId and ParentId say so without
/// contradiction.
bool branches_as_written(vtkPolyData* data, const std::string& name, double scale,
                         Centerline& result) {
  vtkDataArray* ids = data->GetCellData()->GetArray("BranchId");
  vtkDataArray* parents = data->GetCellData()->GetArray("ParentId");
  const vtkIdType count = data->GetNumberOfLines();
  if (!ids || !parents || data->GetNumberOfCells() != count || ids->GetNumberOfTuples() != count ||
      parents->GetNumberOfTuples() != count) {
    return false;
  }
  vtkDataArray* radii = radius_array(data);
  for (vtkIdType c = 0; c < count; ++c) {
    CenterlineBranch branch;
    branch.id = static_cast<int>(c);
    if (ids->GetComponent(c, 0) != static_cast<double>(c)) return false;
    const double parent = parents->GetComponent(c, 0);
    if (!(parent >= -1 && parent < static_cast<double>(c)) || parent != std::floor(parent))
      return false;
    branch.parent = static_cast<int>(parent);
    if ((c == 0) != (branch.parent < 0)) return false;
    vtkIdType points = 0;
    const vtkIdType* point_ids = nullptr;
    data->GetLines()->GetCellAtId(c, points, point_ids);
    for (vtkIdType i = 0; i < points; ++i) {
      double x[3];
      data->GetPoint(point_ids[i], x);
      const double radius = radii ? scale * radii->GetComponent(point_ids[i], 0) : 0.0;
      if (!std::isfinite(radius) || radius < 0) {
        fail(name, "radius " + number(radius) + " at point " + std::to_string(point_ids[i]));
      }
      branch.points.push_back(scale * Vec3(x[0], x[1], x[2]));
      branch.radii.push_back(radius);
      if (i > 0 &&
          branch.points[at(static_cast<int>(i))] == branch.points[at(static_cast<int>(i)) - 1])
        return false;
    }
    if (branch.points.size() < 2) return false;
    if (branch.parent >= 0 &&
        result.branches[at(branch.parent)].points.back() != branch.points.front()) {
      return false;
    }
    result.branches.push_back(std::move(branch));
  }
  return count > 0;
}

}  // namespace

Centerline read_centerline(const std::filesystem::path& path, LengthUnit unit) {
  const auto data = read_polydata(path);
  const std::string name = path.string();
  if (data->GetNumberOfLines() == 0) {
    throw Error(ExitCode::input_file,
                name + ": no lines, so no centerline (" +
                    counted(at(static_cast<int>(data->GetNumberOfPolys())), "polygon") + ")");
  }
  const double scale = millimetres_per(unit);
  Centerline as_written;
  if (branches_as_written(data, name, scale, as_written)) return as_written;

  const Lines lines = lines_of(data, name, scale);
  Graph graph = graph_of(lines);
  const std::vector<char> reached = reached_from(graph, lines.lines.front().front());
  const bool is_tree = graph.edges() + 1 == graph.points.size() &&
                       std::find(reached.begin(), reached.end(), 0) == reached.end();
  if (!is_tree || has_overlaps(graph, lines)) graph = merged(lines);
  return branches_of(rooted(graph, root_of(graph, lines)));
}

}  // namespace vstent::vessels

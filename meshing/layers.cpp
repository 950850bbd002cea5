#include "meshing/layers.hpp"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "meshing/cap.hpp"
#include "meshing/wall.hpp"
#include "sdf/box_tree.hpp"
#include "vessels/check.hpp"
#include "vessels/error.hpp"
#include "vessels/predicates.hpp"
#include "vessels/text.hpp"

namespace vstent::meshing {
namespace {

constexpr double kShareOfLumen = 0.25;  // of the way to the opposite wall
constexpr double kSlope = 0.3;          // largest change of thickness per length along the wall
constexpr double kShrink = 0.7;         // of the thickness where an element fails
constexpr double kLeastVolume = 0.2;    // of that in a straight prism
constexpr int kAttempts = 40;
constexpr double kSteep = 0.5;  // least cosine between a rim's direction and its normal

std::size_t index(int i) { return static_cast<std::size_t>(i); }

/// How far along `ray` (to its full length 1) the triangle is hit from `origin`; above 1: not.
double hit(const Vec3& origin, const Vec3& ray, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 u = b - a, v = c - a, p = ray.cross(v);
  const double determinant = u.dot(p);
  if (determinant == 0) return 2;
  const Vec3 s = origin - a;
  const double x = s.dot(p) / determinant;
  const Vec3 q = s.cross(u);
  const double y = ray.dot(q) / determinant, t = v.dot(q) / determinant;
  return x >= 0 && y >= 0 && x + y <= 1 && t > 0 ? t : 2;
}

/// The layers in the making: one thickness per wall point, shrunk until everything fits.
class Growing {
 public:
  Growing(const Model& model, const LayerOptions& options, vessels::LengthUnit unit)
      : model_(model),
        options_(options),
        unit_(unit),
        wall_(wall_of(model, unit)),
        direction_(inward_directions(wall_, unit)) {
    measure_slant();
    double total = 0, step = 1;
    depth_.push_back(0);
    for (int l = 0; l < options.count; ++l, step *= options.growth) depth_.push_back(total += step);
    for (double& d : depth_) d /= total;
    wanted_.assign(wall_.mesh.points.size(), options.thickness);
    if (options.thickness == 0) {
      // The innermost layer is half an edge thick, as SimVascular's layers are by default.
      const double innermost = 1 - depth_[depth_.size() - 2];
      wanted_ = local_edges();
      for (double& thickness : wanted_) thickness *= 0.5 / innermost;
    }
  }

  Layers run() {
    thickness_ = wanted_;
    limit_by_lumen();
    settle();
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
      std::vector<char> failing = bad_prisms();
      if (std::find(failing.begin(), failing.end(), 1) == failing.end()) {
        close_core();
        failing = crossings();
        if (std::find(failing.begin(), failing.end(), 1) == failing.end()) return finished();
      }
      for (std::size_t v = 0; v < failing.size(); ++v) {
        if (failing[v] == 0) continue;
        thickness_[v] *= kShrink;
        place_ = v;
      }
      settle();
    }
    throw Error(ExitCode::geometry, "boundary layers do not fit at " +
                                        vessels::place(wall_.mesh.points[place_], unit_) +
                                        "; ask for fewer or thinner ones, or smooth the wall");
  }

 private:
  std::vector<double> local_edges() const {
    std::vector<double> edge(wall_.mesh.points.size(), 0);
    for (std::size_t v = 0; v < edge.size(); ++v) {
      for (const int n : wall_.neighbours[v])
        edge[v] += (wall_.mesh.points[index(n)] - wall_.mesh.points[v]).norm();
      edge[v] /= static_cast<double>(wall_.neighbours[v].size());
    }
    for (int sweep = 0; sweep < 10; ++sweep) {
      std::vector<double> smooth = edge;
      for (std::size_t v = 0; v < edge.size(); ++v) {
        for (const int n : wall_.neighbours[v]) smooth[v] += edge[index(n)];
        smooth[v] /= static_cast<double>(wall_.neighbours[v].size() + 1);
      }
      edge = std::move(smooth);
    }
    return edge;
  }

  /// Caps are no obstacle: rims grow along them.
  void limit_by_lumen() {
    const TriangleMesh& mesh = wall_.mesh;
    std::vector<Box> boxes(mesh.triangles.size());
    for (std::size_t t = 0; t < boxes.size(); ++t) {
      for (const int v : mesh.triangles[t]) boxes[t].include(mesh.points[index(v)]);
    }
    const sdf::BoxTree tree(boxes);
    oneapi::tbb::parallel_for(std::size_t{0}, thickness_.size(), [&](std::size_t v) {
      const Vec3& origin = wall_.mesh.points[v];
      const Vec3 ray = direction_[v] * (thickness_[v] / kShareOfLumen);
      Box box;
      box.include(origin);
      box.include(origin + ray);
      double nearest = 1;
      tree.overlapping(box, [&](int t) {
        const Triangle& corners = mesh.triangles[index(t)];
        const auto at = [&](std::size_t k) -> const Vec3& {
          return mesh.points[index(corners[k])];
        };
        if (at(0) == origin || at(1) == origin || at(2) == origin) return;
        nearest = std::min(nearest, hit(origin, ray, at(0), at(1), at(2)));
      });
      thickness_[v] *= nearest;
    });
  }

  /// Thickness changes gently along the wall.
  void settle() {
    bool changed = true;
    while (changed) {
      changed = false;
      for (std::size_t v = 0; v < thickness_.size(); ++v) {
        for (const int n : wall_.neighbours[v]) {
          const double most = thickness_[index(n)] +
                              kSlope * (wall_.mesh.points[index(n)] - wall_.mesh.points[v]).norm();
          if (thickness_[v] > most * (1 + 1e-9)) {
            thickness_[v] = most;
            changed = true;
          }
        }
      }
    }
  }

  Vec3 at(int v, std::size_t level) const {
    return level == 0 ? wall_.mesh.points[index(v)]
                      : Vec3(wall_.mesh.points[index(v)] +
                             depth_[level] * reach(index(v)) * direction_[index(v)]);
  }
  /// Where directions slant, as they do along oblique caps, it is farther to the same distance from
  /// the wall.
  double reach(std::size_t v) const { return thickness_[v] / slant_[v]; }

  void measure_slant() {
    for (std::size_t v = 0; v < direction_.size(); ++v) {
      Vec3 normal = Vec3::Zero();
      for (const int t : wall_.triangles[v]) {
        const Triangle& c = wall_.mesh.triangles[index(t)];
        const Vec3& a = wall_.mesh.points[index(c[0])];
        normal += (wall_.mesh.points[index(c[2])] - a).cross(wall_.mesh.points[index(c[1])] - a);
      }
      slant_.push_back(std::max(kSteep, direction_[v].dot(normal.normalized())));
    }
  }

  /// The three tetrahedra of one layer over a wall triangle, by number of point and level. The
  /// diagonal of a side runs from its lower point outside to its higher point inside, so that
  /// neighbours agree.
  template <class Visit>
  static void split(const Triangle& t, std::size_t level, Visit&& visit) {
    Triangle s = t;
    std::rotate(s.begin(), std::min_element(s.begin(), s.end()), s.end());
    const bool even = s[1] < s[2];
    const int low = s[0], middle = std::min(s[1], s[2]), high = std::max(s[1], s[2]);
    using Corner = std::pair<int, std::size_t>;
    const Corner a{low, level}, b{middle, level}, c{high, level};
    const Corner d{low, level + 1}, e{middle, level + 1}, f{high, level + 1};
    const auto turned = [&](Corner p, Corner q, Corner r, Corner u) {
      even ? visit(p, r, q, u) : visit(p, q, r, u);
    };
    // Outward triangles are clockwise seen from the layer inside.
    turned(a, b, c, f);
    turned(a, b, f, e);
    turned(a, e, f, d);
  }

  std::vector<char> bad_prisms() const {
    std::vector<char> failing(wall_.mesh.points.size(), 0);
    for (const Triangle& t : wall_.mesh.triangles) {
      const Vec3 a = at(t[0], 0);
      const double area = (at(t[1], 0) - a).cross(at(t[2], 0) - a).norm() / 2;
      const double thickness =
          std::min({thickness_[index(t[0])], thickness_[index(t[1])], thickness_[index(t[2])]});
      bool bad = false;
      for (std::size_t level = 0; level + 1 < depth_.size(); ++level) {
        const double least =
            kLeastVolume * area * thickness * (depth_[level + 1] - depth_[level]) / 3;
        split(t, level, [&](auto p, auto q, auto r, auto u) {
          const Vec3 x = at(p.first, p.second);
          const double volume = (at(q.first, q.second) - x)
                                    .cross(at(r.first, r.second) - x)
                                    .dot(at(u.first, u.second) - x) /
                                6;
          bad = bad || !(volume > least);
        });
      }
      if (!bad) continue;
      for (const int v : t) failing[index(v)] = 1;
    }
    return failing;
  }

  /// The innermost surface, its openings closed by caps.
  void close_core() {
    core_ = wall_.mesh;
    for (std::size_t v = 0; v < core_.points.size(); ++v)
      core_.points[v] = at(static_cast<int>(v), depth_.size() - 1);
    core_cap_.assign(core_.triangles.size(), -1);
    for (const Opening& opening : find_openings(core_)) {
      const int cap = wall_.cap[index(opening.rim.front())];
      close(core_, opening, unit_);
      core_cap_.resize(core_.triangles.size(), cap);
    }
  }

  /// Wall points whose innermost triangles cross others.
  std::vector<char> crossings() const {
    std::vector<char> failing(wall_.mesh.points.size(), 0);
    for (const auto& [s, t] : vessels::self_intersections(core_)) {
      for (const int triangle : {s, t}) {
        for (const int v : core_.triangles[index(triangle)]) {
          if (index(v) < failing.size()) failing[index(v)] = 1;
        }
      }
    }
    return failing;
  }

  Layers finished() {
    Layers layers;
    number_points(layers);
    Model& model = layers.model;
    model.faces = model_.faces;
    model.mesh.triangles = wall_.mesh.triangles;
    model.face_of_triangle = wall_.face;
    const std::size_t levels = depth_.size();
    for (std::size_t t = 0; t < wall_.mesh.triangles.size(); ++t) {
      const Triangle& corners = wall_.mesh.triangles[t];
      for (std::size_t level = 0; level + 1 < levels; ++level) {
        split(corners, level, [&](auto p, auto q, auto r, auto u) {
          layers.mesh.tetrahedra.push_back({number(p), number(q), number(r), number(u)});
        });
      }
      for (std::size_t k = 0; k < 3; ++k) {
        const int a = corners[k], b = corners[(k + 1) % 3];
        if (is_rim(a, b)) add_strip(layers, a, b);
      }
    }
    for (std::size_t t = 0; t < core_.triangles.size(); ++t) {
      if (core_cap_[t] < 0) continue;
      Triangle corners = core_.triangles[t];
      for (int& v : corners) v = layers.core_point[index(v)];
      model.mesh.triangles.push_back(corners);
      model.face_of_triangle.push_back(core_cap_[t]);
    }
    layers.core = core_;
    summarise(layers);
    return layers;
  }

  /// Wall points, rings and the inside of caps come first: they are the model's.
  void number_points(Layers& layers) {
    const std::size_t points = wall_.mesh.points.size(), levels = depth_.size();
    number_.assign(points * levels, -1);
    std::vector<Vec3>& all = layers.mesh.points;
    const auto give = [&](std::size_t v, std::size_t level) {
      number_[v * levels + level] = static_cast<int>(all.size());
      all.push_back(at(static_cast<int>(v), level));
    };
    for (std::size_t v = 0; v < points; ++v) give(v, 0);
    for (std::size_t v = 0; v < points; ++v) {
      for (std::size_t level = 1; level < levels && wall_.cap[v] >= 0; ++level) give(v, level);
    }
    layers.core_point.assign(core_.points.size(), -1);
    for (std::size_t v = points; v < core_.points.size(); ++v) {
      layers.core_point[v] = static_cast<int>(all.size());
      all.push_back(core_.points[v]);
    }
    layers.model.mesh.points = all;
    for (std::size_t v = 0; v < points; ++v) {
      for (std::size_t level = 1; level < levels && wall_.cap[v] < 0; ++level) give(v, level);
      layers.core_point[v] = number_[v * levels + levels - 1];
    }
  }
  int number(const std::pair<int, std::size_t>& corner) const {
    return number_[index(corner.first) * depth_.size() + corner.second];
  }

  bool is_rim(int a, int b) const {
    if (wall_.cap[index(a)] < 0 || wall_.cap[index(b)] < 0) return false;
    std::vector<int> shared;
    std::set_intersection(wall_.triangles[index(a)].begin(), wall_.triangles[index(a)].end(),
                          wall_.triangles[index(b)].begin(), wall_.triangles[index(b)].end(),
                          std::back_inserter(shared));
    return shared.size() == 1;
  }

  /// The cap's triangles between the rim edge from a to b and the layers' rings.
  void add_strip(Layers& layers, int a, int b) {
    const auto add = [&](std::pair<int, std::size_t> p, std::pair<int, std::size_t> q,
                         std::pair<int, std::size_t> r) {
      layers.model.mesh.triangles.push_back({number(p), number(q), number(r)});
      layers.model.face_of_triangle.push_back(wall_.cap[index(a)]);
    };
    for (std::size_t l = 0; l + 1 < depth_.size(); ++l) {
      if (a < b) {
        add({a, l}, {a, l + 1}, {b, l + 1});
        add({a, l}, {b, l + 1}, {b, l});
      } else {
        add({a, l}, {a, l + 1}, {b, l});
        add({a, l + 1}, {b, l + 1}, {b, l});
      }
    }
  }

  void summarise(Layers& layers) const {
    std::size_t thinnest = 0;
    for (std::size_t v = 0; v < thickness_.size(); ++v) {
      layers.thinned += thickness_[v] < 0.9 * wanted_[v];
      if (thickness_[v] < thickness_[thinnest]) thinnest = v;
    }
    std::vector<double> sorted = thickness_;
    std::sort(sorted.begin(), sorted.end());
    layers.smallest = sorted.front();
    layers.median = sorted[sorted.size() / 2];
    layers.largest = sorted.back();
    if (layers.thinned > 0)
      layers.warnings.push_back("boundary layers are thinner than asked for at " +
                                std::to_string(layers.thinned) + " of " +
                                std::to_string(thickness_.size()) + " wall points, down to " +
                                vessels::number(layers.smallest) + " mm at " +
                                vessels::place(wall_.mesh.points[thinnest], unit_) + ", where " +
                                vessels::number(wanted_[thinnest]) + " mm were asked for");
  }

  const Model& model_;
  LayerOptions options_;
  vessels::LengthUnit unit_;
  Wall wall_;
  std::vector<Vec3> direction_;
  std::vector<double> slant_;  // cosine between direction and normal
  std::vector<double> depth_;  // of each level, as a share of the whole
  std::vector<double> wanted_, thickness_;
  TriangleMesh core_;
  std::vector<int> core_cap_;  // per triangle of the core: its cap, or -1
  std::vector<int> number_;    // per wall point and level
  std::size_t place_ = 0;      // of the last failure
};

}  // namespace

Layers grow_layers(const Model& model, const LayerOptions& options, vessels::LengthUnit unit) {
  if (options.count < 1 || options.count > 30)
    throw Error(ExitCode::usage,
                "boundary layers: " + std::to_string(options.count) + " of them; ask for 1 to 30");
  if (!(options.thickness >= 0) || !(options.growth >= 0.5 && options.growth <= 3))
    throw Error(ExitCode::usage,
                "boundary layers: the thickness must be positive, the growth 0.5 to 3");
  return Growing(model, options, unit).run();
}

TetMesh joined(const Layers& layers, const TetMesh& filling) {
  TetMesh result = layers.mesh;
  const std::size_t core_points = layers.core.points.size();
  const auto first = static_cast<int>(result.points.size());
  result.points.insert(result.points.end(),
                       filling.points.begin() + static_cast<std::ptrdiff_t>(core_points),
                       filling.points.end());
  for (Tetrahedron t : filling.tetrahedra) {
    for (int& v : t)
      v = index(v) < core_points ? layers.core_point[index(v)]
                                 : first + v - static_cast<int>(core_points);
    result.tetrahedra.push_back(t);
  }
  return result;
}

}  // namespace vstent::meshing

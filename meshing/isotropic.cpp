#include "meshing/isotropic.hpp"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <queue>

namespace vstent::meshing {
namespace {

constexpr double kTooLong = 4.0 / 3.0, kTooShort = 4.0 / 5.0;  // of the length wanted
constexpr double kTurn = 0.5;       // cosine: triangles turn by no more in one operation
constexpr double kSliver = 1e-3;    // height over longest side: its normal means nothing
constexpr double kPoorShape = 0.3;  // operations make no triangle worse than this, or than it was
constexpr double kWorse = 0.5;      // of that: what a collapse may leave, as it removes two slivers
constexpr double kCrease = 0.866;   // cosine: no flip makes a sharper edge than this or the old one
constexpr double kAtRest = 0.02;    // of the length wanted: a smaller move is none
constexpr double kWideEnough = 1.2;  // cotangent of 40 degrees: such angles are left alone
constexpr double kGain = 1e-6;       // of a cotangent; less is rounding

constexpr double kUneven = 0.9;  // a curve is not cut into a part longer than this

enum class Kind : char { free, curve, fixed };

/// 1 for an equilateral triangle, 0 for none: 4 sqrt(3) area / sum of squared sides.
double shape(const Vec3& a, const Vec3& b, const Vec3& c) {
  const double squares = (b - a).squaredNorm() + (c - b).squaredNorm() + (a - c).squaredNorm();
  return squares > 0 ? 2 * std::numbers::sqrt3 * (b - a).cross(c - a).norm() / squares : 0;
}

/// Cotangent of the smallest angle: 0.577 for an equilateral triangle, more for all others.
double sharpest(const Vec3& a, const Vec3& b, const Vec3& c) {
  const double area = (b - a).cross(c - a).norm();
  return std::max({(b - a).dot(c - a), (a - b).dot(c - b), (a - c).dot(b - c)}) / area;
}

double longest_squared(const Vec3& a, const Vec3& b, const Vec3& c) {
  return std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
}

class Isotropic {
 public:
  Isotropic(EditMesh& mesh, const Reference& reference, const IsotropicOptions& options)
      : mesh_(mesh), reference_(reference), options_(options) {
    const std::size_t count = mesh.points.size();
    kind_.assign(count, Kind::free);
    size_.assign(count, 0);
    near_.assign(count, -1);
    valence_.assign(count, 0);
    ideal_.assign(count, 6);
    classify();
    for (std::size_t v = 0; v < count; ++v) locate(static_cast<int>(v));
  }

  void run() {
    for (int i = 0; i < options_.iterations; ++i) {
      split_long();
      collapse_short();
      flip([&](int h) { return evens_valence(h); });
      relax(Goal::even);
    }
    flip([&](int h) { return widens_angles(h); });
    for (int pass = 0; pass < 4; ++pass) {
      relax(Goal::angles);
      flip([&](int h) { return widens_angles(h); });
    }
    relax(Goal::project);
  }

 private:
  enum class Goal { even, angles, project };

  static std::size_t index(int i) { return static_cast<std::size_t>(i); }
  Kind kind(int v) const { return kind_[index(v)]; }
  double size(int v) const { return size_[index(v)]; }
  int face_of(int h) const { return mesh_.face[index(h / 3)]; }

  bool is_curve(int h) const {
    const int g = mesh_.twin(h);
    return g < 0 || face_of(g) != face_of(h);
  }
  bool may_change(int h) const {  // split or collapsed, as far as the edge itself is concerned
    return !is_curve(h) || (options_.resample_curves && mesh_.twin(h) >= 0);
  }

  void classify() {
    std::vector<int> curves(mesh_.points.size(), 0);
    std::vector<double> angle(mesh_.points.size(), 0);
    for (int h = 0; h < mesh_.half_edges(); ++h) {
      const int v = mesh_.from(h);
      ++valence_[index(v)];
      const Vec3 u = mesh_.edge(h), w = mesh_.at(mesh_.apex(h)) - mesh_.at(v);
      angle[index(v)] += std::atan2(u.cross(w).norm(), u.dot(w));
      if (is_curve(h)) {
        ++curves[index(v)];
        if (mesh_.twin(h) < 0) ++curves[index(mesh_.to(h))];
      }
    }
    for (std::size_t v = 0; v < kind_.size(); ++v) {
      if (curves[v] == 0) continue;
      const bool border = mesh_.on_border(static_cast<int>(v));
      kind_[v] = options_.resample_curves && !border && curves[v] == 2 ? Kind::curve : Kind::fixed;
      if (border)
        ideal_[v] = std::max(1, static_cast<int>(std::lround(angle[v] * 3 / std::numbers::pi)));
    }
  }

  Reference::Place place_of(int v, const Vec3& x, std::vector<int>& ring) const {
    if (kind(v) == Kind::curve) {
      mesh_.leaving(v, ring);
      for (const int h : ring)
        if (is_curve(h)) return reference_.on_curve(face_of(h), face_of(mesh_.twin(h)), x);
    }
    return reference_.on_face(face_of(mesh_.any_leaving(v)), x, near_[index(v)]);
  }

  void locate(int v) {
    const Reference::Place place = place_of(v, mesh_.at(v), ring_a_);
    size_[index(v)] = place.size;
    near_[index(v)] = kind(v) == Kind::free ? place.triangle : -1;
  }

  double wanted(int h) const { return std::min(size(mesh_.from(h)), size(mesh_.to(h))); }

  /// The longest first: else slivers would be cut into more and more of them.
  void split_long() {
    struct Long {
      double excess;
      int h, from, to;
      bool operator<(const Long& other) const {
        return excess != other.excess ? excess < other.excess : h > other.h;
      }
    };
    std::priority_queue<Long> queue;
    const auto enqueue = [&](int h) {
      const double excess = mesh_.edge(h).norm() / wanted(h);
      if (excess > kTooLong && may_change(h)) queue.push({excess, h, mesh_.from(h), mesh_.to(h)});
    };
    for (int h = 0; h < mesh_.half_edges(); ++h)
      if (mesh_.lives(h) && mesh_.twin(h) < h) enqueue(h);
    while (!queue.empty()) {
      const auto [excess, h, from, to] = queue.top();
      queue.pop();
      if (mesh_.from(h) != from || mesh_.to(h) != to || !split(h)) continue;
      mesh_.leaving(static_cast<int>(mesh_.points.size()) - 1, ring_a_);
      for (const int r : ring_a_) {
        enqueue(r);
        enqueue(EditMesh::next(r));  // it may have got another number
      }
    }
  }

  bool split(int h) {
    const int a = mesh_.from(h), b = mesh_.to(h);
    const bool curve = is_curve(h);
    const Vec3 middle = 0.5 * (mesh_.at(a) + mesh_.at(b));
    Reference::Place place =
        curve ? reference_.on_curve(face_of(h), face_of(mesh_.twin(h)), middle)
              : reference_.on_face(face_of(h), middle, near_[index(kind(a) == Kind::free ? a : b)]);
    if (!curve) {
      place.point = middle;
    } else if (std::max((place.point - mesh_.at(a)).norm(), (place.point - mesh_.at(b)).norm()) >
               kUneven * mesh_.edge(h).norm()) {
      return false;
    }
    mesh_.split(h, place.point);
    for (const int g : {h, mesh_.twin(h)}) ++valence_[index(mesh_.apex(g))];
    kind_.push_back(curve ? Kind::curve : Kind::free);
    size_.push_back(place.size);
    near_.push_back(place.triangle);
    valence_.push_back(4);
    ideal_.push_back(6);
    return true;
  }

  // --- collapses -------------------------------------------------------------------------------

  void collapse_short() {
    for (int pass = 0; pass < 4; ++pass) {
      bool any = false;
      for (int h = 0; h < mesh_.half_edges(); ++h) {
        if (!mesh_.lives(h)) continue;
        const int v = mesh_.from(h);
        if (valence_[index(v)] == 3 && kind(v) == Kind::free) {
          any |= join(h, mesh_.at(mesh_.to(h)));  // three triangles become one
        } else if (mesh_.twin(h) > h && may_change(h) &&
                   mesh_.edge(h).norm() < kTooShort * wanted(h)) {
          any |= collapse(h);
        }
      }
      if (!any) break;
    }
  }

  bool collapse(int h) {
    const int g = mesh_.twin(h);
    const Kind a = kind(mesh_.from(h)), b = kind(mesh_.to(h));
    const bool along = is_curve(h);
    if (a != Kind::free && b != Kind::free && !along) return false;
    if (a == b && a != Kind::fixed) {
      Vec3 middle = 0.5 * (mesh_.at(mesh_.from(h)) + mesh_.at(mesh_.to(h)));
      if (along) middle = reference_.on_curve(face_of(h), face_of(g), middle).point;
      return join(h, middle) || join(h, mesh_.at(mesh_.to(h))) || join(g, mesh_.at(mesh_.to(g)));
    }
    const bool first_goes = a == Kind::free || (a == Kind::curve && b == Kind::fixed);
    const int leaving = first_goes ? h : g;
    if (kind(mesh_.from(leaving)) == Kind::fixed) return false;
    return join(leaving, mesh_.at(mesh_.to(leaving)));
  }

  /// Collapses h if that keeps the surface's topology, its curves, and its triangles sound.
  bool join(int h, const Vec3& place) {
    const int g = mesh_.twin(h);
    const int a = mesh_.from(h), b = mesh_.to(h), c = mesh_.apex(h), d = mesh_.apex(g);
    if (c == d) return false;
    for (const int top : {c, d})
      if (valence_[index(top)] <= (mesh_.on_border(top) ? 1 : 3)) return false;
    // No two curves, or a curve and the border, may fall together.
    if (is_curve(EditMesh::next(h)) && is_curve(EditMesh::previous(h))) return false;
    if (is_curve(EditMesh::next(g)) && is_curve(EditMesh::previous(g))) return false;
    mesh_.leaving(a, ring_a_);
    mesh_.leaving(b, ring_b_);
    mark_.resize(mesh_.points.size(), 0);
    ++stamp_;
    for (const int r : ring_b_) {
      mark_[index(mesh_.to(r))] = stamp_;
      mark_[index(mesh_.apex(r))] = stamp_;
    }
    int common = 0;
    const bool b_on_border = mesh_.on_border(b);
    for (const int r : ring_a_) {
      const int x = mesh_.to(r);
      if (x == b) continue;
      const bool known = mark_[index(x)] == stamp_;
      common += known;
      // They may be joined by an edge outside the patch.
      if (!known && b_on_border && mesh_.on_border(x)) return false;
    }
    if (common != 2) return false;
    if (!sound(ring_a_, a, b, place, h, g) ||
        (place != mesh_.at(b) && !sound(ring_b_, b, a, place, h, g)))
      return false;
    const double merged = 0.5 * (size(a) + size(b));
    mesh_.collapse(h);
    if (place != mesh_.at(b)) {
      mesh_.points[index(b)] = place;
      size_[index(b)] = merged;
    }
    valence_[index(b)] += valence_[index(a)] - 4;
    --valence_[index(c)];
    --valence_[index(d)];
    return true;
  }

  /// Whether the triangles around v, other than those of h and g, stay sound with v at `place`.
  bool sound(const std::vector<int>& ring, int v, int other, const Vec3& place, int h,
             int g) const {
    Vec3 around = Vec3::Zero();
    for (const int r : ring) around += mesh_.doubled_area(r / 3);
    const double size_there = std::min(size(v), size(other));
    for (const int r : ring) {
      if (r / 3 == h / 3 || r / 3 == g / 3) continue;
      const int i = mesh_.to(r), j = mesh_.apex(r);
      const Vec3 &x = mesh_.at(i), &y = mesh_.at(j), &old = mesh_.at(v);
      if ((place - x).norm() > kTooLong * std::min(size_there, size(i)) &&
          (place - x).norm() > (old - x).norm())
        return false;
      if ((place - y).norm() > kTooLong * std::min(size_there, size(j)) &&
          (place - y).norm() > (old - y).norm())
        return false;
      if (!keeps(old, place, x, y, around, kWorse)) return false;
    }
    return true;
  }

  /// Whether triangle (v, x, y) may go from v = old to v = place.
  static bool keeps(const Vec3& old, const Vec3& place, const Vec3& x, const Vec3& y,
                    const Vec3& around, double tolerated) {
    const Vec3 before = (x - old).cross(y - old), after = (x - place).cross(y - place);
    const bool sliver = before.norm() < kSliver * longest_squared(old, x, y);
    const Vec3& facing = sliver ? around : before;
    if (!(after.dot(facing) > kTurn * after.norm() * facing.norm())) return false;
    return shape(place, x, y) >= tolerated * std::min(kPoorShape, shape(old, x, y));
  }

  // --- flips -----------------------------------------------------------------------------------

  template <class Better>
  void flip(Better&& better) {
    for (int pass = 0; pass < 4; ++pass) {
      bool any = false;
      for (int h = 0; h < mesh_.half_edges(); ++h) {
        if (!mesh_.lives(h) || mesh_.twin(h) < h || is_curve(h)) continue;
        if (!better(h) || !may_flip(h)) continue;
        --valence_[index(mesh_.from(h))];
        --valence_[index(mesh_.to(h))];
        ++valence_[index(mesh_.apex(h))];
        ++valence_[index(mesh_.apex(mesh_.twin(h)))];
        mesh_.flip(h);
        any = true;
      }
      if (!any) break;
    }
  }

  bool evens_valence(int h) const {
    const auto excess = [&](int v, int change) {
      const int e = valence_[index(v)] + change - ideal_[index(v)];
      return e * e;
    };
    const int a = mesh_.from(h), b = mesh_.to(h), c = mesh_.apex(h), d = mesh_.apex(mesh_.twin(h));
    return excess(a, -1) + excess(b, -1) + excess(c, 1) + excess(d, 1) <
           excess(a, 0) + excess(b, 0) + excess(c, 0) + excess(d, 0);
  }

  bool widens_angles(int h) const {
    const Vec3 &a = mesh_.at(mesh_.from(h)), &b = mesh_.at(mesh_.to(h)),
               &c = mesh_.at(mesh_.apex(h)), &d = mesh_.at(mesh_.apex(mesh_.twin(h)));
    return std::max(sharpest(d, c, a), sharpest(c, d, b)) <
           std::max(sharpest(a, b, c), sharpest(b, a, d)) - kGain;
  }

  bool may_flip(int h) {
    const int g = mesh_.twin(h);
    const int a = mesh_.from(h), b = mesh_.to(h), c = mesh_.apex(h), d = mesh_.apex(g);
    if (c == d || (mesh_.on_border(c) && mesh_.on_border(d))) return false;
    for (const int v : {a, b})
      if (valence_[index(v)] <= (mesh_.on_border(v) ? 1 : 3)) return false;
    const Vec3 first = mesh_.doubled_area(h / 3), second = mesh_.doubled_area(g / 3);
    const Vec3 &A = mesh_.at(a), &B = mesh_.at(b), &C = mesh_.at(c), &D = mesh_.at(d);
    const Vec3 upper = (C - D).cross(A - D), lower = (D - C).cross(B - C);
    const Vec3 around = first + second;
    if (!(upper.dot(around) > kTurn * upper.norm() * around.norm()) ||
        !(lower.dot(around) > kTurn * lower.norm() * around.norm()))
      return false;
    const double before = first.dot(second) / (first.norm() * second.norm());
    const double after = upper.dot(lower) / (upper.norm() * lower.norm());
    if (!(after > kCrease) && !(after >= before)) return false;
    const double worst = std::min(shape(A, B, C), shape(B, A, D));
    if (std::min(shape(D, C, A), shape(C, D, B)) < std::min(kPoorShape, worst)) return false;
    return !mesh_.joined(c, d, ring_a_);
  }

  // --- moves -----------------------------------------------------------------------------------

  /// Where v should go, before it is put on the surface.
  Vec3 wish(int v, Goal goal, std::vector<int>& ring) const {
    const Vec3& x = mesh_.at(v);
    mesh_.leaving(v, ring);
    if (goal == Goal::project) return x;
    if (kind(v) == Kind::curve) {
      Vec3 sum = Vec3::Zero();
      double total = 0;
      for (const int h : ring) {
        if (!is_curve(h)) continue;
        const double weight = 1 / (size(v) + size(mesh_.to(h)));
        sum += weight * mesh_.at(mesh_.to(h));
        total += weight;
      }
      return sum / total;
    }
    Vec3 normal = Vec3::Zero(), sum = Vec3::Zero();
    double total = 0;
    for (const int h : ring) {
      const int i = mesh_.to(h), j = mesh_.apex(h);
      const Vec3 area = (mesh_.at(i) - x).cross(mesh_.at(j) - x);
      const double mean_size = (size(v) + size(i) + size(j)) / 3;
      const double weight = area.norm() / (mean_size * mean_size);
      normal += area;
      sum += weight * (x + mesh_.at(i) + mesh_.at(j)) / 3;
      total += weight;
    }
    if (!(total > 0) || !(normal.norm() > 0)) return x;
    normal.normalize();
    const Vec3 move = sum / total - x;
    return x + move - normal.dot(move) * normal;
  }

  void relax(Goal goal) {
    const std::size_t count = mesh_.points.size();
    std::vector<Reference::Place> places(count);
    std::vector<char> moves(count, 0);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, 256), [&](const auto& range) {
      std::vector<int> ring;
      for (std::size_t i = range.begin(); i < range.end(); ++i) {
        const int v = static_cast<int>(i);
        if (!mesh_.vertex_lives[i] || kind_[i] == Kind::fixed) continue;
        const Vec3 place = wish(v, goal, ring);
        if (goal == Goal::even && (place - mesh_.at(v)).norm() < kAtRest * size(v)) continue;
        if (goal == Goal::angles && sharpest_around(v, ring) < kWideEnough) continue;
        places[i] = place_of(v, place, ring);
        moves[i] = 1;
      }
    });
    for (std::size_t i = 0; i < count; ++i) {
      if (!moves[i]) continue;
      const int v = static_cast<int>(i);
      for (const double step : {1.0, 0.5, 0.25}) {
        const Vec3 target = step == 1 ? places[i].point
                                      : Vec3(mesh_.at(v) + step * (places[i].point - mesh_.at(v)));
        if (kind_[i] == Kind::curve && step != 1) break;
        if (!may_move(v, target, goal)) continue;
        mesh_.points[i] = target;
        size_[i] = places[i].size;
        near_[i] = places[i].triangle;
        break;
      }
    }
  }

  double sharpest_around(int v, const std::vector<int>& ring) const {
    double most = 0;
    for (const int h : ring)
      most = std::max(most, sharpest(mesh_.at(v), mesh_.at(mesh_.to(h)), mesh_.at(mesh_.apex(h))));
    return most;
  }

  bool may_move(int v, const Vec3& target, Goal goal) {
    mesh_.leaving(v, ring_a_);
    Vec3 around = Vec3::Zero();
    for (const int r : ring_a_) around += mesh_.doubled_area(r / 3);
    double before = 0, after = 0;
    for (const int r : ring_a_) {
      const Vec3 &x = mesh_.at(mesh_.to(r)), &y = mesh_.at(mesh_.apex(r));
      if (!keeps(mesh_.at(v), target, x, y, around, 1)) return false;
      if (goal != Goal::angles) continue;
      before = std::max(before, sharpest(mesh_.at(v), x, y));
      after = std::max(after, sharpest(target, x, y));
    }
    return goal != Goal::angles || after < before - kGain;
  }

  EditMesh& mesh_;
  const Reference& reference_;
  const IsotropicOptions& options_;
  std::vector<Kind> kind_;
  std::vector<double> size_;
  std::vector<int> near_;  ///< a triangle of the reference close to a free vertex, on its face
  std::vector<int> valence_, ideal_;  ///< triangles around each vertex
  std::vector<int> ring_a_, ring_b_, mark_;
  int stamp_ = 0;
};

}  // namespace

void make_isotropic(EditMesh& mesh, const Reference& reference, const IsotropicOptions& options) {
  Isotropic(mesh, reference, options).run();
}

}  // namespace vstent::meshing

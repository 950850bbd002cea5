#include "stents/straight_surface.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

namespace vstent::stents {
namespace {

// Two moments this much apart count as equal; the third must lie as far from them as that.
constexpr double kEqualMoments = 0.1;
constexpr double kOtherMoment = 0.2;
// Of the outer radius: metal nearer to the axis leaves no lumen, and an axis that sags by more is
// bent.
constexpr double kLumen = 0.2;
constexpr double kSag = 0.1;

// Cosine between a facet of the outer surface and the way out.
constexpr double kFacesOutward = 0.7;
// Of the outer radius: the height of a slice.
constexpr double kSlice = 0.1;

struct Facet {
  Vec3 a, b, c;
  Vec3 centroid() const { return (a + b + c) / 3; }
  Vec3 area() const { return 0.5 * (b - a).cross(c - a); }
  double size() const { return std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()}); }
  /// The centroids of its pieces of equal area, `parts` along each side.
  template <class Visit>
  void for_each_piece(int parts, Visit&& visit) const {
    const Vec3 u = (b - a) / parts, v = (c - a) / parts;
    for (int i = 0; i < parts; ++i) {
      for (int j = 0; i + j < parts; ++j) {
        visit(a + (i + 1.0 / 3) * u + (j + 1.0 / 3) * v);
        if (i + j + 1 < parts) visit(a + (i + 2.0 / 3) * u + (j + 2.0 / 3) * v);
      }
    }
  }
};

Facet facet(const TriangleMesh& mesh, const Triangle& t) {
  return {mesh.points[static_cast<std::size_t>(t[0])], mesh.points[static_cast<std::size_t>(t[1])],
          mesh.points[static_cast<std::size_t>(t[2])]};
}

[[noreturn]] void refuse(const std::ostringstream& text) {
  throw std::invalid_argument(text.str());
}

Vec3 centroid(const TriangleMesh& mesh) {
  Vec3 sum = Vec3::Zero();
  double area = 0;
  for (const Triangle& t : mesh.triangles) {
    const Facet f = facet(mesh, t);
    const double share = f.area().norm();
    sum += share * f.centroid();
    area += share;
  }
  if (!(area > 0)) throw std::invalid_argument("its surface has no area");
  return sum / area;
}

Vec3 axis_of_symmetry(const TriangleMesh& mesh) {
  const Vec3 centre = centroid(mesh);
  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
  double area = 0;
  for (const Triangle& t : mesh.triangles) {
    const Facet f = facet(mesh, t);
    const Vec3 a = f.a - centre, b = f.b - centre, c = f.c - centre, sum = a + b + c;
    const double share = f.area().norm();
    // The second moment of a triangle about the origin.
    moments += share / 12 *
               (a * a.transpose() + b * b.transpose() + c * c.transpose() + sum * sum.transpose());
    area += share;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(moments / area);
  const Vec3 m = solver.eigenvalues();  // ascending
  const bool lower_pair_is_nearer = m[1] / std::max(m[0], 1e-300) < m[2] / m[1];
  const double pair = lower_pair_is_nearer ? m[1] / m[0] - 1 : m[2] / m[1] - 1;
  const double other = lower_pair_is_nearer ? m[2] / m[1] - 1 : m[1] / m[0] - 1;
  if (!(pair <= kEqualMoments) || !(other >= kOtherMoment)) {
    std::ostringstream text;
    text << "is not tube-like: the second moments of its area about its centre are " << m[0] << ", "
         << m[1] << " and " << m[2] << " mm2, of which a tube has two within "
         << 100 * kEqualMoments << " % of each other and the third at least " << 100 * kOtherMoment
         << " % away; a design file can give its \"axis\"";
    refuse(text);
  }
  return solver.eigenvectors().col(lower_pair_is_nearer ? 2 : 0);
}

/// A line with its frame: `w` along it.
struct Line {
  Vec3 point, u, v, w;
};

Line line_along(const Vec3& point, const Vec3& direction) {
  Line line;
  line.point = point;
  line.w = direction.normalized();
  const Vec3 x = std::abs(line.w.x()) > 0.9 ? Vec3(Vec3::UnitY()) : Vec3(Vec3::UnitX());
  line.u = (x - x.dot(line.w) * line.w).normalized();
  line.v = line.w.cross(line.u);
  return line;
}

/// How the outer surface lies about the line: the least-squares solution of
/// radius = R + (p + q z + s z^2) . e_r over it, as far as the columns go.
Eigen::VectorXd fitted(const TriangleMesh& mesh, const Line& line,
                       const std::vector<int>& columns) {
  const auto n = static_cast<Eigen::Index>(columns.size());
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(n);
  Box bounds;
  for (const Vec3& p : mesh.points) bounds.include(p);
  const double coarsest = (bounds.upper - bounds.lower).norm() / 32;
  for (const Triangle& t : mesh.triangles) {
    const Facet f = facet(mesh, t);
    // A long facet's centroid does not stand for all of it.
    const int parts = std::max(1, static_cast<int>(std::ceil(f.size() / coarsest)));
    f.for_each_piece(parts, [&](const Vec3& centre) {
      const Vec3 from = centre - line.point;
      const double x = from.dot(line.u), y = from.dot(line.v), z = from.dot(line.w);
      const double radius = std::hypot(x, y);
      if (!(radius > 0)) return;
      const double c = x / radius, s = y / radius;
      const double share = f.area().dot(c * line.u + s * line.v);
      if (!(share > kFacesOutward * f.area().norm())) return;
      const std::array<double, 7> all = {1, c, s, z * c, z * s, z * z * c, z * z * s};
      Eigen::VectorXd row(n);
      for (Eigen::Index k = 0; k < n; ++k)
        row[k] = all[static_cast<std::size_t>(columns[static_cast<std::size_t>(k)])];
      const double weight = share / (parts * parts);
      normal += weight * row * row.transpose();
      right += weight * radius * row;
    });
  }
  return normal.ldlt().solve(right);
}

/// Gauss and Newton's way to the line.
Line fitted_line(const TriangleMesh& mesh, Line line, bool direction_is_known) {
  const std::vector<int> columns =
      direction_is_known ? std::vector<int>{0, 1, 2} : std::vector<int>{0, 1, 2, 3, 4};
  for (int round = 0; round < 30; ++round) {
    const Eigen::VectorXd fit = fitted(mesh, line, columns);
    if (!fit.allFinite() || !(fit[0] > 0)) break;
    const double move = std::hypot(fit[1], fit[2]) / fit[0];
    const double tilt = direction_is_known ? 0 : std::hypot(fit[3], fit[4]);
    if (move > 0.5 || tilt > 0.5) break;  // no cylinder to be found: the first guess stays
    const Vec3 direction =
        direction_is_known ? line.w : Vec3(line.w + fit[3] * line.u + fit[4] * line.v);
    line = line_along(line.point + fit[1] * line.u + fit[2] * line.v, direction);
    if (move + tilt < 1e-12) break;
  }
  return line;
}

double distance_to_triangle(const Eigen::Vector2d& a, const Eigen::Vector2d& b,
                            const Eigen::Vector2d& c) {
  const auto cross = [](const Eigen::Vector2d& p, const Eigen::Vector2d& q) {
    return p.x() * q.y() - p.y() * q.x();
  };
  const double ab = cross(a, b), bc = cross(b, c), ca = cross(c, a);
  if ((ab >= 0 && bc >= 0 && ca >= 0) || (ab <= 0 && bc <= 0 && ca <= 0)) return 0;
  const auto to_side = [](const Eigen::Vector2d& p, const Eigen::Vector2d& q) {
    const Eigen::Vector2d side = q - p;
    const double length2 = side.squaredNorm();
    const double t = length2 > 0 ? std::clamp(-p.dot(side) / length2, 0.0, 1.0) : 0.0;
    return (p + t * side).norm();
  };
  return std::min({to_side(a, b), to_side(b, c), to_side(c, a)});
}

/// Slices without metal take what lies between their neighbours.
void fill_gaps(std::vector<double>& radii) {
  const std::size_t n = radii.size();
  std::size_t known = n;
  for (std::size_t k = 0; k < n; ++k) {
    if (!(radii[k] > 0)) continue;
    for (std::size_t i = known == n ? 0 : known + 1; i < k; ++i) {
      const double t =
          known == n ? 1 : static_cast<double>(i - known) / static_cast<double>(k - known);
      radii[i] = (1 - t) * (known == n ? 0 : radii[known]) + t * radii[k];
    }
    known = k;
  }
  for (std::size_t i = known == n ? n : known + 1; i < n; ++i) radii[i] = radii[known];
}

void measure_outer_radii(StraightSurface& surface) {
  const auto slices = static_cast<std::size_t>(
      std::max(1.0, std::ceil(surface.length / (kSlice * surface.outer_radius))));
  const double height = surface.length / static_cast<double>(slices);
  surface.outer_radii.assign(slices, 0.0);
  for (const Triangle& t : surface.mesh.triangles) {
    const Facet f = facet(surface.mesh, t);
    const Vec3 out = Vec3(f.centroid().x(), f.centroid().y(), 0).normalized();
    if (!(f.area().dot(out) > kFacesOutward * f.area().norm())) continue;
    const int parts = std::max(1, static_cast<int>(std::ceil(2 * f.size() / height)));
    for (int i = 0; i <= parts; ++i) {
      for (int j = 0; i + j <= parts; ++j) {
        const Vec3 x = f.a + (f.b - f.a) * i / parts + (f.c - f.a) * j / parts;
        const auto slice = static_cast<std::size_t>(std::max(0.0, x.z() / height));
        double& radius = surface.outer_radii[std::min(slice, slices - 1)];
        radius = std::max(radius, std::hypot(x.x(), x.y()));
      }
    }
  }
  fill_gaps(surface.outer_radii);
  if (!(surface.outer_radii.front() > 0)) surface.outer_radii.assign(slices, surface.outer_radius);
}

void measure(StraightSurface& surface) {
  surface.outer_radius = surface.area = surface.volume = surface.length = 0;
  surface.inner_radius = std::numeric_limits<double>::infinity();
  for (const Vec3& p : surface.mesh.points) {
    surface.outer_radius = std::max(surface.outer_radius, std::hypot(p.x(), p.y()));
    surface.length = std::max(surface.length, p.z());
  }
  for (const Triangle& t : surface.mesh.triangles) {
    const Facet f = facet(surface.mesh, t);
    surface.inner_radius = std::min(
        surface.inner_radius,
        distance_to_triangle(f.a.head<2>().eval(), f.b.head<2>().eval(), f.c.head<2>().eval()));
    surface.area += f.area().norm();
    surface.volume += f.a.dot(f.b.cross(f.c)) / 6;
  }
  measure_outer_radii(surface);
}

}  // namespace

StraightSurface on_its_axis(const TriangleMesh& mesh, const std::optional<Vec3>& axis) {
  Vec3 direction = axis ? *axis : axis_of_symmetry(mesh);
  Line line = fitted_line(mesh, line_along(centroid(mesh), direction), axis.has_value());
  if (!axis) {
    int largest = 0;
    line.w.cwiseAbs().maxCoeff(&largest);
    if (line.w[largest] < 0) line = line_along(line.point, -line.w);
  }
  double lowest = std::numeric_limits<double>::infinity();
  for (const Vec3& p : mesh.points) lowest = std::min(lowest, (p - line.point).dot(line.w));
  StraightSurface result;
  result.mesh.triangles = mesh.triangles;
  for (const Vec3& p : mesh.points) {
    const Vec3 from = p - line.point;
    result.mesh.points.emplace_back(from.dot(line.u), from.dot(line.v), from.dot(line.w) - lowest);
  }
  measure(result);
  if (!(result.inner_radius >= kLumen * result.outer_radius)) {
    std::ostringstream text;
    text << "is not tube-like: it comes within " << result.inner_radius
         << " mm of its axis, its outer radius is " << result.outer_radius
         << " mm; a lumen of at least " << 100 * kLumen << " % of that is needed";
    refuse(text);
  }
  const Line middle{0.5 * result.length * Vec3::UnitZ(), Vec3::UnitX(), Vec3::UnitY(),
                    Vec3::UnitZ()};
  const Eigen::VectorXd bend = fitted(result.mesh, middle, {0, 1, 2, 3, 4, 5, 6});
  const double sag = std::hypot(bend[5], bend[6]) * std::pow(0.5 * result.length, 2);
  if (!(sag <= kSag * result.outer_radius)) {
    std::ostringstream text;
    text << "is not straight: its axis sags by " << sag << " mm over its length of "
         << result.length << " mm; a straight stent is needed";
    refuse(text);
  }
  return result;
}

double outer_radius_at(const StraightSurface& surface, double z) {
  const std::vector<double>& radii = surface.outer_radii;
  const double slice = z / surface.length * static_cast<double>(radii.size()) - 0.5;
  const double last = static_cast<double>(radii.size() - 1);
  const double at = std::clamp(slice, 0.0, last);
  const auto below = static_cast<std::size_t>(at);
  const std::size_t above = std::min(below + 1, radii.size() - 1);
  const double t = at - static_cast<double>(below);
  return (1 - t) * radii[below] + t * radii[above];
}

StraightSurface turned_around(StraightSurface surface) {
  std::reverse(surface.outer_radii.begin(), surface.outer_radii.end());
  for (Vec3& p : surface.mesh.points) p = Vec3(p.x(), -p.y(), surface.length - p.z());
  return surface;
}

}  // namespace vstent::stents

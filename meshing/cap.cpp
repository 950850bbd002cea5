#include "meshing/cap.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "meshing/isotropic.hpp"
#include "vessels/check.hpp"
#include "vessels/error.hpp"
#include "vessels/predicates.hpp"
#include "vessels/text.hpp"
#include "vessels/triangulate.hpp"

namespace vstent::meshing {
namespace {

using vessels::Vec2;

const Vec3& at(const TriangleMesh& mesh, int point) {
  return mesh.points[static_cast<std::size_t>(point)];
}

/// The rim seen against the outward normal, counter-clockwise.
struct Outline {
  Vec3 origin, x, y, normal;
  std::vector<int> points;  ///< of the mesh
  std::vector<Vec2> flat;

  Outline(const TriangleMesh& mesh, const Opening& opening)
      : origin(opening.centre),
        x(opening.outward.unitOrthogonal()),
        y(opening.outward.cross(x)),
        normal(opening.outward),
        points(opening.rim.rbegin(), opening.rim.rend()) {
    for (const int p : points) flat.push_back(seen(at(mesh, p)));
  }
  Vec2 seen(const Vec3& point) const { return {(point - origin).dot(x), (point - origin).dot(y)}; }
  std::size_t next(std::size_t i) const { return (i + 1) % flat.size(); }
};

void require_simple(const TriangleMesh& mesh, const Outline& outline, vessels::LengthUnit unit) {
  const auto& flat = outline.flat;
  std::size_t crossings = 0;
  std::string places;
  for (std::size_t i = 0; i < flat.size(); ++i) {
    for (std::size_t j = i + 2; j < flat.size(); ++j) {
      if (outline.next(j) == i) continue;
      if (!vessels::segments_meet(flat[i], flat[outline.next(i)], flat[j], flat[outline.next(j)]))
        continue;
      if (crossings++ < 3)
        places += (crossings > 1 ? "; " : "") + vessels::place(at(mesh, outline.points[i]), unit);
    }
  }
  if (crossings == 0) return;
  throw Error(ExitCode::geometry,
              "the rim of the opening around " + vessels::place(outline.origin, unit) +
                  " crosses itself " + std::to_string(crossings) + " times, at " + places +
                  (crossings > 3 ? "; ..." : "") + ": it cannot be capped, cut the end clean");
}

/// Every rim edge is seen from the centre.
bool star_shaped(const Outline& outline) {
  for (std::size_t i = 0; i < outline.flat.size(); ++i) {
    if (vessels::orient2d({0, 0}, outline.flat[i], outline.flat[outline.next(i)]) <= 0)
      return false;
  }
  return true;
}

/// Triangles over the flat outline, with its points first: a fan, or ears where it is not seen from
/// its centre.
TriangleMesh covered(const Outline& outline) {
  TriangleMesh mesh;
  std::vector<int> polygon;
  for (const auto& [x, y] : outline.flat) {
    polygon.push_back(static_cast<int>(mesh.points.size()));
    mesh.points.emplace_back(x, y, 0);
  }
  if (star_shaped(outline)) {
    const int centre = static_cast<int>(mesh.points.size());
    mesh.points.emplace_back(0, 0, 0);
    for (std::size_t i = 0; i < polygon.size(); ++i)
      mesh.triangles.push_back({polygon[i], polygon[outline.next(i)], centre});
  } else {
    bool simple = true;
    mesh.triangles = vessels::triangulate(polygon, mesh.points, simple);
  }
  return mesh;
}

/// Height over the mean plane at a place within the outline: mean value coordinates of the rim's
/// heights (Floater 2003).
double height(const Outline& outline, const std::vector<double>& heights, const Vec3& place) {
  double sum = 0, total = 0;
  const std::size_t n = heights.size();
  const auto spoke = [&](std::size_t i) {
    return Eigen::Vector2d(outline.flat[i][0] - place.x(), outline.flat[i][1] - place.y());
  };
  const auto half_tangent = [&](std::size_t i) {
    const Eigen::Vector2d u = spoke(i), v = spoke(outline.next(i));
    const double cross = u.x() * v.y() - u.y() * v.x();
    const double lengths = u.norm() * v.norm();
    return cross / (lengths + u.dot(v));
  };
  double before = half_tangent(n - 1);
  for (std::size_t i = 0; i < n; ++i) {
    const double after = half_tangent(i);
    const double weight = (before + after) / spoke(i).norm();
    sum += weight * heights[i];
    total += weight;
    before = after;
  }
  return sum / total;
}

}  // namespace

std::vector<Opening> find_openings(const TriangleMesh& mesh) {
  std::vector<Opening> openings;
  for (std::vector<int>& loop : vessels::topology(mesh).boundary_loops) {
    Opening opening;
    double perimeter = 0;
    Vec3 moment = Vec3::Zero(), doubled_area = Vec3::Zero();
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Vec3& a = at(mesh, loop[i]);
      const Vec3& b = at(mesh, loop[(i + 1) % loop.size()]);
      perimeter += (b - a).norm();
      moment += 0.5 * (b - a).norm() * (a + b);
      doubled_area -= (a - at(mesh, loop[0])).cross(b - at(mesh, loop[0]));
    }
    opening.rim = std::move(loop);
    opening.edge = perimeter / static_cast<double>(opening.rim.size());
    opening.centre = perimeter > 0 ? Vec3(moment / perimeter) : at(mesh, opening.rim.front());
    if (doubled_area.norm() > 0) opening.outward = doubled_area.normalized();
    opening.radius = std::sqrt(0.5 * doubled_area.norm() / std::numbers::pi);
    for (const int p : opening.rim) {
      opening.unevenness =
          std::max(opening.unevenness, std::abs(opening.outward.dot(at(mesh, p) - opening.centre)));
    }
    openings.push_back(std::move(opening));
  }
  std::stable_sort(openings.begin(), openings.end(),
                   [](const Opening& a, const Opening& b) { return a.radius > b.radius; });
  return openings;
}

void close(TriangleMesh& mesh, const Opening& opening, vessels::LengthUnit unit) {
  const Outline outline(mesh, opening);
  require_simple(mesh, outline, unit);
  const TriangleMesh start = covered(outline);
  const std::vector<int> face(start.triangles.size(), 0);
  std::vector<char> on_rim(start.points.size(), 0);
  std::fill_n(on_rim.begin(), outline.points.size(), char{1});
  EdgeLengths wanted;
  wanted.everywhere = opening.edge;
  EditMesh cap(start.points, start.triangles, face);
  make_isotropic(cap, Reference(start, face, LengthField(start, face, on_rim, wanted)), {});

  std::vector<double> heights;
  for (const int p : outline.points)
    heights.push_back(outline.normal.dot(at(mesh, p) - outline.origin));
  std::vector<int> number = outline.points;
  number.resize(cap.points.size(), -1);
  for (std::size_t v = outline.points.size(); v < cap.points.size(); ++v) {
    if (!cap.vertex_lives[v]) continue;
    const Vec3& flat = cap.points[v];
    number[v] = static_cast<int>(mesh.points.size());
    mesh.points.push_back(outline.origin + flat.x() * outline.x + flat.y() * outline.y +
                          height(outline, heights, flat) * outline.normal);
  }
  for (std::size_t t = 0; t < cap.triangles.size(); ++t) {
    if (!cap.triangle_lives[t]) continue;
    Triangle corners = cap.triangles[t];
    for (int& p : corners) p = number[static_cast<std::size_t>(p)];
    mesh.triangles.push_back(corners);
  }
}

void flatten(TriangleMesh& mesh, Opening& opening) {
  for (const int p : opening.rim) {
    Vec3& point = mesh.points[static_cast<std::size_t>(p)];
    point -= opening.outward.dot(point - opening.centre) * opening.outward;
  }
  opening.unevenness = 0;
}

}  // namespace vstent::meshing

#include "flow/faces.hpp"

#include <algorithm>
#include <set>

#include "flow/lumen_tree.hpp"
#include "vessels/error.hpp"
#include "vessels/file_arrays.hpp"
#include "vessels/text.hpp"

namespace vstent::flow {
namespace {

namespace fs = std::filesystem;

struct WeightedCentre {
  Vec3 sum = Vec3::Zero();
  double area = 0;
  void add(const TriangleMesh& mesh, const Triangle& t) {
    const auto point = [&](std::size_t k) { return mesh.points[static_cast<std::size_t>(t[k])]; };
    const double weight = 0.5 * (point(1) - point(0)).cross(point(2) - point(0)).norm();
    sum += weight * (point(0) + point(1) + point(2)) / 3;
    area += weight;
  }
};

fs::path cap_file(const BoundaryConditions& conditions, const std::string& name) {
  for (const char* extension : {".vtp", ".stl", ".vtk"}) {
    const fs::path path = conditions.caps / (name + extension);
    if (fs::exists(path)) return path;
  }
  throw Error(ExitCode::usage, conditions.source + ": /caps: " + conditions.caps.string() +
                                   " has no " + name + ".vtp or " + name + ".stl for the face " +
                                   name);
}

Vec3 centre_of(const TriangleMesh& mesh) {
  WeightedCentre centre;
  for (const Triangle& t : mesh.triangles) centre.add(mesh, t);
  return centre.sum / centre.area;
}

Vec3 centre_of_face(const BoundaryConditions& conditions, const FaceCondition& face,
                    const vessels::Surface& surface) {
  WeightedCentre centre;
  for (std::size_t t = 0; t < surface.face_of_triangle.size(); ++t)
    if (surface.face_of_triangle[t] == *face.face_id)
      centre.add(surface.mesh, surface.mesh.triangles[t]);
  if (centre.area > 0) return centre.sum / centre.area;
  throw Error(ExitCode::usage,
              conditions.source + ": /faces/" + face.name + "/face_id: " + surface.path +
                  " has no triangle with the ModelFaceID " + std::to_string(*face.face_id));
}

TreeEnd end_at(const Vec3& point, double radius, const vessels::Surface& surface,
               const vessels::LumenEnds& ends) {
  TreeEnd end;
  end.point = point;
  end.radius = radius;
  double nearest = 2 * radius;
  for (const vessels::LumenEnd& e : ends.ends) {
    const double distance = (e.centre - point).norm();
    if (distance < nearest) nearest = distance, end.radius = e.radius;
  }
  double nearest_cap = 2 * end.radius;
  for (std::size_t t = 0; t < surface.face_of_triangle.size(); ++t) {
    if (!ends.is_cap[t]) continue;
    const Triangle& corners = surface.mesh.triangles[t];
    const double distance =
        (surface.mesh.points[static_cast<std::size_t>(corners[0])] - point).norm();
    if (distance < nearest_cap) nearest_cap = distance, end.face_id = surface.face_of_triangle[t];
  }
  return end;
}

std::string listed(const std::vector<TreeEnd>& ends) {
  std::string text;
  for (const TreeEnd& end : ends) text += (text.empty() ? "" : "; ") + describe(end);
  return text;
}

}  // namespace

std::vector<TreeEnd> tree_ends(const vessels::Centerline& centerline,
                               const vessels::Surface& surface, const vessels::LumenEnds& ends) {
  const vessels::CenterlineBranch& first = centerline.branches.front();
  std::vector<TreeEnd> result{end_at(first.points.front(), first.radii.front(), surface, ends)};
  result.front().root = true;
  result.front().name = "inlet";
  for (const int leaf : leaves(centerline.branches)) {
    const vessels::CenterlineBranch& branch = centerline.branches[static_cast<std::size_t>(leaf)];
    TreeEnd end = end_at(branch.points.back(), branch.radii.back(), surface, ends);
    end.branch = leaf;
    end.name = "outlet" + std::to_string(result.size());
    result.push_back(std::move(end));
  }
  if (result.size() == 2) result.back().name = "outlet";
  return result;
}

std::map<std::string, Vec3> face_centres(const BoundaryConditions& conditions,
                                         const vessels::Surface& surface) {
  std::map<std::string, Vec3> centres;
  for (const FaceCondition& face : conditions.faces) {
    if (face.near_to) {
      const auto& [x, y, z] = *face.near_to;
      centres[face.name] = vessels::millimetres_per(surface.unit) * Vec3(x, y, z);
    } else if (face.face_id) {
      centres[face.name] = centre_of_face(conditions, face, surface);
    } else if (!conditions.caps.empty()) {
      centres[face.name] =
          centre_of(vessels::read_patch(cap_file(conditions, face.name), surface.unit));
    }
  }
  return centres;
}

void name_ends(std::vector<TreeEnd>& ends, const BoundaryConditions& conditions,
               const std::map<std::string, Vec3>& centres, const std::string& model) {
  std::set<std::size_t> named;
  for (const auto& [name, centre] : centres) {
    const auto nearest = std::min_element(ends.begin(), ends.end(),
                                          [&, c = centre](const TreeEnd& a, const TreeEnd& b) {
                                            return (a.point - c).norm() < (b.point - c).norm();
                                          });
    const auto index = static_cast<std::size_t>(nearest - ends.begin());
    const std::string where =
        conditions.source + ": /faces/" + name + ": lies at " + vessels::place(centre) + " mm, ";
    if ((nearest->point - centre).norm() > 2 * nearest->radius) {
      throw Error(ExitCode::usage,
                  where + "where " + model + " has no end; it has " + listed(ends));
    }
    if (!named.insert(index).second) {
      throw Error(ExitCode::usage, where + "the same end of " + model + " as " + nearest->name);
    }
    nearest->name = name;
  }
  std::vector<std::string> names;
  for (const TreeEnd& end : ends) names.push_back(end.name);
  require_faces(conditions, names, model);
  for (const TreeEnd& end : ends) {
    if (is_inflow(conditions.find(end.name)->condition) == end.root) continue;
    throw Error(ExitCode::usage,
                conditions.source + ": /faces/" + end.name +
                    (end.root ? ": blood enters here, but its condition is an outlet's"
                              : ": the reduced model has one inflow, at the tree's root; this "
                                "face is another end"));
  }
}

std::string describe(const TreeEnd& end) {
  return end.name + " at " + vessels::place(end.point) + " mm, diameter " +
         vessels::number(2 * end.radius) + " mm" +
         (end.face_id ? ", ModelFaceID " + std::to_string(*end.face_id) : "");
}

}  // namespace vstent::flow

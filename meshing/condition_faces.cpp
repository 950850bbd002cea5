#include "meshing/condition_faces.hpp"

#include <limits>

#include "vessels/error.hpp"

namespace vstent::meshing {
namespace {

Vec3 centre_of(const Model& model, int id) {
  Vec3 moment = Vec3::Zero();
  double area = 0;
  for (const Triangle& t : triangles_of(model, id)) {
    const auto at = [&](std::size_t k) -> const Vec3& {
      return model.mesh.points[static_cast<std::size_t>(t[k])];
    };
    const double part = (at(1) - at(0)).cross(at(2) - at(0)).norm();
    moment += part * (at(0) + at(1) + at(2)) / 3;
    area += part;
  }
  return moment / area;
}

Face* nearest_cap(Model& model, const Vec3& point) {
  Face* nearest = nullptr;
  double least = std::numeric_limits<double>::infinity();
  for (Face& face : model.faces) {
    if (!face.cap) continue;
    const double distance = (centre_of(model, face.id) - point).norm();
    if (distance >= least) continue;
    least = distance;
    nearest = &face;
  }
  return nearest;
}

}  // namespace

void add_names(FaceNames& names, const flow::BoundaryConditions& conditions) {
  for (const flow::FaceCondition& face : conditions.faces) {
    if (face.face_id) names.names.emplace(*face.face_id, face.name);
  }
  if (names.files.empty() && !conditions.caps.empty()) names.files = face_files(conditions.caps);
}

void name_by_place(Model& model, const flow::BoundaryConditions& conditions,
                   vessels::LengthUnit unit) {
  std::map<int, std::string> taken;
  for (const flow::FaceCondition& condition : conditions.faces) {
    if (!condition.near_to) continue;
    const auto& [x, y, z] = *condition.near_to;
    Face* cap = nearest_cap(model, Vec3(x, y, z) * vessels::millimetres_per(unit));
    if (cap == nullptr) return;
    const auto [other, fresh] = taken.emplace(cap->id, condition.name);
    if (!fresh)
      throw Error(ExitCode::usage, conditions.source + ": /faces: " + other->second + " and " +
                                       condition.name + " lie nearest to the same cap");
    cap->name = condition.name;
  }
}

}  // namespace vstent::meshing

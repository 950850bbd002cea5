#include "apps/mesh_picture.hpp"

#include <vtkProperty.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <iostream>
#include <map>

#include "apps/display.hpp"
#include "apps/drawing.hpp"

namespace vstent::apps {
namespace {

/// The plane in which the model spreads widest.
struct Cut {
  Vec3 origin, normal, up;
};

Cut cut_through(const TriangleMesh& mesh) {
  Vec3 mean = Vec3::Zero();
  for (const Vec3& p : mesh.points) mean += p;
  mean /= static_cast<double>(mesh.points.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Vec3& p : mesh.points) spread += (p - mean) * (p - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
  Vec3 up = solver.eigenvectors().col(2);
  int most = 0;
  up.cwiseAbs().maxCoeff(&most);
  if (up[most] < 0) up = -up;  // axes of scans mostly point to the head, to the back, to the left
  return {mean, solver.eigenvectors().col(0), up};
}

/// The facets of the tetrahedra behind the cut: those of the model's surface, and those that the
/// cut lays open.
struct Halves {
  TriangleMesh surface, open;
};

Halves behind(const meshing::TetMesh& mesh, std::size_t surface_points, const Cut& cut) {
  std::map<std::array<int, 3>, Triangle> single;
  for (const meshing::Tetrahedron& t : mesh.tetrahedra) {
    Vec3 centre = Vec3::Zero();
    for (const int v : t) centre += mesh.points[static_cast<std::size_t>(v)] / 4;
    if ((centre - cut.origin).dot(cut.normal) < 0) continue;
    for (int k = 0; k < 4; ++k) {
      const Triangle facet = meshing::facet(t, k);
      std::array<int, 3> key = facet;
      std::sort(key.begin(), key.end());
      if (const auto [other, fresh] = single.emplace(key, facet); !fresh) single.erase(other);
    }
  }
  Halves halves{{mesh.points, {}}, {mesh.points, {}}};
  for (const auto& [key, facet] : single) {
    const bool on_surface = static_cast<std::size_t>(key[2]) < surface_points;
    (on_surface ? halves.surface : halves.open).triangles.push_back(facet);
  }
  return halves;
}

}  // namespace

void draw_mesh(const meshing::Model& model, const meshing::TetMesh& mesh,
               const std::filesystem::path& png) {
  const OffscreenDisplay display;
  if (!display.available()) {
    std::cerr << "warning: no picture: " << display.reason() << '\n';
    return;
  }
  const Cut cut = cut_through(model.mesh);
  const Halves halves = behind(mesh, model.mesh.points.size(), cut);
  const Polyline axis = {cut.origin + cut.up, cut.origin - cut.up};
  View whole = view_across(axis, model.mesh.points, model.mesh.points);
  if (whole.direction.dot(cut.normal) < 0) whole.direction = -whole.direction;
  View near = whole;
  double least = std::numeric_limits<double>::infinity();
  for (const Triangle& t : halves.open.triangles) {
    const Vec3& p = mesh.points[static_cast<std::size_t>(t[0])];
    if (const double d = (p - whole.centre).norm(); d < least) {
      least = d;
      near.centre = p;
    }
  }
  near.height = whole.height / 6;
  Panels panels(2);
  for (const auto& [title, view] : {std::pair{"mesh, cut open", whole}, {"enlarged", near}}) {
    vtkRenderer* renderer = panels.add(title, view);
    for (const auto& [part, look] : {std::pair{&halves.surface, Look{0.80, 0.36, 0.33, 1.0}},
                                     {&halves.open, Look{0.93, 0.86, 0.70, 1.0}}}) {
      if (part->triangles.empty()) continue;
      auto actor = actor_for(*part, look);
      actor->GetProperty()->EdgeVisibilityOn();
      actor->GetProperty()->SetEdgeColor(0.25, 0.2, 0.2);
      actor->GetProperty()->SetInterpolationToFlat();
      renderer->AddActor(actor);
    }
  }
  panels.write_png(png);
}

}  // namespace vstent::apps

#include "meshing/remesh.hpp"

#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <stdexcept>

#include "meshing/crossings.hpp"
#include "meshing/isotropic.hpp"
#include "sdf/mesh_distance.hpp"
#include "vessels/check.hpp"
#include "vessels/error.hpp"
#include "vessels/text.hpp"

namespace vstent::meshing {
namespace {

constexpr int kTries = 4;
constexpr double kMostTriangles = 2e7;  // some 10 GB

/// The triangles of a region with points of their own; a point where the region touches itself
/// without an edge counts once for each side.
struct Patch {
  TriangleMesh mesh;
  std::vector<int> face;
  std::vector<int> point_of_model;
};

/// Numbers the fans of triangles around `vertex`, in the order of `triangles`.
std::vector<int> fans(const std::vector<Triangle>& triangles, int vertex) {
  const std::size_t count = triangles.size();
  std::vector<int> fan(count);
  for (std::size_t i = 0; i < count; ++i) fan[i] = static_cast<int>(i);
  const auto share_edge = [&](const Triangle& a, const Triangle& b) {
    int shared = 0;
    for (const int p : a) shared += p != vertex && std::find(b.begin(), b.end(), p) != b.end();
    return shared > 0;
  };
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = 0; j < count; ++j) {
      if (fan[i] == fan[j] || !share_edge(triangles[i], triangles[j])) continue;
      const int high = std::max(fan[i], fan[j]), low = std::min(fan[i], fan[j]);
      std::replace(fan.begin(), fan.end(), high, low);
    }
  }
  return fan;
}

Patch extract(const Model& model, std::span<const char> region) {
  Patch patch;
  std::vector<int> local(model.mesh.points.size(), -1);
  for (std::size_t t = 0; t < model.mesh.triangles.size(); ++t) {
    if (!region[t]) continue;
    Triangle corners = model.mesh.triangles[t];
    for (int& p : corners) {
      int& known = local[static_cast<std::size_t>(p)];
      if (known < 0) {
        known = static_cast<int>(patch.mesh.points.size());
        patch.mesh.points.push_back(model.mesh.points[static_cast<std::size_t>(p)]);
        patch.point_of_model.push_back(p);
      }
      p = known;
    }
    patch.mesh.triangles.push_back(corners);
    patch.face.push_back(model.face_of_triangle[t]);
  }
  for (const int tie : vessels::topology(patch.mesh).bow_tie_vertices) {
    std::vector<std::size_t> around;
    std::vector<Triangle> triangles;
    for (std::size_t t = 0; t < patch.mesh.triangles.size(); ++t) {
      const Triangle& corners = patch.mesh.triangles[t];
      if (std::find(corners.begin(), corners.end(), tie) == corners.end()) continue;
      around.push_back(t);
      triangles.push_back(corners);
    }
    const std::vector<int> fan = fans(triangles, tie);
    std::map<int, int> copy_of_fan = {{fan.front(), tie}};
    for (std::size_t i = 0; i < around.size(); ++i) {
      const auto [found, fresh] =
          copy_of_fan.try_emplace(fan[i], static_cast<int>(patch.mesh.points.size()));
      if (fresh) {
        const Vec3 place = patch.mesh.points[static_cast<std::size_t>(tie)];
        patch.mesh.points.push_back(place);
        patch.point_of_model.push_back(patch.point_of_model[static_cast<std::size_t>(tie)]);
      }
      for (int& p : patch.mesh.triangles[around[i]])
        if (p == tie) p = found->second;
    }
  }
  return patch;
}

/// Points that no operation moves: on the border, and on curves unless those are resampled.
std::vector<char> kept_points(const EditMesh& mesh, bool resample) {
  std::vector<char> kept(mesh.points.size(), 0);
  for (int h = 0; h < mesh.half_edges(); ++h) {
    const int g = mesh.twin(h);
    const bool curve = g >= 0 && mesh.face[static_cast<std::size_t>(g / 3)] !=
                                     mesh.face[static_cast<std::size_t>(h / 3)];
    if (g >= 0 && (resample || !curve)) continue;
    kept[static_cast<std::size_t>(mesh.from(h))] = 1;
    kept[static_cast<std::size_t>(mesh.to(h))] = 1;
  }
  return kept;
}

/// Puts the patch in the place of the region it came from.
Remeshed stitch(const Model& model, std::span<const char> region, const Patch& patch,
                const EditMesh& edited) {
  Remeshed result;
  result.model.faces = model.faces;
  const std::size_t old_points = model.mesh.points.size();
  std::vector<char> used(old_points, 0);
  std::vector<int> place_in_model(edited.points.size(), -1);  // of points that stay
  for (std::size_t v = 0; v < patch.point_of_model.size(); ++v) {
    const int p = patch.point_of_model[v];
    if (!edited.vertex_lives[v] ||
        edited.points[v] != model.mesh.points[static_cast<std::size_t>(p)])
      continue;
    place_in_model[v] = p;
    used[static_cast<std::size_t>(p)] = 1;
  }
  for (std::size_t t = 0; t < region.size(); ++t) {
    if (region[t]) continue;
    for (const int p : model.mesh.triangles[t]) used[static_cast<std::size_t>(p)] = 1;
  }
  TriangleMesh& mesh = result.model.mesh;
  std::vector<int> renumbered(old_points, -1);
  for (std::size_t p = 0; p < old_points; ++p) {
    if (!used[p]) continue;
    renumbered[p] = static_cast<int>(mesh.points.size());
    mesh.points.push_back(model.mesh.points[p]);
    result.kept_point.push_back(static_cast<int>(p));
  }
  std::vector<int> number(edited.points.size(), -1);
  for (std::size_t v = 0; v < edited.points.size(); ++v) {
    if (!edited.vertex_lives[v]) continue;
    if (place_in_model[v] >= 0) {
      number[v] = renumbered[static_cast<std::size_t>(place_in_model[v])];
    } else {
      number[v] = static_cast<int>(mesh.points.size());
      mesh.points.push_back(edited.points[v]);
      result.kept_point.push_back(-1);
    }
  }
  for (std::size_t t = 0; t < region.size(); ++t) {
    if (region[t]) continue;
    Triangle corners = model.mesh.triangles[t];
    for (int& p : corners) p = renumbered[static_cast<std::size_t>(p)];
    mesh.triangles.push_back(corners);
    result.model.face_of_triangle.push_back(model.face_of_triangle[t]);
    result.kept_triangle.push_back(static_cast<int>(t));
    result.is_new.push_back(0);
  }
  for (std::size_t t = 0; t < edited.triangles.size(); ++t) {
    if (!edited.triangle_lives[t]) continue;
    Triangle corners = edited.triangles[t];
    for (int& p : corners) p = number[static_cast<std::size_t>(p)];
    mesh.triangles.push_back(corners);
    result.model.face_of_triangle.push_back(edited.face[t]);
    result.kept_triangle.push_back(-1);
    result.is_new.push_back(1);
  }
  return result;
}

/// Equilateral triangles of the wanted lengths that the area holds; \throws Error (resources)
void require_few(const TriangleMesh& mesh, const LengthField& lengths) {
  double count = 0;
  for (const Triangle& t : mesh.triangles) {
    const Vec3& a = mesh.points[static_cast<std::size_t>(t[0])];
    const Vec3& b = mesh.points[static_cast<std::size_t>(t[1])];
    const Vec3& c = mesh.points[static_cast<std::size_t>(t[2])];
    const double length =
        (lengths.of_point(t[0]) + lengths.of_point(t[1]) + lengths.of_point(t[2])) / 3;
    count += 2 / std::numbers::sqrt3 * (b - a).cross(c - a).norm() / (length * length);
  }
  if (count < kMostTriangles) return;
  throw Error(ExitCode::resources, "remeshing would make about " + vessels::number(count) +
                                       " triangles, more than " + vessels::number(kMostTriangles) +
                                       ": ask for longer edges");
}

Remeshed attempt(const Model& model, std::span<const char> region, const RemeshOptions& options) {
  const Patch patch = extract(model, region);
  EditMesh edited(patch.mesh.points, patch.mesh.triangles, patch.face);
  LengthField lengths(patch.mesh, patch.face, kept_points(edited, options.resample_rims),
                      options.edge_lengths);
  require_few(patch.mesh, lengths);
  const Reference reference(patch.mesh, patch.face, std::move(lengths));
  make_isotropic(edited, reference, {options.iterations, options.resample_rims});
  return stitch(model, region, patch, edited);
}

/// The triangle of `before` each one is or, where new, lies nearest to by its centroid.
std::vector<int> origins(const TriangleMesh& before, const Remeshed& after) {
  const sdf::MeshDistance distance(before);
  std::vector<int> origin = after.kept_triangle;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, origin.size(), 256), [&](const auto& range) {
    for (std::size_t t = range.begin(); t < range.end(); ++t) {
      if (origin[t] >= 0) continue;
      Vec3 centroid = Vec3::Zero();
      for (const int p : after.model.mesh.triangles[t])
        centroid += after.model.mesh.points[static_cast<std::size_t>(p)] / 3;
      origin[t] = distance.closest(centroid).triangle;
    }
  });
  return origin;
}

/// Leaves the triangles within `reach` of the places as they are.
std::vector<char> without(const Model& model, std::span<const char> region,
                          const std::vector<Vec3>& places, double reach) {
  std::vector<char> rest(region.begin(), region.end());
  for (std::size_t t = 0; t < rest.size(); ++t) {
    Box box;
    for (const int p : model.mesh.triangles[t])
      box.include(model.mesh.points[static_cast<std::size_t>(p)]);
    for (const Vec3& place : places)
      if (box.squared_distance(place) < reach * reach) rest[t] = 0;
  }
  return rest;
}

}  // namespace

Remeshed remesh(const Model& model, std::span<const char> wanted, const RemeshOptions& options,
                vessels::LengthUnit unit) {
  std::vector<char> region(wanted.begin(), wanted.end());
  if (region.empty()) region.assign(model.mesh.triangles.size(), 1);
  if (region.size() != model.mesh.triangles.size())
    throw std::invalid_argument("remesh: a mark for every triangle");
  const auto& adaptive = options.edge_lengths.adaptive;
  const double shortest = adaptive ? adaptive->shortest : options.edge_lengths.everywhere;
  if (!(shortest > 0) || (adaptive && !(adaptive->longest >= shortest && adaptive->deviation > 0)))
    throw Error(ExitCode::usage,
                "remeshing needs edge lengths and a deviation above 0, the shortest edge no longer "
                "than the longest");
  const double reach = 2 * (adaptive ? adaptive->longest : shortest);
  const auto asked = std::count(region.begin(), region.end(), 1);
  for (int tries = 1;; ++tries) {
    Remeshed result = attempt(model, region, options);
    const std::vector<Vec3> places = crossings(result.model.mesh, result.is_new);
    if (!places.empty()) {
      region = without(model, region, places, tries * reach);
      const auto remaining = std::count(region.begin(), region.end(), 1);
      if (tries == kTries || 2 * remaining < asked)
        require_no_crossings(result.model.mesh, unit, "remeshing", result.is_new);
      continue;
    }
    result.left = static_cast<std::size_t>(asked - std::count(region.begin(), region.end(), 1));
    result.origin = origins(model.mesh, result);
    result.before = measure_quality(model.mesh, region);
    result.after = measure_quality(result.model.mesh, result.is_new);
    result.deviation = std::max(one_way_distance(result.model.mesh, model.mesh, result.is_new),
                                one_way_distance(model.mesh, result.model.mesh, region));
    if (vessels::topology(model.mesh).boundary_loops.empty()) {
      const double volume = enclosed_volume(model.mesh);
      result.volume_change = enclosed_volume(result.model.mesh) / volume - 1;
    }
    return result;
  }
}

}  // namespace vstent::meshing

#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkDoubleArray.h>
#include <vtkNew.h>
#include <vtkPoints.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>
#include <unordered_map>

#include "vessels/check.hpp"
#include "vessels/error.hpp"
#include "vessels/file_guard.hpp"
#include "vessels/half_edges.hpp"
#include "vessels/orientation.hpp"
#include "vessels/polydata.hpp"
#include "vessels/surface_part.hpp"
#include "vessels/text.hpp"
#include "vessels/triangulate.hpp"

namespace vstent::vessels {
namespace {

using Severity = Finding::Severity;

constexpr double kSeamTolerance = 1e-6;        // of the diagonal
constexpr double kSmallestVessel = 2.0;        // mm, diagonal of the bounding box
constexpr double kLargestVessel = 1500.0;      // mm
constexpr double kOutlier = 1e6;               // times the median extent
constexpr std::size_t kLargestPolygon = 4096;  // corners; ear cutting is cubic in them

Error unreadable(const Surface& surface, const std::string& why) {
  return Error(ExitCode::input_file, surface.path + ": " + why);
}

void report(Surface& surface, Severity severity, const char* kind, std::size_t count,
            const std::string& text) {
  if (count > 0) surface.findings.push_back({severity, kind, text, count});
}

struct ExactPlace {
  std::array<double, 3> x;
  bool operator==(const ExactPlace& other) const { return x == other.x; }
};
struct ExactPlaceHash {
  std::size_t operator()(const ExactPlace& place) const {
    std::size_t hash = 0;
    for (const double value : place.x)
      hash = hash * 0x9E3779B97F4A7C15ULL + std::hash<double>()(value);
    return hash ^ (hash >> 29);
  }
};

// Vertices are the used points in their order, exactly coincident ones merged; in the file's unit
// until scaled.
void weld_points(Surface& surface, SourceData& source) {
  vtkPoints* points = source.data->GetPoints();
  vtkCellArray* polygons = source.data->GetPolys();
  const auto count = static_cast<std::size_t>(points->GetNumberOfPoints());
  std::vector<char> used(count, 0);
  vtkNew<vtkIdList> ids;
  for (vtkIdType c = 0; c < polygons->GetNumberOfCells(); ++c) {
    polygons->GetCellAtId(c, ids);
    for (const vtkIdType id : *ids) used[static_cast<std::size_t>(id)] = 1;
  }
  source.vertex_of_point.assign(count, -1);
  std::unordered_map<ExactPlace, int, ExactPlaceHash> vertex_at;
  vertex_at.reserve(count);
  std::size_t unused = 0, merged = 0;
  for (std::size_t p = 0; p < count; ++p) {
    if (used[p] == 0) {
      ++unused;
      continue;
    }
    ExactPlace x{};
    points->GetPoint(static_cast<vtkIdType>(p), x.x.data());
    const auto [found, fresh] =
        vertex_at.try_emplace(x, static_cast<int>(surface.mesh.points.size()));
    if (fresh) surface.mesh.points.emplace_back(x.x[0], x.x[1], x.x[2]);
    merged += fresh ? 0 : 1;
    source.vertex_of_point[p] = found->second;
  }
  report(surface, Severity::repaired, "duplicate-point", merged,
         counted(merged, "point") + " coincided exactly with another and moved as one with it");
  report(surface, Severity::note, "unused-point", unused,
         counted(unused, "point") + " no polygon uses; kept in the file, left out of the mesh");
}

void cut_polygons(Surface& surface, SourceData& source) {
  vtkCellArray* polygons = source.data->GetPolys();
  std::size_t cut = 0, broken = 0, dropped = 0;
  std::string first_broken;
  vtkNew<vtkIdList> ids;
  std::vector<int> corners;
  for (vtkIdType c = 0; c < polygons->GetNumberOfCells(); ++c) {
    polygons->GetCellAtId(c, ids);
    corners.clear();
    for (const vtkIdType id : *ids)
      corners.push_back(source.vertex_of_point[static_cast<std::size_t>(id)]);
    if (corners.size() > kLargestPolygon) {
      throw unreadable(surface, "polygon " + std::to_string(c) + " has " +
                                    std::to_string(corners.size()) + " corners, more than " +
                                    std::to_string(kLargestPolygon));
    }
    if (corners.size() > 3) {  // a corner repeated in a row adds nothing
      corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
      while (corners.size() > 1 && corners.front() == corners.back()) corners.pop_back();
      ++cut;
    }
    bool simple = true;
    const auto triangles = corners.size() < 3 ? std::vector<Triangle>()
                                              : triangulate(corners, surface.mesh.points, simple);
    if (!simple && broken++ == 0) first_broken = std::to_string(c);
    std::size_t kept = 0;
    for (const Triangle& t : triangles) {
      if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
      surface.mesh.triangles.push_back(t);
      source.polygon_of_triangle.push_back(static_cast<int>(c));
      ++kept;
    }
    if (kept == 0) ++dropped;
  }
  report(surface, Severity::repaired, "polygon", cut,
         counted(cut, "polygon") +
             " with more than three corners cut into triangles; the file keeps them whole");
  report(surface, Severity::error, "polygon", broken,
         counted(broken, "polygon") + " crossing itself, the first is cell " + first_broken);
  report(
      surface, Severity::repaired, "collapsed-triangle", dropped,
      counted(dropped, "cell") + " with fewer than three different corners left out of the mesh");
}

// Seams whose two sides differ by rounding: boundary vertices closer than the tolerance become one,
// but only where that closes boundary edges and breaks nothing; otherwise all stay apart.
void close_seams(Surface& surface, SourceData& source) {
  TriangleMesh& mesh = surface.mesh;
  const Topology before = topology(mesh);
  std::vector<int> rim;
  std::size_t open_before = 0;
  for (const auto& loop : before.boundary_loops) {
    rim.insert(rim.end(), loop.begin(), loop.end());
    open_before += loop.size();
  }
  if (rim.empty()) return;
  std::sort(rim.begin(), rim.end());
  rim.erase(std::unique(rim.begin(), rim.end()), rim.end());
  Box box;
  for (const Vec3& x : mesh.points) box.include(x);
  const double tolerance = kSeamTolerance * (box.upper - box.lower).norm();
  const auto at = [&](int v) -> const Vec3& { return mesh.points[static_cast<std::size_t>(v)]; };
  std::vector<int> by_x = rim;
  std::sort(by_x.begin(), by_x.end(),
            [&](int a, int b) { return at(a).x() != at(b).x() ? at(a).x() < at(b).x() : a < b; });
  std::vector<int> representative(mesh.points.size());
  std::iota(representative.begin(), representative.end(), 0);
  std::size_t pairs = 0;
  for (std::size_t i = 0; i < by_x.size(); ++i) {
    for (std::size_t j = i + 1; j < by_x.size() && at(by_x[j]).x() - at(by_x[i]).x() <= tolerance;
         ++j) {
      if ((at(by_x[i]) - at(by_x[j])).norm() > tolerance) continue;
      int a = by_x[i], b = by_x[j];
      while (representative[static_cast<std::size_t>(a)] != a)
        a = representative[static_cast<std::size_t>(a)];
      while (representative[static_cast<std::size_t>(b)] != b)
        b = representative[static_cast<std::size_t>(b)];
      if (a == b) continue;
      representative[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
      ++pairs;
    }
  }
  if (pairs == 0) return;

  std::vector<int> renumbered(mesh.points.size(), -1);
  TriangleMesh merged;
  for (std::size_t v = 0; v < mesh.points.size(); ++v) {
    int r = static_cast<int>(v);
    while (representative[static_cast<std::size_t>(r)] != r)
      r = representative[static_cast<std::size_t>(r)];
    if (r == static_cast<int>(v)) {
      renumbered[v] = static_cast<int>(merged.points.size());
      merged.points.push_back(mesh.points[v]);
    } else {
      renumbered[v] = renumbered[static_cast<std::size_t>(r)];
    }
  }
  bool collapses = false;
  for (const Triangle& t : mesh.triangles) {
    Triangle n{};
    for (std::size_t k = 0; k < 3; ++k) n[k] = renumbered[static_cast<std::size_t>(t[k])];
    collapses |= n[0] == n[1] || n[1] == n[2] || n[2] == n[0];
    merged.triangles.push_back(n);
  }
  const std::string within = " within " + number(tolerance) + " " +
                             std::string(name(surface.unit)) +
                             " (1e-6 of the diagonal) of another rim point";
  if (!collapses) {
    const Topology after = topology(merged);
    std::size_t open_after = 0;
    for (const auto& loop : after.boundary_loops) open_after += loop.size();
    if (open_after < open_before &&
        after.non_manifold_edges.size() <= before.non_manifold_edges.size() &&
        after.bow_tie_vertices.size() <= before.bow_tie_vertices.size()) {
      mesh = std::move(merged);
      for (int& vertex : source.vertex_of_point) {
        if (vertex >= 0) vertex = renumbered[static_cast<std::size_t>(vertex)];
      }
      report(surface, Severity::repaired, "seam", pairs,
             counted(pairs, "point") + within + " joined to it: " +
                 std::to_string((open_before - open_after) / 2) + " seam edges closed");
      return;
    }
  }
  report(
      surface, Severity::warning, "near-coincident-point", pairs,
      counted(pairs, "point") + within + "; left apart, as joining would not close a clean seam");
}

void turn_triangles(Surface& surface, SourceData& source) {
  TriangleMesh& mesh = surface.mesh;
  const Orientation orientation = orient(mesh, source.polygon_of_triangle);
  source.polygon_turned.assign(
      static_cast<std::size_t>(source.data->GetPolys()->GetNumberOfCells()), 0);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (orientation.turned[t] == 0) continue;
    std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
    source.polygon_turned[static_cast<std::size_t>(source.polygon_of_triangle[t])] = 1;
  }
  const std::size_t turned = orientation.turned_count;
  report(surface, Severity::repaired, "orientation", turned,
         turned == mesh.triangles.size()
             ? "the surface faced inward: all " + counted(turned, "triangle") + " turned outward"
             : std::to_string(turned) + " of " + counted(mesh.triangles.size(), "triangle") +
                   " turned so that neighbours agree and face outward");
  if (!orientation.one_sided_edges.empty()) {
    const auto [a, b] = orientation.one_sided_edges.front();
    const Vec3 middle =
        0.5 * (mesh.points[static_cast<std::size_t>(a)] + mesh.points[static_cast<std::size_t>(b)]);
    report(surface, Severity::error, "one-sided", orientation.one_sided_edges.size(),
           "the surface is one-sided (like a Moebius band) and has no outside; neighbours cannot "
           "agree at " +
               counted(orientation.one_sided_edges.size(), "edge") + ", the first at " +
               place(middle) + " mm");
  }
}

std::string fitting_unit(double diagonal_in_file_units) {
  std::string fits;
  for (const LengthUnit unit : {LengthUnit::mm, LengthUnit::cm, LengthUnit::m}) {
    const double diagonal = diagonal_in_file_units * millimetres_per(unit);
    if (diagonal < 10 || diagonal > 1000) continue;
    fits += (fits.empty() ? "" : " or ") + std::string(name(unit));
  }
  return fits.empty() ? "no unit among mm, cm and m fits a vessel" : "is the unit " + fits + "?";
}

enum class Extent { of_a_vessel, any };

// After this the mesh is in millimetres.
void apply_unit(Surface& surface, Extent extent) {
  std::vector<Vec3>& points = surface.mesh.points;
  Box box;
  for (const Vec3& x : points) box.include(x);
  const Vec3 size = box.upper - box.lower;

  Vec3 centre;
  std::vector<double> values(points.size());
  const auto median = [&] {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
  };
  for (int axis = 0; axis < 3; ++axis) {
    std::transform(points.begin(), points.end(), values.begin(),
                   [axis](const Vec3& x) { return x[axis]; });
    centre[axis] = median();
  }
  const auto distance = [&](const Vec3& x) { return (x - centre).norm(); };
  std::transform(points.begin(), points.end(), values.begin(), distance);
  const double typical = median();
  for (std::size_t v = 0; v < points.size(); ++v) {
    if (distance(points[v]) <= kOutlier * typical || typical == 0) continue;
    throw unreadable(surface, "point at " + place(points[v]) + " lies " +
                                  number(distance(points[v]) / typical) +
                                  " times farther out than the others: damaged coordinates");
  }

  const double scale = millimetres_per(surface.unit);
  const double diagonal = size.norm() * scale;
  if (extent == Extent::of_a_vessel &&
      (diagonal < kSmallestVessel || diagonal > kLargestVessel)) {
    throw unreadable(surface, "in " + std::string(name(surface.unit)) + " its extent is " +
                                  number(size.x() * scale) + " x " + number(size.y() * scale) +
                                  " x " + number(size.z() * scale) + " mm, which is no vessel (" +
                                  number(kSmallestVessel) + " to " + number(kLargestVessel) +
                                  " mm): " + fitting_unit(size.norm()));
  }
  for (Vec3& x : points) x *= scale;
}

void read_faces(Surface& surface, const SourceData& source) {
  vtkCellData* arrays = source.data->GetCellData();
  const vtkIdType first_polygon =
      source.data->GetVerts()->GetNumberOfCells() + source.data->GetLines()->GetNumberOfCells();
  for (const char* key : {"ModelFaceID", "CapID"}) {
    vtkDataArray* ids = arrays->GetArray(key);
    if (ids == nullptr || ids->GetNumberOfComponents() != 1) continue;
    for (const int polygon : source.polygon_of_triangle) {
      const double id = ids->GetComponent(first_polygon + polygon, 0);
      if (!(std::abs(id) < 2e9) || id != std::floor(id)) {
        throw unreadable(surface, std::string(key) + " of polygon " + std::to_string(polygon) +
                                      " is " + number(id) + ", not a face number");
      }
      surface.face_of_triangle.push_back(static_cast<int>(id));
    }
    return;
  }
}

void build_mesh(Surface& surface, SourceData& source, Extent extent) {
  const vtkIdType strips = source.data->GetStrips()->GetNumberOfCells();
  if (strips > 0) {
    throw unreadable(surface, "it holds " +
                                  counted(static_cast<std::size_t>(strips), "triangle strip") +
                                  ", turn them into triangles first");
  }
  const auto others = static_cast<std::size_t>(source.data->GetVerts()->GetNumberOfCells() +
                                               source.data->GetLines()->GetNumberOfCells());
  if (source.data->GetPolys()->GetNumberOfCells() == 0) {
    throw unreadable(
        surface, others > 0 ? "it has no triangles, only " + counted(others, "line or vertex cell")
                            : "it has no triangles");
  }
  report(surface, Severity::note, "lines", others,
         counted(others, "line or vertex cell") + " kept in the file, left out of the mesh");
  weld_points(surface, source);
  cut_polygons(surface, source);
  if (surface.mesh.triangles.empty()) {
    throw unreadable(surface, "it has no triangles: no cell has three different corners");
  }
  close_seams(surface, source);
  apply_unit(surface, extent);
  turn_triangles(surface, source);
  read_faces(surface, source);
}

Surface read(const std::filesystem::path& path, LengthUnit unit, Extent extent) {
  Surface surface;
  surface.unit = unit;
  surface.path = path.string();
  auto source = std::make_shared<SourceData>();
  const std::string format = extension(path);
  if (format == ".vtp" || format == ".vtk") {
    source->data = read_polydata(path);
  } else if (format == ".stl") {
    std::size_t merged = 0;
    source->data = parse_stl(read_bytes(path), surface.path, merged);
  } else if (format == ".obj") {
    source->data = parse_obj(read_bytes(path), surface.path, surface.findings);
  } else {
    read_bytes(path);  // a missing file is the better message
    throw Error(ExitCode::input_file,
                surface.path + ": \"" + format +
                    "\" files are not supported, save it as .vtp, .vtk (PolyData), .stl or .obj");
  }
  build_mesh(surface, *source, extent);
  surface.source = std::move(source);
  return surface;
}

}  // namespace

Surface read_surface(const std::filesystem::path& path, LengthUnit unit) {
  return read(path, unit, Extent::of_a_vessel);
}

Surface read_surface_part(const std::filesystem::path& path, LengthUnit unit) {
  return read(path, unit, Extent::any);
}

Surface make_surface(TriangleMesh mesh, std::string name) {
  auto source = std::make_shared<SourceData>();
  vtkNew<vtkDoubleArray> coordinates;
  coordinates->SetNumberOfComponents(3);
  coordinates->SetNumberOfTuples(static_cast<vtkIdType>(mesh.points.size()));
  for (std::size_t v = 0; v < mesh.points.size(); ++v) {
    coordinates->SetTuple(static_cast<vtkIdType>(v), mesh.points[v].data());
  }
  vtkNew<vtkPoints> points;
  points->SetData(coordinates);
  vtkNew<vtkCellArray> cells;
  for (const Triangle& t : mesh.triangles) {
    cells->InsertNextCell({vtkIdType{t[0]}, vtkIdType{t[1]}, vtkIdType{t[2]}});
  }
  source->data = vtkSmartPointer<vtkPolyData>::New();
  source->data->SetPoints(points);
  source->data->SetPolys(cells);
  source->vertex_of_point.resize(mesh.points.size());
  std::iota(source->vertex_of_point.begin(), source->vertex_of_point.end(), 0);
  source->polygon_of_triangle.resize(mesh.triangles.size());
  std::iota(source->polygon_of_triangle.begin(), source->polygon_of_triangle.end(), 0);
  source->polygon_turned.assign(mesh.triangles.size(), 0);
  Surface surface;
  surface.mesh = std::move(mesh);
  surface.path = std::move(name);
  surface.source = std::move(source);
  return surface;
}

}  // namespace vstent::vessels

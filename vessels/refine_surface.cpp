#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>

#include "vessels/polydata.hpp"
#include "vessels/refine.hpp"

namespace vstent::vessels {
namespace {

/// SimVascular's arrays of numbers that no two places share; new places continue them.
bool holds_unique_numbers(const vtkAbstractArray& array) {
  const char* name = const_cast<vtkAbstractArray&>(array).GetName();
  return name != nullptr &&
         (std::string(name) == "GlobalNodeID" || std::string(name) == "GlobalElementID");
}

bool holds_whole_numbers(const vtkDataArray& array) {
  const int type = const_cast<vtkDataArray&>(array).GetDataType();
  return type != VTK_FLOAT && type != VTK_DOUBLE;
}

/// `from` with a tuple added per pair of places: their mean, or the first one's.
vtkSmartPointer<vtkAbstractArray> extended(vtkAbstractArray* from,
                                           const std::vector<std::array<vtkIdType, 2>>& added) {
  vtkSmartPointer<vtkAbstractArray> result;
  result.TakeReference(from->NewInstance());
  result->DeepCopy(from);
  auto* target = vtkDataArray::SafeDownCast(result);
  double next = target != nullptr && holds_unique_numbers(*from) ? target->GetRange(0)[1] : 0;
  for (const auto& [a, b] : added) {
    const vtkIdType place = result->InsertNextTuple(a, result);
    if (target == nullptr) continue;
    if (holds_unique_numbers(*from)) {
      target->SetComponent(place, 0, ++next);
    } else if (a != b && !holds_whole_numbers(*target)) {
      for (int k = 0; k < target->GetNumberOfComponents(); ++k)
        target->SetComponent(place, k,
                             0.5 * (target->GetComponent(a, k) + target->GetComponent(b, k)));
    }
  }
  return result;
}

void extend_fields(vtkDataSetAttributes* from, vtkDataSetAttributes* to,
                   const std::vector<std::array<vtkIdType, 2>>& added) {
  for (int a = 0; a < from->GetNumberOfArrays(); ++a)
    to->AddArray(extended(from->GetAbstractArray(a), added));
}

/// The file's point that a triangle of the mesh uses for a vertex: welded vertices have several.
class CornerPoints {
 public:
  CornerPoints(const Surface& surface, std::size_t vertices)
      : source_(*surface.source), any_point_(vertices, -1) {
    for (std::size_t p = source_.vertex_of_point.size(); p-- > 0;) {
      if (source_.vertex_of_point[p] >= 0)
        any_point_[static_cast<std::size_t>(source_.vertex_of_point[p])] =
            static_cast<vtkIdType>(p);
    }
  }
  vtkIdType of(int triangle, int vertex) {
    source_.data->GetPolys()->GetCellAtId(
        source_.polygon_of_triangle[static_cast<std::size_t>(triangle)], corners_);
    for (vtkIdType k = 0; k < corners_->GetNumberOfIds(); ++k) {
      const vtkIdType p = corners_->GetId(k);
      if (source_.vertex_of_point[static_cast<std::size_t>(p)] == vertex) return p;
    }
    return any_of(vertex);
  }
  vtkIdType any_of(int vertex) const { return any_point_[static_cast<std::size_t>(vertex)]; }
  void add(vtkIdType point) { any_point_.push_back(point); }

 private:
  const SourceData& source_;
  std::vector<vtkIdType> any_point_;
  vtkNew<vtkIdList> corners_;
};

}  // namespace

Surface refine(const Surface& surface, const EdgeLimit& longest_edge, std::size_t vertex_limit) {
  const std::size_t old_vertices = surface.mesh.points.size();
  RefinedMesh refined = refine(surface.mesh, longest_edge, vertex_limit);
  if (refined.parents.empty()) return surface;
  const SourceData& old = *surface.source;
  auto source = std::make_shared<SourceData>();
  source->data = vtkSmartPointer<vtkPolyData>::New();

  vtkNew<vtkPoints> points;
  points->SetDataType(old.data->GetPoints()->GetDataType());
  points->DeepCopy(old.data->GetPoints());
  source->vertex_of_point = old.vertex_of_point;
  CornerPoints corner_points(surface, old_vertices);
  std::vector<std::array<vtkIdType, 2>> point_parents;
  const double scale = millimetres_per(surface.unit);
  for (std::size_t i = 0; i < refined.parents.size(); ++i) {
    const std::size_t vertex = old_vertices + i;
    point_parents.push_back(
        {corner_points.any_of(refined.parents[i][0]), corner_points.any_of(refined.parents[i][1])});
    const vtkIdType point =
        points->InsertNextPoint(Vec3(refined.mesh.points[vertex] / scale).data());
    corner_points.add(point);
    source->vertex_of_point.push_back(static_cast<int>(vertex));
    refined.mesh.points[vertex] = scale * Vec3(points->GetPoint(point));
  }
  source->data->SetPoints(points);
  source->data->SetVerts(old.data->GetVerts());
  source->data->SetLines(old.data->GetLines());

  // A polygon keeps its place with its first triangle; all others follow at the end.
  const auto polygons = static_cast<std::size_t>(old.data->GetPolys()->GetNumberOfCells());
  const std::size_t triangles = refined.mesh.triangles.size();
  constexpr std::size_t kNone = static_cast<std::size_t>(-1);  // no area: the mesh does not know it
  std::vector<std::size_t> order(polygons, kNone);
  std::vector<char> placed(triangles, 0);
  for (std::size_t t = 0; t < old.polygon_of_triangle.size(); ++t) {
    std::size_t& first = order[static_cast<std::size_t>(old.polygon_of_triangle[t])];
    if (first != kNone) continue;
    first = t;
    placed[t] = 1;
  }
  for (std::size_t t = 0; t < triangles; ++t) {
    if (!placed[t]) order.push_back(t);
  }
  const vtkIdType first_polygon =
      old.data->GetVerts()->GetNumberOfCells() + old.data->GetLines()->GetNumberOfCells();
  vtkNew<vtkCellArray> cells;
  vtkNew<vtkIdList> corners;
  std::vector<std::array<vtkIdType, 2>> cell_parents;
  source->polygon_of_triangle.resize(triangles);
  source->polygon_turned.assign(order.size(), 0);
  for (std::size_t c = 0; c < order.size(); ++c) {
    const std::size_t t = order[c];
    if (t == kNone) {
      old.data->GetPolys()->GetCellAtId(static_cast<vtkIdType>(c), corners);
      cells->InsertNextCell(corners);
      continue;
    }
    const int origin = refined.origin[t];
    cells->InsertNextCell(3);
    for (const int v : refined.mesh.triangles[t]) {
      const bool is_old = v < static_cast<int>(old_vertices);
      cells->InsertCellPoint(is_old ? corner_points.of(origin, v) : corner_points.any_of(v));
    }
    source->polygon_of_triangle[t] = static_cast<int>(c);
    if (c < polygons) continue;
    const vtkIdType parent =
        first_polygon + old.polygon_of_triangle[static_cast<std::size_t>(origin)];
    cell_parents.push_back({parent, parent});
  }
  source->data->SetPolys(cells);
  extend_fields(old.data->GetPointData(), source->data->GetPointData(), point_parents);
  extend_fields(old.data->GetCellData(), source->data->GetCellData(), cell_parents);
  source->data->GetFieldData()->DeepCopy(old.data->GetFieldData());

  Surface result = surface;
  result.face_of_triangle.clear();
  if (!surface.face_of_triangle.empty()) {
    for (const int origin : refined.origin)
      result.face_of_triangle.push_back(surface.face_of_triangle[static_cast<std::size_t>(origin)]);
  }
  result.mesh = std::move(refined.mesh);
  result.source = std::move(source);
  return result;
}

}  // namespace vstent::vessels

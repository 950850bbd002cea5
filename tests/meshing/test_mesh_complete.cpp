// mesh-complete, read back with VTK's own readers.
#include <gtest/gtest.h>
#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkCellType.h>
#include <vtkIntArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLPolyDataReader.h>
#include <vtkXMLUnstructuredGridReader.h>

#include <cmath>
#include <set>

#include "meshing/mesh_complete.hpp"
#include "tests/meshing/blocks.hpp"
#include "tests/temporary_folder.hpp"
#include "vessels/error.hpp"

namespace vstent::meshing {
namespace {

namespace fs = std::filesystem;
using tests::Block;
using tests::TemporaryFolder;

template <class Reader, class Data>
vtkSmartPointer<Data> read(const fs::path& path) {
  vtkNew<Reader> reader;
  reader->SetFileName(path.c_str());
  reader->Update();
  return reader->GetOutput();
}

vtkSmartPointer<vtkPolyData> read_face(const fs::path& path) {
  return read<vtkXMLPolyDataReader, vtkPolyData>(path);
}

/// The values of an array, which must be of Int32.
std::vector<int> ids(vtkFieldData* attributes, const char* name) {
  auto* array = vtkIntArray::SafeDownCast(attributes->GetAbstractArray(name));
  EXPECT_NE(array, nullptr) << name;
  if (array == nullptr) return {};
  return {array->GetPointer(0), array->GetPointer(0) + array->GetNumberOfValues()};
}

struct Written {
  Block block = tests::block(2, 7);
  TemporaryFolder folder;
  vtkSmartPointer<vtkUnstructuredGrid> grid;

  Written() {
    for (Vec3& p : block.mesh.points) p += Vec3(0.1, -3.3, 1e-3);  // nothing is round in binary
    block.model.mesh.points.assign(
        block.mesh.points.begin(),
        block.mesh.points.begin() + static_cast<std::ptrdiff_t>(block.model.mesh.points.size()));
    write_mesh_complete(block.model, block.mesh,
                        check_partition(block.mesh, block.model.mesh.triangles).behind,
                        folder / "mesh-complete");
    grid = read<vtkXMLUnstructuredGridReader, vtkUnstructuredGrid>(folder / "mesh-complete" /
                                                                   "mesh-complete.mesh.vtu");
  }
  fs::path file(const std::string& name) const { return folder / "mesh-complete" / name; }
};

TEST(MeshComplete, VolumeHasItsIdsFromOneAndCentimetres) {
  const Written w;
  const auto points = static_cast<vtkIdType>(w.block.mesh.points.size());
  const auto cells = static_cast<vtkIdType>(w.block.mesh.tetrahedra.size());
  ASSERT_EQ(w.grid->GetNumberOfPoints(), points);
  ASSERT_EQ(w.grid->GetNumberOfCells(), cells);
  const std::vector<int> nodes = ids(w.grid->GetPointData(), "GlobalNodeID");
  const std::vector<int> elements = ids(w.grid->GetCellData(), "GlobalElementID");
  EXPECT_EQ(ids(w.grid->GetCellData(), "ModelRegionID"),
            std::vector<int>(static_cast<std::size_t>(cells), 1));
  for (vtkIdType i = 0; i < points; ++i) {
    const auto at = static_cast<std::size_t>(i);
    EXPECT_EQ(nodes[at], i + 1);
    Vec3 x;
    w.grid->GetPoint(i, x.data());
    EXPECT_EQ(x, w.block.mesh.points[at] / 10);
  }
  for (vtkIdType c = 0; c < cells; ++c) {
    const auto at = static_cast<std::size_t>(c);
    EXPECT_EQ(elements[at], c + 1);
    EXPECT_EQ(w.grid->GetCellType(c), VTK_TETRA);
    vtkNew<vtkIdList> corners;
    w.grid->GetCellPoints(c, corners);
    for (vtkIdType k = 0; k < 4; ++k)
      EXPECT_EQ(corners->GetId(k), w.block.mesh.tetrahedra[at][static_cast<std::size_t>(k)]);
  }
}

/// Every triangle lies on the element it names, seen from outside; returns the triangles' nodes.
std::multiset<std::set<int>> check_face(const Written& w, const fs::path& path,
                                        const std::set<int>& faces) {
  const vtkSmartPointer<vtkPolyData> data = read_face(path);
  const std::vector<int> nodes = ids(data->GetPointData(), "GlobalNodeID");
  const std::vector<int> elements = ids(data->GetCellData(), "GlobalElementID");
  const std::vector<int> face_ids = ids(data->GetCellData(), "ModelFaceID");
  EXPECT_EQ(std::set<int>(face_ids.begin(), face_ids.end()), faces) << path;
  EXPECT_EQ(std::set<int>(nodes.begin(), nodes.end()).size(), nodes.size()) << path;
  for (vtkIdType i = 0; i < data->GetNumberOfPoints(); ++i) {
    Vec3 on_face, in_volume;
    data->GetPoint(i, on_face.data());
    w.grid->GetPoint(nodes[static_cast<std::size_t>(i)] - 1, in_volume.data());
    EXPECT_EQ(on_face, in_volume) << path;
  }
  std::multiset<std::set<int>> triangles;
  for (vtkIdType c = 0; c < data->GetNumberOfCells(); ++c) {
    vtkNew<vtkIdList> corners, element;
    data->GetCellPoints(c, corners);
    EXPECT_EQ(corners->GetNumberOfIds(), 3);
    std::array<Vec3, 3> x;
    std::set<int> triangle;
    for (vtkIdType k = 0; k < 3; ++k) {
      data->GetPoint(corners->GetId(k), x[static_cast<std::size_t>(k)].data());
      triangle.insert(nodes[static_cast<std::size_t>(corners->GetId(k))]);
    }
    triangles.insert(triangle);
    w.grid->GetCellPoints(elements[static_cast<std::size_t>(c)] - 1, element);
    int shared = 0;
    for (vtkIdType k = 0; k < 4; ++k) {
      Vec3 corner;
      w.grid->GetPoint(element->GetId(k), corner.data());
      if (triangle.contains(static_cast<int>(element->GetId(k)) + 1)) {
        ++shared;
      } else {
        EXPECT_LT((x[1] - x[0]).cross(x[2] - x[0]).dot(corner - x[0]), 0) << "inward: " << path;
      }
    }
    EXPECT_EQ(shared, 3) << path;
  }
  return triangles;
}

TEST(MeshComplete, FacesLieOnTheVolumeBitForBitAndFaceOutward) {
  const Written w;
  const auto wall = check_face(w, w.file("mesh-surfaces/wall.vtp"), {1});
  const auto inlet = check_face(w, w.file("mesh-surfaces/inlet.vtp"), {2});
  const auto outlet = check_face(w, w.file("mesh-surfaces/outlet.vtp"), {3});
  EXPECT_EQ(wall.size(), 32u);  // two triangles on each of the squares: 4 x 4 sides, 4, 4
  EXPECT_EQ(inlet.size(), 8u);
  EXPECT_EQ(outlet.size(), 8u);
  EXPECT_EQ(check_face(w, w.file("walls_combined.vtp"), {1}), wall);
  std::multiset<std::set<int>> all = wall;
  all.insert(inlet.begin(), inlet.end());
  all.insert(outlet.begin(), outlet.end());
  EXPECT_EQ(check_face(w, w.file("mesh-complete.exterior.vtp"), {1, 2, 3}), all);
}

TEST(MeshComplete, FilesAreTheSameBytesAgain) {
  const Written a, b;
  for (const char* name : {"mesh-complete.mesh.vtu", "mesh-complete.exterior.vtp",
                           "walls_combined.vtp", "mesh-surfaces/inlet.vtp"})
    EXPECT_EQ(tests::read_text(a.file(name)), tests::read_text(b.file(name))) << name;
}

TEST(MeshComplete, FacesThatSolversCannotReadAreRefused) {
  const Block b = tests::block(1, 10);
  const auto refusal = [&](auto&& spoil) -> std::string {
    Model model = b.model;
    spoil(model);
    try {
      require_writable_faces(model);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(refusal([](Model&) {}), "");
  EXPECT_NE(refusal([](Model& m) { m.faces[1].name = "left inlet"; }).find("\"left inlet\""),
            std::string::npos);
  EXPECT_NE(refusal([](Model& m) { m.faces[1].name = "../x"; }).find("letters, digits"),
            std::string::npos);
  EXPECT_EQ(refusal([](Model& m) { m.faces[1].name = "wall"; }), "two faces are called wall");
  EXPECT_EQ(refusal([](Model& m) { m.faces[1].id = 1; }), "two faces have the id 1");
  EXPECT_NE(refusal([](Model& m) { m.faces[1].id = 0; }).find("count from 1"), std::string::npos);
  EXPECT_EQ(refusal([](Model& m) {
              m.faces.push_back({9, "ghost", true});
            }),
            "face ghost has no triangles: no part of the surface belongs to it; leave its file or "
            "name out of the faces given");
  EXPECT_NE(refusal([](Model& m) { m.faces.pop_back(); }).find("face id 3"), std::string::npos);
}

TEST(MeshComplete, ElementsThatRoundingInvertsAreRefused) {
  // Doubles between 1.25 and 2 lie closer than those of a tenth of them: two neighbours fall
  // together, and the element between them with them.
  double low = 1.5;
  while (low / 10 != std::nextafter(low, 2.0) / 10) low = std::nextafter(low, 2.0);
  const double high = std::nextafter(low, 2.0);
  const TetMesh thin{{{0, 0, low}, {1, 0, low}, {0, 1, low}, {0, 0, high}}, {{0, 1, 2, 3}}};
  ASSERT_GT(signed_volume(thin, thin.tetrahedra[0]), 0);
  const Model model{{thin.points, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}},
                    {1, 1, 1, 1},
                    {{1, "wall", false}}};
  const TemporaryFolder folder;
  EXPECT_THROW(write_mesh_complete(model, thin, {0, 0, 0, 0}, folder / "out"), Error);
  EXPECT_FALSE(fs::exists(folder / "out"));
}

}  // namespace
}  // namespace vstent::meshing

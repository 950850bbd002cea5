#include <gtest/gtest.h>

#include <numbers>
#include <set>

#include "meshing/faces.hpp"
#include "tests/data.hpp"
#include "tests/meshing/models.hpp"
#include "tests/vessels/shapes.hpp"
#include "vessels/check.hpp"
#include "vessels/error.hpp"

namespace vstent::meshing {
namespace {

using tests::area_of;
using tests::tube;

std::vector<std::string> names_of(const Model& model, bool caps) {
  std::vector<std::string> names;
  for (const Face& one : model.faces)
    if (one.cap == caps) names.push_back(one.name);
  return names;
}

std::string refusal(const vessels::Surface& surface, const FaceNames& names = {}) {
  try {
    model_of(surface, names);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

void expect_closed(const Model& model) {
  const vessels::Topology facts = vessels::topology(model.mesh);
  EXPECT_TRUE(facts.boundary_loops.empty());
  EXPECT_TRUE(facts.non_manifold_edges.empty());
  EXPECT_TRUE(facts.inconsistent_edges.empty());
  EXPECT_EQ(facts.components, 1);
  EXPECT_EQ(model.face_of_triangle.size(), model.mesh.triangles.size());
}

/// A tube along z whose upper end is wider.
TriangleMesh funnel() {
  TriangleMesh mesh = tube(2, 12, 40, 41);
  for (Vec3& p : mesh.points) p.head<2>() *= 1 + p.z() / 24;
  return mesh;
}

TEST(Faces, OpenTubeBecomesAClosedModelWithTheWidestCapAsInlet) {
  const TriangleMesh mesh = funnel();
  const NamedModel named = model_of(vessels::make_surface(mesh, "funnel"));
  expect_closed(named.model);
  EXPECT_EQ(names_of(named.model, false), std::vector<std::string>{"wall"});
  EXPECT_EQ(names_of(named.model, true), (std::vector<std::string>{"inlet", "outlet1"}));
  for (const Triangle& t : triangles_of(named.model, 2))
    for (const int p : t)
      EXPECT_NEAR(named.model.mesh.points[static_cast<std::size_t>(p)].z(), 12, 1e-12);
  // What was given stays as it was, bit by bit.
  for (std::size_t p = 0; p < mesh.points.size(); ++p)
    EXPECT_EQ(named.model.mesh.points[p], mesh.points[p]);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    EXPECT_EQ(named.model.mesh.triangles[t], mesh.triangles[t]);
  // A polygon of n corners on a circle of radius R has the area n/2 R^2 sin(2 pi / n).
  EXPECT_NEAR(area_of(named.model, 2), 20 * 9 * std::sin(2 * std::numbers::pi / 40), 1e-9);
  EXPECT_TRUE(vessels::self_intersections(named.model.mesh).empty());
}

TEST(Faces, TheInletCanBeGiven) {
  const NamedModel named =
      model_of(vessels::make_surface(funnel(), "funnel"), {.inlet = Vec3(0, 0, 1)});
  EXPECT_EQ(face(named.model, 3).name, "inlet");
  EXPECT_EQ(face(named.model, 2).name, "outlet1");
}

TEST(Faces, NamesGoByIdAndRefuseWhatIsNotThere) {
  const vessels::Surface surface = vessels::make_surface(funnel(), "funnel");
  const NamedModel named = model_of(surface, {.names = {{1, "aorta"}, {3, "distal"}}});
  EXPECT_EQ(face(named.model, 1).name, "aorta");
  EXPECT_EQ(face(named.model, 2).name, "inlet");
  EXPECT_EQ(face(named.model, 3).name, "distal");
  EXPECT_EQ(refusal(surface, {.names = {{7, "aorta"}}}),
            "face names: the surface has no face 7, only 1, 2, 3");
  EXPECT_EQ(refusal(surface, {.names = {{1, "a"}, {2, "a"}}}),
            "face names: two faces are called a");
  EXPECT_EQ(refusal(surface, {.names = {{1, "a/b"}}}),
            "face names: \"a/b\" cannot name a face, use letters, digits, _ - + .");
}

TEST(Faces, FilesNameTheFacesTheyLieOn) {
  const tests::TemporaryFolder folder;
  const NamedModel whole = model_of(vessels::make_surface(funnel(), "funnel"));
  const auto write = [&](const std::string& name, const std::vector<Triangle>& triangles,
                         const Vec3& shift = Vec3::Zero()) {
    TriangleMesh part{whole.model.mesh.points, triangles};
    for (Vec3& p : part.points) p += shift;
    return folder.write(name, tests::obj_text(part));
  };
  const auto top = write("top.obj", triangles_of(whole.model, 2));
  const auto bottom = write("bottom.obj", triangles_of(whole.model, 3));
  // The wall in two files divides it; where is seen by the nearest.
  std::vector<Triangle> upper, lower;
  for (const Triangle& t : triangles_of(whole.model, 1))
    (tests::centroid(whole.model.mesh, t).z() > 6 ? upper : lower).push_back(t);
  const auto above = write("above.obj", upper), below = write("below.obj", lower);
  const vessels::Surface surface = vessels::make_surface(funnel(), "funnel");
  const NamedModel named = model_of(surface, {.files = {above, below, bottom, top}});
  EXPECT_EQ(names_of(named.model, true), (std::vector<std::string>{"top", "bottom"}));
  for (const Face& one : named.model.faces) {
    if (one.cap) continue;
    EXPECT_EQ(triangles_of(named.model, one.id), one.name == "above" ? upper : lower);
  }
  const auto line_of = [&](const std::vector<std::filesystem::path>& files) {
    return refusal(surface, {.files = files});
  };
  EXPECT_NE(line_of({top}).find("no file names the cap at"), std::string::npos);
  EXPECT_NE(line_of({top, bottom, write("again.obj", triangles_of(whole.model, 3))})
                .find("it lies on the same cap as"),
            std::string::npos);
  EXPECT_NE(line_of({write("far.obj", triangles_of(whole.model, 3), {50, 0, 0})})
                .find("away from the model, on average"),
            std::string::npos);
  std::vector<Triangle> both = triangles_of(whole.model, 2);
  for (const Triangle& t : triangles_of(whole.model, 3)) both.push_back(t);
  EXPECT_NE(line_of({write("both.obj", both)}).find("it lies on 2 faces"), std::string::npos);
}

TEST(Faces, NamesAreReadFromJson) {
  const tests::TemporaryFolder folder;
  EXPECT_EQ(read_face_names(folder.write("n.json", R"({"1": "wall", "12": "inflow"})")),
            (std::map<int, std::string>{{1, "wall"}, {12, "inflow"}}));
  for (const char* text : {"[]", "{", R"({"wall": "1"})", R"({"1": 2})"})
    EXPECT_THROW(read_face_names(folder.write("bad.json", text)), Error) << text;
  EXPECT_THROW(face_files(folder / "absent"), Error);
}

TEST(Faces, AHoleInTheWallIsFilledAsWall) {
  TriangleMesh mesh = tube(2, 12, 40, 41);
  mesh.triangles.erase(mesh.triangles.begin() + 1600);
  const NamedModel named = model_of(vessels::make_surface(mesh, "pierced"));
  expect_closed(named.model);
  EXPECT_EQ(names_of(named.model, true).size(), 2u);
  EXPECT_NEAR(area_of(named.model, 1),
              area_of(model_of(vessels::make_surface(tube(2, 12, 40, 41), "whole")).model, 1),
              1e-9);
}

TEST(Faces, UnevenRimsAreSpannedOrFlattened) {
  TriangleMesh mesh = tube(2, 12, 40, 41);
  for (std::size_t j = 0; j < 40; ++j) mesh.points[j].z() += j % 2 == 0 ? 0.05 : -0.05;
  const vessels::Surface surface = vessels::make_surface(mesh, "sawn");
  const NamedModel spanned = model_of(surface);
  expect_closed(spanned.model);
  const auto says = [](const NamedModel& named, const std::string& text) {
    return std::any_of(named.notes.begin(), named.notes.end(), [&](const std::string& note) {
      return note.find(text) != std::string::npos;
    });
  };
  EXPECT_TRUE(says(spanned, "lies up to 0.05 mm off its plane: its cap is curved"));
  const NamedModel flat = model_of(surface, {.flatten_rims = true});
  EXPECT_TRUE(says(flat, "flattened"));
  for (std::size_t j = 0; j < 40; ++j) EXPECT_NEAR(flat.model.mesh.points[j].z(), 0, 1e-12);
}

TEST(Faces, ARimThatCrossesItselfIsRefusedWithItsPlace) {
  TriangleMesh mesh = tube(2, 12, 100, 101);
  std::swap(mesh.points[5], mesh.points[15]);
  const std::string line = refusal(vessels::make_surface(mesh, "twisted"));
  EXPECT_NE(line.find("crosses itself"), std::string::npos) << line;
  EXPECT_NE(line.find("mm"), std::string::npos);
}

TEST(Faces, RealCapsOfTheCoarctationNameItsOpenings) {
  const auto folder = tests::shared_data("coa_patient1");
  SKIP_WITHOUT(folder);
  const auto raw = vessels::read_surface(folder / "wall_aorta.stl", vessels::LengthUnit::mm);
  const std::vector<std::filesystem::path> caps = {folder / "inlet.stl", folder / "outlet1.stl",
                                                   folder / "outlet2.stl", folder / "outlet3.stl",
                                                   folder / "outlet4.stl"};
  const NamedModel named = model_of(raw, {.files = caps});
  expect_closed(named.model);
  const auto names = names_of(named.model, true);
  EXPECT_EQ(std::set<std::string>(names.begin(), names.end()),
            (std::set<std::string>{"inlet", "outlet1", "outlet2", "outlet3", "outlet4"}));
  for (const auto& cap : caps) {
    const auto part = vessels::read_surface(cap, vessels::LengthUnit::mm);
    for (const Face& one : named.model.faces) {
      if (one.name != cap.stem()) continue;
      // Rims and caps were cut apart by the same plane: areas agree to the files' rounding.
      EXPECT_NEAR(area_of(named.model, one.id), area_of(part.mesh), 1e-3 * area_of(part.mesh));
    }
  }
}

TEST(Faces, ClosedModelsKeepTheirFaces) {
  const auto rpa = tests::shared_data("rpa_su201/SU201_2005_RPA1_exterior.vtp");
  SKIP_WITHOUT(rpa);
  const auto surface = vessels::read_surface(rpa, vessels::LengthUnit::mm);
  const NamedModel named =
      model_of(surface, {.files = face_files(tests::shared_data("rpa_su201/mesh-surfaces"))});
  EXPECT_EQ(named.model.mesh.points, surface.mesh.points);
  EXPECT_EQ(named.model.mesh.triangles, surface.mesh.triangles);
  EXPECT_EQ(named.model.face_of_triangle, surface.face_of_triangle);
  const auto caps = names_of(named.model, true), walls = names_of(named.model, false);
  EXPECT_EQ(std::set<std::string>(caps.begin(), caps.end()),
            (std::set<std::string>{"inflow", "cap_RPA1", "cap_RPA1_1", "cap_RPA1_1_1", "cap_RPA1_2",
                                   "cap_RPA1_3"}));
  EXPECT_EQ(std::set<std::string>(walls.begin(), walls.end()),
            (std::set<std::string>{"wall_RPA1", "wall_RPA1_1", "wall_RPA1_1_1", "wall_RPA1_2",
                                   "wall_RPA1_3"}));
}

TEST(Faces, CapsWithIdsAreRecognisedInTheVeinGraftAndTheCoarctation) {
  const auto vein = tests::shared_data("veingraft_stenosis/capped.vtp");
  const auto coa = tests::shared_data("coa_patient1/capped_oriented.vtp");
  SKIP_WITHOUT(vein);
  for (const auto& [path, unit, caps] : {std::tuple(vein, vessels::LengthUnit::cm, 2u),
                                         std::tuple(coa, vessels::LengthUnit::mm, 5u)}) {
    const auto surface = vessels::read_surface(path, unit);
    const NamedModel named = model_of(surface);
    EXPECT_EQ(named.model.mesh.points, surface.mesh.points);
    EXPECT_EQ(named.model.face_of_triangle, surface.face_of_triangle);
    EXPECT_EQ(names_of(named.model, true).size(), caps) << path;
    EXPECT_EQ(names_of(named.model, false), std::vector<std::string>{"wall"});
  }
}

}  // namespace
}  // namespace vstent::meshing

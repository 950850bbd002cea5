// What deploy writes beside the surface: fields, profiles, sections, defined figures.
#include <gtest/gtest.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkPointData.h>

#include <algorithm>

#include "tests/deployment/whole_run.hpp"
#include "tests/measure/defined.hpp"
#include "vessels/idealised.hpp"
#include "vessels/polydata.hpp"

namespace vstent::deployment {
namespace {

using tests::TemporaryFolder;

TEST(ResultFields, AreThoseOfTheSurfaceAsItWasWritten) {
  const TemporaryFolder folder;
  vessels::IdealisedVessel vessel;
  vessel.edge_length = 1;
  const vessels::Surface surface =
      vessels::make_surface(vessels::idealised_vessel(vessel), "ideal");
  const std::vector<char> none(surface.mesh.points.size(), 0);
  vessels::write_surface(surface, surface.mesh.points, none, folder / "vessel.vtp");
  const tests::WholeRun r = tests::run(
      folder, tests::make_case(folder / "vessel.vtp", "mm",
                               {{"at", "lesion"}, {"length", "24mm"}, {"diameter", "10mm"}}));

  const auto data = vessels::read_polydata(folder / "stented.vtp");
  const auto points = [&](const char* name) { return data->GetPointData()->GetArray(name); };
  const auto cells = [&](const char* name) { return data->GetCellData()->GetArray(name); };
  ASSERT_TRUE(points("Displacement") && points("StentDistance"));
  ASSERT_TRUE(cells("StretchCircumferential") && cells("StretchAxial") && cells("AreaRatio"));
  double nearest = 1e9;
  for (std::size_t v = 0; v < surface.mesh.points.size(); ++v) {
    const auto id = static_cast<vtkIdType>(v);
    const Vec3 moved = Vec3(data->GetPoint(id)) - surface.mesh.points[v];
    EXPECT_EQ((moved - Vec3(points("Displacement")->GetTuple3(id))).norm(), 0);
    nearest = std::min(nearest, points("StentDistance")->GetTuple1(id));
  }
  EXPECT_EQ(std::max(0.0, -nearest), r.metrics.deepest_penetration);
  double widest = 0;
  for (std::size_t t = 0; t < surface.mesh.triangles.size(); ++t) {
    const auto id = static_cast<vtkIdType>(t);
    const Triangle& corners = surface.mesh.triangles[t];
    const bool still = std::none_of(corners.begin(), corners.end(), [&](int v) {
      return r.outcome.moved[static_cast<std::size_t>(v)] != 0;
    });
    if (still) {
      EXPECT_EQ(cells("AreaRatio")->GetTuple1(id), 1);
    }
    widest = std::max(widest, cells("StretchCircumferential")->GetTuple1(id));
  }
  // From 5 to 10 mm at the narrowest, where its vertices lie on the stent.
  EXPECT_NEAR(widest, 2, 0.05);

  const auto json = nlohmann::ordered_json::parse(tests::read_text(folder / "metrics.json"));
  const auto met = tests::defined_in(json);
  tests::expect_absences_stated(met);
  EXPECT_TRUE(met.contains("/simulation/contact_force_N"));
  EXPECT_EQ(json["lumen"]["narrowest_after_mm"].get<double>(), r.metrics.narrowest_after);
  EXPECT_EQ(json["mesh"]["changed_vertices_outside_patch"], 0);

  const auto sections = vessels::read_polydata(folder / "sections.vtp");
  auto* arc = sections->GetCellData()->GetArray("arc_length_mm");
  auto* which = sections->GetCellData()->GetArray("which");
  auto* station = sections->GetCellData()->GetArray("station");
  ASSERT_TRUE(arc && which && station);
  vtkIdType outlines = 0;
  for (std::size_t i = 0; i < r.metrics.stations.size(); ++i) {
    const measure::Station& s = r.metrics.stations[i];
    for (const int after : {0, 1}) {
      if (!(after == 1 ? s.after : s.before)) continue;
      ASSERT_LT(outlines, sections->GetNumberOfCells());
      EXPECT_EQ(arc->GetTuple1(outlines), s.arc_length);
      EXPECT_EQ(which->GetTuple1(outlines), after);
      EXPECT_EQ(station->GetTuple1(outlines), static_cast<double>(i));
      ++outlines;
    }
  }
  EXPECT_EQ(outlines, sections->GetNumberOfCells());
  EXPECT_GT(outlines, 50);
  const std::string csv = tests::read_text(folder / "profiles.csv");
  EXPECT_EQ(static_cast<std::size_t>(std::count(csv.begin(), csv.end(), '\n')),
            r.metrics.stations.size() + 1);
}

}  // namespace
}  // namespace vstent::deployment

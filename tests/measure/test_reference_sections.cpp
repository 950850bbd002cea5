// Sections against those that SimVascular wrote with its centerline of the same vessel.
#include <gtest/gtest.h>
#include <vtkDataArray.h>
#include <vtkPointData.h>

#include <iostream>

#include "measure/profile.hpp"
#include "tests/data.hpp"
#include "vessels/polydata.hpp"

namespace vstent::measure {
namespace {

TEST(ReferenceSections, OfTheAortoiliacModelAgreeAwayFromItsBranches) {
  const auto lines = tests::shared_data("aortoiliac_demo/rom_centerlines.vtp");
  const auto model = tests::shared_data("aortoiliac_demo/rom_model_surface.vtp");
  SKIP_WITHOUT(lines);
  SKIP_WITHOUT(model);
  const auto data = vessels::read_polydata(lines);
  const auto array = [&](const char* name) { return data->GetPointData()->GetArray(name); };
  auto* areas = array("CenterlineSectionArea");
  auto* normals = array("CenterlineSectionNormal");
  auto* radii = array("MaximumInscribedSphereRadius");
  auto* forks = array("CenterlineSectionBifurcation");
  auto* fork_ids = array("BifurcationId");
  ASSERT_TRUE(areas && normals && radii && forks && fork_ids);
  constexpr double kCm = 10;
  const vessels::Surface surface = vessels::read_surface(model, vessels::LengthUnit::cm);
  const CutSurface cut(surface);
  int compared = 0, open = 0;
  double worst = 0;
  for (vtkIdType i = 0; i < data->GetNumberOfPoints(); i += 3) {
    if (forks->GetTuple1(i) != 0 || fork_ids->GetTuple1(i) >= 0) continue;
    const Vec3 x = kCm * Vec3(data->GetPoint(i)), normal(normals->GetTuple3(i));
    const auto section = cut.section(x, normal, 3 * kCm * radii->GetTuple1(i));
    if (!section) {
      ++open;
      continue;
    }
    ++compared;
    const double area = kCm * kCm * areas->GetTuple1(i);
    worst = std::max(worst, std::abs(section->area / area - 1));
    EXPECT_NEAR(section->area, area, 0.03 * area) << "point " << i;
  }
  RecordProperty("compared", compared);
  std::cout << compared << " compared, " << open << " open, worst " << 100 * worst << " %\n";
  EXPECT_GT(compared, 100);
}

}  // namespace
}  // namespace vstent::measure

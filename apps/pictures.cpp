#include "apps/pictures.hpp"

#include <vtkActor.h>
#include <vtkActor2D.h>
#include <vtkCamera.h>
#include <vtkCellArray.h>
#include <vtkNew.h>
#include <vtkPNGWriter.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkPolyDataNormals.h>
#include <vtkProperty.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkTextActor.h>
#include <vtkTextProperty.h>
#include <vtkUnsignedCharArray.h>
#include <vtkWindowToImageFilter.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>
#include <iostream>

#include "apps/commands.hpp"
#include "apps/display.hpp"
#include "vessels/error.hpp"
#include "vessels/file_guard.hpp"

namespace vstent::apps {
namespace {

constexpr int kPanelWidth = 640;
constexpr int kPanelHeight = 860;
constexpr int kPanelsInARow = 4;

vtkNew<vtkActor> actor_for(const TriangleMesh& mesh, double red, double green, double blue,
                           double opacity) {
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  points->SetNumberOfPoints(static_cast<vtkIdType>(mesh.points.size()));
  for (std::size_t i = 0; i < mesh.points.size(); ++i)
    points->SetPoint(static_cast<vtkIdType>(i), mesh.points[i].data());
  vtkNew<vtkCellArray> cells;
  for (const Triangle& t : mesh.triangles) cells->InsertNextCell({t[0], t[1], t[2]});
  vtkNew<vtkPolyData> data;
  data->SetPoints(points);
  data->SetPolys(cells);
  vtkNew<vtkPolyDataNormals> normals;
  normals->SetInputData(data);
  normals->SplittingOff();
  normals->ConsistencyOff();
  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputConnection(normals->GetOutputPort());
  mapper->ScalarVisibilityOff();
  vtkNew<vtkActor> actor;
  actor->SetMapper(mapper);
  actor->GetProperty()->SetColor(red, green, blue);
  actor->GetProperty()->SetOpacity(opacity);
  actor->GetProperty()->SetSpecular(0.2);
  return actor;
}

void aim(vtkRenderer* renderer, const View& view) {
  vtkCamera* camera = renderer->GetActiveCamera();
  camera->ParallelProjectionOn();
  camera->SetParallelScale(0.5 * view.height);
  const Vec3 eye = view.centre - 10 * view.height * view.direction;
  camera->SetFocalPoint(view.centre.data());
  camera->SetPosition(eye.data());
  camera->SetViewUp(view.up.data());
  renderer->ResetCameraClippingRange();
}

void label(vtkRenderer* renderer, const std::string& text, int x, int y, int size) {
  vtkNew<vtkTextActor> actor;
  actor->SetInput(text.c_str());
  actor->GetTextProperty()->SetFontSize(size);
  actor->GetTextProperty()->SetColor(0.1, 0.1, 0.1);
  actor->SetPosition(x, y);
  renderer->AddActor2D(actor);
}

/// A round number of millimetres that spans about a quarter of the panel, drawn to scale.
void scale_bar(vtkRenderer* renderer, const View& view) {
  const double per_pixel = view.height / kPanelHeight;
  const double wanted = 0.25 * kPanelWidth * per_pixel;
  const double decade = std::pow(10, std::floor(std::log10(wanted)));
  const double bar = decade * (wanted >= 5 * decade ? 5 : wanted >= 2 * decade ? 2 : 1);
  const Vec3 right = view.direction.cross(view.up);
  const Vec3 corner = view.centre - 0.46 * view.height * view.up -
                      0.46 * kPanelWidth * per_pixel * right - 5 * view.height * view.direction;
  const Vec3 thickness = 4 * per_pixel * view.up;
  const TriangleMesh strip{
      {corner, corner + bar * right, corner + bar * right + thickness, corner + thickness},
      {{0, 1, 2}, {0, 2, 3}}};
  auto actor = actor_for(strip, 0.1, 0.1, 0.1, 1.0);
  actor->GetProperty()->LightingOff();
  renderer->AddActor(actor);
  char text[40];
  std::snprintf(text, sizeof text, "%g mm", bar);
  label(renderer, text, static_cast<int>(0.04 * kPanelWidth),
        static_cast<int>(0.055 * kPanelHeight), 22);
}

TriangleMesh surface_of(const deployment::Setup& setup, const deployment::StentShape& stent) {
  if (const auto* mesh = std::get_if<TriangleMesh>(&stent)) return *mesh;
  return deployment::voxelised(stent, {*setup.specification.voxel_size, 3}).surface();
}

}  // namespace

View view_of(const deployment::Setup& setup) {
  const Polyline& axis = setup.placement.axis;
  View view;
  view.up = (axis.front() - axis.back()).normalized();
  Vec3 mean = Vec3::Zero();
  for (const Vec3& p : setup.placement.way.points) mean += p;
  mean /= static_cast<double>(setup.placement.way.points.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  Box box;
  for (const int v : setup.region.vertices)
    box.include(setup.surface.mesh.points[static_cast<std::size_t>(v)]);
  for (const Vec3& p : setup.placement.way.points) {
    Vec3 across = p - mean;
    across -= across.dot(view.up) * view.up;
    spread += across * across.transpose();
  }
  spread += 1e-6 * spread.trace() * Eigen::Matrix3d::Identity();
  // Of the directions across the axis, the way spreads widest along the last eigenvector: that one
  // lies in the picture.
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
  Vec3 sideways = solver.eigenvectors().col(2);
  if (spread.trace() < 1e-9) sideways = view.up.unitOrthogonal();
  view.direction = view.up.cross(sideways).normalized();
  view.centre = 0.5 * (box.lower + box.upper);
  double half_height = 0;
  double half_width = 0;
  for (const int v : setup.region.vertices) {
    const Vec3 offset = setup.surface.mesh.points[static_cast<std::size_t>(v)] - view.centre;
    half_height = std::max(half_height, std::abs(offset.dot(view.up)));
    half_width = std::max(half_width, std::abs(offset.dot(view.up.cross(view.direction))));
  }
  view.height = 2 * 1.12 * std::max(half_height, half_width * kPanelHeight / kPanelWidth);
  return view;
}

TriangleMesh stent_surface(const deployment::Setup& setup, const deployment::Outcome& outcome) {
  return surface_of(setup, outcome.stent);
}

void draw_panels(const View& view, std::span<const Panel> panels,
                 const std::filesystem::path& png) {
  const OffscreenDisplay display;
  if (!display.available()) {
    std::cerr << "warning: no picture: " << display.reason() << '\n';
    return;
  }
  const int count = static_cast<int>(panels.size());
  const int columns = std::min(count, kPanelsInARow);
  const int rows = (count + columns - 1) / columns;
  vtkNew<vtkRenderWindow> window;
  window->SetOffScreenRendering(1);
  window->SetSize(columns * kPanelWidth, rows * kPanelHeight);
  window->SetMultiSamples(0);
  window->SetAlphaBitPlanes(1);
  for (int k = 0; k < rows * columns; ++k) {
    const int column = k % columns, row = rows - 1 - k / columns;
    vtkNew<vtkRenderer> renderer;
    renderer->SetViewport(static_cast<double>(column) / columns, static_cast<double>(row) / rows,
                          static_cast<double>(column + 1) / columns,
                          static_cast<double>(row + 1) / rows);
    renderer->SetBackground(1, 1, 1);
    window->AddRenderer(renderer);
    if (k >= count) continue;
    const Panel& panel = panels[static_cast<std::size_t>(k)];
    renderer->SetUseDepthPeeling(1);
    renderer->SetMaximumNumberOfPeels(8);
    renderer->SetUseFXAA(true);
    renderer->AddActor(actor_for(panel.wall, 0.80, 0.36, 0.33, 0.42));
    renderer->AddActor(actor_for(panel.stent, 0.45, 0.52, 0.60, 1.0));
    label(renderer, panel.title, static_cast<int>(0.04 * kPanelWidth),
          static_cast<int>(0.94 * kPanelHeight), 30);
    scale_bar(renderer, view);
    if (k == count - 1) label(renderer, kDisclaimer, static_cast<int>(0.45 * kPanelWidth), 12, 16);
    aim(renderer, view);
  }
  window->Render();
  vtkNew<vtkWindowToImageFilter> image;
  image->SetInput(window);
  image->ReadFrontBufferOff();
  vtkNew<vtkPNGWriter> writer;
  writer->SetInputConnection(image->GetOutputPort());
  writer->WriteToMemoryOn();
  writer->Write();
  vtkUnsignedCharArray* bytes = writer->GetResult();
  vessels::write_whole(png, {reinterpret_cast<const char*>(bytes->GetPointer(0)),
                             static_cast<std::size_t>(bytes->GetNumberOfValues())});
}

void draw_stages(const deployment::Setup& setup, const deployment::Outcome& outcome,
                 std::span<const Vec3> midway, const std::filesystem::path& png) {
  const auto stent_at = [&](double expansion) {
    return surface_of(setup,
                      deployment::shape_of(setup, deployment::stent_state(setup, expansion)));
  };
  const TriangleMesh& before = setup.surface.mesh;
  std::vector<Panel> panels{{"before", before, stent_at(0)},
                            {"midway", before, stent_at(0.5)},
                            {"after", before, surface_of(setup, outcome.stent)}};
  for (std::size_t i = 0; i < midway.size(); ++i)
    panels[1].wall.points[static_cast<std::size_t>(setup.region.vertices[i])] = midway[i];
  panels[2].wall.points = outcome.positions;
  draw_panels(view_of(setup), panels, png);
}

}  // namespace vstent::apps

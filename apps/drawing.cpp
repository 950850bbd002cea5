#include "apps/drawing.hpp"

#include <vtkActor2D.h>
#include <vtkCamera.h>
#include <vtkCellArray.h>
#include <vtkPNGWriter.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkPolyDataNormals.h>
#include <vtkProperty.h>
#include <vtkRendererCollection.h>
#include <vtkTextProperty.h>
#include <vtkUnsignedCharArray.h>
#include <vtkWindowToImageFilter.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <cstdio>

#include "apps/commands.hpp"
#include "vessels/file_guard.hpp"

namespace vstent::apps {
namespace {

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
  auto actor = actor_for(strip, {0.1, 0.1, 0.1, 1.0});
  actor->GetProperty()->LightingOff();
  renderer->AddActor(actor);
  char text[40];
  std::snprintf(text, sizeof text, "%g mm", bar);
  label(renderer, text, static_cast<int>(0.04 * kPanelWidth),
        static_cast<int>(0.055 * kPanelHeight), 22);
}

}  // namespace

View view_across(const Polyline& axis, const Polyline& way, std::span<const Vec3> shown) {
  View view;
  view.up = (axis.front() - axis.back()).normalized();
  Vec3 mean = Vec3::Zero();
  for (const Vec3& p : way) mean += p;
  mean /= static_cast<double>(way.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Vec3& p : way) {
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
  Box box;
  for (const Vec3& p : shown) box.include(p);
  view.centre = 0.5 * (box.lower + box.upper);
  double half_height = 0;
  double half_width = 0;
  for (const Vec3& p : shown) {
    const Vec3 offset = p - view.centre;
    half_height = std::max(half_height, std::abs(offset.dot(view.up)));
    half_width = std::max(half_width, std::abs(offset.dot(view.up.cross(view.direction))));
  }
  view.height = 2 * 1.12 * std::max(half_height, half_width * kPanelHeight / kPanelWidth);
  return view;
}

vtkNew<vtkActor> actor_for(const TriangleMesh& mesh, const Look& look) {
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
  actor->GetProperty()->SetColor(look.red, look.green, look.blue);
  actor->GetProperty()->SetOpacity(look.opacity);
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
}

void caption(vtkTextActor* actor, int x, int y, int size) {
  actor->GetTextProperty()->SetFontSize(size);
  actor->GetTextProperty()->SetColor(0.1, 0.1, 0.1);
  actor->SetPosition(x, y);
}

void label(vtkRenderer* renderer, const std::string& text, int x, int y, int size) {
  vtkNew<vtkTextActor> actor;
  actor->SetInput(text.c_str());
  caption(actor, x, y, size);
  renderer->AddActor2D(actor);
}

void prepare(vtkRenderer* renderer) {
  renderer->SetBackground(1, 1, 1);
  renderer->SetUseDepthPeeling(1);
  renderer->SetMaximumNumberOfPeels(8);
  renderer->SetUseFXAA(true);
}

Panels::Panels(int panels)
    : panels_(panels), columns_(std::min(panels, 4)), rows_((panels + columns_ - 1) / columns_) {
  window_->SetOffScreenRendering(1);
  window_->SetSize(columns_ * kPanelWidth, rows_ * kPanelHeight);
  window_->SetMultiSamples(0);
  window_->SetAlphaBitPlanes(1);
}

vtkRenderer* Panels::add(const std::string& title, const View& view) {
  vtkNew<vtkRenderer> renderer;
  const int column = added_ % columns_, row = rows_ - 1 - added_ / columns_;
  renderer->SetViewport(static_cast<double>(column) / columns_, static_cast<double>(row) / rows_,
                        static_cast<double>(column + 1) / columns_,
                        static_cast<double>(row + 1) / rows_);
  prepare(renderer);
  label(renderer, title, static_cast<int>(0.04 * kPanelWidth),
        static_cast<int>(0.94 * kPanelHeight), 30);
  scale_bar(renderer, view);
  if (++added_ == panels_)
    label(renderer, kDisclaimer, static_cast<int>(0.45 * kPanelWidth), 12, 16);
  window_->AddRenderer(renderer);
  aim(renderer, view);
  return renderer;
}

void Panels::write_png(const std::filesystem::path& path) { write_window(window_, path); }

void write_window(vtkRenderWindow* window, const std::filesystem::path& path) {
  vtkRendererCollection* renderers = window->GetRenderers();
  renderers->InitTraversal();
  while (vtkRenderer* renderer = renderers->GetNextItem()) renderer->ResetCameraClippingRange();
  window->Render();
  vtkNew<vtkWindowToImageFilter> image;
  image->SetInput(window);
  image->ReadFrontBufferOff();
  vtkNew<vtkPNGWriter> writer;
  writer->SetInputConnection(image->GetOutputPort());
  writer->WriteToMemoryOn();
  writer->Write();
  vtkUnsignedCharArray* bytes = writer->GetResult();
  vessels::write_whole(path, {reinterpret_cast<const char*>(bytes->GetPointer(0)),
                              static_cast<std::size_t>(bytes->GetNumberOfValues())});
}

}  // namespace vstent::apps

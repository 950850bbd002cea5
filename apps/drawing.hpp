// Three-dimensional pictures in panels side by side, drawn off screen.
#pragma once

#include <vtkActor.h>
#include <vtkNew.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkTextActor.h>

#include <filesystem>
#include <span>
#include <string>

#include "sdf/geometry.hpp"

namespace vstent::apps {

inline constexpr int kPanelWidth = 640;
inline constexpr int kPanelHeight = 860;

/// Looking along `direction` with `up` upwards at `centre`, half `height` (mm) above and below it.
struct View {
  Vec3 centre, direction, up;
  double height = 0;
};

/// Across the plane in which `way` bends most, with `axis` (proximal to distal) upright from its
/// distal end, so that all `shown` points are in a panel.
View view_across(const Polyline& axis, const Polyline& way, std::span<const Vec3> shown);

struct Look {
  double red = 0, green = 0, blue = 0, opacity = 1;
};
inline constexpr Look kWallLook{0.80, 0.36, 0.33, 0.42};
inline constexpr Look kStentLook{0.45, 0.52, 0.60, 1.0};
inline constexpr Look kBeforeLook{0.45, 0.50, 0.55, 0.28};

vtkNew<vtkActor> actor_for(const TriangleMesh& mesh, const Look& look);
/// Dark text, its lower left corner at pixel (x, y).
void caption(vtkTextActor* actor, int x, int y, int size);
void label(vtkRenderer* renderer, const std::string& text, int x, int y, int size);

/// White, see-through surfaces in the right order.
void prepare(vtkRenderer* renderer);
void aim(vtkRenderer* renderer, const View& view);

/// Renders and writes a PNG. \throws Error (output)
void write_window(vtkRenderWindow* window, const std::filesystem::path& path);

/// `panels` beside each other in an off-screen window, four to a row.
class Panels {
 public:
  explicit Panels(int panels);
  /// The next panel, titled, with a bar to scale.
  vtkRenderer* add(const std::string& title, const View& view);
  /// With the disclaimer in the last panel. \throws Error (output)
  void write_png(const std::filesystem::path& path);

 private:
  int panels_ = 1, columns_ = 1, rows_ = 1, added_ = 0;
  vtkNew<vtkRenderWindow> window_;
};

}  // namespace vstent::apps

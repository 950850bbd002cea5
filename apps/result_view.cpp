#include "apps/result_view.hpp"

namespace vstent::apps {

View view_of(const report::ResultFiles& files) {
  std::vector<Vec3> moved;
  for (std::size_t v = 0; v < files.before.size(); ++v) {
    if (files.before[v] != files.after.points[v]) moved.push_back(files.after.points[v]);
  }
  if (moved.empty()) moved = files.after.points;
  Box box;
  for (const Vec3& p : files.stent.points.empty() ? moved : files.stent.points) box.include(p);
  // The line that runs farthest through the stent is its axis, nearly.
  Polyline axis;
  for (const Polyline& line : files.centerline) {
    Polyline inside;
    for (const Vec3& p : line) {
      if (box.squared_distance(p) == 0) inside.push_back(p);
    }
    if (inside.size() > axis.size()) axis = std::move(inside);
  }
  if (axis.size() < 2) axis = {box.upper, box.lower};
  return view_across(axis, axis, moved);
}

}  // namespace vstent::apps

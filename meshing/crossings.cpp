#include "meshing/crossings.hpp"

#include "vessels/check.hpp"
#include "vessels/error.hpp"
#include "vessels/text.hpp"

namespace vstent::meshing {

std::vector<Vec3> crossings(const TriangleMesh& mesh, std::span<const char> marked) {
  std::vector<Vec3> places;
  for (const auto& [first, second] : vessels::self_intersections(mesh, marked)) {
    Vec3 sum = Vec3::Zero();
    for (const int t : {first, second})
      for (const int p : mesh.triangles[static_cast<std::size_t>(t)])
        sum += mesh.points[static_cast<std::size_t>(p)];
    places.push_back(sum / 6);
  }
  return places;
}

void require_no_crossings(const TriangleMesh& mesh, vessels::LengthUnit unit,
                          const std::string& what, std::span<const char> marked) {
  const std::vector<Vec3> found = crossings(mesh, marked);
  if (found.empty()) return;
  std::string text;
  for (std::size_t i = 0; i < std::min<std::size_t>(3, found.size()); ++i)
    text += (i > 0 ? "; " : "") + vessels::place(found[i], unit);
  throw Error(ExitCode::geometry, what + ": " + vessels::counted(found.size(), "pair") +
                                      " of triangles cross or overlap at " + text +
                                      (found.size() > 3 ? "; ..." : "") +
                                      "; no mesher can fill this, repair the surface there");
}

}  // namespace vstent::meshing

#include "meshing/edited_region.hpp"

#include <algorithm>
#include <limits>

#include "meshing/edge_graph.hpp"
#include "vessels/error.hpp"
#include "vessels/file_arrays.hpp"

namespace vstent::meshing {

std::vector<char> edited_region(const vessels::Surface& stented, const Model& model,
                                double margin) {
  const vessels::Fields fields = vessels::vertex_fields(stented);
  const auto found = fields.find("Displacement");
  const std::size_t points = stented.mesh.points.size();
  if (found == fields.end() || found->second.size() != 3 * points) {
    throw Error(ExitCode::input_file,
                stented.path +
                    ": no point array Displacement that tells what a deployment moved; remesh the "
                    "whole surface, or give the stented.vtp of a result");
  }
  std::vector<double> way(points, std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < found->second.size(); ++i)
    if (found->second[i] != 0) way[i / 3] = 0;
  if (std::find(way.begin(), way.end(), 0.0) == way.end())
    throw Error(ExitCode::geometry, stented.path + ": Displacement is 0 everywhere: nothing moved");
  EdgeGraph(stented.mesh).spread(way, 1);
  std::vector<char> region(model.mesh.triangles.size(), 0);
  for (std::size_t t = 0; t < stented.mesh.triangles.size(); ++t) {
    const Triangle& corners = stented.mesh.triangles[t];
    region[t] = std::any_of(corners.begin(), corners.end(),
                            [&](int p) { return way[static_cast<std::size_t>(p)] <= margin; });
  }
  return region;
}

}  // namespace vstent::meshing

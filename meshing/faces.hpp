// From a lumen surface to a model: openings capped, caps found, every face with an id and a name.
#pragma once

#include <filesystem>
#include <map>
#include <optional>

#include "meshing/model.hpp"
#include "vessels/surface.hpp"

namespace vstent::meshing {

/// Where names come from; the first that names a face wins: `names`, `files`, generated ones. Those
/// are `wall` (`wall_<id>` where there are several), `inlet`, `outlet1`, ... by falling width.
struct FaceNames {
  std::map<int, std::string> names = {};  ///< by ModelFaceID
  /// Surface files of one face each, named by their stems.
  std::vector<std::filesystem::path> files = {};
  std::optional<Vec3> inlet = {};  ///< mm; near the inlet's cap. Default: the widest
  bool flatten_rims = false;       ///< move uneven rims into their plane before capping
};

/// All surface files (.vtp .vtk .stl .obj) of a folder such as SimVascular's `mesh-surfaces`,
/// sorted. \throws Error (input_file) when it has none
std::vector<std::filesystem::path> face_files(const std::filesystem::path& folder);

/// {"1": "wall", "2": "inlet"}. \throws Error (input_file) naming the key
std::map<int, std::string> read_face_names(const std::filesystem::path& json);

struct NamedModel {
  Model model;  ///< the surface's points and triangles first, as they were; then caps
  std::vector<std::string> notes;  ///< what was capped, filled, chosen; one line each
};

/// ModelFaceIDs are kept; caps without an id of their own are recognised
/// (vessels::find_lumen_ends), openings are capped, holes filled as part of the wall around them.
/// \throws Error (geometry) for surfaces with errors, rims that cannot be capped, files or names
/// that fit no face or the same face, and caps without a file where files name the others
NamedModel model_of(const vessels::Surface& surface, const FaceNames& names = {});

}  // namespace vstent::meshing

// Which face of a model is the surface in a file?
#pragma once

#include <filesystem>
#include <map>

#include "meshing/model.hpp"
#include "vessels/units.hpp"

namespace vstent::meshing {

/// The stem of the file that lies on each face, by id. Faces are matched by place. Several files on
/// one wall divide it among them, each triangle going to the nearest file; `model` then has more
/// faces.
/// \throws Error (input_file) for a file that is no surface; (geometry) for one that lies on no
/// face, on several, or on a cap that another file lies on
std::map<int, std::string> names_from_files(Model& model,
                                            const std::vector<std::filesystem::path>& files,
                                            vessels::LengthUnit unit);

}  // namespace vstent::meshing

// What files carry beside a lumen surface: its fields, polylines, pieces of surfaces.
#pragma once

#include "vessels/surface.hpp"

namespace vstent::vessels {

/// The numeric arrays (1 or 3 components) of the file that `surface` was read from, per vertex of
/// its mesh; a vertex welded from several points takes the first one's values. Values are as
/// written.
Fields vertex_fields(const Surface& surface);

/// The same per triangle of the mesh.
Fields triangle_fields(const Surface& surface);

/// A piece of a surface by itself, such as a cap, in mm; of any size, its polygons as fans.
/// .vtp, .vtk or .stl. \throws Error (input_file)
TriangleMesh read_patch(const std::filesystem::path& path, LengthUnit unit);

struct PolylineFile {
  std::vector<Polyline> lines;  ///< mm
  Fields line_arrays;           ///< one value per line; others are left out
};

/// \throws Error (input_file)
PolylineFile read_polylines(const std::filesystem::path& path, LengthUnit unit);

}  // namespace vstent::vessels

// Lumen surfaces: read with every array they carry, checked, oriented, and written back whole.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "sdf/geometry.hpp"
#include "vessels/units.hpp"

namespace vstent::vessels {

/// One defect of a surface that was repaired on reading, or noticed and left; `text` has counts and places.
struct Finding {
  enum class Severity { note, repaired, warning, error };
  Severity severity = Severity::note;
  std::string kind;  ///< machine-readable: "orientation", "self-intersection", "non-manifold-edge", ...
  std::string text;  ///< one line for a person
  std::size_t count = 0;
};

/// What the file held, kept aside untouched (VTK's data set); surface.cpp alone looks inside.
struct SourceData;

/// A checked lumen surface. `mesh` is welded, triangulated and outward oriented, in millimetres; the source keeps the
/// file's own points, cells and arrays so that write_surface can put results back into them.
struct Surface {
  TriangleMesh mesh;
  LengthUnit unit = LengthUnit::mm;   ///< of the file
  std::string path;                   ///< as the user named it
  std::vector<int> face_of_triangle;  ///< ModelFaceID per triangle (CapID where that is all there is); empty when absent
  std::vector<Finding> findings;
  std::shared_ptr<const SourceData> source;
};

/// Reads .vtp .vtk .stl .obj. The file is checked before VTK sees it, parsed first in a child process that may crash
/// without harm, VTK's messages are failures, and the arrays are validated after. Repairs what is harmless (coincident
/// STL points, mixed or inward orientation, polygons, repeated-index triangles) and says so in `findings`; defects that
/// make stenting impossible are findings of severity `error` (see check.hpp), not exceptions.
/// \throws Error (input_file) one line naming the file and what is wrong with it
Surface read_surface(const std::filesystem::path& path, LengthUnit unit);

/// Wraps a generated mesh (mm) so that it can be written like one that was read.
Surface make_surface(TriangleMesh mesh, std::string name);

/// Extra arrays for the written file, per mesh vertex or per mesh triangle; 1 or 3 components by size.
using Fields = std::map<std::string, std::vector<double>>;

/// Writes .vtp or .stl (by extension) with the points of `surface` where `moved` is false bit-identical to the file
/// that was read, and all its arrays untouched; moved vertices take `points` (mm), converted to the file's unit and
/// precision. Goes through a temporary name, is read back and compared, then renamed.
/// \throws Error (output)
void write_surface(const Surface& surface, std::span<const Vec3> points, std::span<const char> moved,
                   const std::filesystem::path& path, const Fields& vertex_fields = {},
                   const Fields& triangle_fields = {});

/// Writes polylines with a radius per point (and further arrays) as .vtp, the same way. Coordinates are multiplied by
/// `scale` (1 / millimetres_per(unit) for a file in that unit); so are arrays named *Radius*.
void write_polylines(const std::vector<Polyline>& lines, const std::map<std::string, std::vector<double>>& point_arrays,
                     const std::map<std::string, std::vector<int>>& line_arrays, const std::filesystem::path& path,
                     double scale = 1.0);

}  // namespace vstent::vessels

// Triangles and tetrahedra with whole-number arrays, as flow solvers read them.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "sdf/geometry.hpp"

namespace vstent::vessels {

/// Arrays of Int32 by name, written in this order; the first of each kind is the active scalar.
using IdArrays = std::vector<std::pair<std::string, std::vector<int>>>;

/// Triangles as .vtp, coordinates as they are (Float64). Goes through a temporary name, is read
/// back and compared, then renamed. \throws Error (output, resources)
void write_triangles(const TriangleMesh& mesh, const IdArrays& of_points,
                     const IdArrays& of_triangles, const std::filesystem::path& path);

/// Tetrahedra as .vtu, the same way.
void write_tetrahedra(const std::vector<Vec3>& points,
                      const std::vector<std::array<int, 4>>& tetrahedra, const IdArrays& of_points,
                      const IdArrays& of_tetrahedra, const std::filesystem::path& path);

}  // namespace vstent::vessels

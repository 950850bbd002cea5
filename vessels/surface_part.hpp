// Caps and other pieces of a surface in files of their own.
#pragma once

#include "vessels/surface.hpp"

namespace vstent::vessels {

/// read_surface for a piece of a vessel, which may be smaller than any vessel.
/// \throws Error (input_file)
Surface read_surface_part(const std::filesystem::path& path, LengthUnit unit);

}  // namespace vstent::vessels

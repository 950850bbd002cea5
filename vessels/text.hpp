// Numbers and places as messages print them.
#pragma once

#include <string>

#include "sdf/geometry.hpp"
#include "vessels/units.hpp"

namespace vstent::vessels {

std::string number(double value);                       ///< six significant digits
std::string mm(double value);                           ///< "2.5 mm"
std::string exact(double value);                        ///< the shortest that reads back the same
std::string place(const Vec3& point);                   ///< "(1, 2.5, 3)"
std::string place(const Vec3& point, LengthUnit unit);  ///< "(10, 25, 30) mm = (1, 2.5, 3) cm"
std::string counted(std::size_t count, const std::string& noun);  ///< "1 triangle", "3 triangles"

}  // namespace vstent::vessels

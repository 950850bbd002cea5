#include "vessels/text.hpp"

#include <charconv>
#include <cstdio>

namespace vstent::vessels {

std::string number(double value) {
  char buffer[40];
  std::snprintf(buffer, sizeof buffer, "%.6g", value);
  for (char& c : buffer) {
    if (c == '\0') break;
    if (c == ',') c = '.';  // the decimal point does not depend on the locale
  }
  return buffer;
}

std::string mm(double value) { return number(value) + " mm"; }

std::string exact(double value) {
  char buffer[40];
  return {buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr};
}

std::string place(const Vec3& point) {
  std::string text = "(";
  text += number(point.x()) + ", ";
  text += number(point.y()) + ", ";
  text += number(point.z()) + ")";
  return text;
}

std::string place(const Vec3& point, LengthUnit unit) {
  std::string text = place(point) + " mm";
  if (unit != LengthUnit::mm)
    text += " = " + place(point / millimetres_per(unit)) + " " + std::string(name(unit));
  return text;
}

std::string counted(std::size_t count, const std::string& noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

}  // namespace vstent::vessels

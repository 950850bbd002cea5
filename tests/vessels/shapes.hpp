// Generated meshes, and files written into a folder of their own, for the vessel tests.
#pragma once

#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <numbers>
#include <sstream>
#include <string>

#include "sdf/geometry.hpp"

namespace vstent::tests {

/// An open tube along z, outward oriented: `around` x (`rings` - 1) x 2 triangles.
inline TriangleMesh tube(double radius, double length, int around, int rings) {
  TriangleMesh mesh;
  for (int i = 0; i < rings; ++i) {
    for (int j = 0; j < around; ++j) {
      const double angle = 2 * std::numbers::pi * j / around;
      mesh.points.emplace_back(radius * std::cos(angle), radius * std::sin(angle),
                               length * i / (rings - 1));
    }
  }
  for (int i = 0; i + 1 < rings; ++i) {
    for (int j = 0; j < around; ++j) {
      const int a = i * around + j, b = i * around + (j + 1) % around;
      mesh.triangles.push_back({a, b, b + around});
      mesh.triangles.push_back({a, b + around, a + around});
    }
  }
  return mesh;
}

/// Turns every `step`-th triangle.
inline TriangleMesh turned(TriangleMesh mesh, std::size_t step) {
  for (std::size_t t = 0; t < mesh.triangles.size(); t += step)
    std::swap(mesh.triangles[t][1], mesh.triangles[t][2]);
  return mesh;
}

inline std::string vtp_text(const TriangleMesh& mesh, const std::string& cell_data = "",
                            const std::string& point_data = "") {
  std::ostringstream text;
  text << std::setprecision(17);
  text << "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"0.1\" "
          "byte_order=\"LittleEndian\">\n<PolyData>\n"
       << "<Piece NumberOfPoints=\"" << mesh.points.size()
       << "\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\""
       << mesh.triangles.size() << "\">\n<PointData>" << point_data << "</PointData>\n<CellData>"
       << cell_data
       << "</CellData>\n<Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" "
          "format=\"ascii\">\n";
  for (const Vec3& x : mesh.points) text << x.x() << ' ' << x.y() << ' ' << x.z() << '\n';
  text << "</DataArray></Points>\n<Polys><DataArray type=\"Int64\" Name=\"connectivity\" "
          "format=\"ascii\">\n";
  for (const Triangle& t : mesh.triangles) text << t[0] << ' ' << t[1] << ' ' << t[2] << '\n';
  text << "</DataArray>\n<DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">\n";
  for (std::size_t t = 1; t <= mesh.triangles.size(); ++t) text << 3 * t << '\n';
  text << "</DataArray></Polys>\n</Piece>\n</PolyData>\n</VTKFile>\n";
  return text.str();
}

inline std::string obj_text(const TriangleMesh& mesh) {
  std::ostringstream text;
  text << std::setprecision(17);
  for (const Vec3& x : mesh.points) text << "v " << x.x() << ' ' << x.y() << ' ' << x.z() << '\n';
  for (const Triangle& t : mesh.triangles)
    text << "f " << t[0] + 1 << ' ' << t[1] + 1 << ' ' << t[2] + 1 << '\n';
  return text.str();
}

inline std::string replaced(std::string text, const std::string& what, const std::string& with) {
  const std::size_t at = text.find(what);
  if (at == std::string::npos) throw std::logic_error("no \"" + what + "\" to replace");
  return text.replace(at, what.size(), with);
}

inline std::string file_bytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// A folder that lives as long as this object.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    static int count = 0;
    path_ = std::filesystem::temp_directory_path() /
            ("vstent test " + std::to_string(::getpid()) + "-" + std::to_string(count++));
    std::filesystem::create_directories(path_);
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::permissions(path_, std::filesystem::perms::owner_all, ignored);
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  std::filesystem::path write(const std::string& name, const std::string& bytes) const {
    std::ofstream(path_ / name, std::ios::binary) << bytes;
    return path_ / name;
  }
  std::size_t entries() const {
    return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(path_), {}));
  }

 private:
  std::filesystem::path path_;
};

}  // namespace vstent::tests

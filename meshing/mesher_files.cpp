#include "meshing/mesher_files.hpp"

#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <unordered_map>

#include "vessels/error.hpp"
#include "vessels/file_guard.hpp"
#include "vessels/text.hpp"

namespace vstent::meshing {
namespace {

Error nonsense(const std::filesystem::path& path, const std::string& what) {
  return Error(ExitCode::numerical, path.string() + ": the mesher wrote nonsense: " + what);
}

void append_point(std::string& text, const Vec3& x) {
  char line[100];
  std::snprintf(line, sizeof line, " %.17g %.17g %.17g\n", x.x(), x.y(), x.z());
  text += line;
}

void append_corners(std::string& text, const Triangle& t, int first) {
  char line[60];
  std::snprintf(line, sizeof line, " %d %d %d\n", t[0] + first, t[1] + first, t[2] + first);
  text += line;
}

std::string bytes_of(const std::filesystem::path& path) {
  try {
    return vessels::read_bytes(path);
  } catch (const Error& error) {
    throw Error(ExitCode::numerical, std::string("the mesher left no mesh: ") + error.what());
  }
}

/// The bytes of a binary MSH file, taken piece by piece.
class MshBytes {
 public:
  MshBytes(std::string bytes, const std::filesystem::path& path)
      : bytes_(std::move(bytes)), path_(path) {}

  template <class Number>
  Number take() {
    if (bytes_.size() - at_ < sizeof(Number)) throw nonsense(path_, "it ends early");
    Number value;
    std::memcpy(&value, bytes_.data() + at_, sizeof value);
    at_ += sizeof value;
    return value;
  }
  std::string line() {
    const std::size_t end = bytes_.find('\n', at_);
    if (end == std::string::npos) throw nonsense(path_, "it ends early");
    std::string result = bytes_.substr(at_, std::min<std::size_t>(end - at_, 200));
    at_ = end + 1;
    return result;
  }
  /// Moves behind the next line that reads `title`.
  void find(const std::string& title) {
    const std::size_t found = bytes_.find("\n" + title + "\n", at_ == 0 ? 0 : at_ - 1);
    if (found == std::string::npos) throw nonsense(path_, "it has no " + title);
    at_ = found + title.size() + 2;
  }
  /// A line with a count of things of at least `size` bytes each.
  std::size_t count(std::size_t size) {
    const std::string text = line();
    std::size_t value = 0;
    const auto [end, fault] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (fault != std::errc() || end != text.data() + text.size() || value > bytes_.size() / size)
      throw nonsense(path_, "\"" + text + "\" is not a count");
    return value;
  }

 private:
  std::string bytes_;
  std::filesystem::path path_;
  std::size_t at_ = 0;
};

/// Points and tetrahedra in the numbering of the mesher, brought to that of the surface.
class Renumbering {
 public:
  Renumbering(const TriangleMesh& surface, const std::filesystem::path& path) : path_(path) {
    mesh_.points = surface.points;
    for (std::size_t i = 0; i < surface.points.size(); ++i)
      on_surface_.emplace(key(surface.points[i]), static_cast<int>(i));
    if (on_surface_.size() != surface.points.size())
      throw std::invalid_argument("surface with coincident points");
  }
  void add_point(int tag, const Vec3& x) {
    const auto found = on_surface_.find(key(x));
    int number = 0;
    if (found != on_surface_.end()) {
      number = found->second;
    } else {
      number = static_cast<int>(mesh_.points.size());
      mesh_.points.push_back(x);
    }
    if (!number_of_.emplace(tag, number).second)
      throw nonsense(path_, "two nodes are called " + std::to_string(tag));
  }
  void add_tetrahedron(const std::array<int, 4>& tags) {
    Tetrahedron t{};
    for (std::size_t k = 0; k < 4; ++k) {
      const auto found = number_of_.find(tags[k]);
      if (found == number_of_.end())
        throw nonsense(path_, "a tetrahedron names node " + std::to_string(tags[k]) +
                                  ", which it does not have");
      t[k] = found->second;
    }
    mesh_.tetrahedra.push_back(t);
  }
  TetMesh finished() { return std::move(mesh_); }

 private:
  using Key = std::array<std::uint64_t, 3>;
  struct Hash {
    std::size_t operator()(const Key& k) const {
      std::uint64_t h = 0;
      for (const std::uint64_t part : k) h = (h ^ part ^ (h >> 29)) * 0x9E3779B97F4A7C15ULL;
      return static_cast<std::size_t>(h ^ (h >> 32));
    }
  };
  static Key key(const Vec3& x) {
    const std::array<double, 3> values = {x.x() + 0.0, x.y() + 0.0, x.z() + 0.0};  // -0 is 0
    Key result{};
    std::memcpy(result.data(), values.data(), sizeof values);
    return result;
  }
  std::filesystem::path path_;
  TetMesh mesh_;
  std::unordered_map<Key, int, Hash> on_surface_;
  std::unordered_map<int, int> number_of_;
};

/// Numbers from text; '#' begins a comment that ends with its line.
class Numbers {
 public:
  explicit Numbers(const std::filesystem::path& path) : bytes_(bytes_of(path)), path_(path) {}

  template <class Number>
  Number next() {
    skip();
    Number value{};
    const char* end = bytes_.data() + bytes_.size();
    const auto [stop, fault] = std::from_chars(bytes_.data() + at_, end, value);
    if (fault != std::errc())
      throw nonsense(path_, at_ < bytes_.size()
                                ? "a number is expected at byte " + std::to_string(at_)
                                : "it ends early");
    at_ = static_cast<std::size_t>(stop - bytes_.data());
    return value;
  }
  std::size_t count() {
    const int value = next<int>();
    if (value < 0 || static_cast<std::size_t>(value) > bytes_.size())
      throw nonsense(path_, std::to_string(value) + " is not a count");
    return static_cast<std::size_t>(value);
  }

 private:
  void skip() {
    while (at_ < bytes_.size()) {
      const char c = bytes_[at_];
      if (c == '#') {
        at_ = std::min(bytes_.find('\n', at_), bytes_.size());
      } else if (c == ' ' || c == '\t' || c == '\n' || c == '\r') {
        ++at_;
      } else {
        return;
      }
    }
  }
  std::string bytes_;
  std::filesystem::path path_;
  std::size_t at_ = 0;
};

}  // namespace

std::string msh_text(const TriangleMesh& surface) {
  std::string text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n";
  text += std::to_string(surface.points.size()) + "\n";
  for (std::size_t i = 0; i < surface.points.size(); ++i) {
    text += std::to_string(i + 1);
    append_point(text, surface.points[i]);
  }
  text += "$EndNodes\n$Elements\n" + std::to_string(surface.triangles.size()) + "\n";
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    text += std::to_string(t + 1);
    text += " 2 2 1 1";
    append_corners(text, surface.triangles[t], 1);
  }
  return text + "$EndElements\n";
}

TetMesh read_msh(const std::filesystem::path& path, const TriangleMesh& surface) {
  constexpr int kTetrahedron = 4;
  const auto nodes_of = [&](int type) {  // MSH element types of first order
    switch (type) {
      case 15:
        return 1;
      case 1:
        return 2;
      case 2:
        return 3;
      case kTetrahedron:
        return 4;
      default:
        throw nonsense(path, "it has elements of type " + std::to_string(type));
    }
  };
  MshBytes file(bytes_of(path), path);
  if (file.line() != "$MeshFormat") throw nonsense(path, "it is no MSH file");
  if (const std::string format = file.line(); format != "2.2 1 8")
    throw nonsense(path, "its format is " + format + ", not 2.2 1 8");
  if (file.take<std::int32_t>() != 1) throw nonsense(path, "its bytes are swapped");
  file.find("$Nodes");
  Renumbering renumbering(surface, path);
  for (std::size_t left = file.count(28); left > 0; --left) {
    const auto tag = file.take<std::int32_t>();
    const double x = file.take<double>(), y = file.take<double>(), z = file.take<double>();
    renumbering.add_point(tag, {x, y, z});
  }
  file.find("$Elements");
  for (std::size_t left = file.count(8); left > 0;) {
    const auto type = file.take<std::int32_t>();
    const auto count = file.take<std::int32_t>();
    const auto tags = file.take<std::int32_t>();
    if (count < 1 || static_cast<std::size_t>(count) > left || tags < 0 || tags > 100)
      throw nonsense(path, "a block of " + std::to_string(count) + " elements with " +
                               std::to_string(tags) + " tags");
    const int nodes = nodes_of(type);
    for (int i = 0; i < count; ++i) {
      for (int k = 0; k < 1 + tags; ++k) file.take<std::int32_t>();
      std::array<int, 4> corners{};
      for (int k = 0; k < nodes; ++k)
        corners[static_cast<std::size_t>(k)] = file.take<std::int32_t>();
      if (type == kTetrahedron) renumbering.add_tetrahedron(corners);
    }
    left -= static_cast<std::size_t>(count);
  }
  return renumbering.finished();
}

std::string smesh_text(const TriangleMesh& surface) {
  std::string text = std::to_string(surface.points.size()) + " 3 0 0\n";
  for (std::size_t i = 0; i < surface.points.size(); ++i) {
    text += std::to_string(i);
    append_point(text, surface.points[i]);
  }
  text += std::to_string(surface.triangles.size()) + " 0\n";
  for (const Triangle& t : surface.triangles) {
    text += "3";
    append_corners(text, t, 0);
  }
  return text + "0\n0\n";
}

TetMesh read_tetgen(const std::filesystem::path& stem, const TriangleMesh& surface) {
  TetMesh mesh;
  const std::filesystem::path nodes = stem.string() + ".node", cells = stem.string() + ".ele";
  Numbers node_file(nodes);
  const std::size_t points = node_file.count();
  if (node_file.count() != 3) throw nonsense(nodes, "its points have not three coordinates");
  const std::size_t attributes = node_file.count(), markers = node_file.count();
  if (points < surface.points.size()) throw nonsense(nodes, "points of the surface are missing");
  mesh.points.reserve(points);
  for (std::size_t i = 0; i < points; ++i) {
    if (node_file.next<int>() != static_cast<int>(i))
      throw nonsense(nodes, "its points are not numbered from 0");
    Vec3 x;
    for (int k = 0; k < 3; ++k) x[k] = node_file.next<double>();
    for (std::size_t k = 0; k < attributes + markers; ++k) node_file.next<double>();
    if (i < surface.points.size()) {  // sixteen digits of the same number
      const Vec3& own = surface.points[i];
      if (!((x - own).norm() <= 1e-14 * (1 + own.norm())))
        throw nonsense(nodes, "point " + std::to_string(i) + " is at " + vessels::place(x) +
                                  " and was at " + vessels::place(own));
      x = own;
    }
    mesh.points.push_back(x);
  }
  Numbers cell_file(cells);
  const std::size_t count = cell_file.count();
  if (cell_file.count() != 4) throw nonsense(cells, "its elements have not four corners");
  const std::size_t regions = cell_file.count();
  mesh.tetrahedra.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    cell_file.next<int>();
    Tetrahedron t{};
    for (int& corner : t) {
      corner = cell_file.next<int>();
      if (corner < 0 || static_cast<std::size_t>(corner) >= points)
        throw nonsense(cells, "a tetrahedron names point " + std::to_string(corner));
    }
    for (std::size_t k = 0; k < regions; ++k) cell_file.next<double>();
    mesh.tetrahedra.push_back(t);
  }
  return mesh;
}

}  // namespace vstent::meshing

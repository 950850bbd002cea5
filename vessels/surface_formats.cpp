#include <vtkCellArray.h>
#include <vtkDoubleArray.h>
#include <vtkFloatArray.h>
#include <vtkNew.h>
#include <vtkPoints.h>

#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <unordered_map>

#include "vessels/error.hpp"
#include "vessels/polydata.hpp"
#include "vessels/text.hpp"

namespace vstent::vessels {
namespace {

constexpr double kBeyondAnyLength = 1e30;

struct CoordinateHash {
  template <class Real>
  std::size_t operator()(const std::array<Real, 3>& x) const {
    std::size_t hash = 0;
    for (const Real value : x) hash = hash * 0x9E3779B97F4A7C15ULL + std::hash<Real>()(value);
    return hash ^ (hash >> 29);
  }
};

// Points that are equal become one, in order of first use.
template <class Real>
class Welder {
 public:
  int add(const std::array<Real, 3>& x) {
    ++corners_;
    const auto [found, fresh] = index_.try_emplace(x, static_cast<int>(points_.size()));
    if (fresh) points_.push_back(x);
    return found->second;
  }
  std::size_t merged() const { return corners_ - points_.size(); }
  const std::vector<std::array<Real, 3>>& points() const { return points_; }

 private:
  std::unordered_map<std::array<Real, 3>, int, CoordinateHash> index_;
  std::vector<std::array<Real, 3>> points_;
  std::size_t corners_ = 0;
};

template <class Real>
vtkSmartPointer<vtkPoints> vtk_points(const std::vector<std::array<Real, 3>>& points) {
  auto result = vtkSmartPointer<vtkPoints>::New();
  result->SetDataType(sizeof(Real) == 4 ? VTK_FLOAT : VTK_DOUBLE);
  result->SetNumberOfPoints(static_cast<vtkIdType>(points.size()));
  if (!points.empty()) {
    std::memcpy(result->GetData()->GetVoidPointer(0), points.data(),
                points.size() * sizeof(points[0]));
  }
  return result;
}

vtkSmartPointer<vtkPolyData> assemble(vtkPoints* points,
                                      const std::vector<std::vector<int>>& polygons) {
  vtkNew<vtkCellArray> cells;
  for (const std::vector<int>& polygon : polygons) {
    cells->InsertNextCell(static_cast<int>(polygon.size()));
    for (const int id : polygon) cells->InsertCellPoint(id);
  }
  auto data = vtkSmartPointer<vtkPolyData>::New();
  data->SetPoints(points);
  data->SetPolys(cells);
  return data;
}

/// Words of a text file, with the line they stand on.
class Words {
 public:
  Words(std::string_view text, std::string name) : rest_(text), name_(std::move(name)) {}

  std::string_view next() {
    skip_blanks(true);
    return take();
  }
  /// The next word on this line; empty at its end.
  std::string_view next_on_line() {
    skip_blanks(false);
    return rest_.empty() || rest_.front() == '\n' ? std::string_view() : take();
  }
  void skip_line() {
    const std::size_t end = std::min(rest_.find('\n'), rest_.size());
    rest_.remove_prefix(end);
  }
  double coordinate(std::string_view word) {
    if (word.empty())
      throw fault(rest_.empty() ? "it ends where a coordinate belongs: truncated"
                                : "a coordinate is missing");
    std::string_view digits = word;
    if (digits.front() == '+') digits.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    const bool whole = end == digits.data() + digits.size() && error != std::errc::invalid_argument;
    if (!whole) throw fault("\"" + std::string(word.substr(0, 40)) + "\" is not a number");
    if (error == std::errc::result_out_of_range && std::abs(value) < 1)
      value = 0;  // smaller than a double can be
    if (!std::isfinite(value) || std::abs(value) > kBeyondAnyLength || error != std::errc()) {
      throw fault("coordinate " + std::string(word.substr(0, 40)) + " is not a finite position");
    }
    return value;
  }
  Error fault(const std::string& what) const {
    return Error(ExitCode::input_file, name_ + ":" + std::to_string(line_) + ": " + what);
  }
  bool at_end() {
    skip_blanks(true);
    return rest_.empty();
  }
  int line() const { return line_; }

 private:
  void skip_blanks(bool lines_too) {
    while (!rest_.empty()) {
      const char c = rest_.front();
      if (c != ' ' && c != '\t' && c != '\r' && c != '\f' && !(lines_too && c == '\n')) break;
      if (c == '\n') ++line_;
      rest_.remove_prefix(1);
    }
  }
  std::string_view take() {
    std::size_t size = 0;
    while (size < rest_.size() && std::strchr(" \t\r\n\f", rest_[size]) == nullptr) ++size;
    if (size < rest_.size() && rest_[size] == '\0')
      throw fault("it holds zero bytes: not a text file");
    const std::string_view word = rest_.substr(0, size);
    rest_.remove_prefix(size);
    return word;
  }

  std::string_view rest_;
  std::string name_;
  int line_ = 1;
};

vtkSmartPointer<vtkPolyData> parse_binary_stl(std::string_view bytes, const std::string& name,
                                              std::size_t count, std::size_t& merged) {
  Welder<float> welder;
  std::vector<std::vector<int>> triangles(count, std::vector<int>(3));
  for (std::size_t t = 0; t < count; ++t) {
    std::array<float, 9> corners{};
    std::memcpy(corners.data(), bytes.data() + 84 + 50 * t + 12, sizeof corners);
    for (std::size_t k = 0; k < 3; ++k) {
      const std::array<float, 3> x = {corners[3 * k], corners[3 * k + 1], corners[3 * k + 2]};
      for (const float value : x) {
        if (std::isfinite(value) && std::abs(value) < static_cast<float>(kBeyondAnyLength))
          continue;
        throw Error(ExitCode::input_file,
                    name + ": corner " + std::to_string(k) + " of triangle " + std::to_string(t) +
                        " is " + place(Vec3(x[0], x[1], x[2])) + ", not a finite position");
      }
      triangles[t][k] = welder.add(x);
    }
  }
  merged = welder.merged();
  return assemble(vtk_points(welder.points()), triangles);
}

vtkSmartPointer<vtkPolyData> parse_ascii_stl(std::string_view bytes, const std::string& name,
                                             std::size_t& merged) {
  Words words(bytes, name);
  Welder<double> welder;
  std::vector<std::vector<int>> triangles;
  const auto expect = [&](std::string_view wanted) {
    if (words.at_end())
      throw words.fault("it ends where \"" + std::string(wanted) + "\" belongs: truncated");
    if (const std::string_view word = words.next(); word != wanted) {
      throw words.fault("\"" + std::string(word.substr(0, 40)) + "\" where \"" +
                        std::string(wanted) + "\" belongs");
    }
  };
  while (!words.at_end()) {
    expect("solid");
    words.skip_line();
    while (true) {
      if (words.at_end()) throw words.fault("it ends before \"endsolid\": truncated");
      const std::string_view word = words.next();
      if (word == "endsolid") break;
      if (word != "facet")
        throw words.fault("\"" + std::string(word.substr(0, 40)) + "\" where \"facet\" belongs");
      expect("normal");
      for (int k = 0; k < 3; ++k) {
        if (words.next().empty())
          throw words.fault("it ends within a normal: truncated");  // never used, often NaN
      }
      expect("outer");
      expect("loop");
      std::vector<int> triangle;
      for (int k = 0; k < 3; ++k) {
        expect("vertex");
        std::array<double, 3> x{};
        for (double& value : x) value = words.coordinate(words.next());
        triangle.push_back(welder.add(x));
      }
      expect("endloop");
      expect("endfacet");
      triangles.push_back(std::move(triangle));
    }
    words.skip_line();
  }
  if (triangles.empty()) throw Error(ExitCode::input_file, name + ": it has no triangles");
  merged = welder.merged();
  return assemble(vtk_points(welder.points()), triangles);
}

}  // namespace

vtkSmartPointer<vtkPolyData> parse_stl(std::string_view bytes, const std::string& name,
                                       std::size_t& merged_points) {
  std::uint32_t count = 0;
  if (bytes.size() >= 84) std::memcpy(&count, bytes.data() + 80, sizeof count);
  const std::size_t promised = 84 + 50 * static_cast<std::size_t>(count);
  if (bytes.size() >= 84 && bytes.size() == promised) {
    if (count == 0) throw Error(ExitCode::input_file, name + ": it has no triangles");
    return parse_binary_stl(bytes, name, count, merged_points);
  }
  const bool text = bytes.substr(0, std::min<std::size_t>(bytes.size(), 1000)).find('\0') ==
                    std::string_view::npos;
  if (text && bytes.starts_with("solid")) return parse_ascii_stl(bytes, name, merged_points);
  if (text && bytes.substr(0, 200).find('<') != std::string_view::npos) {
    throw Error(ExitCode::input_file, name + ": it is a web page or XML, not an STL file");
  }
  if (bytes.size() < 84) {
    throw Error(ExitCode::input_file,
                name + ": " + std::to_string(bytes.size()) + " bytes are no STL file");
  }
  throw Error(ExitCode::input_file, name + ": its header promises " + std::to_string(count) +
                                        " triangles (" + std::to_string(promised) +
                                        " bytes) but it has " + std::to_string(bytes.size()) +
                                        " bytes: damaged or truncated");
}

vtkSmartPointer<vtkPolyData> parse_obj(std::string_view bytes, const std::string& name,
                                       std::vector<Finding>& findings) {
  Words words(bytes, name);
  std::vector<std::array<double, 3>> points;
  std::vector<std::vector<int>> polygons;
  std::vector<int> line_of_polygon;
  std::size_t ignored = 0;
  while (!words.at_end()) {
    const std::string_view key = words.next();
    if (key == "v") {
      std::array<double, 3> x{};
      for (double& value : x) value = words.coordinate(words.next_on_line());
      points.push_back(x);
    } else if (key == "f") {
      std::vector<int> polygon;
      for (std::string_view word = words.next_on_line(); !word.empty() && word.front() != '#';
           word = words.next_on_line()) {
        const std::string_view digits = word.substr(0, word.find('/'));
        long long id = 0;
        const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), id);
        if (error != std::errc() || end != digits.data() + digits.size() || id == 0) {
          throw words.fault("\"" + std::string(word.substr(0, 40)) + "\" is not a vertex number");
        }
        const auto known = static_cast<long long>(points.size());
        if (id < -known || id > 2147483647)
          throw words.fault("vertex " + std::to_string(id) + " does not exist");
        polygon.push_back(static_cast<int>(id < 0 ? known + id : id - 1));
      }
      if (polygon.size() < 3) throw words.fault("a face of " + counted(polygon.size(), "corner"));
      polygons.push_back(std::move(polygon));
      line_of_polygon.push_back(words.line());
    } else if (key == "l" || key == "p") {
      ++ignored;
    } else if (key.substr(0, 1) != "#" && key != "vn" && key != "vt" && key != "vp" && key != "g" &&
               key != "o" && key != "s" && key != "usemtl" && key != "mtllib") {
      throw words.fault("\"" + std::string(key.substr(0, 40)) +
                        "\" is not understood (vertices v and faces f are)");
    }
    words.skip_line();
  }
  for (std::size_t p = 0; p < polygons.size(); ++p) {
    for (const int id : polygons[p]) {
      if (static_cast<std::size_t>(id) < points.size()) continue;
      throw Error(ExitCode::input_file, name + ":" + std::to_string(line_of_polygon[p]) +
                                            ": vertex " + std::to_string(id + 1) +
                                            " does not exist, there are " +
                                            std::to_string(points.size()));
    }
  }
  if (polygons.empty()) throw Error(ExitCode::input_file, name + ": it has no faces");
  if (ignored > 0) {
    findings.push_back({Finding::Severity::note, "lines",
                        counted(ignored, "line or point element") + " left out", ignored});
  }
  return assemble(vtk_points(points), polygons);
}

}  // namespace vstent::vessels

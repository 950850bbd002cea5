#include "meshing/volume.hpp"

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <numbers>

#include "meshing/mesher_files.hpp"
#include "meshing/program.hpp"
#include "meshing/quality.hpp"
#include "vessels/error.hpp"
#include "vessels/file_guard.hpp"
#include "vessels/half_edges.hpp"
#include "vessels/predicates.hpp"
#include "vessels/text.hpp"

namespace vstent::meshing {
namespace fs = std::filesystem;
namespace {

constexpr double kFinest = 0.75;  // of the surface's edges: shorter ones inside do not go with it

/// The files of one run, gone afterwards.
class WorkFolder {
 public:
  explicit WorkFolder(const fs::path& parent) : path_(fs::absolute(parent) / "mesher") {
    std::error_code failed;
    fs::remove_all(path_, failed);
    if (!fs::create_directory(path_, failed))
      throw Error(ExitCode::output, path_.string() + ": cannot be made: " + failed.message());
  }
  ~WorkFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  WorkFolder(const WorkFolder&) = delete;
  WorkFolder& operator=(const WorkFolder&) = delete;
  fs::path operator/(const std::string& file) const { return path_ / file; }
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

void require_closed(const TriangleMesh& surface) {
  const auto edges = vessels::sorted_half_edges(surface);
  std::size_t open = 0;
  int where = -1;
  vessels::for_each_edge(edges, [&](std::size_t begin, std::size_t end) {
    if (end - begin == 2 && edges[begin].ascending != edges[begin + 1].ascending) return;
    if (open++ == 0) where = edges[begin].low;
  });
  if (surface.triangles.empty()) throw Error(ExitCode::geometry, "the surface has no triangles");
  if (open > 0)
    throw Error(ExitCode::geometry,
                "the surface is not closed: " + vessels::counted(open, "edge") +
                    " without two neighbours, the first at " +
                    vessels::place(surface.points[static_cast<std::size_t>(where)]) +
                    " mm; are all caps there?");
}

/// The lengths of a surface's edges: how long where most of the surface is, not where most edges
/// are.
double edge_by_area(const TriangleMesh& surface) {
  double moment = 0, area = 0;
  for (const Triangle& t : surface.triangles) {
    const auto at = [&](std::size_t k) -> const Vec3& {
      return surface.points[static_cast<std::size_t>(t[k % 3])];
    };
    const double part = (at(1) - at(0)).cross(at(2) - at(0)).norm();
    moment += part * ((at(1) - at(0)).norm() + (at(2) - at(1)).norm() + (at(0) - at(2)).norm()) / 3;
    area += part;
  }
  return moment / area;
}

/// HXT's edges are longer than the size it is given by this factor (measured on uniform surfaces:
/// 1.39 to 1.43); sizes below half the surface's edges make it slow and its elements bad.
constexpr double kHxtEdgePerSize = std::numbers::sqrt2;

std::string gmsh_script(double edge) {
  char size[60];
  std::snprintf(size, sizeof size, "Mesh.MeshSizeMax = %.17g;\n", edge / kHxtEdgePerSize);
  return std::string(
             "Merge \"surface.msh\";\n"
             "Surface Loop(1) = {1};\n"
             "Volume(1) = {1};\n"
             "Mesh.Algorithm3D = 10;\n"  // HXT
             "Mesh.MeshSizeExtendFromBoundary = 1;\n") +
         size +
         "Mesh.Optimize = 1;\n"
         "Mesh.MshFileVersion = 2.2;\n"
         "Mesh.Binary = 1;\n"
         "Mesh.SaveAll = 1;\n"
         "Mesh 3;\n"
         "Save \"volume.msh\";\n";
}

/// -Y keeps the surface, q and O and o ask for angles; a regular element of TetGen's largest volume
/// has edges longer than its mean edge by 1.15 (measured).
std::string tetgen_switches(double edge) {
  const double longest = 1.15 * edge;
  char switches[80];
  std::snprintf(switches, sizeof switches, "-pYq1.4/10O10/7o/150a%.9fQ",
                longest * longest * longest / (6 * std::numbers::sqrt2));
  return switches;
}

/// The last line of the log that speaks of an error, or the last line.
std::string complaint(const fs::path& log) {
  std::string bytes;
  try {
    bytes = vessels::read_bytes(log);
  } catch (const Error&) {
    return {};
  }
  std::string last, error;
  for (std::size_t begin = 0; begin < bytes.size();) {
    const std::size_t end = std::min(bytes.find('\n', begin), bytes.size());
    std::string line;
    for (const char c : bytes.substr(begin, end - begin)) {
      if (c >= ' ' && c < 127) line += c;
    }
    begin = end + 1;
    if (line.find_first_not_of(" -") == std::string::npos) continue;
    last = line;
    if (line.find("rror") != std::string::npos && line.find("0 errors") == std::string::npos &&
        line.find("error summary") == std::string::npos)
      error = line;
  }
  const std::string said = (error.empty() ? last : error).substr(0, 160);
  return said.empty() ? said : "; it said \"" + said + "\"";
}

void require_success(const ProgramRun& run, const fs::path& program, const VolumeOptions& options,
                     const fs::path& log) {
  const std::string who = program.string();
  switch (run.end) {
    case ProgramRun::End::timed_out:
      throw Error(ExitCode::resources,
                  who + ": stopped after " + vessels::number(options.time_limit) +
                      " s without a mesh; raise the time limit or the edge length");
    case ProgramRun::End::interrupted:
      throw Error(ExitCode::interrupted, "stopped on request");
    case ProgramRun::End::killed:
      throw Error(ExitCode::resources,
                  who + ": was ended by signal " + std::to_string(run.status) + " (" +
                      strsignal(run.status) + ") after " + vessels::number(run.seconds) + " s" +
                      (run.status == SIGKILL ? ", perhaps for want of memory" : "") +
                      complaint(log));
    case ProgramRun::End::exited:
      if (run.status != 0)
        throw Error(ExitCode::numerical,
                    who + ": failed with exit code " + std::to_string(run.status) + complaint(log));
  }
}

/// Each mesher has its own turn; a tetrahedron that is inverted among its neighbours still shows by
/// its facets.
void turn_right_way_round(TetMesh& mesh) {
  const auto at = [&](int i) -> const Vec3& { return mesh.points[static_cast<std::size_t>(i)]; };
  for (Tetrahedron& t : mesh.tetrahedra) {
    if (vessels::orient3d(at(t[0]), at(t[1]), at(t[2]), at(t[3])) < 0) std::swap(t[2], t[3]);
  }
}

}  // namespace

std::string name(Mesher mesher) { return mesher == Mesher::gmsh ? "gmsh" : "tetgen"; }

fs::path mesher_program(const VolumeOptions& options) {
  const bool gmsh = options.mesher == Mesher::gmsh;
  const char* variable = gmsh ? "VSTENT_GMSH" : "VSTENT_TETGEN";
  const char* set = std::getenv(variable);
  std::string wanted = options.program;
  if (wanted.empty() && set != nullptr) wanted = set;
  if (wanted.empty()) wanted = name(options.mesher);
  const fs::path found = find_program(wanted);
  if (found.empty())
    throw Error(ExitCode::usage, wanted + ": there is no such program; install the package " +
                                     name(options.mesher) + ", or name the program in " + variable);
  return found;
}

Volume fill(const TriangleMesh& surface, const VolumeOptions& options) {
  require_closed(surface);
  const fs::path program = mesher_program(options);
  const WorkFolder work(options.folder);
  const double own_edge = edge_by_area(surface);
  const double edge = std::max(options.edge > 0 ? options.edge : own_edge, kFinest * own_edge);
  const bool gmsh = options.mesher == Mesher::gmsh;
  std::vector<std::string> arguments;
  if (gmsh) {
    vessels::write_whole(work / "surface.msh", msh_text(surface));
    vessels::write_whole(work / "volume.geo", gmsh_script(edge));
    arguments = {"volume.geo", "-", "-nt", "1", "-v", "3"};
  } else {
    vessels::write_whole(work / "surface.smesh", smesh_text(surface));
    arguments = {tetgen_switches(edge), "surface.smesh"};
  }
  const fs::path log = work / "log.txt";
  const ProgramRun run =
      run_program(program, arguments, work.path(), log, {options.time_limit, options.keep_going});
  require_success(run, program, options, log);
  Volume volume;
  volume.mesher = program.string();
  volume.seconds = run.seconds;
  volume.peak_megabytes = run.peak_megabytes;
  try {
    volume.mesh =
        gmsh ? read_msh(work / "volume.msh", surface) : read_tetgen(work / "surface.1", surface);
  } catch (const Error& error) {
    throw Error(error.code(), program.string() + ": " + error.what() + complaint(log));
  }
  turn_right_way_round(volume.mesh);
  Partition partition = check_partition(volume.mesh, surface.triangles);
  if (!partition.fault.empty())
    throw Error(ExitCode::numerical,
                program.string() + ": its mesh is refused: " + partition.fault + complaint(log));
  const double enclosed = enclosed_volume(surface), filled = quality(volume.mesh).volume;
  if (!(std::abs(filled - enclosed) <= 1e-9 * enclosed))
    throw Error(ExitCode::numerical, program.string() + ": its mesh is refused: it fills " +
                                         vessels::number(filled) + " of " +
                                         vessels::number(enclosed) + " mm3");
  volume.behind = std::move(partition.behind);
  return volume;
}

}  // namespace vstent::meshing

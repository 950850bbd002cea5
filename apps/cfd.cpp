// vstent cfd: from a stented surface to a case for a flow solver.
#include <chrono>
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/commands.hpp"
#include "apps/mesh_picture.hpp"
#include "apps/terminal.hpp"
#include "deployment/case.hpp"
#include "deployment/result_folder.hpp"
#include "meshing/condition_faces.hpp"
#include "meshing/crossings.hpp"
#include "meshing/edited_region.hpp"
#include "meshing/faces.hpp"
#include "meshing/layers.hpp"
#include "meshing/mesh_complete.hpp"
#include "meshing/remesh.hpp"
#include "meshing/smooth.hpp"
#include "meshing/solver_xml.hpp"
#include "meshing/volume.hpp"
#include "vessels/error.hpp"
#include "vessels/file_arrays.hpp"
#include "vessels/file_guard.hpp"
#include "vessels/text.hpp"

namespace vstent::apps {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

struct Arguments {
  std::string input, out, units, edge, thickness, conditions, names, faces;
  std::string mesher = "gmsh", remesh, adaptive;
  double time_limit = 1800;
  int smooth = 0;
  meshing::LayerOptions layers;
  meshing::SolverOptions solver;
  bool picture = true, flatten_rims = false;
  ThreadLimit threads;
};

/// The surface, and where it is from.
struct Input {
  fs::path surface;
  vessels::LengthUnit unit = vessels::LengthUnit::mm;
};

Input input_of(const Arguments& a) {
  Input input{a.input, {}};
  std::string units = a.units;
  if (fs::is_directory(a.input)) {
    const fs::path specification = fs::path(a.input) / "case.json";
    const std::string own(vessels::name(deployment::read_case(specification).unit));
    if (!units.empty() && units != own)
      throw Error(ExitCode::usage, "command line: --units " + units + " contradicts " +
                                       specification.string() + ", which says " + own);
    units = own;
    input.surface = fs::path(a.input) / "stented.vtp";
  }
  if (units.empty())
    throw Error(ExitCode::usage,
                "command line: --units is missing: the surface's length unit, mm, cm or m");
  input.unit = vessels::parse_unit(units);
  return input;
}

/// What boundary conditions and options say about faces.
meshing::FaceNames names_of(const Arguments& a,
                            const std::optional<flow::BoundaryConditions>& conditions) {
  meshing::FaceNames names;
  names.flatten_rims = a.flatten_rims;
  if (!a.names.empty()) names.names = meshing::read_face_names(a.names);
  if (!a.faces.empty()) names.files = meshing::face_files(a.faces);
  if (!conditions) return names;
  meshing::add_names(names, *conditions);
  return names;
}

void say(const std::vector<std::string>& notes) {
  for (const std::string& note : notes) std::cerr << "note: " << note << '\n';
}

std::string formatted(const char* format, auto... values) {
  char text[300];
  std::snprintf(text, sizeof text, format, values...);
  return text;
}

ordered_json quality_json(const meshing::TetMesh& mesh) {
  const meshing::TetQuality q = meshing::quality(mesh);
  return {{"tetrahedra", mesh.tetrahedra.size()},
          {"smallest_dihedral_deg", q.smallest_dihedral},
          {"largest_dihedral_deg", q.largest_dihedral},
          {"dihedral_p1_deg", q.dihedral_p1},
          {"dihedral_median_deg", q.dihedral_median},
          {"below_10_deg", q.below_10},
          {"mean_edge_mm", q.mean_edge},
          {"volume_mm3", q.volume}};
}

/// One run, from the surface to the published folder.
class Run {
 public:
  explicit Run(const Arguments& arguments) : a_(arguments), input_(input_of(arguments)) {}

  void operator()() {
    const auto begin = std::chrono::steady_clock::now();
    deployment::ResultFolder folder(a_.out);
    prepare_mesher(folder.stage());
    std::optional<flow::BoundaryConditions> conditions;
    if (!a_.conditions.empty()) conditions = flow::read_boundary_conditions(a_.conditions);
    make_model(conditions);
    std::optional<meshing::SolverCase> solver;
    if (conditions) {
      say(conditions->notes);
      solver = meshing::solver_case(model_, *conditions, a_.solver);
    }
    edit_surface();
    fill();
    progress_.show("writing mesh-complete ...");
    meshing::write_mesh_complete(model_, mesh_, behind_, folder.stage() / "mesh-complete");
    if (solver) write_case(*solver, folder.stage());
    describe_faces();
    if (a_.picture) draw_mesh(model_, mesh_, folder.stage() / "mesh.png");
    progress_.clear();
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    vessels::write_whole(folder.stage() / "cfd.json", report_.dump(2) + "\n");
    if (interrupted()) throw Error(ExitCode::interrupted, "stopped on request");
    folder.publish();
    summarise(solver.has_value(), seconds, folder.final_folder());
  }

 private:
  void prepare_mesher(const fs::path& stage) {
    meshing::VolumeOptions& options = mesher_;
    options.mesher = a_.mesher == "gmsh" ? meshing::Mesher::gmsh : meshing::Mesher::tetgen;
    options.time_limit = a_.time_limit;
    options.folder = stage;
    options.keep_going = [&](double seconds) {
      progress_.show(formatted("meshing with %s: %.0f s", a_.mesher.c_str(), seconds));
      return !interrupted();
    };
    meshing::mesher_program(options);  // must be there before anything long begins
  }

  void make_model(const std::optional<flow::BoundaryConditions>& conditions) {
    progress_.show("reading ...");
    surface_ = vessels::read_surface(input_.surface, input_.unit);
    progress_.show("finding faces ...");
    meshing::NamedModel named = meshing::model_of(surface_, names_of(a_, conditions));
    progress_.clear();
    say(named.notes);
    model_ = std::move(named.model);
    if (conditions) meshing::name_by_place(model_, *conditions, input_.unit);
    meshing::require_writable_faces(model_);
    report_["surface"] = input_.surface.string();
    report_["units"] = vessels::name(input_.unit);
    report_["written_units"] = "cm";
    edge_ = a_.edge.empty() ? 0 : vessels::parse_length(a_.edge, vessels::LengthUnit::mm, "--edge");
    if (!a_.edge.empty() && !(edge_ > 0))
      throw Error(ExitCode::usage, "command line: --edge: must be positive");
  }

  void edit_surface() {
    const bool stented = vessels::vertex_fields(surface_).contains("Displacement");
    std::string how = a_.remesh;
    if (how.empty()) how = stented ? "region" : edge_ > 0 ? "all" : "none";
    const double edge = edge_ > 0 ? edge_ : meshing::measure_quality(model_.mesh).mean_edge;
    std::vector<char> region;  // empty: everywhere
    if (how == "region" || (a_.smooth > 0 && stented))
      region = meshing::edited_region(surface_, model_, 2 * edge);
    if (a_.smooth > 0) smooth(region);
    if (how != "none") remesh(how, how == "region" ? region : std::vector<char>(), edge);
    progress_.show("looking for places where the surface crosses itself ...");
    meshing::require_no_crossings(model_.mesh, input_.unit, input_.surface.string());
    progress_.clear();
    const meshing::SurfaceQuality q = meshing::measure_quality(model_.mesh);
    report_["boundary"] = {{"triangles", q.triangles},
                           {"smallest_angle_deg", q.smallest_angle},
                           {"mean_edge_mm", q.mean_edge}};
    if (how != "all" && edge_ > 0 && edge_ < 0.75 * q.mean_edge)
      std::cerr << "warning: the surface's edges of " << vessels::number(q.mean_edge)
                << " mm on average stay longer than --edge; ask for --remesh all\n";
  }

  void smooth(const std::vector<char>& region) {
    meshing::SmoothOptions options;
    options.iterations = a_.smooth;
    meshing::Smoothed smoothed = meshing::smooth(model_, region, options, input_.unit);
    model_ = std::move(smoothed.model);
    report_["smoothing"] = {{"iterations", a_.smooth},
                            {"largest_move_mm", smoothed.largest_move},
                            {"volume_change", smoothed.volume_change}};
  }

  void remesh(const std::string& how, const std::vector<char>& region, double edge) {
    meshing::RemeshOptions options;
    options.resample_rims = how == "all";
    options.edge_lengths.everywhere = edge;
    if (!a_.adaptive.empty()) {
      const double deviation =
          vessels::parse_length(a_.adaptive, vessels::LengthUnit::mm, "--adaptive");
      if (!(deviation > 0))
        throw Error(ExitCode::usage, "command line: --adaptive: must be positive");
      options.edge_lengths.adaptive = meshing::Adaptive{edge / 4, edge, deviation};
    }
    progress_.show("remeshing the surface ...");
    meshing::Remeshed remeshed = meshing::remesh(model_, region, options, input_.unit);
    progress_.clear();
    if (remeshed.left > 0)
      std::cerr << "note: " << remeshed.left
                << " triangles stay as they were, because longer ones would cross others\n";
    model_ = std::move(remeshed.model);
    report_["remesh"] = {{"region", how},
                         {"edge_mm", edge},
                         {"triangles_before", remeshed.before.triangles},
                         {"triangles_after", remeshed.after.triangles},
                         {"smallest_angle_before_deg", remeshed.before.smallest_angle},
                         {"smallest_angle_after_deg", remeshed.after.smallest_angle},
                         {"mean_edge_after_mm", remeshed.after.mean_edge},
                         {"triangles_left", remeshed.left},
                         {"deviation_mm", remeshed.deviation},
                         {"volume_change", remeshed.volume_change}};
  }

  void fill() {
    mesher_.edge = edge_;
    if (a_.layers.count == 0) {
      meshing::Volume volume = meshing::fill(model_.mesh, mesher_);
      report_["core"] = quality_json(volume.mesh);
      warn_of_thin(volume.mesh);
      mesh_ = std::move(volume.mesh);
      behind_ = std::move(volume.behind);
      note_mesher(volume);
      return;
    }
    meshing::LayerOptions layer_options = a_.layers;
    if (!a_.thickness.empty()) {
      layer_options.thickness =
          vessels::parse_length(a_.thickness, vessels::LengthUnit::mm, "--layer-thickness");
      if (!(layer_options.thickness > 0))
        throw Error(ExitCode::usage, "command line: --layer-thickness: must be positive");
    }
    progress_.show("growing boundary layers ...");
    meshing::Layers layers = meshing::grow_layers(model_, layer_options, input_.unit);
    progress_.clear();
    for (const std::string& warning : layers.warnings) std::cerr << "warning: " << warning << '\n';
    meshing::Volume core = meshing::fill(layers.core, mesher_);
    note_mesher(core);
    mesh_ = meshing::joined(layers, core.mesh);
    model_ = std::move(layers.model);
    meshing::Partition partition = meshing::check_partition(mesh_, model_.mesh.triangles);
    if (!partition.fault.empty())
      throw Error(ExitCode::numerical,
                  "the boundary layers do not fit their core: " + partition.fault);
    behind_ = std::move(partition.behind);
    report_["core"] = quality_json(core.mesh);
    warn_of_thin(core.mesh);
    report_["layers"] = quality_json(layers.mesh);
    report_["layers"]["count"] = layer_options.count;
    report_["layers"]["smallest_thickness_mm"] = layers.smallest;
    report_["layers"]["median_thickness_mm"] = layers.median;
    report_["layers"]["largest_thickness_mm"] = layers.largest;
    report_["layers"]["thinned_points"] = layers.thinned;
  }

  /// Elements this thin slow a solver down and spoil its accuracy.
  void warn_of_thin(const meshing::TetMesh& mesh) const {
    const meshing::TetQuality q = meshing::quality(mesh);
    if (q.below_10 == 0) return;
    Vec3 middle = Vec3::Zero();
    for (const int v : mesh.tetrahedra[static_cast<std::size_t>(q.worst)])
      middle += mesh.points[static_cast<std::size_t>(v)] / 4;
    std::cerr << "warning: " << q.below_10 << " of " << mesh.tetrahedra.size()
              << " tetrahedra have a dihedral angle below 10 deg, the worst "
              << vessels::number(q.smallest_dihedral) << " deg at "
              << vessels::place(middle, input_.unit)
              << (report_.contains("remesh") && report_["remesh"]["region"] == "all"
                      ? "; a shorter --edge, or thinner layers, leave more room there\n"
                      : "; its surface is too uneven there: --remesh all\n");
  }

  void note_mesher(const meshing::Volume& volume) {
    report_["mesher"] = {{"program", volume.mesher},
                         {"seconds", volume.seconds},
                         {"peak_megabytes", volume.peak_megabytes}};
  }

  void write_case(const meshing::SolverCase& solver, const fs::path& stage) {
    say(solver.notes);
    vessels::write_whole(stage / "solver.xml", solver.xml);
    for (const auto& [name, text] : solver.files) vessels::write_whole(stage / name, text);
    report_["solver"] = {{"period_s", solver.period},
                         {"time_step_s", solver.time_step},
                         {"time_steps", solver.time_steps},
                         {"conditions", a_.conditions}};
  }

  void describe_faces() {
    report_["points"] = mesh_.points.size();
    report_["tetrahedra"] = mesh_.tetrahedra.size();
    for (const meshing::Face& face : model_.faces) {
      const std::vector<Triangle> triangles = meshing::triangles_of(model_, face.id);
      const double area = meshing::measure_quality({model_.mesh.points, triangles}).area;
      report_["faces"].push_back({{"name", face.name},
                                  {"id", face.id},
                                  {"cap", face.cap},
                                  {"triangles", triangles.size()},
                                  {"area_mm2", area}});
    }
  }

  void summarise(bool solver, double seconds, const fs::path& out) const {
    const ordered_json& core = report_["core"];
    std::cout << "mesh              " << mesh_.tetrahedra.size() << " tetrahedra, "
              << mesh_.points.size() << " points, in cm whatever the input's unit\n";
    std::cout << formatted(
        "dihedral angles   %.1f to %.1f deg, half of the elements above %.0f deg%s\n",
        core["smallest_dihedral_deg"].get<double>(), core["largest_dihedral_deg"].get<double>(),
        core["dihedral_median_deg"].get<double>(),
        report_.contains("layers") ? " (without layers)" : "");
    if (report_.contains("layers"))
      std::cout << formatted(
          "boundary layers   %d, together %.3g to %.3g mm thick (median %.3g mm)\n",
          report_["layers"]["count"].get<int>(),
          report_["layers"]["smallest_thickness_mm"].get<double>(),
          report_["layers"]["largest_thickness_mm"].get<double>(),
          report_["layers"]["median_thickness_mm"].get<double>());
    if (report_.contains("remesh"))
      std::cout << formatted(
          "surface           %zu triangles remeshed to %zu (%s), smallest angle %.1f deg, "
          "%.2g mm from the one before, volume %+.2g %%\n",
          report_["remesh"]["triangles_before"].get<std::size_t>(),
          report_["remesh"]["triangles_after"].get<std::size_t>(),
          report_["remesh"]["region"].get<std::string>().c_str(),
          report_["remesh"]["smallest_angle_after_deg"].get<double>(),
          report_["remesh"]["deviation_mm"].get<double>(),
          100 * report_["remesh"]["volume_change"].get<double>());
    std::string faces;
    for (const meshing::Face& face : model_.faces) faces += (faces.empty() ? "" : ", ") + face.name;
    std::cout << "faces             " << faces << '\n';
    std::cout << formatted("effort            %.1f s, of which %s %.1f s and %.0f MB\n", seconds,
                           a_.mesher.c_str(), report_["mesher"]["seconds"].get<double>(),
                           report_["mesher"]["peak_megabytes"].get<double>());
    std::cout << "result            " << out.string()
              << (solver ? "\n" : " (no solver.xml: no --boundary-conditions)\n") << kDisclaimer
              << '\n';
  }

  const Arguments& a_;
  Input input_;
  Progress progress_;
  meshing::Model model_;
  meshing::VolumeOptions mesher_;
  vessels::Surface surface_;
  double edge_ = 0;  // mm asked for; 0: none
  meshing::TetMesh mesh_;
  std::vector<int> behind_;
  ordered_json report_;
};

void run(const Arguments& a) {
  a.threads.apply();
  Run{a}();
}

}  // namespace

void add_cfd(CLI::App& app) {
  auto* command = app.add_subcommand(
      "cfd", std::string("Mesh a lumen surface for a flow solver. ") + kDisclaimer);
  auto a = std::make_shared<Arguments>();
  command
      ->add_option("input", a->input,
                   "A folder that `vstent deploy` wrote, or a lumen surface (.vtp .vtk .stl .obj)")
      ->required();
  command->add_option("-o,--out", a->out, "Folder for mesh-complete and solver.xml")->required();
  command->add_option("--units", a->units, "Length unit of a surface: mm, cm or m");
  command->add_option("--edge", a->edge, "Length of edges (0.5mm); default: that of the surface");
  command
      ->add_option("--remesh", a->remesh,
                   "The surface's triangles: region (where the stent moved the wall; default for "
                   "its results), all (default with --edge), none")
      ->check(CLI::IsMember({"region", "all", "none"}));
  command
      ->add_option(
          "--smooth", a->smooth,
          "Times to smooth the wall without shrinking it: where the stent moved it, or all")
      ->check(CLI::Range(0, 1000));
  command->add_option(
      "--adaptive", a->adaptive,
      "Shorter edges (to a quarter) where the surface bends, so that triangles stay "
      "this near to it (0.02mm)");
  command->add_option("--boundary-conditions", a->conditions,
                      "bc.json: what holds at each cap; without it there is no solver.xml");
  command->add_option("--face-names", a->names, "JSON: names by ModelFaceID, {\"1\": \"wall\"}");
  command->add_option("--faces", a->faces,
                      "Folder of one surface file per face, which name the faces");
  command->add_flag("--flatten-rims", a->flatten_rims,
                    "Move uneven rims into their plane before they are capped");
  command->add_option("--layers", a->layers.count, "Boundary layers along the walls")
      ->check(CLI::Range(0, 30));
  command->add_option("--layer-thickness", a->thickness,
                      "Of all layers together (0.6mm); default: the innermost half an edge");
  command
      ->add_option("--layer-growth", a->layers.growth,
                   "Thickness of a layer over that of its neighbour nearer the wall")
      ->capture_default_str();
  command->add_option("--mesher", a->mesher, "gmsh (its HXT) or tetgen")
      ->check(CLI::IsMember({"gmsh", "tetgen"}))
      ->capture_default_str();
  command->add_option("--time-limit", a->time_limit, "Seconds that the mesher may take")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("--beats", a->solver.beats, "Heart beats to simulate")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command->add_option("--steps-per-beat", a->solver.steps_per_beat, "Time steps in a beat")
      ->check(CLI::Range(10, 1000000))
      ->capture_default_str();
  command->add_flag("!--no-picture", a->picture, "Do not draw mesh.png");
  a->threads.add_option(*command);
  command->footer(
      "Examples:\n"
      "  vstent cfd OUT --edge 0.6mm --boundary-conditions bc.json -o CASE\n"
      "  vstent cfd stented.vtp --units cm --layers 3 -o CASE\n"
      "CASE holds mesh-complete as SimVascular writes it, solver.xml for svMultiPhysics with its "
      "waveforms, cfd.json, mesh.png; all in cgs, whatever the input's unit. The mesher (package "
      "gmsh or tetgen) is found in PATH, or named in VSTENT_GMSH or VSTENT_TETGEN.");
  command->callback([a] { run(*a); });
}

}  // namespace vstent::apps

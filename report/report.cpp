#include "report/report.hpp"

#include <cmath>
#include <cstdio>

#include "measure/definitions.hpp"
#include "report/pack.hpp"
#include "report/page.hpp"
#include "report/result_files.hpp"
#include "report/simplify.hpp"
#include "vessels/error.hpp"
#include "vessels/file_guard.hpp"
#include "vessels/text.hpp"

namespace vstent::report {
namespace fs = std::filesystem;
namespace {

using nlohmann::ordered_json;

constexpr double kMegabyte = 1e6;

Box box_of(std::span<const Vec3> points) {
  Box box;
  for (const Vec3& p : points) box.include(p);
  return box;
}

bool inside(const Box& box, std::span<const Vec3> points) {
  const Box other = box_of(points);
  return (box.lower.array() <= other.lower.array()).all() &&
         (other.upper.array() <= box.upper.array()).all();
}

std::string megabytes(double bytes) {
  char text[40];
  std::snprintf(text, sizeof text, "%.1f MB", bytes / kMegabyte);
  return text;
}

/// JSON as the content of a script element: nothing in it may end the element or open a comment.
/// `<` stands only inside strings there, where the escape means the same.
std::string block(const std::string& id, const std::string& json) {
  std::string text = "<script type=\"application/json\" id=\"data-" + id + "\">";
  for (const char c : json) {
    if (c == '<') {
      text += "\\u003c";
    } else {
      text += c;
    }
  }
  return text + "</script>\n";
}

/// Bytes that are no UTF-8, as file names may have, become the replacement character.
std::string dump(const ordered_json& json) {
  return json.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

/// A quarter of the voxel that the stent's surface was made from is not seen.
double drawing_error(const ResultFiles& files) {
  const nlohmann::json::json_pointer key("/level_set/voxel_size");
  if (files.specification.contains(key) && files.specification[key].is_string()) {
    return 0.25 * vessels::parse_length(files.specification[key].get<std::string>(),
                                        vessels::LengthUnit::mm,
                                        "case.json: /level_set/voxel_size");
  }
  const Box box = box_of(files.stent.points);
  return 1e-3 * (box.upper - box.lower).maxCoeff();
}

ordered_json add_stent(Pack& pack, const TriangleMesh& mesh, double error) {
  const Simplified drawn = simplify(mesh, error);
  const Box box = box_of(drawn.mesh.points);
  pack.points("stent", drawn.mesh.points, box);
  pack.triangles("stent.triangles", drawn.mesh.triangles);
  return {{"triangles", drawn.mesh.triangles.size()},
          {"triangles_in_file", drawn.triangles_before},
          {"error_mm", drawn.error}};
}

void add_lines(Pack& pack, const std::string& name, const std::vector<Polyline>& lines) {
  Polyline points;
  std::vector<std::size_t> counts;
  for (const Polyline& line : lines) {
    points.insert(points.end(), line.begin(), line.end());
    counts.push_back(line.size());
  }
  pack.points(name, points, box_of(points));
  pack.counts(name + ".counts", counts);
}

Box wall_box(const ResultFiles& files) {
  Box box = box_of(files.after.points);
  box.include(box_of(files.before));
  return box;
}

std::string scene_block(const ResultFiles& files) {
  Pack pack;
  const Box box = wall_box(files);
  pack.points("before", files.before, box);
  pack.points("after", files.after.points, box, "before", files.before);
  pack.triangles("triangles", files.after.triangles);
  ordered_json fields = ordered_json::array();
  const auto add_fields = [&](const vessels::Fields& some, const char* on) {
    for (const auto& [name, values] : some) {
      const std::string array = std::string(on) + ":" + name;
      pack.field(array, values);
      fields.push_back({{"name", name}, {"on", on}, {"array", array}});
    }
  };
  add_fields(files.vertex_fields, "vertex");
  add_fields(files.triangle_fields, "triangle");
  ordered_json scene;
  if (!files.stent.triangles.empty())
    scene["stent"] = add_stent(pack, files.stent, drawing_error(files));
  add_lines(pack, "struts", files.struts);
  add_lines(pack, "centerline", files.centerline);
  add_lines(pack, "outlines", files.outlines.lines);
  scene["fields"] = std::move(fields);
  scene["outline_arrays"] = files.outlines.line_arrays;
  scene["rounding_mm"] = rounding(box);
  scene["pack"] = pack.json();
  return block("scene", dump(scene));
}

std::string step_block(const ResultFiles& files, const SavedStep& step) {
  Pack pack;
  const TriangleMesh wall = vessels::read_surface(step.wall, files.unit).mesh;
  const Box box = wall_box(files);
  if (wall.triangles == files.after.triangles && inside(box, wall.points)) {
    pack.points("wall", wall.points, box, "before", files.before);
  } else {
    // A simulation on finer triangles than stented.vtp has.
    pack.points("wall", wall.points, box_of(wall.points));
    pack.triangles("wall.triangles", wall.triangles);
  }
  add_stent(pack, vessels::read_surface(step.stent, files.unit).mesh, drawing_error(files));
  return block("step-" + std::to_string(step.step),
               dump({{"step", step.step}, {"pack", pack.json()}}));
}

/// As many of the blocks as fit into `room` bytes, evenly picked, the last always among them.
std::vector<std::size_t> fitting(const std::vector<std::string>& blocks, double room) {
  const std::size_t all = blocks.size();
  for (std::size_t count = all; count > 0; --count) {
    std::vector<std::size_t> picked;
    double bytes = 0;
    for (std::size_t k = 1; k <= count; ++k) {
      picked.push_back((2 * k * all + count) / (2 * count) - 1);  // k * all / count, rounded
      bytes += static_cast<double>(blocks[picked.back()].size());
    }
    if (bytes <= room) return picked;
  }
  return {};
}

ordered_json definitions_json() {
  ordered_json list = ordered_json::array();
  for (const measure::Definition& d : measure::definitions()) {
    list.push_back({{"key", d.key},
                    {"label", d.label},
                    {"unit", d.unit},
                    {"meaning", d.meaning},
                    {"absent", d.absent}});
  }
  return list;
}

std::string summary_block(const ResultFiles& files, const Options& options, std::size_t steps,
                          const std::vector<std::string>& warnings) {
  return block("summary", dump({{"name", options.name},
                                {"folder", options.shown_folder},
                                {"version", options.version},
                                {"disclaimer", options.disclaimer},
                                {"unit", vessels::name(files.unit)},
                                {"steps", steps},
                                {"warnings", warnings},
                                {"definitions", definitions_json()},
                                {"profiles_csv", files.profiles_csv},
                                {"history_csv", files.history_csv}}));
}

}  // namespace

bool available() { return !page().empty(); }

Written write_report(const fs::path& folder, const fs::path& file, const Options& options) {
  if (!available()) {
    throw Error(ExitCode::usage,
                "this vstent was built without its report page (VSTENT_REPORT=OFF); build it with "
                "-DVSTENT_REPORT=ON");
  }
  const ResultFiles files = read_result(folder);
  const double limit = options.size_limit * kMegabyte;

  const std::string fixed =
      scene_block(files) + block("metrics", files.metrics_text) + block("case", files.case_text);
  std::vector<std::string> steps;
  for (const SavedStep& step : files.steps) steps.push_back(step_block(files, step));
  Written written;
  written.warnings = files.warnings;
  constexpr double kRoomForWarnings = 2000;
  const double without_steps =
      static_cast<double>(page().size() + fixed.size() +
                          summary_block(files, options, 0, written.warnings).size()) +
      kRoomForWarnings;
  double with_all = without_steps;
  for (const std::string& step : steps) with_all += static_cast<double>(step.size());
  const auto larger_limit = [](double bytes) {
    return "--size-limit " + std::to_string(static_cast<long>(std::ceil(bytes / kMegabyte)));
  };
  if (without_steps > limit) {
    throw Error(ExitCode::resources, file.string() + ": would be " + megabytes(without_steps) +
                                         ", the limit is " + megabytes(limit) + "; raise it with " +
                                         larger_limit(without_steps));
  }
  const std::vector<std::size_t> shown = fitting(steps, limit - without_steps);
  if (shown.size() < steps.size()) {
    written.warnings.push_back("the page shows " + std::to_string(shown.size()) + " of " +
                               vessels::counted(steps.size(), "saved step") + ": all would make " +
                               megabytes(with_all) + ", the limit is " + megabytes(limit) + " (" +
                               larger_limit(with_all) + " shows them all)");
  }
  const std::size_t mark = page().find(kDataMark);
  std::string html(page().substr(0, mark));
  html += summary_block(files, options, shown.size(), written.warnings);
  html += fixed;
  for (const std::size_t s : shown) html += steps[s];
  html += page().substr(mark + kDataMark.size());
  vessels::write_whole(file, html);
  written.bytes = html.size();
  return written;
}

}  // namespace vstent::report

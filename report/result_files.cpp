#include "report/result_files.hpp"

#include <cmath>
#include <regex>

#include "report/outlines.hpp"
#include "vessels/error.hpp"
#include "vessels/file_guard.hpp"

namespace vstent::report {
namespace fs = std::filesystem;
namespace {

using nlohmann::json;

constexpr const char* kDisplacement = "Displacement";

[[noreturn]] void refuse(const fs::path& path, const std::string& what) {
  throw Error(ExitCode::input_file, path.string() + ": " + what);
}

json parse(const fs::path& path, const std::string& text) {
  try {
    return json::parse(text);
  } catch (const json::parse_error& error) {
    refuse(path, "is no JSON at byte " + std::to_string(error.byte));
  }
}

vessels::LengthUnit unit_of(const json& specification, const fs::path& path) {
  const json::json_pointer key("/vessel/units");
  if (!specification.contains(key) || !specification[key].is_string())
    refuse(path, "/vessel/units is missing: the length unit of the surfaces");
  return vessels::parse_unit(specification[key].get<std::string>());
}

std::string text_if_there(const fs::path& path) {
  return fs::exists(path) ? vessels::read_bytes(path) : std::string();
}

/// Scalars stay; vectors become their lengths.
vessels::Fields magnitudes(vessels::Fields fields, std::size_t count) {
  for (auto& [name, values] : fields) {
    if (values.size() == count) continue;
    std::vector<double> lengths;
    for (std::size_t i = 0; i + 2 < values.size(); i += 3)
      lengths.push_back(std::hypot(values[i], values[i + 1], values[i + 2]));
    values = std::move(lengths);
  }
  return fields;
}

void read_wall(const fs::path& path, ResultFiles& files) {
  const vessels::Surface surface = vessels::read_surface(path, files.unit);
  files.after = surface.mesh;
  vessels::Fields fields = vessels::vertex_fields(surface);
  const auto displacement = fields.find(kDisplacement);
  if (displacement == fields.end() ||
      displacement->second.size() != 3 * files.after.points.size()) {
    refuse(path, "has no point array Displacement, so it is no result of `vstent deploy`");
  }
  files.before = files.after.points;
  for (std::size_t v = 0; v < files.before.size(); ++v) {
    for (int k = 0; k < 3; ++k)
      files.before[v][k] -= displacement->second[3 * v + static_cast<std::size_t>(k)];
  }
  files.vertex_fields = magnitudes(std::move(fields), files.after.points.size());
  files.triangle_fields =
      magnitudes(vessels::triangle_fields(surface), files.after.triangles.size());
}

std::vector<SavedStep> read_steps(const fs::path& list) {
  const std::string text = text_if_there(list);
  std::map<int, SavedStep> steps;
  const std::regex entry(R"re(<DataSet\s+timestep="(\d{1,9})"\s+part="([01])"\s+file="([^"]+)")re");
  for (std::sregex_iterator match(text.begin(), text.end(), entry), end; match != end; ++match) {
    const int number = std::stoi((*match)[1]);
    SavedStep& step = steps[number];
    step.step = number;
    ((*match)[2] == "0" ? step.wall : step.stent) = list.parent_path() / (*match)[3].str();
  }
  if (!text.empty() && steps.empty()) refuse(list, "lists no steps of `vstent deploy`");
  std::vector<SavedStep> result;
  for (auto& [number, step] : steps) {
    if (step.wall.empty() || step.stent.empty())
      refuse(list, "step " + std::to_string(number) + " lacks its wall or its stent");
    result.push_back(std::move(step));
  }
  return result;
}

}  // namespace

json read_metrics(const fs::path& folder) {
  const fs::path path = folder / "metrics.json";
  return parse(path, vessels::read_bytes(path));
}

ResultFiles read_result(const fs::path& folder) {
  if (!fs::is_directory(folder))
    refuse(folder, "is no folder; name one that `vstent deploy` wrote");
  ResultFiles files;
  files.case_text = vessels::read_bytes(folder / "case.json");
  files.specification = parse(folder / "case.json", files.case_text);
  files.metrics_text = vessels::read_bytes(folder / "metrics.json");
  files.metrics = parse(folder / "metrics.json", files.metrics_text);
  files.unit = unit_of(files.specification, folder / "case.json");
  read_wall(folder / "stented.vtp", files);
  const auto there = [&](const char* name, const char* consequence) {
    if (fs::exists(folder / name)) return true;
    files.warnings.push_back(std::string(name) + " is not in the folder: " + consequence);
    return false;
  };
  if (there("stent.vtp", "the stent is not drawn"))
    files.stent = vessels::read_surface(folder / "stent.vtp", files.unit).mesh;
  if (fs::exists(folder / "struts.vtp"))
    files.struts = vessels::read_polylines(folder / "struts.vtp", files.unit).lines;
  if (there("centerline.vtp", "the centerline is not drawn"))
    files.centerline = vessels::read_polylines(folder / "centerline.vtp", files.unit).lines;
  if (fs::exists(folder / "sections.vtp")) {
    files.outlines = vessels::read_polylines(folder / "sections.vtp", files.unit);
  } else if (!files.centerline.empty()) {
    files.outlines =
        cut_outlines({files.before, files.after.triangles}, files.after, folder / "centerline.vtp",
                     files.unit, files.specification, files.metrics);
  }
  files.profiles_csv = text_if_there(folder / "profiles.csv");
  files.history_csv = text_if_there(folder / "history.csv");
  files.steps = read_steps(folder / "steps.pvd");
  return files;
}

}  // namespace vstent::report

#include "meshing/faces.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <numeric>
#include <set>

#include "meshing/cap.hpp"
#include "meshing/face_files.hpp"
#include "vessels/check.hpp"
#include "vessels/error.hpp"
#include "vessels/file_guard.hpp"
#include "vessels/half_edges.hpp"
#include "vessels/lumen_ends.hpp"
#include "vessels/text.hpp"

namespace vstent::meshing {
namespace {

constexpr double kHole = 3.0;        // rim edges across: a narrower opening is no vessel's end
constexpr double kUnevenRim = 1e-3;  // of the radius; more is said

void require_usable_name(const std::string& name, const std::string& source) {
  const bool usable = !name.empty() &&
                      name.find_first_not_of(
                          "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
                          "0123456789_-+.") == std::string::npos &&
                      name.front() != '.';
  if (usable) return;
  throw Error(ExitCode::geometry,
              source + ": \"" + name + "\" cannot name a face, use letters, digits, _ - + .");
}

std::string diameter(double radius) { return vessels::number(2 * radius) + " mm across"; }

/// A model in the making.
class Builder {
 public:
  Builder(const vessels::Surface& surface, const FaceNames& sources)
      : surface_(surface), sources_(sources) {
    model().mesh = surface.mesh;
  }

  NamedModel run() {
    vessels::require_stentable(surface_, vessels::check(surface_), "meshed");
    take_ids();
    find_caps();
    close_openings();
    list_faces();
    for (const auto& [id, name] : sources_.names) give(id, name, "face names");
    if (!sources_.files.empty()) {
      for (const auto& [id, name] : names_from_files(model(), sources_.files, surface_.unit))
        if (face_named(id).empty()) give(id, name, "face files");
      require_all_caps_named();
    }
    generate_names();
    return std::move(result_);
  }

 private:
  Model& model() { return result_.model; }
  void note(const std::string& line) { result_.notes.push_back(line); }
  std::string where(const Vec3& point) const { return vessels::place(point, surface_.unit); }

  void take_ids() {
    std::vector<int>& ids = model().face_of_triangle;
    ids = surface_.face_of_triangle;
    if (ids.empty()) ids.assign(surface_.mesh.triangles.size(), 1);
    next_id_ = std::max(0, *std::max_element(ids.begin(), ids.end())) + 1;
    std::map<int, int> renumbered;
    for (int& id : ids) {
      if (id > 0) continue;
      const auto [found, fresh] = renumbered.try_emplace(id, next_id_);
      if (fresh) {
        note("face " + std::to_string(id) + " has become " + std::to_string(next_id_++) +
             ": ids count from 1");
      }
      id = found->second;
    }
  }

  /// Faces that are caps; patches that are caps within a face that also holds wall get new ids.
  void find_caps() {
    const vessels::LumenEnds ends = vessels::find_lumen_ends(surface_);
    std::vector<int>& ids = model().face_of_triangle;
    std::map<int, std::pair<std::size_t, std::size_t>> cap_and_all;  // by face
    for (std::size_t t = 0; t < ids.size(); ++t) {
      auto& [caps, all] = cap_and_all[ids[t]];
      caps += ends.is_cap[t] != 0;
      ++all;
    }
    for (const auto& [id, counts] : cap_and_all)
      if (counts.first == counts.second) caps_.insert(id);
    const std::vector<int> patch = patches(ends.is_cap);
    std::map<int, int> id_of_patch;
    for (std::size_t t = 0; t < ids.size(); ++t) {
      if (!ends.is_cap[t] || caps_.contains(ids[t])) continue;
      const auto [found, fresh] = id_of_patch.try_emplace(patch[t], next_id_);
      if (fresh) caps_.insert(next_id_++);
      ids[t] = found->second;
    }
    for (const vessels::LumenEnd& end : ends.ends)
      if (end.open) lumen_ends_.push_back(end.centre);
    if (!id_of_patch.empty())
      note(vessels::counted(id_of_patch.size(), "cap") +
           " recognised by being plane with a sharp rim");
  }

  /// Connected pieces of the marked triangles, numbered by one of their own.
  std::vector<int> patches(const std::vector<char>& marked) const {
    std::vector<int> root(marked.size());
    std::iota(root.begin(), root.end(), 0);
    const auto find = [&](int t) {
      while (root[static_cast<std::size_t>(t)] != t) t = root[static_cast<std::size_t>(t)];
      return t;
    };
    const auto edges = vessels::sorted_half_edges(surface_.mesh);
    vessels::for_each_edge(edges, [&](std::size_t begin, std::size_t end) {
      for (std::size_t e = begin + 1; e < end; ++e) {
        const int a = edges[begin].triangle, b = edges[e].triangle;
        if (!marked[static_cast<std::size_t>(a)] || !marked[static_cast<std::size_t>(b)]) continue;
        const int root_a = find(a), root_b = find(b);
        root[static_cast<std::size_t>(std::max(root_a, root_b))] = std::min(root_a, root_b);
      }
    });
    for (std::size_t t = 0; t < root.size(); ++t) root[t] = find(static_cast<int>(t));
    return root;
  }

  bool is_end(const Opening& opening) const {
    return 2 * opening.radius >= kHole * opening.edge &&
           std::any_of(lumen_ends_.begin(), lumen_ends_.end(), [&](const Vec3& centre) {
             return (centre - opening.centre).norm() < 1e-6 * opening.radius;
           });
  }

  void close_openings() {
    std::map<int, int> face_at;  // by rim point
    const std::vector<Opening> openings = find_openings(model().mesh);
    for (const Opening& opening : openings)
      for (const int p : opening.rim) face_at[p] = 0;
    for (std::size_t t = 0; t < surface_.mesh.triangles.size(); ++t) {
      for (const int p : surface_.mesh.triangles[t]) {
        const auto found = face_at.find(p);
        if (found != face_at.end()) found->second = model().face_of_triangle[t];
      }
    }
    for (Opening opening : openings) {
      if (opening.unevenness > kUnevenRim * opening.radius) {
        note("the rim around " + where(opening.centre) + " lies up to " +
             vessels::number(opening.unevenness) + " mm off its plane" +
             (sources_.flatten_rims ? ": flattened" : ": its cap is curved"));
        if (sources_.flatten_rims) flatten(model().mesh, opening);
      }
      const bool end = is_end(opening);
      const int id = end ? next_id_++ : face_at[opening.rim.front()];
      if (end) caps_.insert(id);
      close(model().mesh, opening, surface_.unit);
      model().face_of_triangle.resize(model().mesh.triangles.size(), id);
      note((end ? "opening capped: " : "hole filled: ") + diameter(opening.radius) + " at " +
           where(opening.centre));
    }
  }

  void list_faces() {
    const std::set<int> ids(model().face_of_triangle.begin(), model().face_of_triangle.end());
    for (const int id : ids) model().faces.push_back({id, "", caps_.contains(id)});
    for (std::size_t t = 0; t < model().mesh.triangles.size(); ++t) {
      const auto& points = model().mesh.points;
      const Triangle& c = model().mesh.triangles[t];
      const Vec3 a = points[static_cast<std::size_t>(c[0])],
                 b = points[static_cast<std::size_t>(c[1])],
                 d = points[static_cast<std::size_t>(c[2])];
      const double area = 0.5 * (b - a).cross(d - a).norm();
      auto& extent = extents_[model().face_of_triangle[t]];
      extent.area += area;
      extent.moment += area / 3 * (a + b + d);
    }
  }

  Face& find(int id, const std::string& source) {
    for (Face& one : model().faces)
      if (one.id == id) return one;
    std::string ids;
    for (const Face& one : model().faces) ids += (ids.empty() ? "" : ", ") + std::to_string(one.id);
    throw Error(ExitCode::geometry,
                source + ": the surface has no face " + std::to_string(id) + ", only " + ids);
  }
  std::string face_named(int id) { return find(id, "").name; }
  bool taken(const std::string& name) {
    return std::any_of(model().faces.begin(), model().faces.end(),
                       [&](const Face& one) { return one.name == name; });
  }

  void give(int id, const std::string& name, const std::string& source) {
    require_usable_name(name, source);
    if (taken(name)) throw Error(ExitCode::geometry, source + ": two faces are called " + name);
    find(id, source).name = name;
  }

  void require_all_caps_named() {
    const auto cap_has_name = [](const Face& one) { return one.cap && !one.name.empty(); };
    if (std::none_of(model().faces.begin(), model().faces.end(), cap_has_name)) return;
    for (const Face& one : model().faces) {
      if (!one.cap || !one.name.empty()) continue;
      throw Error(ExitCode::geometry,
                  "no file names the cap at " + where(extents_[one.id].centre()) + ", " +
                      diameter(extents_[one.id].radius()) + ": add its file, or give none");
    }
  }

  void generate(Face& one, const std::string& wanted) {
    one.name = wanted;
    for (int copy = 2; std::count_if(model().faces.begin(), model().faces.end(),
                                     [&](const Face& f) { return f.name == one.name; }) > 1;
         ++copy)
      one.name = wanted + "_" + std::to_string(copy);
  }

  void generate_names() {
    std::vector<Face*> unnamed_caps;
    const auto walls = std::count_if(model().faces.begin(), model().faces.end(),
                                     [](const Face& one) { return !one.cap; });
    for (Face& one : model().faces) {
      if (!one.name.empty()) continue;
      if (one.cap) {
        unnamed_caps.push_back(&one);
      } else {
        generate(one, walls == 1 ? "wall" : "wall_" + std::to_string(one.id));
      }
    }
    if (unnamed_caps.empty()) return;
    std::stable_sort(unnamed_caps.begin(), unnamed_caps.end(), [&](const Face* a, const Face* b) {
      return extents_[a->id].area > extents_[b->id].area;
    });
    if (sources_.inlet) {
      const auto nearest = std::min_element(
          unnamed_caps.begin(), unnamed_caps.end(), [&](const Face* a, const Face* b) {
            return (extents_[a->id].centre() - *sources_.inlet).norm() <
                   (extents_[b->id].centre() - *sources_.inlet).norm();
          });
      std::rotate(unnamed_caps.begin(), nearest, nearest + 1);
    }
    const bool inlet_is_known =
        std::any_of(model().faces.begin(), model().faces.end(), [](const Face& f) {
          return f.cap && (f.name.find("inlet") != std::string::npos ||
                           f.name.find("inflow") != std::string::npos);
        });
    int outlet = 0;
    for (Face* one : unnamed_caps) {
      if (one == unnamed_caps.front() && !inlet_is_known) {
        generate(*one, "inlet");
        const Extent& extent = extents_[one->id];
        note(std::string("inlet: the cap ") +
             (sources_.inlet ? "nearest to the point given, " : "of largest area, ") +
             diameter(extent.radius()) + " at " + where(extent.centre()));
      } else {
        generate(*one, "outlet" + std::to_string(++outlet));
      }
    }
  }

  struct Extent {
    double area = 0;
    Vec3 moment = Vec3::Zero();
    double radius() const { return std::sqrt(area / std::numbers::pi); }
    Vec3 centre() const { return area > 0 ? Vec3(moment / area) : moment; }
  };

  const vessels::Surface& surface_;
  const FaceNames& sources_;
  NamedModel result_;
  int next_id_ = 1;
  std::set<int> caps_;
  std::vector<Vec3> lumen_ends_;
  std::map<int, Extent> extents_;
};

}  // namespace

NamedModel model_of(const vessels::Surface& surface, const FaceNames& names) {
  return Builder(surface, names).run();
}

std::map<int, std::string> read_face_names(const std::filesystem::path& json) {
  const auto parsed = nlohmann::json::parse(vessels::read_bytes(json), nullptr, false);
  if (!parsed.is_object())
    throw Error(ExitCode::input_file,
                json.string() + ": expected an object of names by face id, like {\"1\": \"wall\"}");
  std::map<int, std::string> names;
  for (const auto& [key, value] : parsed.items()) {
    const bool is_id =
        !key.empty() && key.size() < 9 && key.find_first_not_of("0123456789") == std::string::npos;
    if (!is_id || !value.is_string())
      throw Error(
          ExitCode::input_file,
          json.string() + ": /" + key + ": expected a face id and its name, like \"1\": \"wall\"");
    names[std::stoi(key)] = value.get<std::string>();
  }
  return names;
}

}  // namespace vstent::meshing

#include "vessels/check.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "vessels/error.hpp"
#include "vessels/polydata.hpp"
#include "vessels/text.hpp"

namespace vstent::vessels {
namespace {

using Severity = Finding::Severity;

constexpr std::size_t kPlaces = 3;       // named per finding
constexpr double kFlatTriangle = 1e-6;   // height over longest edge
constexpr double kNeedle = 1e-2;         // the same, worth a warning
constexpr double kFlatShare = 1e-3;      // of the triangles that may be flat
constexpr double kCrossingShare = 1e-3;  // crossing pairs per triangle that may be left
constexpr std::size_t kCrossingPairs = 50;
constexpr double kHole = 3.0;  // rim edges across (9 around): a smaller opening is no vessel's end

class Checker {
 public:
  Checker(const Surface& surface, CheckReport& report)
      : surface_(surface), mesh_(surface.mesh), report_(report) {}

  void run() {
    measure();
    const Topology facts = topology(mesh_);
    report_edges(facts);
    report_components(facts);
    report_duplicates();
    report_shapes();
    report_openings(facts);
    report_crossings();
    std::stable_sort(report_.findings.begin(), report_.findings.end(),
                     [](const Finding& a, const Finding& b) { return a.severity > b.severity; });
  }

 private:
  const Vec3& at(int vertex) const { return mesh_.points[static_cast<std::size_t>(vertex)]; }

  Vec3 centroid(std::size_t t) const {
    const Triangle& corners = mesh_.triangles[t];
    return (at(corners[0]) + at(corners[1]) + at(corners[2])) / 3.0;
  }

  std::string where(const Vec3& x) const { return place(x, surface_.unit); }

  template <class PlaceOf>
  std::string places(std::size_t count, PlaceOf&& place_of) const {
    std::string text = " at ";
    for (std::size_t i = 0; i < std::min(count, kPlaces); ++i)
      text += (i > 0 ? "; " : "") + place_of(i);
    if (count > kPlaces) text += "; ...";
    return text;
  }

  void add(Severity severity, const char* kind, std::size_t count, const std::string& text) {
    if (count > 0) report_.findings.push_back({severity, kind, text, count});
  }

  void measure() {
    report_.triangles = mesh_.triangles.size();
    report_.points =
        surface_.source ? surface_.source->vertex_of_point.size() : mesh_.points.size();
    for (const Finding& finding : surface_.findings) {
      if (finding.kind == "unused-point") report_.unused_points = finding.count;
      if (finding.kind == "duplicate-point") report_.duplicate_points = finding.count;
      report_.findings.push_back(finding);
    }
    for (const Vec3& x : mesh_.points) report_.bounds.include(x);
    std::vector<double> lengths;
    lengths.reserve(3 * mesh_.triangles.size());
    for (const Triangle& t : mesh_.triangles) {
      for (std::size_t k = 0; k < 3; ++k) lengths.push_back((at(t[(k + 1) % 3]) - at(t[k])).norm());
    }
    if (lengths.empty()) return;
    const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
    std::nth_element(lengths.begin(), middle, lengths.end());
    report_.edge_median = *middle;
    report_.edge_min = *std::min_element(lengths.begin(), lengths.end());
    report_.edge_max = *std::max_element(lengths.begin(), lengths.end());
    for (const int face : surface_.face_of_triangle) ++report_.triangles_per_face[face];
  }

  void report_edges(const Topology& facts) {
    const auto edge_place = [&](const std::vector<std::array<int, 2>>& edges) {
      return places(edges.size(), [&](std::size_t i) {
        return where(0.5 * (at(edges[i][0]) + at(edges[i][1])));
      });
    };
    const auto& shared = facts.non_manifold_edges;
    add(Severity::error, "non-manifold-edge", shared.size(),
        counted(shared.size(), "edge") + " of more than two triangles" + edge_place(shared));
    const auto& torn = facts.inconsistent_edges;
    add(Severity::error, "inconsistent-orientation", torn.size(),
        counted(torn.size(), "edge") + " between triangles that face opposite ways" +
            edge_place(torn));
    const auto& ties = facts.bow_tie_vertices;
    add(Severity::error, "bow-tie", ties.size(),
        std::string("sheets touch in a single point at ") + std::to_string(ties.size()) +
            (ties.size() == 1 ? " vertex" : " vertices") +
            places(ties.size(), [&](std::size_t i) { return where(at(ties[i])); }));
  }

  void report_components(const Topology& facts) {
    if (facts.components < 2) return;
    std::vector<std::pair<std::size_t, std::size_t>> sizes(
        static_cast<std::size_t>(facts.components));  // size, first
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      auto& [size, first] = sizes[static_cast<std::size_t>(facts.component_of_triangle[t])];
      if (size++ == 0) first = t;
    }
    std::stable_sort(sizes.begin(), sizes.end(),
                     [](const auto& a, const auto& b) { return a.first > b.first; });
    std::string text = std::to_string(sizes.size()) + " separate pieces; keep one: ";
    for (std::size_t i = 0; i < std::min<std::size_t>(sizes.size(), 2 * kPlaces); ++i) {
      text += (i > 0 ? "; " : "") + counted(sizes[i].first, "triangle") + " near " +
              where(centroid(sizes[i].second));
    }
    if (sizes.size() > 2 * kPlaces) text += "; ...";
    add(Severity::error, "components", sizes.size(), text);
  }

  void report_duplicates() {
    std::vector<std::pair<Triangle, std::size_t>> sorted(mesh_.triangles.size());
    for (std::size_t t = 0; t < sorted.size(); ++t) {
      sorted[t] = {mesh_.triangles[t], t};
      std::sort(sorted[t].first.begin(), sorted[t].first.end());
    }
    std::sort(sorted.begin(), sorted.end());
    std::vector<std::size_t> copies;
    for (std::size_t i = 1; i < sorted.size(); ++i) {
      if (sorted[i].first == sorted[i - 1].first) copies.push_back(sorted[i].second);
    }
    add(Severity::error, "duplicate-triangle", copies.size(),
        counted(copies.size(), "triangle") + " given twice" +
            places(copies.size(), [&](std::size_t i) { return where(centroid(copies[i])); }));
  }

  void report_shapes() {
    std::vector<std::size_t> flat, needles;
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      const Triangle& corners = mesh_.triangles[t];
      const Vec3 u = at(corners[1]) - at(corners[0]), v = at(corners[2]) - at(corners[0]);
      const double longest = std::max({u.squaredNorm(), v.squaredNorm(), (u - v).squaredNorm()});
      const double slimness =
          longest > 0 ? u.cross(v).norm() / longest : 0.0;  // height over longest edge
      if (slimness < kFlatTriangle) {
        flat.push_back(t);
      } else if (slimness < kNeedle) {
        needles.push_back(t);
      }
    }
    const bool too_many =
        static_cast<double>(flat.size()) > kFlatShare * static_cast<double>(mesh_.triangles.size());
    const auto centre = [&](const std::vector<std::size_t>& which) {
      return places(which.size(), [&](std::size_t i) { return where(centroid(which[i])); });
    };
    add(too_many ? Severity::error : Severity::warning, "degenerate-triangle", flat.size(),
        counted(flat.size(), "triangle") + " without area" + centre(flat));
    add(Severity::warning, "needle-triangle", needles.size(),
        counted(needles.size(), "triangle") + " more than 100 times longer than high" +
            centre(needles));
  }

  void report_openings(const Topology& facts) {
    report_.closed = facts.boundary_loops.empty();
    std::size_t holes = 0;
    std::string first_hole;
    for (const std::vector<int>& loop : facts.boundary_loops) {
      Vec3 centre = Vec3::Zero(), area = Vec3::Zero();
      double perimeter = 0;
      for (std::size_t k = 0; k < loop.size(); ++k) {
        const Vec3 &a = at(loop[k]), &b = at(loop[(k + 1) % loop.size()]);
        const double length = (b - a).norm();
        centre += 0.5 * length * (a + b);
        perimeter += length;
        area += 0.5 * (a - at(loop[0])).cross(b - at(loop[0]));
      }
      if (perimeter > 0) centre /= perimeter;
      const double diameter = 2.0 * std::sqrt(area.norm() / std::numbers::pi);
      report_.openings.push_back({centre, diameter, loop.size()});
      const double rim_edge = perimeter / static_cast<double>(loop.size());
      if (diameter < kHole * rim_edge && holes++ == 0) first_hole = where(centre);
    }
    if (holes > 0) {
      add(Severity::warning, "hole", holes,
          counted(holes, "opening") +
              " no wider than three edges: a hole rather than a vessel's end, the first at " +
              first_hole);
    }
    if (report_.closed && report_.triangles_per_face.size() < 2) {
      add(Severity::note, "closed", 1,
          "no open ends and no ModelFaceID or CapID that tells caps from wall");
    }
  }

  void report_crossings() {
    const auto pairs = self_intersections(mesh_);
    const bool too_many =
        pairs.size() > kCrossingPairs ||
        static_cast<double>(pairs.size()) > kCrossingShare * static_cast<double>(report_.triangles);
    const auto twice = std::count_if(pairs.begin(), pairs.end(), [&](const auto& pair) {
      Triangle a = mesh_.triangles[static_cast<std::size_t>(pair.first)];
      Triangle b = mesh_.triangles[static_cast<std::size_t>(pair.second)];
      std::sort(a.begin(), a.end());
      std::sort(b.begin(), b.end());
      return a == b;
    });
    const std::string of_these =
        twice > 0 ? " (" + std::to_string(twice) + " of them given twice)" : "";
    add(too_many ? Severity::error : Severity::warning, "self-intersection", pairs.size(),
        counted(pairs.size(), "pair") + " of triangles cross or overlap" + of_these +
            places(pairs.size(), [&](std::size_t i) {
              const auto& [a, b] = pairs[i];
              return where(0.5 * (centroid(static_cast<std::size_t>(a)) +
                                  centroid(static_cast<std::size_t>(b))));
            }));
  }

  const Surface& surface_;
  const TriangleMesh& mesh_;
  CheckReport& report_;
};

}  // namespace

bool CheckReport::stentable() const {
  return std::none_of(findings.begin(), findings.end(),
                      [](const Finding& finding) { return finding.severity == Severity::error; });
}

CheckReport check(const Surface& surface) {
  CheckReport report;
  Checker(surface, report).run();
  return report;
}

void require_stentable(const Surface& surface, const CheckReport& report,
                       const std::string& done) {
  if (report.stentable()) return;
  std::string text;
  for (const Finding& finding : report.findings) {
    if (finding.severity == Severity::error) text += (text.empty() ? "" : ". ") + finding.text;
  }
  throw Error(ExitCode::geometry, surface.path + ": cannot be " + done + ": " + text);
}

}  // namespace vstent::vessels

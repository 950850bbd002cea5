// Draws the figures of docs/validation.md: draw_validation FOLDER_OF_FINITE_ELEMENTS OUT
#include <cstdio>
#include <fstream>

#include "apps/plot.hpp"
#include "tests/validation/finite_elements.hpp"
#include "tests/validation/stent_edge.hpp"

namespace {

using namespace vstent;
using apps::Colour;
using apps::PlotPoint;
using xpbd::MembraneModel;

constexpr Colour kElements{40, 44, 48}, kTriangles{168, 42, 34}, kSprings{63, 111, 159},
    kAtRest{160, 168, 176};

struct Curve {
  std::string name;
  std::vector<PlotPoint> points;
  Colour colour;
  bool dash = false;
};

void write(const std::filesystem::path& file, const std::vector<Curve>& curves,
           const std::string& x_label, const std::string& y_label) {
  apps::Range x, y;
  for (const Curve& curve : curves)
    for (const PlotPoint& p : curve.points) {
      x.include(p.x);
      y.include(*p.y);
    }
  const double margin = 0.05 * (y.high - y.low);
  y.low -= margin;
  y.high += margin;
  apps::Plot plot(x, y);
  plot.axes(x_label, y_label);
  std::vector<apps::Plot::Entry> entries;
  for (const Curve& curve : curves) {
    const apps::Stroke stroke{{}, curve.colour, 2};
    plot.line(curve.points, stroke, curve.dash);
    entries.push_back({curve.name, stroke, curve.dash});
  }
  plot.legend(entries);
  std::ofstream(file) << apps::svg(plot.take());
  std::printf("%s\n", file.c_str());
}

/// Mean radius of every ring of the half z > 0 over its mean z.
std::vector<PlotPoint> profile(const tests::WidenedTube& tube, double from) {
  std::vector<PlotPoint> points;
  for (std::size_t begin = 0, end = 0; begin < tube.places.size(); begin = end) {
    double z = 0, radius = 0;
    const double row = tube.mesh.points[begin].z();
    while (end < tube.places.size() && tube.mesh.points[end].z() == row) {
      z += tube.places[end].z();
      radius += tests::distance_from_axis(tube.places[end++]);
    }
    const auto count = static_cast<double>(end - begin);
    if (z / count >= from) points.push_back({z / count, radius / count});
  }
  return points;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: draw_validation FOLDER_OF_FINITE_ELEMENTS OUT\n");
    return 2;
  }
  const std::filesystem::path elements = argv[1], out = argv[2];
  const tests::FiniteElementCase& c = tests::kFiniteElementCases[0];
  const auto lumen = tests::read_lumen(elements / (c.file + ".csv"));
  if (lumen.empty()) {
    std::fprintf(stderr, "%s: no profile there\n", (elements / (c.file + ".csv")).c_str());
    return 3;
  }
  Curve rest{"at rest", {}, kAtRest}, solid{"finite elements", {}, kElements};
  Curve beside{"finite elements", {}, kElements};
  for (const tests::LumenPoint& p : lumen) {
    rest.points.push_back({p.rest_z, p.rest_radius});
    solid.points.push_back({p.z, p.radius});
    if (p.z >= 7) beside.points.push_back({p.z, p.radius});
  }
  const double length = 2 * lumen.back().rest_z;
  const auto triangles = tests::widen(c, length, 0.5, MembraneModel::neo_hookean);
  const auto springs = tests::widen(c, length, 0.5, MembraneModel::springs);
  write(out / "validation_lumen.svg",
        {rest, solid, {"triangles, 0.5 mm", profile(triangles, 0), kTriangles, true}},
        "along the vessel (mm)", "lumen radius (mm)");
  write(out / "validation_beside.svg",
        {beside,
         {"triangles, 0.5 mm", profile(triangles, 7), kTriangles},
         {"springs", profile(springs, 7), kSprings}},
        "along the vessel (mm)", "lumen radius (mm)");

  Curve theory{"thin-shell theory", {}, kElements};
  for (double q = 0; q <= 5; q += 0.02) theory.points.push_back({q, tests::beside_the_end(q)});
  std::vector<Curve> edges{theory};
  for (const auto& [edge, colour] : {std::pair{0.8, kSprings}, std::pair{0.4, kTriangles}}) {
    const tests::StentEdge found = tests::widen_beside_a_stent(edge);
    char name[40];
    std::snprintf(name, sizeof name, "edges of %.1f mm", edge);
    Curve curve{name, {}, colour, true};
    for (const auto& [s, w] : found.rings)
      curve.points.push_back({found.beta * s, w / found.oversize});
    edges.push_back(curve);
  }
  write(out / "validation_edge.svg", edges, "beta s", "displacement over oversize");
}

#include "measure/rows.hpp"

namespace vstent::measure {
namespace {

using Json = nlohmann::ordered_json;

template <class Value>
Json of_wall(const Metrics& m, Value&& value) {
  return m.wall ? Json(value(*m.wall)) : Json(nullptr);
}

template <class Value>
Json of_apposition(const Metrics& m, Value&& value) {
  return m.apposition ? Json(value(*m.apposition)) : Json(nullptr);
}

}  // namespace

std::vector<Row> stent_rows() {
  return {
      {{"/stent/length_mm", "Length of the stent", "mm",
        "Of its own axis where that is known, otherwise of the lumen's axis between its ends.",
        kNoStent},
       [](const Metrics& m) { return or_null(m.stent.length); }},
      {{"/stent/foreshortening_percent", "Foreshortening", "%",
        "100 (1 - length deployed / length crimped).", kNoDesign},
       [](const Metrics& m) { return or_null(m.stent.foreshortening); }},
      {{"/stent/recoil_percent", "Radial recoil", "%",
        "100 (1 - diameter unloaded / diameter on the balloon), of the design; the deployed "
        "diameter is the unloaded one.",
        kNoDesign},
       [](const Metrics& m) { return or_null(m.stent.recoil); }},
      {{"/apposition/stent_area_mm2", "Outer surface of the stent", "mm2",
        "Of the level set's surface, what faces away from the lumen's axis within 45 degrees, "
        "parts over openings left out.",
        kNoStent},
       [](const Metrics& m) { return of_apposition(m, [](auto& a) { return a.area; }); }},
      {{"/apposition/mean_gap_mm", "Mean gap", "mm",
        "Distance from there to the nearest wall, 0 where the wall is touched.", kNoStent},
       [](const Metrics& m) { return of_apposition(m, [](auto& a) { return a.mean_gap; }); }},
      {{"/apposition/largest_gap_mm", "Largest gap", "mm", "The largest such distance.", kNoStent},
       [](const Metrics& m) { return of_apposition(m, [](auto& a) { return a.largest_gap; }); }},
      {{"/apposition/gap_above_0_1_mm_percent", "Gap above 0.1 mm", "%",
        "Share of the outer surface whose gap is larger.", kNoStent},
       [](const Metrics& m) {
         return of_apposition(m, [](auto& a) { return a.share_with_gap[0]; });
       }},
      {{"/apposition/gap_above_0_2_mm_percent", "Gap above 0.2 mm", "%", "The same.", kNoStent},
       [](const Metrics& m) {
         return of_apposition(m, [](auto& a) { return a.share_with_gap[1]; });
       }},
      {{"/apposition/gap_above_0_4_mm_percent", "Gap above 0.4 mm", "%", "The same.", kNoStent},
       [](const Metrics& m) {
         return of_apposition(m, [](auto& a) { return a.share_with_gap[2]; });
       }},
      {{"/apposition/over_openings_percent", "Over openings", "%",
        "Share of the whole outer surface more than 0.1 mm from any wall and with no wall ahead "
        "within the stent's radius: over an ostium or an end.",
        kNoStent},
       [](const Metrics& m) { return of_apposition(m, [](auto& a) { return a.over_openings; }); }},
      {{"/apposition/deepest_penetration_mm", "Deepest penetration", "mm",
        "Of any wall vertex into the stent, sampled in its level set.", kNoStent},
       [](const Metrics& m) {
         return of_apposition(m, [](auto& a) { return a.deepest_penetration; });
       }},
  };
}

std::vector<Row> wall_rows() {
  return {
      {{"/wall/area_mm2", "Stented wall", "mm2",
        "Area before of the triangles around the treated length that belong to no branch.",
        kNoTriangles},
       [](const Metrics& m) { return of_wall(m, [](auto& w) { return w.area_before; }); }},
      {{"/wall/circumferential_stretch_p5", "Circumferential stretch, 5th percentile", "",
        "Length after over before around the vessel, in each triangle's plane, weighted with areas "
        "before over the stented wall: |F e|, F mapping edges before to edges after.",
        kNoTriangles},
       [](const Metrics& m) { return of_wall(m, [](auto& w) { return w.circumferential.p5; }); }},
      {{"/wall/circumferential_stretch_p50", "Circumferential stretch, median", "", "The same.",
        kNoTriangles},
       [](const Metrics& m) { return of_wall(m, [](auto& w) { return w.circumferential.p50; }); }},
      {{"/wall/circumferential_stretch_p95", "Circumferential stretch, 95th percentile", "",
        "The same.", kNoTriangles},
       [](const Metrics& m) { return of_wall(m, [](auto& w) { return w.circumferential.p95; }); }},
      {{"/wall/circumferential_stretch_p99", "Circumferential stretch, 99th percentile", "",
        "The same.", kNoTriangles},
       [](const Metrics& m) { return of_wall(m, [](auto& w) { return w.circumferential.p99; }); }},
      {{"/wall/axial_stretch_p5", "Axial stretch, 5th percentile", "", "The same along the vessel.",
        kNoTriangles},
       [](const Metrics& m) { return of_wall(m, [](auto& w) { return w.axial.p5; }); }},
      {{"/wall/axial_stretch_p50", "Axial stretch, median", "", "The same.", kNoTriangles},
       [](const Metrics& m) { return of_wall(m, [](auto& w) { return w.axial.p50; }); }},
      {{"/wall/axial_stretch_p95", "Axial stretch, 95th percentile", "", "The same.", kNoTriangles},
       [](const Metrics& m) { return of_wall(m, [](auto& w) { return w.axial.p95; }); }},
      {{"/wall/axial_stretch_p99", "Axial stretch, 99th percentile", "", "The same.", kNoTriangles},
       [](const Metrics& m) { return of_wall(m, [](auto& w) { return w.axial.p99; }); }},
      {{"/wall/area_ratio_p5", "Area ratio, 5th percentile", "",
        "Area after over before, of triangles.", kNoTriangles},
       [](const Metrics& m) { return of_wall(m, [](auto& w) { return w.area_ratio.p5; }); }},
      {{"/wall/area_ratio_p50", "Area ratio, median", "", "The same.", kNoTriangles},
       [](const Metrics& m) { return of_wall(m, [](auto& w) { return w.area_ratio.p50; }); }},
      {{"/wall/area_ratio_p95", "Area ratio, 95th percentile", "", "The same.", kNoTriangles},
       [](const Metrics& m) { return of_wall(m, [](auto& w) { return w.area_ratio.p95; }); }},
      {{"/wall/area_ratio_p99", "Area ratio, 99th percentile", "", "The same.", kNoTriangles},
       [](const Metrics& m) { return of_wall(m, [](auto& w) { return w.area_ratio.p99; }); }},
      {{"/wall/largest_stretch_p5", "Largest principal stretch, 5th percentile", "",
        "Larger singular value of F.", kNoTriangles},
       [](const Metrics& m) { return of_wall(m, [](auto& w) { return w.largest.p5; }); }},
      {{"/wall/largest_stretch_p50", "Largest principal stretch, median", "", "The same.",
        kNoTriangles},
       [](const Metrics& m) { return of_wall(m, [](auto& w) { return w.largest.p50; }); }},
      {{"/wall/largest_stretch_p95", "Largest principal stretch, 95th percentile", "", "The same.",
        kNoTriangles},
       [](const Metrics& m) { return of_wall(m, [](auto& w) { return w.largest.p95; }); }},
      {{"/wall/largest_stretch_p99", "Largest principal stretch, 99th percentile", "", "The same.",
        kNoTriangles},
       [](const Metrics& m) { return of_wall(m, [](auto& w) { return w.largest.p99; }); }},
      {{"/wall/smallest_stretch_p5", "Smallest principal stretch, 5th percentile", "",
        "Smaller singular value of F.", kNoTriangles},
       [](const Metrics& m) { return of_wall(m, [](auto& w) { return w.smallest.p5; }); }},
      {{"/wall/smallest_stretch_p50", "Smallest principal stretch, median", "", "The same.",
        kNoTriangles},
       [](const Metrics& m) { return of_wall(m, [](auto& w) { return w.smallest.p50; }); }},
      {{"/wall/smallest_stretch_p95", "Smallest principal stretch, 95th percentile", "",
        "The same.", kNoTriangles},
       [](const Metrics& m) { return of_wall(m, [](auto& w) { return w.smallest.p95; }); }},
      {{"/wall/smallest_stretch_p99", "Smallest principal stretch, 99th percentile", "",
        "The same.", kNoTriangles},
       [](const Metrics& m) { return of_wall(m, [](auto& w) { return w.smallest.p99; }); }},
      {{"/wall/stretched_above_1_2_percent", "Stretched above 1.2", "%",
        "Share of the stented wall whose circumferential stretch is larger; a scale, no limit of "
        "injury.",
        kNoTriangles},
       [](const Metrics& m) { return of_wall(m, [](auto& w) { return w.overstretched[0]; }); }},
      {{"/wall/stretched_above_1_5_percent", "Stretched above 1.5", "%", "The same.", kNoTriangles},
       [](const Metrics& m) { return of_wall(m, [](auto& w) { return w.overstretched[1]; }); }},
      {{"/wall/stretched_above_2_0_percent", "Stretched above 2.0", "%", "The same.", kNoTriangles},
       [](const Metrics& m) { return of_wall(m, [](auto& w) { return w.overstretched[2]; }); }},
      {{"/neighbours/within_mm", "Neighbours looked for within", "mm",
        "The largest equivalent diameter after in the treated length.", ""},
       [](const Metrics& m) -> Json { return m.neighbours_within; }},
      {{"/neighbours/distance_before_mm", "Distance to neighbouring wall before", "mm",
        "From a vertex of the stented wall to the nearest wall that is within that distance in "
        "space, but farther than twice it along the surface.",
        kNoNeighbour},
       [](const Metrics& m) { return or_null(m.neighbours_before); }},
      {{"/neighbours/distance_after_mm", "Distance to neighbouring wall after", "mm",
        "The same, after.", kNoNeighbour},
       [](const Metrics& m) { return or_null(m.neighbours_after); }},
  };
}

}  // namespace vstent::measure

#include "measure/rows.hpp"

namespace vstent::measure {
namespace {

using Json = nlohmann::ordered_json;

Json some(double value) { return known(value > 0, value); }

std::optional<double> difference(const std::optional<double>& a, const std::optional<double>& b) {
  return a && b ? std::optional(*a - *b) : std::nullopt;
}

}  // namespace

std::vector<Row> lumen_rows() {
  return {
      {{"/lumen/treated_from_mm", "Treated length from", "mm",
        "Arc length along the centerline before, from its inlet, where the stent begins; where no "
        "stent is known, where the lumen's diameter first changed by more than 2 %, or the whole "
        "way where it did nowhere.",
        ""},
       [](const Metrics& m) -> Json { return m.treated_from; }},
      {{"/lumen/treated_to_mm", "Treated length to", "mm", "Where it ends, the same way.", ""},
       [](const Metrics& m) -> Json { return m.treated_to; }},
      {{"/lumen/narrowest_before_mm", "Narrowest lumen before", "mm",
        "Smallest equivalent diameter sqrt(4 A / pi) of a section in the treated length; sections "
        "that run into a branch do not count.",
        kNoSection},
       [](const Metrics& m) { return some(m.narrowest_before); }},
      {{"/lumen/narrowest_after_mm", "Narrowest lumen after", "mm", "The same, after.", kNoSection},
       [](const Metrics& m) { return some(m.narrowest_after); }},
      {{"/lumen/narrowest_before_at_mm", "Place of the narrowest lumen before", "mm",
        "Its arc length along the centerline.", kNoSection},
       [](const Metrics& m) { return known(m.narrowest_before > 0, m.narrowest_before_at); }},
      {{"/lumen/narrowest_after_at_mm", "Place of the narrowest lumen after", "mm",
        "Its arc length along the centerline.", kNoSection},
       [](const Metrics& m) { return known(m.narrowest_after > 0, m.narrowest_after_at); }},
      {{"/lumen/acute_gain_mm", "Acute gain", "mm",
        "Narrowest equivalent diameter after less that before.", kNoSection},
       [](const Metrics& m) {
         return known(m.narrowest_before > 0 && m.narrowest_after > 0,
                      m.narrowest_after - m.narrowest_before);
       }},
      {{"/lumen/minimum_lumen_area_before_mm2", "Minimum lumen area before", "mm2",
        "Smallest section of the treated length and 5 mm beyond both of its ends.", kNoSection},
       [](const Metrics& m) { return or_null(m.min_area_before); }},
      {{"/lumen/minimum_lumen_area_after_mm2", "Minimum lumen area after", "mm2",
        "The same, after.", kNoSection},
       [](const Metrics& m) { return or_null(m.min_area_after); }},
      {{"/lumen/minimum_stent_area_mm2", "Minimum stent area", "mm2",
        "Smallest lumen section after within the treated length.", kNoSection},
       [](const Metrics& m) { return or_null(m.min_stent_area); }},
      {{"/lumen/reference_proximal_mm", "Proximal reference lumen", "mm",
        "Largest equivalent diameter before in the proximal landing zone: 5 mm, or a diameter, "
        "beyond the treated length.",
        kNoReference},
       [](const Metrics& m) { return or_null(m.reference_proximal); }},
      {{"/lumen/reference_distal_mm", "Distal reference lumen", "mm",
        "The same in the distal landing zone.", kNoReference},
       [](const Metrics& m) { return or_null(m.reference_distal); }},
      {{"/lumen/diameter_stenosis_before_percent", "Diameter stenosis before", "%",
        "100 (1 - narrowest / reference lumen diameter).", kNoReference},
       [](const Metrics& m) { return or_null(m.stenosis_before); }},
      {{"/lumen/diameter_stenosis_after_percent", "Residual diameter stenosis", "%",
        "The same after, against the reference before; negative where the lumen became wider.",
        kNoReference},
       [](const Metrics& m) { return or_null(m.stenosis_after); }},
      {{"/lumen/area_stenosis_before_percent", "Area stenosis before", "%",
        "100 (1 - narrowest / reference lumen area).", kNoReference},
       [](const Metrics& m) { return or_null(m.area_stenosis_before); }},
      {{"/lumen/area_stenosis_after_percent", "Residual area stenosis", "%", "The same, after.",
        kNoReference},
       [](const Metrics& m) { return or_null(m.area_stenosis_after); }},
      {{"/lumen/volume_before_mm3", "Lumen volume before", "mm3",
        "Integral of the section area over the treated length.", kNoSection},
       [](const Metrics& m) { return or_null(m.volume_before); }},
      {{"/lumen/volume_after_mm3", "Lumen volume after", "mm3", "The same, after.", kNoSection},
       [](const Metrics& m) { return or_null(m.volume_after); }},
      {{"/lumen/volume_gain_mm3", "Volume gain", "mm3", "Lumen volume after less that before.",
        kNoSection},
       [](const Metrics& m) { return or_null(difference(m.volume_after, m.volume_before)); }},
      {{"/lumen/symmetry_after", "Smallest symmetry after", "",
        "Smallest over largest diameter through the centroid, of the least round section in the "
        "treated length.",
        kNoSection},
       [](const Metrics& m) { return or_null(m.symmetry_after); }},
      {{"/lumen/expansion_mean_percent", "Mean expansion", "%",
        "Equivalent diameter after over the nominal one, mean over the stent.", kNoTarget},
       [](const Metrics& m) { return or_null(m.expansion_mean); }},
      {{"/lumen/expansion_smallest_percent", "Smallest expansion", "%",
        "The same, where it is smallest.", kNoTarget},
       [](const Metrics& m) { return or_null(m.expansion_min); }},
      {{"/lumen/expansion_of_reference_percent", "Expansion of the reference area", "%",
        "Minimum stent area over the mean of the two reference lumen areas (EAPCI 2018: above "
        "80 %).",
        kNoReference},
       [](const Metrics& m) { return or_null(m.expansion_of_reference); }},
      {{"/lumen/opened_mean_diameter_over_target", "Opened lumen over target", "",
        "Where the lumen was narrower than the nominal diameter: mean equivalent diameter after "
        "over nominal.",
        kNoTarget},
       [](const Metrics& m) { return known(m.has_target, m.opened_mean_over_target); }},
      {{"/lumen/opened_min_diameter_mm", "Smallest diameter opened", "mm",
        "There, the smallest diameter of any direction.", kNoTarget},
       [](const Metrics& m) { return known(m.has_target, m.opened_min_diameter); }},
      {{"/lumen/opened_share_of_length", "Share of the stent that opened", "",
        "Share of the stented length that was narrower than the nominal diameter.", kNoTarget},
       [](const Metrics& m) { return known(m.has_target, m.opened_share); }},
  };
}

}  // namespace vstent::measure

#include "report/definitions.hpp"

namespace vstent::report {

std::span<const Definition> definitions() {
  static constexpr Definition kDefinitions[] = {
      {"/lumen/narrowest_before_mm", "Narrowest lumen before", "mm",
       "smallest equivalent diameter, sqrt(4 area / pi), of the cross-sections along the stent"},
      {"/lumen/narrowest_after_mm", "Narrowest lumen after", "mm",
       "the same after stenting, on stented.vtp as written"},
      {"/lumen/opened_mean_diameter_over_target", "Mean diameter over target", "",
       "mean equivalent diameter over the stent's nominal one, where the stent opened the lumen"},
      {"/lumen/opened_min_diameter_mm", "Smallest chord where opened", "mm",
       "shortest chord through the centroid of a cross-section that the stent opened"},
      {"/lumen/opened_share_of_length", "Share of length opened", "",
       "part of the stent's length along which the lumen was narrower than the stent"},
      {"/lumen/diameter_stenosis_before_percent", "Diameter stenosis before", "%",
       "100 (1 - narrowest / reference diameter)"},
      {"/lumen/diameter_stenosis_after_percent", "Diameter stenosis after", "%",
       "the same after stenting; negative where the narrowest lumen is wider than the reference"},
      {"/shape/stent_bend_before_deg", "Bend before", "deg",
       "angle between the end tangents of the stent's axis before stenting"},
      {"/shape/stent_bend_after_deg", "Bend of the stent", "deg",
       "the same of the stent's axis as deployed"},
      {"/shape/lumen_bend_after_deg", "Bend of the lumen after", "deg",
       "angle between the end tangents of the line through the centroids of the cross-sections"},
      {"/shape/largest_displacement_mm", "Largest displacement", "mm",
       "farthest that a vertex of the wall moved"},
      {"/shape/deepest_penetration_mm", "Deepest penetration", "mm",
       "farthest that a vertex of the wall lies inside the stent; a residual of the solver"},
      {"/struts/strut_length_mm", "Length of metal", "mm", "of all strut centre lines"},
      {"/struts/mean_gap_mm", "Mean gap", "mm",
       "between the struts' outer surface and the wall; 0 where they touch"},
      {"/struts/largest_gap_mm", "Largest gap", "mm", "of any strut that does not cross an opening"},
      {"/struts/percent_over_openings", "Struts over openings", "%",
       "part of the strut length that crosses the mouth of a branch"},
      {"/struts/mean_prolapse_mm", "Mean prolapse", "mm",
       "how far the wall sags between the struts into the lumen"},
      {"/struts/largest_prolapse_mm", "Largest prolapse", "mm", "deepest of these"},
      {"/struts/deepest_penetration_mm", "Deepest penetration by struts", "mm",
       "farthest that the wall lies inside a strut"},
      {"/design/foreshortening_percent", "Foreshortening", "%",
       "100 (1 - deployed length / crimped length)"},
      {"/design/percent_metal_to_artery", "Metal to artery", "%",
       "outer metal area over the area of the cylinder it lies on"},
      {"/design/largest_inscribed_circle_mm", "Largest inscribed circle", "mm",
       "diameter of the largest ball that fits through a cell"},
      {"/simulation/relative_residual", "Force imbalance", "",
       "unbalanced force on the wall over the mean contact force, at the last step"},
      {"/simulation/contact_force_N", "Contact force", "N",
       "sum of the forces by which the stent holds the wall open"},
      {"/reference_diameter_mm", "Reference diameter", "mm",
       "smaller of the healthy lumens before and behind the lesion; 0 where there is none"},
  };
  return kDefinitions;
}

}  // namespace vstent::report

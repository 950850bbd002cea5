#include "measure/definitions.hpp"

#include "measure/rows.hpp"

namespace vstent::measure {
namespace {

constexpr std::string_view kNoBranch = "no branch leaves the way near the treated length";
constexpr std::string_view kNoOstium = "no section across the branch's root is closed";
constexpr std::string_view kDeployOnly = "only a deployment knows it";
constexpr std::string_view kRigidStent = "the stent does not give way";
constexpr std::string_view kNoStruts = "only a deployment of a design knows it";
constexpr std::string_view kOpen = "the surface is open there";

/// What stands in lists, or is written by a deployment.
constexpr Definition kListed[] = {
    {"/branches/*/branch", "Branch", "", "Its id in the centerline.", kNoBranch},
    {"/branches/*/arc_length_mm", "Place", "mm",
     "Arc length along the centerline where it leaves the vessel.", kNoBranch},
    {"/branches/*/in_stent", "Beside the stent", "", "Whether that is in the treated length.",
     kNoBranch},
    {"/branches/*/ostium_area_before_mm2", "Ostium before", "mm2",
     "Area of the section across the branch's root: half a branch radius behind the place where "
     "its "
     "centerline leaves the vessel's inscribed spheres, or the first place from there on (steps of "
     "a tenth of the radius, up to three radii) where the outline closes and is no wider than 1.5 "
     "branch diameters.",
     kNoOstium},
    {"/branches/*/ostium_area_after_mm2", "Ostium after", "mm2",
     "Area of the same loop as the wall carried it; where triangles do not correspond, of the cut "
     "in the same plane.",
     kNoOstium},
    {"/branches/*/ostium_area_change_percent", "Ostium change", "%", "100 (after / before - 1).",
     kNoOstium},
    {"/branches/*/ostium_symmetry_before", "Ostium symmetry before", "",
     "Smallest over largest diameter.", kNoOstium},
    {"/branches/*/ostium_symmetry_after", "Ostium symmetry after", "", "The same, after.",
     kNoOstium},
    {"/branches/*/coverage_percent", "Coverage", "%",
     "Share of the ostium from which the way along the branch meets the stent before the vessel's "
     "axis; a smooth tube is one closed body.",
     kNoStent},
    {"/struts/strut_length_mm", "Length of all struts", "mm",
     "Of the centre lines of struts, connectors and wires.", kNoStruts},
    {"/struts/outer_surface_mm2", "Outer surface", "mm2",
     "Of a stent that is a surface, instead of the length; its shares are of this area.",
     "the stent is no surface"},
    {"/struts/mean_gap_mm", "Mean gap of the struts", "mm",
     "From the outer face of the metal to the wall, along the way out from the axis.", kNoStruts},
    {"/struts/largest_gap_mm", "Largest gap of a strut", "mm", "The largest.", kNoStruts},
    {"/struts/malapposed/*/gap_above_mm", "Gap above", "mm", "A threshold.", kNoStruts},
    {"/struts/malapposed/*/percent_of_struts", "Struts with such a gap", "%",
     "Share of the struts' length.", kNoStruts},
    {"/struts/percent_over_openings", "Struts over openings", "%",
     "Share of their length with no wall within a stent radius.", kNoStruts},
    {"/struts/mean_prolapse_mm", "Mean prolapse", "mm",
     "How far the wall comes inside the stent's outer surface, where it does.", kNoStruts},
    {"/struts/largest_prolapse_mm", "Largest prolapse", "mm", "The largest.", kNoStruts},
    {"/struts/deepest_penetration_mm", "Deepest penetration of a strut", "mm",
     "Of any place of the wall into the metal, by the exact distance.", kNoStruts},
    {"/stations/*/arc_length_mm", "Arc length", "mm", "Along the centerline, from its inlet.", ""},
    {"/stations/*/target_diameter_mm", "Nominal diameter", "mm", "Of the lumen, in the stent.",
     kNoTarget},
    {"/stations/*/crosses_branch_before", "Runs into a branch before", "",
     "A point of the outline belongs to a branch.", ""},
    {"/stations/*/crosses_branch_after", "Runs into a branch after", "", "The same, after.", ""},
    {"/stations/*/before/area_mm2", "Area before", "mm2", "Of the section normal to the axis.",
     kOpen},
    {"/stations/*/before/equivalent_diameter_mm", "Equivalent diameter before", "mm",
     "sqrt(4 A / pi).", kOpen},
    {"/stations/*/before/min_diameter_mm", "Smallest diameter before", "mm",
     "Shortest chord through the centroid.", kOpen},
    {"/stations/*/before/max_diameter_mm", "Largest diameter before", "mm",
     "Longest chord through the centroid.", kOpen},
    {"/stations/*/after/area_mm2", "Area after", "mm2", "The same, after.", kOpen},
    {"/stations/*/after/equivalent_diameter_mm", "Equivalent diameter after", "mm",
     "The same, after.", kOpen},
    {"/stations/*/after/min_diameter_mm", "Smallest diameter after", "mm", "The same, after.",
     kOpen},
    {"/stations/*/after/max_diameter_mm", "Largest diameter after", "mm", "The same, after.",
     kOpen},
    {"/unmeasured/*", "Not measured", "", "Why figures are null, by their JSON pointers.",
     "everything could be measured"},
    {"/design/name", "Design", "", "Its name.", kNoStruts},
    {"/design/family", "Family", "", "Of designs.", kNoStruts},
    {"/design/length_mm", "Length deployed", "mm", "Of the stent at its final diameter.",
     kNoStruts},
    {"/design/nominal_length_mm", "Nominal length", "mm", "At its nominal diameter.", kNoStruts},
    {"/design/crimped_length_mm", "Length crimped", "mm", "At its crimped diameter.", kNoStruts},
    {"/design/foreshortening_percent", "Foreshortening", "%",
     "100 (1 - length deployed / length crimped).", kNoStruts},
    {"/design/percent_metal_to_artery", "Metal to artery", "%",
     "Abluminal metal over the area of the cylinder it lies on.", kNoStruts},
    {"/design/cells", "Cells", "", "Openings of the unrolled design.", kNoStruts},
    {"/design/median_cell_mm2", "Median cell", "mm2", "Of those.", kNoStruts},
    {"/design/largest_cell_mm2", "Largest cell", "mm2", "Of those.", kNoStruts},
    {"/design/largest_inscribed_circle_mm", "Largest circle in a cell", "mm", "Its diameter.",
     kNoStruts},
    {"/design/struts", "Struts", "", "Their number.", kNoStruts},
    {"/design/connectors", "Connectors", "", "Their number.", kNoStruts},
    {"/design/largest_diameter_mm", "Largest diameter of the design", "mm",
     "Beyond which it cannot be expanded.", kNoStruts},
    {"/design/balloon_diameter_for_recoil_mm", "Balloon diameter", "mm",
     "That leaves the deployed diameter after recoil.", kNoStruts},
    {"/design/largest_strut_strain", "Largest strain of a strut", "",
     "By which a placed strut is longer or shorter than the design's.", kNoStruts},
    {"/design/largest_connector_strain", "Largest strain of a connector", "", "The same.",
     kNoStruts},
    {"/design/overlapping_rings/*", "Overlapping rings", "", "On the inner side of bends.",
     kNoStruts},
    {"/design/surface_outer_diameter_mm", "Outer diameter of the surface", "mm", "As it was given.",
     "the stent is no surface"},
    {"/design/widened_by", "Widened by", "", "Deployed over given diameter.",
     "the stent is no surface"},
    {"/design/thickness_mm", "Thickness", "mm", "Of the metal.", "the stent is no surface"},
    {"/design/strut_width_mm", "Strut width", "mm", "Of the metal.", "the stent is no surface"},
    {"/design/metal_mm3", "Metal", "mm3", "Volume of the surface.", "the stent is no surface"},
    {"/simulation/converged", "Forces balance", "", "Whether they did within the tolerance.",
     kDeployOnly},
    {"/simulation/steps", "Steps", "", "Taken in all.", kDeployOnly},
    {"/simulation/relative_residual", "Force residual", "", "Over the mean contact force.",
     kDeployOnly},
    {"/simulation/contact_force_N", "Contact force", "N", "Sum over the wall.", kDeployOnly},
    {"/simulation/stent_shift_mm", "Shift of the stent's axis", "mm",
     "Largest, from where it was prescribed.", kRigidStent},
    {"/simulation/stent_unbalanced", "Unbalanced force on the stent", "",
     "The most work that forces on it do along any shift, turn, bend or narrowing of 1 mm rms, "
     "over "
     "1 mm and the contact force.",
     kRigidStent},
    {"/simulation/stent_smallest_diameter_mm", "Diameter of the stent where it is narrowed most",
     "mm", "Outer.", kRigidStent},
    {"/simulation/stent_looks", "Looks at the stent's balance", "",
     "Settled walls that it took to find its rest.", kRigidStent},
    {"/warnings/*", "Warning", "", "What a user should look at first.", "there is none"},
};

/// `*` in the pattern stands for one path segment.
bool falls_under(std::string_view pointer, std::string_view pattern) {
  while (!pattern.empty() && !pointer.empty()) {
    const auto next = [](std::string_view& path) {
      path.remove_prefix(1);
      const std::string_view segment = path.substr(0, path.find('/'));
      path.remove_prefix(segment.size());
      return segment;
    };
    const std::string_view wanted = next(pattern), found = next(pointer);
    if (wanted != "*" && wanted != found) return false;
  }
  return pattern.empty() && pointer.empty();
}

}  // namespace

const std::vector<Row>& rows() {
  static const std::vector<Row> all = [] {
    std::vector<Row> result = lumen_rows();
    for (const auto& group : {shape_rows(), stent_rows(), wall_rows(), mesh_rows()})
      result.insert(result.end(), group.begin(), group.end());
    result.push_back(
        {{"/reference_diameter_mm", "Reference lumen", "mm",
          "The smaller of the proximal and the distal reference lumen.", kNoReference},
         [](const Metrics& m) { return known(m.reference_diameter > 0, m.reference_diameter); }});
    return result;
  }();
  return all;
}

std::span<const Definition> definitions() {
  static const std::vector<Definition> all = [] {
    std::vector<Definition> result;
    for (const Row& row : rows()) result.push_back(row.definition);
    result.insert(result.end(), std::begin(kListed), std::end(kListed));
    return result;
  }();
  return all;
}

const Definition* find_definition(std::string_view pointer) {
  for (const Definition& definition : definitions())
    if (falls_under(pointer, definition.key)) return &definition;
  return nullptr;
}

}  // namespace vstent::measure

// What to deploy where: the case file, and the same from the command line.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <variant>

#include "stents/smooth_tube.hpp"
#include "vessels/units.hpp"
#include "xpbd/sheet.hpp"

namespace vstent::deployment {

struct Lesion {};  ///< the tightest narrowing, found
struct AtPoint {
  Vec3 point = Vec3::Zero();
};  ///< nearest place on a centerline; coordinates of the surface file
struct AtArcLength {
  int branch = 0;
  double arc_length = 0;
};  ///< mm from the branch's first point
using Location = std::variant<Lesion, AtPoint, AtArcLength>;

/// `tube`: round joints, flat ends. `capsule`: round joints and ends. `paper`: the union of
/// cylinders of eq. 18.
enum class Shape { tube, capsule, paper };

/// A case as a person writes it: values left out are derived from the geometry (see Setup), then
/// written back into OUT/case.json. Lengths in mm.
struct Case {
  std::filesystem::path surface;
  vessels::LengthUnit unit = vessels::LengthUnit::mm;
  std::filesystem::path centerline;  ///< empty: extracted from the lumen

  Location at = Lesion{};
  std::optional<int>
      towards;         ///< last branch of the way that the stent follows; default: the widest
  std::string design;  ///< preset or design file, absolute; empty: a smooth tube
  double length = 0;   ///< at nominal diameter; 0: the design's own
  std::optional<double>
      diameter;  ///< nothing: auto, the smaller reference lumen (paper, section 3.1)
  double distal_diameter = 0, flare_diameter = 0, flare_length = 0;  ///< 0: none
  Shape shape = Shape::tube;
  stents::Cell cell = stents::Cell::open;
  std::optional<double>
      straightening;  ///< 0 follows the vessel, 1 straightens it; default 0 for open, 1 for closed

  bool gives_way = false;  ///< the wall may bend, shift and narrow the stent
  std::optional<double> bending_stiffness,
      radial_stiffness;  ///< N mm^2; N/mm^2: force per mm of length and mm of diameter

  std::string wall_preset = "elastic";  ///< `elastic`, `paper`, or one of wall_presets()
  bool paper_wall() const { return wall_preset == "paper"; }
  std::optional<double> youngs_modulus, thickness, poisson_ratio;  ///< MPa, mm, 1
  xpbd::MembraneModel membrane = xpbd::MembraneModel::neo_hookean;
  std::string modulus_array, thickness_array;  ///< point arrays of the surface, in place of these
  std::string modulus_unit = "MPa";            ///< of modulus_array; thickness is in the file's
  double tissue_support = 0;                   ///< MPa/mm; 0: none
  /// Walls that come near push each other away and do not cross; default: no.
  std::optional<bool> self_collision;

  std::optional<double> contact_distance;   ///< d_c of eq. 3
  std::optional<double> contact_stiffness;  ///< N/mm per vertex; nothing: rigid
  double friction = 0;                      ///< Coulomb's coefficient, stent on wall
  std::optional<double> patch_margin;       ///< wall that may move beyond the stent
  std::optional<double> patch_edge_length;  ///< that the stented wall is refined to, for struts
  bool keep_refined = true;                 ///< or give the result on the input's own vertices
  std::optional<double> voxel_size;
  std::optional<double> growth_per_step;
  std::optional<int> iterations;
  std::optional<double> tolerance;  ///< static force residual, relative to the mean contact force
  std::optional<int> max_settling_steps;
  int save_steps = 0;  ///< every N steps; 0: none
};

/// \throws Error (usage) `<source>: <key>: what is wrong, what is allowed`; unknown keys name the
/// nearest known one
Case parse_case(const nlohmann::json& json, const std::string& source,
                const std::filesystem::path& relative_to);
/// \throws Error (usage) also for text that is not JSON (line and column) or repeats a key
Case read_case(const std::filesystem::path& path);
nlohmann::ordered_json to_json(const Case& specification);

/// "11mm", shortest text that reads back as the same number.
std::string length_text(double millimetres);

}  // namespace vstent::deployment

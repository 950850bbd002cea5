// What holds at a model's faces: the inflow, and what the vessels beyond each outlet do.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "flow/waveform.hpp"

namespace vstent::flow {

/// Newtonian; cgs. The common choice of large-vessel models.
struct Blood {
  double viscosity = 0.04;  ///< P
  double density = 1.06;    ///< g/mL
};

/// Positive into the vessel; mL/s, or cm/s averaged over the face.
struct Inflow {
  Waveform waveform;
  bool velocity = false;
};

/// p = resistance q + distal_pressure (dyn s/cm5, dyn/cm2).
struct Resistance {
  double resistance = 0, distal_pressure = 0;
};

/// Windkessel: `proximal` in series with `distal` and, beside that, `capacitance` to ground.
struct Rcr {
  double proximal = 0, capacitance = 0, distal = 0;  ///< dyn s/cm5, cm5/dyn, dyn s/cm5
  double distal_pressure = 0;                        ///< dyn/cm2
};

struct Pressure {
  double pressure = 0;  ///< dyn/cm2
};

/// Lumped coronary bed (Kim 2010): Ra, Ca to ground, Ra_micro, Cim to the intramyocardial pressure,
/// Rv to the venous pressure.
struct Coronary {
  double arterial = 0, micro = 0, venous = 0;            ///< dyn s/cm5
  double arterial_compliance = 0, micro_compliance = 0;  ///< cm5/dyn
  Waveform intramyocardial_pressure = constant(0);       ///< dyn/cm2
  double venous_pressure = 0;                            ///< dyn/cm2
};

using Condition = std::variant<Inflow, Resistance, Rcr, Pressure, Coronary>;
bool is_inflow(const Condition& condition);
std::string describe(const Condition& condition);  ///< for a person, one line

/// A face, and where it is on a surface whose faces have no names.
struct FaceCondition {
  std::string name;
  Condition condition;
  std::optional<int> face_id;                    ///< ModelFaceID
  std::optional<std::array<double, 3>> near_to;  ///< coordinates of the surface's file
};

struct BoundaryConditions {
  std::string source;  ///< the file, for messages
  Blood blood;
  std::vector<FaceCondition> faces;  ///< each name once; those of the file in alphabetical order
  std::filesystem::path caps;        ///< folder of one surface file per face, by name; or empty
  std::vector<std::string> notes;    ///< what was converted or mended, one line each

  const FaceCondition* find(const std::string& name) const;
};

/// See docs/boundary-conditions.md. Other files are found relative to this one.
/// \throws Error `<file>: /<key>: what is wrong, what to do` (usage), or of a file that it names
BoundaryConditions read_boundary_conditions(const std::filesystem::path& path);

/// Files differ in what a positive flow means; the mean over the beat tells, because blood enters
/// an inflow face on balance. `positive_in`, where it is given, must agree with that.
/// \throws Error (usage) naming `key` where it does not, or where the mean is near zero
Inflow inflow_of(WaveformFile file, std::optional<bool> positive_in, const std::string& path,
                 const std::string& key, std::vector<std::string>& notes);

/// \throws Error (usage) naming the faces without a condition, or conditions without a face
void require_faces(const BoundaryConditions& conditions, std::span<const std::string> faces,
                   const std::string& model);

/// In mL/s. \param area of the face, cm2; needed only for a velocity
Waveform flow_into(const Inflow& inflow, double area);

/// What steady flow meets from the face to the pressure far beyond it.
Resistance steady(const Condition& outlet);

}  // namespace vstent::flow

#include "meshing/solver_xml.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <nlohmann/json.hpp>
#include <numbers>

#include "meshing/quality.hpp"
#include "vessels/error.hpp"
#include "vessels/text.hpp"

namespace vstent::meshing {
namespace {

using nlohmann::ordered_json;
using vessels::exact;

constexpr int kMostModes = 64;
constexpr double kDeviation = 0.01;
constexpr const char* kCoupling = "svzerod_3Dcoupling.json";

/// Elements in elements.
class Xml {
 public:
  Xml() : text_("<?xml version=\"1.0\" encoding=\"UTF-8\" ?>\n") {}
  void comment(const std::string& words) { line("<!-- " + words + " -->"); }
  void open(const std::string& tag, const std::string& attribute = "") {
    line("<" + tag + (attribute.empty() ? "" : " " + attribute) + ">");
    open_.push_back(tag);
  }
  void close() {
    const std::string tag = open_.back();
    open_.pop_back();
    line("</" + tag + ">");
  }
  void value(const std::string& tag, const std::string& text) {
    line("<" + tag + "> " + text + " </" + tag + ">");
  }
  void value(const std::string& tag, double number) { value(tag, exact(number)); }
  void value(const std::string& tag, int number) { value(tag, std::to_string(number)); }
  std::string text() const { return text_; }

 private:
  void line(const std::string& words) {
    text_.append(2 * open_.size(), ' ');
    text_ += words;
    text_ += '\n';
  }
  std::string text_;
  std::vector<std::string> open_;
};

std::string named(const std::string& name) { return "name=\"" + name + "\""; }

double area_cm2(const Model& model, int id) {
  return measure_quality({model.mesh.points, triangles_of(model, id)}).area / 100;
}

/// Coefficients of the Fourier series of straight lines between samples, exactly integrated.
std::vector<std::complex<double>> fourier(const flow::Waveform& w, int modes) {
  const double period = w.period();
  std::vector<std::complex<double>> c(static_cast<std::size_t>(modes));
  for (int n = 0; n < modes; ++n) {
    auto& sum = c[static_cast<std::size_t>(n)];
    const double omega = 2 * std::numbers::pi * n / period;
    for (std::size_t i = 0; i + 1 < w.time.size(); ++i) {
      const double t0 = w.time[i], t1 = w.time[i + 1], v0 = w.value[i], v1 = w.value[i + 1];
      if (n == 0) {
        sum += 0.5 * (v0 + v1) * (t1 - t0);
      } else {  // by parts; what stands at the samples cancels over a period
        const double slope = (v1 - v0) / (t1 - t0);
        sum +=
            slope * (std::polar(1.0, -omega * t1) - std::polar(1.0, -omega * t0)) / (omega * omega);
      }
    }
    sum /= period;
  }
  return c;
}

/// What the case says of one outlet, and whether svMultiPhysics can hold it by itself.
bool foreign(const flow::Condition& condition) {
  const auto* resistance = std::get_if<flow::Resistance>(&condition);
  return std::holds_alternative<flow::Coronary>(condition) ||
         (resistance != nullptr && resistance->distal_pressure != 0);
}

class CaseWriter {
 public:
  CaseWriter(const Model& model, const flow::BoundaryConditions& conditions,
             const SolverOptions& options)
      : model_(model), conditions_(conditions), options_(options) {
    std::vector<std::string> caps;
    for (const Face& face : model.faces) {
      if (face.cap) caps.push_back(face.name);
    }
    flow::require_faces(conditions, caps, "the model");
    for (const flow::FaceCondition& face : conditions.faces)
      coupled_ = coupled_ || foreign(face.condition);
  }

  SolverCase run() {
    collect_inflows();
    set_time();
    xml_.open("svMultiPhysicsFile", "version=\"0.1\"");
    xml_.comment("cgs: cm, s, g; flow in cm3/s, into the vessel negative; pressure in dyn/cm2");
    write_general();
    write_mesh();
    write_equation();
    xml_.close();
    if (coupled_) write_coupling();
    result_.xml = xml_.text();
    return std::move(result_);
  }

 private:
  void collect_inflows() {
    for (const Face& face : model_.faces) {
      if (!face.cap) continue;
      const auto* inflow = std::get_if<flow::Inflow>(&conditions_.find(face.name)->condition);
      if (inflow == nullptr) continue;
      const flow::Waveform wave = flow::flow_into(*inflow, area_cm2(model_, face.id));
      if (inflow->velocity)
        result_.notes.push_back(face.name + ": the velocity times the face's area of " +
                                vessels::number(area_cm2(model_, face.id)) + " cm2 is " +
                                vessels::number(flow::mean(wave)) + " mL/s on average");
      mean_inflow_ += flow::mean(wave);
      inflows_.emplace(face.name, wave);
    }
    if (inflows_.empty())
      throw Error(ExitCode::usage, conditions_.source + ": no face has an inflow");
  }

  void set_time() {
    for (const auto& [name, wave] : inflows_) {
      if (wave.constant()) continue;
      if (result_.period > 0 && std::abs(wave.period() - result_.period) > 1e-6 * result_.period)
        result_.notes.push_back("inflows have periods of " + vessels::number(result_.period) +
                                " and " + vessels::number(wave.period()) +
                                " s; time steps follow the longest");
      result_.period = std::max(result_.period, wave.period());
    }
    if (result_.period == 0) {
      result_.period = 1;
      result_.notes.push_back("the inflow is constant: beats of 1 s are assumed for time steps");
    }
    result_.time_step = result_.period / options_.steps_per_beat;
    result_.time_steps = options_.steps_per_beat * options_.beats;
  }

  void write_general() {
    const int saved_each = std::max(1, options_.steps_per_beat / 20);
    xml_.open("GeneralSimulationParameters");
    xml_.value("Continue_previous_simulation", "false");
    xml_.value("Number_of_spatial_dimensions", 3);
    xml_.value("Number_of_time_steps", result_.time_steps);
    xml_.value("Time_step_size", result_.time_step);
    xml_.value("Spectral_radius_of_infinite_time_step", 0.5);
    xml_.value("Searched_file_name_to_trigger_stop", "STOP_SIM");
    xml_.value("Save_results_to_VTK_format", "true");
    xml_.value("Name_prefix_of_saved_VTK_files", "result");
    xml_.value("Increment_in_saving_VTK_files", saved_each);
    xml_.value("Start_saving_after_time_step",
               std::max(1, result_.time_steps - options_.steps_per_beat));
    xml_.value("Increment_in_saving_restart_files", options_.steps_per_beat);
    xml_.value("Convert_BIN_to_VTK_format", "false");
    xml_.value("Verbose", "true");
    xml_.value("Warning", "false");
    xml_.value("Debug", "false");
    xml_.close();
  }

  void write_mesh() {
    xml_.open("Add_mesh", named("msh"));
    xml_.value("Mesh_file_path", "mesh-complete/mesh-complete.mesh.vtu");
    for (const Face& face : model_.faces) {
      xml_.open("Add_face", named(face.name));
      xml_.value("Face_file_path", "mesh-complete/mesh-surfaces/" + face.name + ".vtp");
      xml_.close();
    }
    xml_.close();
  }

  void write_equation() {
    xml_.open("Add_equation", "type=\"fluid\"");
    xml_.value("Coupled", "true");
    xml_.value("Min_iterations", 3);
    xml_.value("Max_iterations", 10);
    xml_.value("Tolerance", "1e-3");
    xml_.value("Backflow_stabilization_coefficient", 0.2);
    xml_.value("Density", conditions_.blood.density);
    xml_.open("Viscosity", "model=\"Constant\"");
    xml_.value("Value", conditions_.blood.viscosity);
    xml_.close();
    xml_.open("Output", "type=\"Spatial\"");
    for (const char* field : {"Velocity", "Pressure", "Traction", "WSS", "Vorticity", "Divergence"})
      xml_.value(field, "true");
    xml_.close();
    xml_.open("LS", "type=\"NS\"");
    xml_.open("Linear_algebra", "type=\"fsils\"");
    xml_.value("Preconditioner", "fsils");
    xml_.close();
    xml_.value("Max_iterations", 10);
    xml_.value("NS_GM_max_iterations", 3);
    xml_.value("NS_CG_max_iterations", 500);
    xml_.value("Tolerance", "1e-3");
    xml_.value("NS_GM_tolerance", "1e-3");
    xml_.value("NS_CG_tolerance", "1e-3");
    xml_.value("Krylov_space_dimension", 50);
    xml_.close();
    if (coupled_) {
      xml_.open("svZeroDSolver_interface");
      xml_.value("Coupling_type", "semi-implicit");
      xml_.value("Configuration_file", kCoupling);
      xml_.value("Shared_library", options_.zero_d_library);
      xml_.value("Initial_flows", 0.0);
      xml_.value("Initial_pressures", outlet_pressure());
      xml_.close();
    }
    for (const Face& face : model_.faces) {
      xml_.open("Add_BC", named(face.name));
      if (face.cap) {
        write_condition(face, conditions_.find(face.name)->condition);
      } else {
        xml_.value("Type", "Dir");
        xml_.value("Time_dependence", "Steady");
        xml_.value("Value", 0.0);
      }
      xml_.close();
    }
    xml_.close();
  }

  void write_condition(const Face& face, const flow::Condition& condition) {
    if (std::holds_alternative<flow::Inflow>(condition)) {
      write_inflow(face.name);
      return;
    }
    xml_.value("Type", "Neu");
    const auto* rcr = std::get_if<flow::Rcr>(&condition);
    if (foreign(condition) || (coupled_ && rcr != nullptr)) {
      xml_.value("Time_dependence", "Coupled");
      xml_.value("svZeroDSolver_block", face.name + "_coupling");
      blocks_.push_back(face.name);
    } else if (rcr != nullptr) {
      xml_.value("Time_dependence", "RCR");
      xml_.open("RCR_values");
      xml_.value("Proximal_resistance", rcr->proximal);
      xml_.value("Capacitance", rcr->capacitance);
      xml_.value("Distal_resistance", rcr->distal);
      xml_.value("Distal_pressure", rcr->distal_pressure);
      const double flow =
          (outlet_pressure() - rcr->distal_pressure) / (rcr->proximal + rcr->distal);
      xml_.value("Initial_pressure", rcr->distal_pressure + rcr->distal * flow);
      xml_.close();
    } else if (const auto* resistance = std::get_if<flow::Resistance>(&condition)) {
      xml_.value("Time_dependence", "Resistance");
      xml_.value("Value", resistance->resistance);
    } else {
      xml_.value("Time_dependence", "Steady");
      xml_.value("Value", std::get<flow::Pressure>(condition).pressure);
    }
  }

  void write_inflow(const std::string& face) {
    const flow::Waveform& wave = inflows_.at(face);
    xml_.value("Type", "Dir");
    if (wave.constant()) {
      xml_.value("Time_dependence", "Steady");
      xml_.value("Value", -wave.value.front());
    } else {
      const WaveformText file = svmultiphysics_flow(wave);
      result_.files[face + ".flow"] = file.text;
      result_.notes.push_back(face + ".flow: " + std::to_string(wave.time.size()) +
                              " samples, negative into the vessel, " + std::to_string(file.modes) +
                              " Fourier modes follow them to " +
                              vessels::number(std::round(1e4 * file.deviation) / 100) +
                              " % of their range");
      xml_.value("Time_dependence", "Unsteady");
      xml_.value("Temporal_values_file_path", face + ".flow");
    }
    xml_.value("Profile", "Parabolic");
    xml_.value("Impose_flux", "true");
    xml_.value("Zero_out_perimeter", "true");
  }

  /// At all outlets alike when the mean inflow runs off through them side by side.
  double outlet_pressure() const {
    double conductance = 0, driven = 0;
    for (const flow::FaceCondition& face : conditions_.faces) {
      if (flow::is_inflow(face.condition)) continue;
      if (const auto* fixed = std::get_if<flow::Pressure>(&face.condition)) return fixed->pressure;
      const flow::Resistance outlet = flow::steady(face.condition);
      if (!(outlet.resistance > 0)) return outlet.distal_pressure;
      conductance += 1 / outlet.resistance;
      driven += outlet.distal_pressure / outlet.resistance;
    }
    return conductance > 0 ? (mean_inflow_ + driven) / conductance : 0;
  }

  void write_coupling() {
    ordered_json json;
    json["simulation_parameters"] = {{"coupled_simulation", true},
                                     {"number_of_time_pts", 100},
                                     {"output_all_cycles", true},
                                     {"steady_initial", false}};
    json["boundary_conditions"] = ordered_json::array();
    json["external_solver_coupling_blocks"] = ordered_json::array();
    json["junctions"] = ordered_json::array();
    json["vessels"] = ordered_json::array();
    for (const std::string& face : blocks_) {
      ordered_json bed = bed_of(conditions_.find(face)->condition);
      json["boundary_conditions"].push_back(
          {{"bc_name", face}, {"bc_type", bed["type"]}, {"bc_values", bed["values"]}});
      json["external_solver_coupling_blocks"].push_back(
          {{"name", face + "_coupling"},
           {"type", "FLOW"},
           {"location", "inlet"},
           {"connected_block", face},
           {"periodic", false},
           {"values", {{"t", {0.0, result_.period}}, {"Q", {1.0, 1.0}}}}});
    }
    result_.files[kCoupling] = json.dump(2) + "\n";
    result_.notes.push_back(
        vessels::counted(blocks_.size(), "outlet") + " run through svZeroDSolver (" + kCoupling +
        "); Shared_library in solver.xml must name its interface library, now " +
        options_.zero_d_library);
  }

  ordered_json bed_of(const flow::Condition& condition) const {
    if (const auto* rcr = std::get_if<flow::Rcr>(&condition))
      return {{"type", "RCR"},
              {"values",
               {{"Rp", rcr->proximal},
                {"C", rcr->capacitance},
                {"Rd", rcr->distal},
                {"Pd", rcr->distal_pressure}}}};
    if (const auto* resistance = std::get_if<flow::Resistance>(&condition))
      return {{"type", "RESISTANCE"},
              {"values", {{"R", resistance->resistance}, {"Pd", resistance->distal_pressure}}}};
    const auto& bed = std::get<flow::Coronary>(condition);
    const flow::Waveform& squeeze = bed.intramyocardial_pressure;
    std::vector<double> time = squeeze.time, pressure = squeeze.value;
    if (squeeze.constant()) {
      time = {0, result_.period};
      pressure = {pressure.front(), pressure.front()};
    }
    return {{"type", "CORONARY"},
            {"values",
             {{"Ra1", bed.arterial},
              {"Ra2", bed.micro},
              {"Rv1", bed.venous},
              {"Ca", bed.arterial_compliance},
              {"Cc", bed.micro_compliance},
              {"t", time},
              {"Pim", pressure},
              {"P_v", bed.venous_pressure}}}};
  }

  const Model& model_;
  const flow::BoundaryConditions& conditions_;
  SolverOptions options_;
  Xml xml_;
  SolverCase result_;
  std::map<std::string, flow::Waveform> inflows_;  // mL/s into the vessel, by face
  double mean_inflow_ = 0;
  bool coupled_ = false;
  std::vector<std::string> blocks_;  // faces whose outlet is coupled
};

}  // namespace

WaveformText svmultiphysics_flow(const flow::Waveform& into_vessel) {
  const flow::Waveform& w = into_vessel;
  const auto [low, high] = std::minmax_element(w.value.begin(), w.value.end());
  const double range = std::max(*high - *low, 1e-300);
  const int samples = static_cast<int>(w.time.size());
  const int most = std::min(kMostModes, std::max(2, samples - 1));
  const auto c = fourier(w, most);
  const int places = 8 * samples;
  std::vector<double> rest;
  for (int k = 0; k < places; ++k)
    rest.push_back(flow::at(w, w.period() * k / places) - c[0].real());
  WaveformText result;
  for (result.modes = 1;; ++result.modes) {
    result.deviation = 0;
    for (const double r : rest) result.deviation = std::max(result.deviation, std::abs(r) / range);
    if (result.modes >= most || (result.modes >= 2 && result.deviation <= kDeviation)) break;
    for (int k = 0; k < places; ++k) {
      const double phase = 2 * std::numbers::pi * result.modes * k / places;
      rest[static_cast<std::size_t>(k)] -=
          2 * (c[static_cast<std::size_t>(result.modes)] * std::polar(1.0, phase)).real();
    }
  }
  result.text = std::to_string(samples);
  result.text += " ";
  result.text += std::to_string(result.modes) + "\n";
  for (std::size_t i = 0; i < w.time.size(); ++i) {
    result.text += exact(w.time[i]);
    result.text += " ";
    result.text += exact(-w.value[i] + 0.0) + "\n";
  }
  return result;
}

SolverCase solver_case(const Model& model, const flow::BoundaryConditions& conditions,
                       const SolverOptions& options) {
  return CaseWriter(model, conditions, options).run();
}

}  // namespace vstent::meshing

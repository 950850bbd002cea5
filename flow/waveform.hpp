// A quantity that repeats with the heart's beat, and the files that hold such.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "flow/quantity.hpp"

namespace vstent::flow {

/// Straight lines between samples over one period, repeated; or one constant. cgs.
struct Waveform {
  std::vector<double> time;   ///< s, from 0 to the period, rising; one 0 for a constant
  std::vector<double> value;  ///< the first and the last are equal

  bool constant() const { return value.size() == 1; }
  double period() const { return time.back(); }  ///< s; 0 for a constant
};

Waveform constant(double value);
double at(const Waveform& waveform, double time);  ///< at any time
double mean(const Waveform& waveform);             ///< over time
Waveform times(Waveform waveform, double factor);

/// What a file of samples says.
struct WaveformFile {
  Waveform waveform;  ///< in the file's own numbers times `cgs`
  Dimension dimension = Dimension::flow;
  std::vector<std::string> notes;  ///< what was mended, one line each
};

/// `.flow`: SimVascular's two columns, time (s) and flow; `.csv`: a header `time,flow` or
/// `time,velocity` (each may end in its unit, `velocity (m/s)`), then rows. `units` is that of the
/// values; empty: the header must say. Where the last sample differs from the first, both take
/// their mean. \throws Error: usage for units that are missing or contradict the header,
/// input_file for what is no such file, naming its line
WaveformFile read_waveform(const std::filesystem::path& path, const std::string& units,
                           const std::string& key);

/// As SimVascular's 3-D solvers read it: two columns, what flows into the vessel negative; a
/// constant is two rows, over 1 s. `inflow` in mL/s into the vessel.
std::string simvascular_flow(const Waveform& inflow);

}  // namespace vstent::flow

// The parameters of designs by name, in one list: what reads, writes or shows a design visits it.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "stents/specification.hpp"

namespace vstent::stents {

enum class Need { required, optional };

template <class Value>
using Words = std::vector<std::pair<std::string, Value>>;

inline const Words<Link> kLinks = {
    {"straight", Link::straight}, {"u", Link::u}, {"n", Link::n}, {"s", Link::s}};
inline const Words<Phase> kPhases = {{"facing", Phase::facing},
                                     {"in_phase", Phase::in_phase},
                                     {"offset", Phase::offset},
                                     {"far_peak", Phase::far_peak}};
inline const Words<Wave> kWaves = {{"zig_zag", Wave::zig_zag}, {"sinusoid", Wave::sinusoid}};

/// A visitor has length(name, mm, need), count(name, whole number, need), share(name, 0 .. 1,
/// need), degrees(name, angle, need), number(name, any positive, need), flag(name, bool),
/// maybe(name, optional positive number), choice(name, value, words) and group(name, visit), which
/// runs visit(visitor of that object). Required figures are positive.
template <class Visitor>
void visit_fields(Visitor& v, Connectors& c) {
  v.choice("shape", c.shape, kLinks);
  v.choice("phase", c.phase, kPhases);
  v.count("count", c.count, Need::required);
  v.count("shift", c.shift, Need::optional);
  v.flag("alternate", c.alternate);
  v.length("length", c.length, Need::required);
  v.length("span", c.span, Need::optional);
  v.share("absorption", c.absorption, Need::optional);
}

template <class Visitor>
void visit_fields(Visitor& v, RingParameters& p) {
  v.choice("wave", p.wave, kWaves);
  v.count("crowns", p.crowns, Need::required);
  v.count("rings", p.rings, Need::required);
  v.length("straight_length", p.straight_length, Need::optional);
  v.length("crown_arc", p.crown_arc, Need::optional);
  v.length("strut_length", p.strut_length, Need::optional);
  v.group("connectors", [&](auto& inner) { visit_fields(inner, p.connectors); });
}

template <class Visitor>
void visit_fields(Visitor& v, DiamondParameters& p) {
  v.count("crowns", p.crowns, Need::required);
  v.count("rows", p.rows, Need::required);
  v.length("strut_length", p.strut_length, Need::required);
  v.length("bridge", p.bridge, Need::optional);
}

template <class Visitor>
void visit_fields(Visitor& v, ZParameters& p) {
  v.count("crowns", p.crowns, Need::required);
  v.count("bodies", p.bodies, Need::required);
  v.length("straight_length", p.straight_length, Need::required);
  v.length("crown_arc", p.crown_arc, Need::required);
  v.length("pitch", p.pitch, Need::required);
  v.count("bars", p.bars, Need::required);
}

template <class Visitor>
void visit_fields(Visitor& v, BraidParameters& p) {
  v.count("wires_per_direction", p.wires_per_direction, Need::required);
  v.count("over", p.over, Need::required);
  v.degrees("angle", p.angle, Need::required);
  v.length("gap", p.gap, Need::optional);
}

template <class Visitor>
void visit_fields(Visitor& v, HelixParameters& p) {
  v.count("strands", p.strands, Need::required);
  v.number("units_per_turn", p.units_per_turn, Need::required);
  v.count("units", p.units, Need::required);
  v.length("strut_length", p.strut_length, Need::required);
  v.length("pitch", p.pitch, Need::required);
  v.count("join_every", p.join_every, Need::optional);
  v.choice("joint", p.joint, kLinks);
  v.length("joint_length", p.joint_length, Need::optional);
  v.length("end_ring", p.end_ring, Need::optional);
}

template <class Visitor>
void visit_fields(Visitor& v, CoilParameters& p) {
  v.number("turns", p.turns, Need::required);
  v.length("pitch", p.pitch, Need::required);
  v.flag("spine", p.spine);
  v.share("lengthening", p.lengthening, Need::optional);
}

/// Everything but name, description and provenance.
template <class Visitor>
void visit_fields(Visitor& v, Specification& s) {
  std::visit([&](auto& parameters) { visit_fields(v, parameters); }, s.pattern);
  v.group("section", [&](auto& inner) {
    inner.flag("round", s.section.round);
    inner.length("width", s.section.width, Need::required);
    inner.length("thickness", s.section.thickness, Need::optional);
    inner.length("edge_radius", s.section.edge_radius, Need::optional);
  });
  v.length("nominal_diameter", s.nominal_diameter, Need::required);
  v.length("nominal_length", s.nominal_length, Need::optional);
  v.length("crimped_diameter", s.crimped_diameter, Need::required);
  v.length("smallest_use", s.smallest_use, Need::optional);
  v.length("largest_use", s.largest_use, Need::optional);
  v.group("cover", [&](auto& inner) {
    inner.length("inner", s.cover.inner, Need::optional);
    inner.length("outer", s.cover.outer, Need::optional);
  });
  v.share("recoil", s.recoil, Need::optional);
  v.maybe("radial_stiffness_N_per_mm2", s.radial_stiffness);
  v.maybe("bending_stiffness_N_mm2", s.bending_stiffness);
}

/// Parameters by the names above ("connectors/count") with their values as a person reads them;
/// optional ones that are zero are left out.
std::vector<std::pair<std::string, std::string>> described(const Specification& specification);

}  // namespace vstent::stents

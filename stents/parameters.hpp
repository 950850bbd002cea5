// What each family of designs is made from: counts, lengths of struts that never change, and how
// the pieces are joined. Lengths in mm, angles in degrees. fields.hpp lists every member by name.
#pragma once

namespace vstent::stents {

/// How connectors run between two rings. straight: a line. u: a line with a half-circular jog.
/// n: three limbs. s: one bend to each side.
enum class Link { straight, u, n, s };

/// Which crowns connectors join, the crown that they leave first. With a and b the heights of
/// their ends on the two rings, as shares of the rings' length from the middle:
/// facing: the distal crown to the proximal crown that it faces, rings mirrored; a - b = 1.
/// in_phase: the distal crown to the distal crown of a ring of the same phase; a = b.
/// offset: the distal crown to a proximal crown beside it; a - b = 1.
/// far_peak: the proximal crown to the distal crown of a mirrored ring; a - b = -1.
enum class Phase { facing, in_phase, offset, far_peak };

/// Connectors of every gap between rings. Their length never changes. The axial distance between
/// their ends follows span(D) = span + absorption (a - b) (h(nominal) - h(D)) with the ring length
/// h: what rings lose in length, connectors that bend or turn can give back, until they are taut.
struct Connectors {
  Link shape = Link::straight;
  Phase phase = Phase::in_phase;
  int count = 0;          ///< per gap
  int shift = 0;          ///< crowns by which they move on from gap to gap
  bool alternate = true;  ///< they move to and fro, instead of on in a spiral
  double length = 0;      ///< of the centre line
  double span = 0;        ///< axial distance of the ends at nominal; straight, not offset: `length`
  double absorption = 0;  ///< 0: the pitch follows the rings' length; 1: the pitch stays
};

enum class Wave { zig_zag, sinusoid };

/// Rings in sequence. A strut is half a wave from crown to crown, of length straight_length + 2
/// crown_arc in a zig-zag whose crowns are arcs, strut_length in a sinusoid.
struct RingParameters {
  Wave wave = Wave::zig_zag;
  int crowns = 0;                             ///< distal ones, as many as proximal ones
  int rings = 0;                              ///< at the nominal length
  double straight_length = 0, crown_arc = 0;  ///< crown_arc: from the crown's tip to the straight
  double strut_length = 0;
  Connectors connectors = {};
};

/// Closed cells: rows of straight zig-zag, welded where their crowns face each other or joined
/// there by bridges along the axis.
struct DiamondParameters {
  int crowns = 0;           ///< diamonds around the circumference
  int rows = 0;             ///< of zig-zag, at the nominal length
  double strut_length = 0;  ///< from node to node
  double bridge = 0;        ///< 0: welded crown to crown
};

/// Bodies of one zig-zag ring each, on bars that keep their distance.
struct ZParameters {
  int crowns = 0;
  int bodies = 0;
  double straight_length = 0, crown_arc = 0;
  double pitch = 0;  ///< from body to body: the length of a bar
  int bars = 0;      ///< between two bodies
};

/// Wires wound both ways, over and under each other.
struct BraidParameters {
  int wires_per_direction = 0;
  int over = 1;      ///< crossings that a wire runs over, then under: 1 (1x1) or 2 (2x2)
  double angle = 0;  ///< of the wires from the axis, at nominal diameter and length
  double gap = 0;    ///< between wires that cross
};

/// A sinusoidal wire wound as a helix, its turns joined at crowns; two wires: a double helix.
/// Crowns of neighbouring turns face each other where units_per_turn / strands is half an odd
/// number, as in 7.5; only then can they be fused.
struct HelixParameters {
  int strands = 1;
  double units_per_turn = 0;  ///< waves of the wire on one turn
  int units = 0;              ///< waves of one strand at the nominal length
  double strut_length = 0;    ///< of half a wave, mean of rising and falling ones
  double pitch = 0;           ///< axial distance from turn to turn, at nominal
  int join_every = 0;         ///< waves from one joint of neighbouring turns to the next
  Link joint = Link::straight;
  double joint_length = 0;  ///< 0: what the pitch leaves between crowns; none is left: fused
  double end_ring = 0;  ///< height from which waves grow over the first turn, so that ends are flat;
                        ///< 0: the ends are those of a helix
};

/// One wire wound as a coil; its length never changes.
struct CoilParameters {
  double turns = 0;    ///< at the nominal length
  double pitch = 0;    ///< axial distance from turn to turn, at nominal
  bool spine = false;  ///< a straight wire along it
  /// Share of its crimped length that it gains on the way to nominal; none with a spine.
  double lengthening = 0.05;
};

}  // namespace vstent::stents

// Where struts push the wall: at vertices, and between them on edges and triangles, so that a strut
// thinner than the mesh cannot hide.
#pragma once

#include <limits>
#include <span>

#include "deployment/metal_field.hpp"
#include "xpbd/sheet.hpp"

namespace vstent::deployment {

/// Lengths in mm.
struct StrutContactOptions {
  double depth = 0;    ///< how far below a strut's outer face a place of the wall is still found
  double reach = 0;    ///< gap at which a place of the wall already counts as a contact
  double spacing = 0;  ///< between the places looked at on edges and triangles
  double support = 0;  ///< a strut that holds a vertex needs no further contact so near to it
};

/// The axis of a stent and the radius within which its metal stays, per point.
struct Envelope {
  std::span<const Vec3> axis;
  std::span<const double> radius;
};

/// The distance field says how far a strut is, the way out says where to: the wall lies outside the
/// stent, so each of its places is lifted radially, away from the stent's axis, over the outermost
/// metal on its line. Along the field's own gradient thin struts would push vertices aside and cut
/// through the wall. Places that are known to be clear are left alone until wall and stent have
/// moved by as much.
class StrutContacts {
 public:
  StrutContacts(std::span<const Triangle> triangles, std::span<const char> pinned,
                const StrutContactOptions& options);

  /// `stent_moved`: the most (mm) that any point of the stent has moved since the last call;
  /// infinity where that is unknown. `push`: the most (mm) that a contact lifts the wall at once.
  void update(const MetalField& stent, const Envelope& envelope, std::span<const Vec3> positions,
              double stent_moved, double push);

  std::span<const xpbd::SpanContact> contacts() const { return contacts_; }

 private:
  /// A vertex, an edge or a triangle's inside; unused corners repeat the first.
  struct Feature {
    std::array<int, 3> corners;
    int dimension;
    double looked_at = -1;  // travel at which it was looked at last; negative: never
    double clearance = 0;   // then, mm: no metal may be within reach before so much has moved
    double height = 0;      // of the outermost metal above the place, along its way out
    bool touches = false;
    std::array<double, 3> weights{};
    Vec3 outward = Vec3::Zero();
  };

  void find_ways_out(const Envelope& envelope, std::span<const Vec3> positions);
  void look_at(Feature& feature, const MetalField& stent, std::span<const Vec3> positions) const;

  bool near_support(const Feature& feature, std::span<const Vec3> positions,
                    const Vec3& place) const;

  StrutContactOptions options_;
  std::vector<Feature> features_;
  std::vector<char> pinned_;
  std::vector<char> supported_;  // per vertex: a strut is within reach
  std::vector<Vec3> last_positions_;
  double travel_ = 0;  // of wall and stent together, mm
  std::vector<Vec3> outward_;
  std::vector<double> radial_gap_;
  std::vector<double> arc_;         // length at the points of the axis
  std::vector<int> nearest_point_;  // of the axis
  std::vector<xpbd::SpanContact> contacts_;
};

}  // namespace vstent::deployment

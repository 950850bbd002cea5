// Where struts hold the wall: at vertices, and between them on edges and triangles, so that a strut
// thinner than the mesh cannot hide.
#pragma once

#include <span>

#include "sdf/level_set.hpp"
#include "xpbd/sheet.hpp"

namespace vstent::deployment {

/// Lengths in mm.
struct StrutContactOptions {
  double reach = 0;    ///< gap at which a place of the wall already counts as a contact
  double spacing = 0;  ///< between the places looked at on edges and triangles
  double sink = 0;     ///< that edges and triangles are let into a strut, so as to rest on vertices
};

/// Every vertex, edge and triangle of the wall has at most one contact, where it comes nearest to
/// the metal, along the distance field's gradient. The wall must start outside the metal, and move
/// by less than `reach` between two updates: then it cannot pass through a strut. Places that are
/// known to be clear are left alone until the wall has moved by as much.
class StrutContacts {
 public:
  StrutContacts(std::span<const Triangle> triangles, std::span<const char> pinned,
                const StrutContactOptions& options);

  /// The same stent at every call. `push`: the most (mm) that a contact lifts the wall at once.
  /// \throws Error (numerical) for a place deeper inside metal than the level set's band
  void update(const sdf::LevelSet& stent, std::span<const Vec3> positions, double push);

  std::span<const xpbd::SpanContact> contacts() const { return contacts_; }
  /// mm, at the last update: the most that a place of the wall lay deeper than it is let.
  double deepest() const;

 private:
  /// A vertex, an edge or a triangle's inside; unused corners repeat the first.
  struct Feature {
    std::array<int, 3> corners;
    int dimension;
    double looked_at = -1;  // travel at which it was looked at last; negative: never
    double clearance = 0;   // then, mm: no metal may be within reach before so much has moved
    double lift = 0;        // mm, along the gradient, that takes the place to where it may be
    bool touches = false;
    std::array<double, 3> weights{};
    Vec3 normal = Vec3::Zero();
  };

  void look_at(Feature& feature, const sdf::LevelSet& stent, std::span<const Vec3> positions) const;

  StrutContactOptions options_;
  std::vector<Feature> features_;
  std::vector<Vec3> last_positions_;
  double travel_ = 0;  // of the wall, mm
  std::vector<xpbd::SpanContact> contacts_;
};

}  // namespace vstent::deployment

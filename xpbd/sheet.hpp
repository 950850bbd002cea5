// A vessel wall as particles and constraints: plain arrays, indexed, ready to be batched.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sdf/geometry.hpp"

namespace vstent::xpbd {

/// C = |x_j - x_i| - rest_length (paper, eq. 1); energy stiffness/2 C^2, stiffness in N/mm.
struct DistanceConstraint {
  int i = 0, j = 0;
  double rest_length = 0;
  double stiffness = 0;
};

/// C = theta - rest_angle, the signed angle between the triangles that share edge (edge_a, edge_b)
/// (paper, eq. 2, by atan2 so that it keeps its sign); energy stiffness/2 C^2, stiffness in N mm.
///
///        wing_a
///        /    \        theta = 0 when flat; wing_a belongs to the triangle that runs edge_a ->
///        edge_b
///   edge_a -- edge_b
///        \    /
///        wing_b
struct BendingConstraint {
  int edge_a = 0, edge_b = 0, wing_a = 0, wing_b = 0;
  double rest_angle = 0;
  double stiffness = 0;
};

/// An elastic triangle of the membrane, neo-Hookean in plane stress (see membrane_law.hpp); as a
/// constraint C = sqrt(2 energy), of compliance 1.
struct TriangleConstraint {
  std::array<int, 3> vertices{};
  /// At rest in its own plane its corners lie at (0, 0), (base, 0), (foot, height); mm.
  double base = 0, foot = 0, height = 0;
  double stiffness = 0;  ///< E t, N/mm
  double poisson_ratio = 0.45;
};

/// G t, N/mm
inline double shear_modulus(const TriangleConstraint& t) {
  return t.stiffness / (2 * (1 + t.poisson_ratio));
}

/// C = |x - target|; stiffness in N/mm (infinite attachments are particles of zero inverse mass
/// instead).
struct AttachmentConstraint {
  int vertex = 0;
  Vec3 target = Vec3::Zero();
  double stiffness = 0;
};

/// A half-space the vertex must stay in: C = normal . x - offset >= 0 (paper, eq. 3, linearised at
/// the collision point); it pushes, never pulls. stiffness <= 0 means rigid.
struct Contact {
  int vertex = 0;
  Vec3 normal = Vec3::UnitX();
  double offset = 0;
  double stiffness = 0;
};

/// A half-space that a point between two or three vertices must stay in: C = normal . (sum of
/// weight_k x_k) - offset >= 0, rigid. An edge repeats a vertex with weight 0. `key` names the
/// place from one call to the next, so that its force is kept; keys ascend.
struct SpanContact {
  std::array<int, 3> vertices{};
  std::array<double, 3> weights{};  ///< not negative, of sum 1
  Vec3 normal = Vec3::UnitX();
  double offset = 0;
  std::int64_t key = 0;
};

/// Walls that must not pass through each other (see self_collision.hpp).
struct SurfaceOfWall {
  std::vector<Triangle> triangles;
  std::vector<double> thickness;       ///< mm, per vertex
  std::vector<double> youngs_modulus;  ///< MPa, per vertex
};

/// Particles and the constraints between them. inverse_mass 0 pins a particle.
struct Sheet {
  std::vector<Vec3> positions;       ///< mm
  std::vector<double> inverse_mass;  ///< 1/tonne
  std::vector<DistanceConstraint> distances;
  std::vector<BendingConstraint> bendings;
  std::vector<TriangleConstraint> triangles;
  std::vector<AttachmentConstraint> attachments;
  std::vector<Vec3> forces;              ///< N, constant, one per particle; empty: none
  std::optional<SurfaceOfWall> surface;  ///< there: it does not pass through itself
};

/// What resists stretching: the edges as springs, which make a membrane of nu = 1/3, isotropic
/// where triangles are nearly equilateral; or the triangles themselves, for any nu and any shape.
enum class MembraneModel { springs, neo_hookean };

/// The wall as an isotropic elastic sheet.
struct Membrane {
  double youngs_modulus = 1.0;  ///< MPa
  double thickness = 1.0;       ///< mm
  double poisson_ratio = 0.45;  ///< of springs: enters the bending modulus only
  MembraneModel model = MembraneModel::springs;
  double bending_thickness = 0;  ///< mm, bends as no thicker than that; 0: as thick as it is
};

/// A membrane that changes from place to place: modulus (MPa) and thickness (mm) per vertex in
/// place of `membrane`'s; an edge takes the mean of its ends.
struct VariableMembrane {
  std::span<const double> youngs_modulus, thickness;
  Membrane membrane;
};

/// Stiffness of every edge and hinge of a sheet.
/// Area-weighted: k_e = E t (A1 + A2) / l^2 (van Gelder), k_b = B l^2 / (A1 + A2), B = E t^3 / (12
/// (1 - nu^2)). Uniform: one constant per edge and per hinge, as in the paper.
struct UniformStiffness {
  double distance = 0;  ///< N/mm
  double bending = 0;   ///< N mm
};

/// Builds distances (one per edge) or triangles, and bendings (one per interior edge), from
/// triangles in their rest shape; slivers (height below a tenth of the longest edge) get no hinge
/// and are springs in any model, and area weights are limited beside them, so that a few needles of
/// microns do not set the pace of the whole sheet.
/// Pinned vertices get inverse mass 0; the others are left at 1 (see scale_masses).
Sheet make_sheet(std::span<const Vec3> points, std::span<const Triangle> triangles,
                 std::span<const char> pinned, const Membrane& membrane);
Sheet make_sheet(std::span<const Vec3> points, std::span<const Triangle> triangles,
                 std::span<const char> pinned, const VariableMembrane& membrane);
Sheet make_sheet(std::span<const Vec3> points, std::span<const Triangle> triangles,
                 std::span<const char> pinned, const UniformStiffness& stiffness);

/// Tissue around the wall: springs to the rest positions of `modulus` (N/mm per mm2 of wall, that
/// is MPa/mm) at every vertex that is free.
void support(Sheet& sheet, std::span<const Triangle> triangles, double modulus);

/// Signed hinge angle in (-pi, pi] and its gradient with respect to (edge_a, edge_b, wing_a,
/// wing_b).
double hinge_angle(const Vec3& edge_a, const Vec3& edge_b, const Vec3& wing_a, const Vec3& wing_b,
                   std::array<Vec3, 4>* gradient = nullptr);

}  // namespace vstent::xpbd

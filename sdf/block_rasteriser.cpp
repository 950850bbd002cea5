#include "sdf/block_rasteriser.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>

namespace vstent::sdf {
namespace {

constexpr double kRounding = 1e-9;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

float single(double value) { return static_cast<float>(value); }

/// direction . (x - origin) over the leaf, counted from `zero`.
Affine affine(const Vec3& direction, const Vec3& from_origin, double zero, double h) {
  return {single(direction.dot(from_origin) - zero), single(h * direction.x()),
          single(h * direction.y()), single(h * direction.z())};
}

LeafVector vector(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

double middle_of(int index, int nodes, double h) { return h * (nodes * index + 0.5 * (nodes - 1)); }

/// Of the cube of this many nodes along each side with this index.
Vec3 middle_of(const Index3& cube, int nodes, double h) {
  return {middle_of(cube[0], nodes, h), middle_of(cube[1], nodes, h), middle_of(cube[2], nodes, h)};
}

}  // namespace

CubeReach::CubeReach(int nodes, double voxel_size)
    : half(0.5 * (nodes - 1) * voxel_size), corner(std::numbers::sqrt3 * half) {}

double CubeReach::least(const Sample& middle) const {
  const double slope = middle.gradient.cwiseAbs().sum();
  return middle.distance - (slope > 0 ? half * slope : corner);
}

BlockRasteriser::BlockRasteriser(const Rasteriser& scene, LeafDirectory& leaves, LeafStore& store)
    : scene_(scene),
      leaves_(leaves),
      writer_(store),
      block_reach_(Rasteriser::kBlockSide, scene.voxel_size_),
      leaf_reach_(kLeafSide, scene.voxel_size_) {}

/// Drops the candidates that are nearest to no node of the cube.
BlockRasteriser::Verdict BlockRasteriser::cull(const CubeReach& reach,
                                               std::vector<Candidate>& near) const {
  if (near.empty()) return Verdict::outside;
  const double limit = scene_.band_ * (1 + kRounding);
  const auto [nearest, farthest] = std::minmax_element(
      near.begin(), near.end(),
      [](const auto& a, const auto& b) { return a.sample.distance < b.sample.distance; });
  const Candidate best = *nearest;
  // The best piece's distance at middle + v is at most d + g.v + |v|^2 / (2 arm), where its ball or
  // edge is an arm away; any other convex one's is at least its own d + g.v.
  const PreparedSolid& pieces = scene_.pieces_;
  const auto is_smooth = [&](const Candidate& c) {
    return pieces.is_convex(c.piece) && !c.sample.gradient.isZero();
  };
  const double arm = best.sample.distance + pieces.smallest_bend(best.piece);
  const bool bend_known = is_smooth(best) && arm > 0;
  const double bend = bend_known ? reach.corner * reach.corner / (2 * arm) : 0;
  double rise = reach.corner;
  if (bend_known) rise = std::min(rise, reach.half * best.sample.gradient.cwiseAbs().sum() + bend);
  if (best.sample.distance + rise < -limit) return Verdict::inside;
  if (farthest->sample.distance - best.sample.distance <= std::min(bend, 2 * reach.corner))
    return Verdict::band;  // none is so far that it could be dropped
  std::erase_if(near, [&](const Candidate& c) {
    const double excess = (c.sample.distance - best.sample.distance) * (1 - kRounding);
    if (excess > 2 * reach.corner) return true;
    if (!bend_known || !is_smooth(c)) return false;
    const double slopes = (c.sample.gradient - best.sample.gradient).cwiseAbs().sum();
    return excess > reach.half * slopes + bend;
  });
  return Verdict::band;
}

void BlockRasteriser::operator()(std::size_t block) {
  LeafPage& page = leaves_.page(block);
  page.fill_own(leaves_.outside());
  Index3 lower;
  LeafMiddles middles;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    lower[axis] = LeafPage::kSide * leaves_.block(block)[axis];
    for (int n = 0; n < LeafPage::kSide; ++n) {
      middles[axis][static_cast<std::size_t>(n)] =
          middle_of(lower[axis] + n, kLeafSide, scene_.voxel_size_);
    }
  }
  const Vec3 middle = middle_of(leaves_.block(block), Rasteriser::kBlockSide, scene_.voxel_size_);
  of_block_.clear();
  for (int i = scene_.first_candidate_[block]; i < scene_.first_candidate_[block + 1]; ++i) {
    const int piece = scene_.candidates_[static_cast<std::size_t>(i)];
    of_block_.push_back({piece, scene_.pieces_.distance(piece, middle)});
  }
  const Verdict verdict = cull(block_reach_, of_block_);
  if (verdict == Verdict::inside) page.fill_own(leaves_.inside());
  if (verdict != Verdict::band) return;
  for (const Candidate& c : of_block_) bin_to_leaves(c.piece, lower, middles);
  std::size_t n = 0;
  for (int i = 0; i < LeafPage::kSide; ++i) {
    for (int j = 0; j < LeafPage::kSide; ++j) {
      for (int k = 0; k < LeafPage::kSide; ++k, ++n) {
        if (of_leaf_[n].empty()) continue;
        page.leaves[LeafPage::place(i, j, k)] =
            fill_leaf({lower[0] + i, lower[1] + j, lower[2] + k}, of_leaf_[n]);
        of_leaf_[n].clear();
      }
    }
  }
}

/// Does a neighbour in the same chain come at least as near to all nodes of the leaf? Where all lie
/// beyond the end that two capsules share, that end is the one's nearest point and a point of the
/// other's.
bool BlockRasteriser::yields(int piece, const Vec3& middle, double along) const {
  const Rasteriser::Shape& shape = scene_.shapes_[static_cast<std::size_t>(piece)];
  if (!shape.continues || along - shape.reach < shape.length) {
    // Where two pieces could each yield to the other, the second stays.
    if (!shape.continued || along + shape.reach > 0) return false;
    const Rasteriser::Shape& before = scene_.shapes_[static_cast<std::size_t>(piece) - 1];
    const Vec3 from_a = middle - before.a;  // and rounded as it was for that one
    const double along_before =
        from_a.x() * before.axis.x() + from_a.y() * before.axis.y() + from_a.z() * before.axis.z();
    if (before.continues && along_before - before.reach >= before.length) return false;
  }
  if (shape.is_plain) return true;
  // Behind the planes of its caps max(d, z) keeps the order.
  const PreparedSegment& segment = scene_.pieces_.segment(piece);
  for (const int index : {segment.start_cap, segment.end_cap}) {
    if (index < 0) continue;
    const EndCap& cap = scene_.pieces_.caps()[static_cast<std::size_t>(index)];
    if (leaf_reach_.least(cap.centre - middle, cap.outward) < 0) return false;
  }
  return true;
}

/// Lists the piece in the leaves that its band touches.
void BlockRasteriser::bin_to_leaves(int piece, const Index3& lower, const LeafMiddles& middles) {
  const Rasteriser::Shape& shape = scene_.shapes_[static_cast<std::size_t>(piece)];
  const double limit = scene_.band_ * (1 + kRounding);
  const double thickness = shape.outer_radius + limit;
  BlockCapsule capsule{.a = vector(shape.a),
                       .axis = vector(shape.axis),
                       .length = shape.length,
                       .thickness = thickness,
                       .half = leaf_reach_.half,
                       .reach = shape.reach,
                       .last_along = shape.is_plain && shape.continues ? shape.length : kInfinity,
                       .first = {},
                       .last = {}};
  const double side = kLeafSide * scene_.voxel_size_;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const auto n = static_cast<int>(axis);
    const auto [from, to] = std::minmax(shape.a[n], shape.b[n]);
    const auto leaf = [&](double place) {
      return static_cast<int>(std::floor(std::clamp(place / side - lower[axis], -1.0, 4.0)));
    };
    capsule.first[axis] = std::max(leaf(from - thickness * (1 + kRounding)), 0);
    capsule.last[axis] = std::min(leaf(to + thickness * (1 + kRounding)), LeafPage::kSide - 1);
  }
  for (auto which = kernels_.find_near(capsule, middles, near_); which != 0; which &= which - 1) {
    const auto n = static_cast<std::size_t>(std::countr_zero(which));
    const Vec3 middle(middles[0][n >> 4], middles[1][n >> 2 & 3], middles[2][n & 3]);
    if (yields(piece, middle, near_.along[n])) continue;
    if (!shape.is_plain) {
      if (leaf_reach_.least(scene_.pieces_.uncut_distance(piece, middle)) <= limit)
        of_leaf_[n].push_back({piece, scene_.pieces_.distance(piece, middle)});
      continue;
    }
    const double from_axis = std::sqrt(near_.squared[n]);
    const double inverse = from_axis > 0 ? 1 / from_axis : 0;
    Candidate& c = of_leaf_[n].emplace_back();
    c.piece = piece;
    c.sample.distance = from_axis - shape.outer_radius;
    c.sample.gradient = {near_.x[n] * inverse, near_.y[n] * inverse, near_.z[n] * inverse};
  }
}

/// Where its values are.
const float* BlockRasteriser::fill_leaf(const Index3& leaf, std::vector<Candidate>& near) {
  const Verdict verdict = cull(leaf_reach_, near);
  if (verdict == Verdict::inside) return leaves_.inside();
  if (verdict != Verdict::band) return leaves_.outside();
  const Vec3 middle = middle_of(leaf, kLeafSide, scene_.voxel_size_);
  float* values = writer_.spare();
  const int active = store(near, middle, values);
  active_voxels_ += static_cast<std::size_t>(active);
  // Neighbouring nodes differ by less than the band: without active ones, all have one sign.
  if (active == 0) return values[0] < 0 ? leaves_.inside() : leaves_.outside();
  writer_.keep();
  return values;
}

void BlockRasteriser::resolve(const std::vector<Candidate>& near, const Vec3& middle) {
  entries_.clear();
  whole_caps_.clear();
  for (const Candidate& c : near) resolve(c, middle);
  const auto order = [](const Entry& a, const Entry& b) {
    return std::tuple(a.plane, a.kind, a.radius, a.piece) <
           std::tuple(b.plane, b.kind, b.radius, b.piece);
  };
  if (!std::is_sorted(entries_.begin(), entries_.end(), order))
    std::sort(entries_.begin(), entries_.end(), order);
}

/// What the piece is to the leaf: a cap matters only where its plane cuts the band, and where it
/// cuts the piece off altogether, all pieces with that cap are the same.
void BlockRasteriser::resolve(const Candidate& c, const Vec3& middle) {
  const PreparedSolid& pieces = scene_.pieces_;
  if (pieces.is_strut(c.piece)) {
    entries_.push_back({Kind::strut, 0, c.piece});
    return;
  }
  const PreparedSegment& segment = pieces.segment(c.piece);
  const Rasteriser::Shape& shape = scene_.shapes_[static_cast<std::size_t>(c.piece)];
  const auto is_thick = [&](double radius) { return scene_.is_thick(radius); };
  if (shape.is_plain) {
    Entry& whole = entries_.emplace_back();
    whole.kind = shape.is_thin ? Kind::thin : Kind::thick;
    whole.radius = segment.radius;
    whole.piece = c.piece;
    return;
  }
  Entry entry{Kind::cone, segment.radius, c.piece};
  if (pieces.joints() == Joints::flat) {
    entries_.push_back(entry);
    return;
  }
  const Sample uncut = pieces.uncut_distance(c.piece, middle);
  const double least = leaf_reach_.least(uncut);
  bool is_cut_off = false, is_behind = false;
  for (const int index : {segment.start_cap, segment.end_cap}) {
    if (index < 0) continue;
    const EndCap& cap = pieces.caps()[static_cast<std::size_t>(index)];
    const double least_z = leaf_reach_.least(middle - cap.centre, cap.outward);
    const double largest_z = -leaf_reach_.least(cap.centre - middle, cap.outward);
    if (largest_z <= std::min(std::max(least, -scene_.band_), 0.0)) continue;
    is_behind = largest_z <= 0;
    is_cut_off = uncut.distance + leaf_reach_.corner <=
                 std::max(std::min(least_z, 0.0), -scene_.band_ * (1 + kRounding));
    entry.cap[static_cast<std::size_t>(entry.caps++)] = index;
  }
  if (entry.caps == 1 && is_cut_off) {
    if (std::find(whole_caps_.begin(), whole_caps_.end(), entry.cap[0]) != whole_caps_.end())
      return;
    whole_caps_.push_back(entry.cap[0]);
  }
  if (entry.caps == 1 && is_behind) entry.plane = entry.cap[0];
  if (segment.sine == 0 && segment.length > 0) {
    if (entry.caps == 0 || entry.plane >= 0) {
      entry.kind = is_thick(segment.radius) ? Kind::thick : Kind::thin;
    } else if (entry.caps == 1 && is_thick(segment.radius) &&
               is_thick(pieces.caps()[static_cast<std::size_t>(entry.cap[0])].radius)) {
      entry.kind = Kind::cut;
    }
  } else if (segment.sine == 0 && entry.caps == 0) {
    entry.kind = Kind::thin;
  }
  entries_.push_back(entry);
}

/// Those within the band of the box around the piece.
LeafRows BlockRasteriser::rows_of(int piece, const Vec3& middle) const {
  const Rasteriser::Shape& shape = scene_.shapes_[static_cast<std::size_t>(piece)];
  const auto row = [](double place) { return static_cast<int>(std::clamp(place, 0.0, 8.0)); };
  const double x = middle.x() / scene_.voxel_size_, y = middle.y() / scene_.voxel_size_;
  return {row(shape.first_row[0] - x), row(shape.end_row[0] - x), row(shape.first_row[1] - y),
          row(shape.end_row[1] - y)};
}

/// Puts the distances there; how many are within the band?
int BlockRasteriser::store(const std::vector<Candidate>& near, const Vec3& middle, float* values) {
  const double radius = scene_.shapes_[static_cast<std::size_t>(near.front().piece)].outer_radius;
  const float band = single(scene_.band_);
  const auto is_alike = [&](const Candidate& c) {
    const Rasteriser::Shape& shape = scene_.shapes_[static_cast<std::size_t>(c.piece)];
    return shape.is_thin && shape.outer_radius == radius;
  };
  if (std::all_of(near.begin(), near.end(), is_alike)) {  // as nearly everywhere in a stent
    capsules_.clear();
    for (const Candidate& c : near) capsules_.push_back(thin_capsule(c.piece, middle));
    return kernels_.store_thin(capsules_, single(radius), band, values);
  }
  resolve(near, middle);
  evaluate(middle);
  return kernels_.store(values_, band, values);
}

void BlockRasteriser::evaluate(const Vec3& middle) {
  constexpr float kFar = std::numeric_limits<float>::infinity();
  values_.at.fill(kFar);
  for (std::size_t i = 0; i < entries_.size();) {
    const Entry& first = entries_[i];
    if (first.kind == Kind::cone) {
      lower_to_cone(entries_[i++], middle);
    } else if (first.kind == Kind::cut) {
      lower_to_cut_capsules(i, middle);
    } else if (first.plane >= 0) {
      const EndCap& cap = scene_.pieces_.caps()[static_cast<std::size_t>(first.plane)];
      uncut_.at.fill(kFar);
      lower_to_capsules(i, middle, uncut_);
      kernels_.lower_to_larger(
          uncut_, affine(cap.outward, middle - cap.centre, 0, scene_.voxel_size_), values_);
    } else if (first.kind == Kind::strut) {
      lower_to_struts(i, middle);
    } else {
      lower_to_capsules(i, middle, values_);
    }
  }
}

/// All that follow, and moves on beyond them.
void BlockRasteriser::lower_to_struts(std::size_t& entry, const Vec3& middle) {
  const double h = scene_.voxel_size_;
  struts_.clear();
  for (; entry < entries_.size() && entries_[entry].kind == Kind::strut; ++entry) {
    const int piece = entries_[entry].piece;
    const PreparedStrut& strut = scene_.pieces_.strut(piece);
    const Vec3& sideways = scene_.shapes_[static_cast<std::size_t>(piece)].sideways;
    const Vec3 from_a = middle - strut.a;
    const Vec3 along = strut.normal.cross(sideways);
    struts_.push_back({.sideways = affine(sideways, from_a, 0, h),
                       .height = affine(strut.normal, from_a, 0, h),
                       .past_b = affine(along, from_a, strut.length, h),
                       .before_a = single(-along.dot(from_a)),
                       .half_width = single(strut.half_width),
                       .half_thickness = single(strut.half_thickness),
                       .edge_radius = single(strut.edge_radius),
                       .reached = rows_of(piece, middle)});
  }
  kernels_.lower_to_struts(struts_, values_);
}

void BlockRasteriser::lower_to_cone(const Entry& entry, const Vec3& middle) {
  const PreparedSolid& pieces = scene_.pieces_;
  const PreparedSegment& segment = pieces.segment(entry.piece);
  const Vec3 corner = middle - Vec3::Constant(leaf_reach_.half);
  LeafCone cone{.from_a = vector(corner - segment.a),
                .axis = vector(segment.axis),
                .length = segment.length,
                .radius = segment.radius,
                .sine = segment.sine,
                .tangent = segment.tangent,
                .flat = pieces.joints() == Joints::flat,
                .caps = entry.caps,
                .cap = {}};
  for (std::size_t n = 0; n < static_cast<std::size_t>(entry.caps); ++n) {
    const EndCap& cap = pieces.caps()[static_cast<std::size_t>(entry.cap[n])];
    cone.cap[n] = {vector(corner - cap.centre), vector(cap.outward), cap.radius};
  }
  kernels_.lower_to_cone(cone, scene_.voxel_size_, values_);
}

void BlockRasteriser::lower_to_capsules(std::size_t& entry, const Vec3& middle,
                                        LeafValues& values) {
  const Entry& first = entries_[entry];
  collect_capsules(entry, middle);
  (first.kind == Kind::thick ? kernels_.lower_to_thick : kernels_.lower_to_thin)(
      capsules_, single(first.radius), values);
}

/// All of the same kind, radius and plane that follow, and moves on beyond them.
void BlockRasteriser::collect_capsules(std::size_t& entry, const Vec3& middle) {
  const Entry& first = entries_[entry];
  const auto belongs = [&](const Entry& e) {
    return e.kind == first.kind && e.radius == first.radius && e.plane == first.plane;
  };
  capsules_.clear();
  for (; entry < entries_.size() && belongs(entries_[entry]); ++entry)
    capsules_.push_back(first.kind == Kind::thick ? thick_capsule(entries_[entry], middle)
                                                  : thin_capsule(entries_[entry].piece, middle));
}

LeafCapsule BlockRasteriser::thin_capsule(int piece, const Vec3& middle) const {
  const Rasteriser::Shape& shape = scene_.shapes_[static_cast<std::size_t>(piece)];
  const Vec3 from_a = middle - shape.a;
  const double along = shape.along.dot(from_a);
  LeafCapsule capsule = shape.thin;
  capsule.across.middle = single(shape.sideways.dot(from_a));
  capsule.aside.middle = single(shape.aside.dot(from_a));
  capsule.past_b.middle = single(along - shape.length);
  capsule.before_a = single(-along);
  capsule.reached = rows_of(piece, middle);
  return capsule;
}

/// Coordinates follow the nearest point, so that single precision meets small numbers only: beyond
/// an end they are those of the ball there.
LeafCapsule BlockRasteriser::thick_capsule(const Entry& entry, const Vec3& middle) const {
  const double h = scene_.voxel_size_;
  const Rasteriser::Shape& shape = scene_.shapes_[static_cast<std::size_t>(entry.piece)];
  Vec3 across = shape.sideways, along = shape.along;
  Vec3 from_a = middle - shape.a;
  double length = shape.length;
  const bool is_past_b = leaf_reach_.least(from_a, along) >= length;
  const bool is_before_a = leaf_reach_.least(-from_a, along) >= 0;
  if (entry.kind == Kind::thick && (is_past_b || is_before_a)) {
    if (is_past_b) from_a = middle - shape.b;
    along = from_a.unitOrthogonal();
    length = 0;
  }
  const Vec3 away = from_a - from_a.dot(along) * along;
  if (away.norm() > h) across = away.normalized();
  return {.across = affine(across, from_a, entry.radius, h),
          .aside = affine(along.cross(across), from_a, 0, h),
          .past_b = affine(along, from_a, length, h),
          .before_a = single(-along.dot(from_a)),
          .reached = {}};
}

/// All that follow, and moves on beyond them.
void BlockRasteriser::lower_to_cut_capsules(std::size_t& entry, const Vec3& middle) {
  const double h = scene_.voxel_size_;
  cut_capsules_.clear();
  for (; entry < entries_.size() && entries_[entry].kind == Kind::cut; ++entry) {
    const Entry& e = entries_[entry];
    const Rasteriser::Shape& shape = scene_.shapes_[static_cast<std::size_t>(e.piece)];
    const EndCap& cap = scene_.pieces_.caps()[static_cast<std::size_t>(e.cap[0])];
    const Vec3 from_centre = middle - cap.centre;
    const Vec3 away = from_centre - from_centre.dot(cap.outward) * cap.outward;
    const Vec3 across = away.norm() > h ? Vec3(away.normalized()) : cap.outward.unitOrthogonal();
    cut_capsules_.push_back({.capsule = thick_capsule(e, middle),
                             .radius = single(e.radius),
                             .length = single(shape.length),
                             .beyond = affine(cap.outward, from_centre, 0, h),
                             .across = affine(across, from_centre, cap.radius, h),
                             .aside = affine(cap.outward.cross(across), from_centre, 0, h),
                             .cap_radius = single(cap.radius),
                             .cap_from_a = single((cap.centre - shape.a).dot(cap.outward)),
                             .slope = single(shape.axis.dot(cap.outward))});
  }
  kernels_.lower_to_cut_capsules(cut_capsules_, values_);
}

}  // namespace vstent::sdf

#include "stents/strut_network.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

namespace vstent::stents {
namespace {

constexpr double two_pi = 2 * std::numbers::pi;
constexpr double coincidence = 1e-6;  // mm

std::size_t index(int i) { return static_cast<std::size_t>(i); }

double distance_on_wall(const PatternPoint& a, const PatternPoint& b) {
  const double turn = std::remainder(a.angle - b.angle, two_pi);
  return std::hypot(0.5 * (a.radius + b.radius) * turn, a.z - b.z);
}

/// A point of a member, and sets of them that move as one.
struct Touch {
  int member, point;
  auto operator<=>(const Touch&) const = default;
};

class Joined {
 public:
  explicit Joined(const Pattern& pattern) {
    int count = 0;
    for (const Member& member : pattern.members) {
      offsets_.push_back(count);
      count += static_cast<int>(member.points.size());
    }
    parents_.resize(index(count));
    for (int i = 0; i < count; ++i) parents_[index(i)] = i;
  }
  void join(const Touch& a, const Touch& b) {
    const int root_a = root(a), root_b = root(b);
    parents_[index(std::max(root_a, root_b))] = std::min(root_a, root_b);
  }
  int root(const Touch& touch) {
    int i = offsets_[index(touch.member)] + touch.point;
    while (parents_[index(i)] != i) i = parents_[index(i)] = parents_[index(parents_[index(i)])];
    return i;
  }

 private:
  std::vector<int> offsets_, parents_;
};

/// Places in between, so that no piece spans more than a quarter turn.
void add_places_between(const Member& member, std::set<int>& breaks) {
  const int n = static_cast<int>(member.points.size());
  if (breaks.empty()) breaks.insert(0);
  const std::vector<int> given(breaks.begin(), breaks.end());
  const int count = static_cast<int>(given.size());
  for (int k = 0; k < (member.closed ? count : count - 1); ++k) {
    const int first = given[index(k)];
    const int last = given[index((k + 1) % count)] + (k + 1 == count ? n : 0);
    double turned = 0;
    for (int i = first; i < last; ++i) {
      const double turn =
          member.points[index((i + 1) % n)].angle - member.points[index(i % n)].angle;
      turned += std::abs(std::remainder(turn, two_pi));
      if (turned > two_pi / 4 + 1e-9 && i + 1 < last) {
        breaks.insert((i + 1) % n);
        turned = 0;
      }
    }
  }
}

void find_touches(const Pattern& pattern, std::vector<std::set<int>>& breaks, Joined& joined) {
  std::vector<Touch> touches;
  for (std::size_t m = 0; m < pattern.members.size(); ++m) {
    const Member& member = pattern.members[m];
    const int n = static_cast<int>(member.points.size());
    for (int i = 0; i < n; ++i)
      if (member.kind != Member::Kind::connector || i == 0 || i == n - 1)
        touches.push_back({static_cast<int>(m), i});
  }
  const auto point = [&](const Touch& t) -> const PatternPoint& {
    return pattern.members[index(t.member)].points[index(t.point)];
  };
  std::stable_sort(touches.begin(), touches.end(),
                   [&](const Touch& a, const Touch& b) { return point(a).z < point(b).z; });
  for (std::size_t i = 0; i < touches.size(); ++i)
    for (std::size_t j = i + 1;
         j < touches.size() && point(touches[j]).z - point(touches[i]).z < coincidence; ++j) {
      const Touch &a = touches[i], &b = touches[j];
      if (a.member == b.member) continue;  // turns of one wire touch where no weld joins them
      if (distance_on_wall(point(a), point(b)) >= coincidence) continue;
      breaks[index(a.member)].insert(a.point);
      breaks[index(b.member)].insert(b.point);
      joined.join(a, b);
    }
  // A connector that leaves a strut between its points moves with the nearest of them.
  for (std::size_t m = 0; m < pattern.members.size(); ++m) {
    const Member& connector = pattern.members[m];
    if (connector.kind != Member::Kind::connector) continue;
    for (const int end : {0, static_cast<int>(connector.points.size()) - 1}) {
      const Touch touch{static_cast<int>(m), end};
      Touch nearest{-1, -1};
      double best = pattern.section.width;
      for (const Touch& other : touches) {
        if (pattern.members[index(other.member)].kind == Member::Kind::connector) continue;
        const double distance = distance_on_wall(point(touch), point(other));
        if (distance < best) best = distance, nearest = other;
      }
      if (nearest.member < 0) continue;
      breaks[index(nearest.member)].insert(nearest.point);
      joined.join(touch, nearest);
    }
  }
}

/// A connector whose course is longer than the straight one on the wall can change its shape
/// instead.
bool is_curved(const Member& member) {
  if (member.kind != Member::Kind::connector) return false;
  const PatternPoint &a = member.points.front(), &b = member.points.back();
  const double straight =
      std::hypot(0.5 * (a.radius + b.radius) * (b.angle - a.angle), b.z - a.z, b.radius - a.radius);
  return arc_length(member) > 1.001 * straight;
}

}  // namespace

std::vector<int> crowns_of(const Member& member) {
  std::vector<int> crowns;
  const int n = static_cast<int>(member.points.size());
  const int steps = member.closed ? n : n - 1;
  struct Rise {
    int step;
    bool up;
  };
  std::vector<Rise> rises;
  for (int i = 0; i < steps; ++i) {
    const double dz = member.points[index((i + 1) % n)].z - member.points[index(i)].z;
    if (std::abs(dz) > 1e-9) rises.push_back({i, dz > 0});
  }
  for (std::size_t k = 0; k < rises.size(); ++k) {
    const bool last = k + 1 == rises.size();
    if (last && !member.closed) break;
    const Rise& next = rises[last ? 0 : k + 1];
    if (rises[k].up == next.up) continue;
    const int end = next.step + (last ? n : 0);
    crowns.push_back(((rises[k].step + 1 + end) / 2) % n);
  }
  return crowns;
}

StrutNetwork strut_network(const Pattern& pattern) {
  std::vector<std::set<int>> breaks(pattern.members.size());
  Joined joined(pattern);
  find_touches(pattern, breaks, joined);
  StrutNetwork network;
  std::map<int, int> joint_of_root;
  const auto joint = [&](const Touch& touch) {
    return joint_of_root.try_emplace(joined.root(touch), static_cast<int>(joint_of_root.size()))
        .first->second;
  };
  for (std::size_t m = 0; m < pattern.members.size(); ++m) {
    const Member& member = pattern.members[m];
    const int n = static_cast<int>(member.points.size());
    std::set<int>& places = breaks[m];
    if (!member.closed) places.insert({0, n - 1});
    if (member.kind != Member::Kind::connector) {
      for (const int crown : crowns_of(member)) places.insert(crown);
      add_places_between(member, places);
    }
    const std::vector<int> ends(places.begin(), places.end());
    const int count = static_cast<int>(ends.size());
    for (int k = 0; k < (member.closed ? count : count - 1); ++k) {
      Piece piece;
      piece.member = static_cast<int>(m);
      piece.first = ends[index(k)];
      piece.last = ends[index((k + 1) % count)] + (k + 1 == count ? n : 0);
      for (int i = piece.first; i < piece.last; ++i)
        piece.length += (straight_point(member.points[index((i + 1) % n)]) -
                         straight_point(member.points[index(i % n)]))
                            .norm();
      piece.flexible = is_curved(member);
      piece.joint_a = joint({piece.member, piece.first});
      piece.joint_b = joint({piece.member, piece.last % n});
      if (piece.length > 0) network.pieces.push_back(piece);
    }
  }
  network.joints = static_cast<int>(joint_of_root.size());
  return network;
}

std::vector<Row> rows_of(const Pattern& pattern, const StrutNetwork& network) {
  struct Span {
    double low, high, angle, turn;
    int piece;
  };
  std::vector<Span> spans;
  for (std::size_t k = 0; k < network.pieces.size(); ++k) {
    const Piece& piece = network.pieces[k];
    const Member& member = pattern.members[index(piece.member)];
    if (member.kind == Member::Kind::connector) continue;
    const int n = static_cast<int>(member.points.size());
    const PatternPoint& a = member.points[index(piece.first)];
    const PatternPoint& b = member.points[index(piece.last % n)];
    const double turn = std::remainder(b.angle - a.angle, two_pi);
    const double middle = std::remainder(a.angle + 0.5 * turn, two_pi);
    spans.push_back(
        {std::min(a.z, b.z), std::max(a.z, b.z), middle, std::abs(turn), static_cast<int>(k)});
  }
  std::stable_sort(spans.begin(), spans.end(),
                   [](const Span& a, const Span& b) { return a.low < b.low; });
  std::vector<Row> rows;
  std::vector<bool> taken(spans.size(), false);
  for (std::size_t i = 0; i < spans.size(); ++i) {
    if (taken[i] || spans[i].high - spans[i].low < coincidence) continue;
    std::vector<Span> row;
    double turned = 0;
    for (std::size_t j = i; j < spans.size() && spans[j].low - spans[i].low < coincidence; ++j) {
      if (taken[j] || std::abs(spans[j].high - spans[i].high) >= coincidence) continue;
      taken[j] = true;
      turned += spans[j].turn;
      row.push_back(spans[j]);
    }
    if (std::abs(turned - two_pi) > 1e-6) continue;
    std::stable_sort(row.begin(), row.end(),
                     [](const Span& a, const Span& b) { return a.angle < b.angle; });
    Row pieces;
    for (const Span& span : row) pieces.push_back(span.piece);
    rows.push_back(pieces);
  }
  return rows;
}

}  // namespace vstent::stents

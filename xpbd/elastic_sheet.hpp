// A sheet in the solvers' order, and the forces of its elastic energy.
#pragma once

#include <vector>

#include "xpbd/kernels.hpp"
#include "xpbd/layout.hpp"
#include "xpbd/sheet.hpp"
#include "xpbd/softness.hpp"

namespace vstent::xpbd {

/// Things that belong to one particle each (contacts, attachments), grouped by particle.
template <class Item>
struct Grouped {
  std::vector<int> first;  ///< by particle, and the total at the end; empty: no items
  std::vector<Item> items;

  std::span<Item> of(std::size_t particle) {
    return std::span(items).subspan(begin(particle), begin(particle + 1) - begin(particle));
  }
  std::span<const Item> of(std::size_t particle) const {
    return std::span(items).subspan(begin(particle), begin(particle + 1) - begin(particle));
  }

 private:
  std::size_t begin(std::size_t particle) const {
    return first.empty() ? 0 : static_cast<std::size_t>(first[particle]);
  }
};

/// `number`: the particle of each vertex.
template <class Item, class Source, class Make>
void group(Grouped<Item>& grouped, std::span<const Source> sources, const std::vector<int>& number,
           const Make& make) {
  const auto particle_of = [&](const Source& s) {
    return static_cast<std::size_t>(number[static_cast<std::size_t>(s.vertex)]);
  };
  grouped.first.clear();
  grouped.items.clear();
  if (sources.empty()) return;
  grouped.first.assign(number.size() + 1, 0);
  for (const Source& s : sources) ++grouped.first[particle_of(s) + 1];
  for (std::size_t k = 0; k < number.size(); ++k) grouped.first[k + 1] += grouped.first[k];
  grouped.items.resize(sources.size());
  for (std::size_t k = sources.size(); k-- > 0;) {  // from the back: starts end where they began
    const auto slot = static_cast<std::size_t>(--grouped.first[particle_of(sources[k]) + 1]);
    grouped.items[slot] = make(sources[k]);
  }
  // Every start has moved down to where its group begins, one place late.
  for (std::size_t k = 0; k < number.size(); ++k) grouped.first[k] = grouped.first[k + 1];
  grouped.first.back() = static_cast<int>(sources.size());
}

struct Attachment {
  Vec3 target;  ///< from the sheet's origin
  double compliance;
  double force;
};

/// Positions are taken from `origin`, the mean of the rest positions: far from zero, coordinates
/// have fewer digits left.
struct ElasticSheet {
  Layout layout;
  Vec3 origin = Vec3::Zero();
  std::vector<char> free;  ///< by particle
  std::vector<Vec3> load;  ///< N, by particle; empty: none
  Grouped<Attachment> attachments;
};

ElasticSheet make_elastic_sheet(const Sheet& sheet);

/// The vertices' places, in the solvers' order.
std::vector<Slot> particles_of(const ElasticSheet& sheet, std::span<const Vec3> positions);

/// Elastic forces and loads at these places, by particle; their energy in the tally.
Tally elastic_forces(const ElasticSheet& sheet, std::span<const Slot> particles,
                     std::vector<Slot>& forces);

/// See softness.hpp; attachments included.
std::vector<Softness> measure_softness(const ElasticSheet& sheet, std::span<const Slot> particles,
                                       std::span<const Link> links = {});

}  // namespace vstent::xpbd

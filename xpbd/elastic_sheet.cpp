#include "xpbd/elastic_sheet.hpp"

#include <cassert>

#include "xpbd/parallel.hpp"

namespace vstent::xpbd {

ElasticSheet make_elastic_sheet(const Sheet& sheet) {
  const std::size_t count = sheet.positions.size();
  assert(sheet.inverse_mass.size() == count);
  assert(sheet.forces.empty() || sheet.forces.size() == count);
  ElasticSheet made;
  made.layout = make_layout(sheet);
  made.free.reserve(count);
  for (const Vec3& p : sheet.positions) made.origin += p / static_cast<double>(count);
  for (const int vertex : made.layout.original) {
    made.free.push_back(sheet.inverse_mass[at(vertex)] > 0);
    if (!sheet.forces.empty()) made.load.push_back(sheet.forces[at(vertex)]);
  }
  group(made.attachments, std::span(sheet.attachments), made.layout.number,
        [&](const AttachmentConstraint& a) {
          assert(a.stiffness > 0);
          return Attachment{a.target - made.origin, 1 / a.stiffness, 0};
        });
  return made;
}

std::vector<Slot> particles_of(const ElasticSheet& sheet, std::span<const Vec3> positions) {
  std::vector<Slot> particles(positions.size());
  for (std::size_t k = 0; k < particles.size(); ++k)
    put(particles[k], positions[at(sheet.layout.original[k])] - sheet.origin);
  return particles;
}

Tally elastic_forces(const ElasticSheet& sheet, std::span<const Slot> particles,
                     std::vector<Slot>& forces) {
  forces.resize(particles.size());
  Tally total;
  std::vector<Tally> partial(chunks_of(particles.size()));
  for_each_particle(particles.size(), [&](std::size_t k, std::size_t chunk) {
    Vec3 force = sheet.load.empty() ? Vec3::Zero() : sheet.load[k];
    for (const Attachment& a : sheet.attachments.of(k)) {
      const Vec3 offset = place(particles[k]) - a.target;
      force -= offset / a.compliance;
      add({0.5 * offset.squaredNorm() / a.compliance,
           offset.squaredNorm() / (a.compliance * a.compliance), 1},
          partial[chunk]);
    }
    forces[k] = {force.x(), force.y(), force.z(), 0};
  });
  for (const Tally& part : partial) add(part, total);
  const Kernels& kernel = kernels();
  for (const auto* phase : {&sheet.layout.within, &sheet.layout.between}) {
    partial.assign(phase->size(), Tally{});
    side_by_side(phase->size(), [&](std::size_t k) {
      partial[k] = kernel.add_elastic_forces(batches_of(sheet.layout, (*phase)[k]),
                                             particles.data(), forces.data());
    });
    for (const Tally& part : partial) add(part, total);
  }
  return total;
}

std::vector<Softness> measure_softness(const ElasticSheet& sheet, std::span<const Slot> particles,
                                       std::span<const Link> links) {
  std::vector<double> own(particles.size(), 0.0);
  for (std::size_t k = 0; k < particles.size(); ++k)
    for (const Attachment& a : sheet.attachments.of(k)) own[k] += 1 / a.compliance;
  return measure_softness(sheet.layout, particles, own, links);
}

}  // namespace vstent::xpbd

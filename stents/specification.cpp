#include "stents/specification.hpp"

#include <array>

#include "stents/braid_design.hpp"
#include "stents/coil_design.hpp"
#include "stents/diamond_design.hpp"
#include "stents/helix_design.hpp"
#include "stents/ring_design.hpp"

namespace vstent::stents {

std::string family(const Specification& specification) {
  constexpr std::array kNames = {"rings", "diamonds", "z", "braid", "helix", "coil"};
  static_assert(kNames.size() == std::variant_size_v<Parameters>);
  return kNames[specification.pattern.index()];
}

namespace {

struct Maker {
  const Specification& specification;
  std::optional<double> length;
  using Result = std::unique_ptr<const Design>;

  Result operator()(const RingParameters& p) const {
    return std::make_unique<RingDesign>(p, specification, length);
  }
  Result operator()(const DiamondParameters& p) const {
    return std::make_unique<DiamondDesign>(p, specification, length);
  }
  Result operator()(const ZParameters& p) const {
    return std::make_unique<RingDesign>(rings_of(p), specification, length);
  }
  Result operator()(const BraidParameters& p) const {
    return std::make_unique<BraidDesign>(p, specification, length);
  }
  Result operator()(const HelixParameters& p) const {
    return std::make_unique<HelixDesign>(p, specification, length);
  }
  Result operator()(const CoilParameters& p) const {
    return std::make_unique<CoilDesign>(p, specification, length);
  }
};

}  // namespace

std::unique_ptr<const Design> make_design(const Specification& specification,
                                          std::optional<double> length) {
  return std::visit(Maker{specification, length}, specification.pattern);
}

}  // namespace vstent::stents

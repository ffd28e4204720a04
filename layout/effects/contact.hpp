// Values of contact between bodies; its law stands in kernels/couplings/contact_solve.hpp.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "layout/convex.hpp"
#include "layout/effects/facts.hpp"

namespace linden {

struct PairContact {
  double stiffness = 1e7;  // of one contact point [N/m]
  double friction = 0.8;   // Coulomb's coefficient
  std::vector<ConvexBody> shapes{};                                // sorted by slot
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs{};    // of shapes that can touch, the first before the second, in ascending order

  static constexpr EffectFacts facts{.name = "contact",
                                     .owners = "pairs of shapes that can touch",
                                     .site = Site::pair,
                                     .account = Account::taken,
                                     .stores = true,
                                     .has_states = true,
                                     .sudden = "contact"};
};

}  // namespace linden

// Values of contact between bodies; its law stands in kernels/couplings/contact_solve.hpp.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "layout/convex.hpp"
#include "layout/effects/facts.hpp"

namespace linden {

/// How two shapes meet.
struct ContactMaterial {
  double stiffness = std::numeric_limits<double>::infinity();  // of one contact point [N/m]; infinite: rigid
  double damping = 0;      // of one, while it is pressed [N s/m]
  double friction = 0.8;   // Coulomb's coefficient
  double restitution = 0;  // speed after a blow beside that before it, 0 to 1
  // moments against rolling, and against spinning about the normal, are at most so much times the force along it, at each place of contact [m]
  double rolling_friction = 0, torsional_friction = 0;
  bool resists_turning() const { return rolling_friction > 0 || torsional_friction > 0; }
  bool operator==(const ContactMaterial&) const = default;
};

struct PairContact {
  std::vector<ContactMaterial> materials{ContactMaterial{}};
  std::vector<std::uint32_t> of_pair{};                            // which of them each pair has; empty: all the first
  std::vector<ConvexBody> shapes{};                                // sorted by slot
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs{};    // of shapes that can touch, the first before the second, in ascending order

  bool resists_turning() const { return std::ranges::any_of(materials, &ContactMaterial::resists_turning); }
  const ContactMaterial& material(std::size_t pair) const { return materials[of_pair.empty() ? 0 : of_pair[pair]]; }

  static constexpr EffectFacts facts{.name = "contact",
                                     .owners = "pairs of shapes that can touch",
                                     .site = Site::pair,
                                     .account = Account::taken,
                                     .stores = true,
                                     .has_states = true,
                                     .strikes = true,
                                     .sudden = "contact"};
};

}  // namespace linden

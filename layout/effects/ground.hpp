// layout/effects/ground.hpp
// Values of kernels/effects/ground.hpp.
#pragma once

#include <array>
#include <optional>

#include "layout/contacts.hpp"
#include "layout/effects/facts.hpp"
#include "layout/height_field.hpp"

namespace linden {

struct Ground {
  std::array<double, 3> normal{0, 0, 1};  // unit length, world frame
  double height = 0;                      // of the plane along its normal [m]
  double stiffness = 1e5;                 // of one contact point [N/m]
  double damping = 0;                     // of one contact point along the normal [N s/m]
  double friction = 0.8;                  // Coulomb's coefficient
  std::optional<HeightField> terrain{};
  Contacts contacts{};

  static constexpr EffectFacts facts{.name = "ground",
                                     .owners = "points of a ground",
                                     .site = Site::body,
                                     .account = Account::taken,
                                     .stores = true,
                                     .has_states = true,
                                     .strikes = true,
                                     .sudden = "ground"};
};

}  // namespace linden

// layout/effects/friction.hpp
// Values of kernels/effects/friction.hpp.
#pragma once

#include "layout/attributes.hpp"
#include "layout/effects/facts.hpp"
#include "layout/field.hpp"

namespace linden {

/// Coulomb friction: holds the joint still below it, opposes its motion by it.
struct JointFriction {
  Index row;
  double force;  // [N m, N]

  static constexpr EffectFacts facts{.name = "friction",
                                     .owners = "friction",
                                     .site = Site::joint,
                                     .account = Account::taken,
                                     .single = true,
                                     .has_states = true,
                                     .sudden = "friction"};
  static constexpr NumberField<JointFriction> fields[] = {
      {"force", &JointFriction::force, kForceUnits, Allowed::not_negative, Given::always, Carried::by_size}};
  static constexpr auto in_file = &Attributes::friction;
};

}  // namespace linden

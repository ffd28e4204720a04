// layout/effects/armature.hpp
// Values of kernels/effects/armature.hpp.
#pragma once

#include "layout/effects/facts.hpp"
#include "layout/field.hpp"

namespace linden {

/// Inertia of a rotor that a joint turns along.
struct Armature {
  Index row;
  double inertia;  // [kg m^2, kg]

  static constexpr EffectFacts facts{.name = "armature", .owners = "armature", .site = Site::joint};
  static constexpr NumberField<Armature> fields[] = {
      {"inertia", &Armature::inertia, kInertiaUnits, Allowed::not_negative, Given::always, Carried::by_square}};
};

}  // namespace linden

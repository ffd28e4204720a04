// layout/effects/spring.hpp
// Values of kernels/effects/spring.hpp.
#pragma once

#include "layout/effects/facts.hpp"
#include "layout/field.hpp"

namespace linden {

struct JointSpring {
  Index row;
  double stiffness;  // [N m/rad, N/m]
  double rest = 0;   // [rad, m]

  static constexpr EffectFacts facts{.name = "spring", .owners = "springs", .site = Site::joint, .stores = true};
  static constexpr NumberField<JointSpring> fields[] = {
      {"stiffness", &JointSpring::stiffness, kStiffnessUnits, Allowed::not_negative},
      {"rest", &JointSpring::rest, kPositionUnits, Allowed::finite, Given::perhaps}};
};

}  // namespace linden

// layout/effects/damping.hpp
// Values of kernels/effects/damping.hpp.
#pragma once

#include "layout/attributes.hpp"
#include "layout/effects/facts.hpp"
#include "layout/field.hpp"

namespace linden {

struct JointDamping {
  Index row;           // of a screw, or any row of a ball joint
  double coefficient;  // [N m s/rad, N s/m]

  static constexpr EffectFacts facts{
      .name = "damping", .owners = "damping", .site = Site::joint, .account = Account::taken, .on_balls = true};
  static constexpr NumberField<JointDamping> fields[] = {
      {"coefficient", &JointDamping::coefficient, kDampingUnits, Allowed::not_negative, Given::always, Carried::by_square}};
  static constexpr auto in_file = &Attributes::damping;
};

}  // namespace linden

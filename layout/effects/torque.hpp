// layout/effects/torque.hpp
// Values of kernels/effects/torque.hpp.
#pragma once

#include "layout/effects/time_table.hpp"
#include "layout/effects/facts.hpp"
#include "layout/field.hpp"

namespace linden {

struct JointTorque {
  Index row;
  TimeTable force;  // [N m, N]

  static constexpr EffectFacts facts{.name = "torque", .owners = "torques", .site = Site::joint, .account = Account::given};
};

}  // namespace linden

// layout/effects/limits.hpp
// Values of kernels/effects/limits.hpp.
#pragma once

#include <limits>

#include "layout/effects/facts.hpp"
#include "layout/field.hpp"

namespace linden {

struct JointLimit {
  Index row;
  double lower = -std::numeric_limits<double>::infinity();  // [rad, m]
  double upper = std::numeric_limits<double>::infinity();
  double restitution = 0;  // 0: stops, 1: bounces back at the same speed
  double velocity = std::numeric_limits<double>::infinity();  // at most, either way [rad/s, m/s]

  static constexpr EffectFacts facts{.name = "limits",
                                     .owners = "limits",
                                     .site = Site::joint,
                                     .account = Account::taken,
                                     .single = true,
                                     .has_states = true,
                                     .strikes = true,
                                     .sudden = "limits"};
};

}  // namespace linden

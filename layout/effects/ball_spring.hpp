// layout/effects/ball_spring.hpp
// Values of kernels/effects/ball_spring.hpp.
#pragma once

#include <array>

#include "layout/effects/facts.hpp"
#include "layout/field.hpp"

namespace linden {

/// Pulls a ball joint towards an orientation by an angle's worth of torque.
struct BallSpring {
  Index slot;
  double stiffness;                        // [N m/rad]
  std::array<double, 4> rest{0, 0, 0, 1};  // unit quaternion x y z w

  static constexpr EffectFacts facts{.name = "spring", .owners = "springs of ball joints", .site = Site::joint, .stores = true};
};

}  // namespace linden

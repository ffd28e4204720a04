// layout/effects/servo.hpp
// Values of kernels/effects/servo.hpp.
#pragma once

#include <cmath>
#include <limits>

#include "layout/effects/time_table.hpp"
#include "layout/effects/facts.hpp"
#include "layout/field.hpp"

namespace linden {

/// A force of stiffness (target - q) + damping (target_velocity - qdot) + feedforward on a joint, at most max_force in all.
struct Servo {
  Index row;
  double stiffness;    // [N m/rad, N/m]
  double damping = 0;  // [N m s/rad, N s/m]
  double target = 0;   // [rad, m]
  double max_force = std::numeric_limits<double>::infinity();  // [N m, N]
  TimeTable target_over_time{{}, {}};  // [rad, m]; goes over target where it has any points
  TimeTable target_velocity{};         // [rad/s, m/s]; that of a moving target is not taken from it
  TimeTable feedforward{};             // [N m, N]

  bool target_moves() const { return !target_over_time.times.empty(); }
  double target_at(double time) const { return target_moves() ? target_over_time.at(time) : target; }
  bool settles() const { return std::isfinite(max_force); }

  static constexpr EffectFacts facts{.name = "servo",
                                     .owners = "servos",
                                     .site = Site::joint,
                                     .account = Account::given,
                                     .single = true,
                                     .has_states = true,
                                     .sudden = "servo with limited force"};
};

}  // namespace linden

// layout/attributes.hpp
// What a robot's file says of its joints beside kinematics and mass. Kept for people and for effects; a scene that names no such
// effect never reads it.
#pragma once

#include <vector>

#include "layout/field.hpp"

namespace linden {

#define LINDEN_ATTRIBUTES_FIELDS(FIELD)                                                  \
  FIELD(double, lower, 1, velocities, "lower limit [rad, m]; -inf where there is none")  \
  FIELD(double, upper, 1, velocities, "upper limit [rad, m]; +inf where there is none")  \
  FIELD(double, max_velocity, 1, velocities, "[rad/s, m/s]; +inf where there is none")   \
  FIELD(double, max_effort, 1, velocities, "[N m, N]; +inf where there is none")         \
  FIELD(double, damping, 1, velocities, "viscous [N m s/rad, N s/m]")                    \
  FIELD(double, friction, 1, velocities, "Coulomb [N m, N]")

struct Attributes {
  LINDEN_FIELDS(LINDEN_ATTRIBUTES_FIELDS)
};

/// q[follower] = multiplier * q[leader] + offset: one coordinate moves several joints. Leaders follow nobody.
struct Mimic {
  Index follower_slot, leader_slot;
  Index follower_v, leader_v;
  Index follower_q, leader_q;
  double multiplier, offset;
};

}  // namespace linden

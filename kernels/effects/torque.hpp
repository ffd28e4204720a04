// kernels/effects/torque.hpp
// Forces on joints that are given over time.
//
//   force tau(t), taken at the middle of the step:    o = -h^2 tau,  g = 0,  share 1/2
//
// units   [N m, N]
// energy  gives tau delta a step
// cost    one look into a table an entry and step
#pragma once

#include <span>

#include "kernels/effects/joint_impulses.hpp"
#include "layout/effects.hpp"

namespace linden {

/// force: one number an entry, of the middle of the step.
template <class S>
void torque_map(std::span<const JointTorque> torques, std::span<const double> force, const S& h, JointImpulses<S>& sum) {
  for (std::size_t k = 0; k < torques.size(); ++k) add_impulse(sum, torques[k].row, 0.5, -(h * h * as<S>(force[k])), S(0.0));
}

/// Work in a step [J].
template <class S>
S torque_work(std::span<const JointTorque> torques, std::span<const double> force, const Field<S>& delta) {
  S sum(0.0);
  for (std::size_t k = 0; k < torques.size(); ++k) sum = sum + as<S>(force[k]) * delta(torques[k].row);
  return sum;
}

}  // namespace linden

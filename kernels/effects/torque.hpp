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
void torque_map(std::span<const JointTorque> torques, const Field<S>& force, const S& h, JointImpulses<S>& sum) {
  for (Index k = 0; k < force.rows(); ++k) {
    add_impulse(sum, torques[static_cast<std::size_t>(k)].row, 0.5, -(h * h * force(k)), S(0.0));
  }
}

/// Work in a step [J].
template <class S>
S torque_work(std::span<const JointTorque> torques, const Field<S>& force, const Field<S>& delta) {
  S sum(0.0);
  for (Index k = 0; k < force.rows(); ++k) sum = sum + force(k) * delta(torques[static_cast<std::size_t>(k)].row);
  return sum;
}

}  // namespace linden

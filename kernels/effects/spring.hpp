// kernels/effects/spring.hpp
// Linear springs at screw joints.
//
//   P = 1/2 k (q - rest)^2,    taken at the middle of the step:  o = h^2 k (q^k - rest),  g = h^2 k / 2,  share 1/2
//
// The discrete Lagrangian holds -h P((q^k + q^k+1) / 2), so the step stays symplectic and symmetric and conserves the energy of a linear
// oscillator exactly, at any stiffness. Where h sqrt(k / inertia) is beyond some 2 the oscillation itself is no longer followed: it
// appears slower than it is, at its right amplitude.
//
// units   k [N m/rad, N/m], rest [rad, m]
// energy  P, conservative
// cost    some 3 operations an entry and step
// source  Marsden, West, Discrete mechanics and variational integrators (2001), 2.3.1 (midpoint rule)
#pragma once

#include <span>

#include "kernels/effects/law.hpp"

namespace linden {

/// q_row: position row of a velocity row.
template <class S>
void spring_map(std::span<const JointSpring> springs, const Field<Index>& q_row, const S& h, const Field<S>& q, JointImpulses<S>& sum) {
  for (const JointSpring& spring : springs) {
    const S pull = h * h * as<S>(spring.stiffness);
    add_impulse(sum, spring.row, 0.5, pull * (q(q_row(spring.row)) - as<S>(spring.rest)), S(0.5) * pull);
  }
}

template <class S>
class SpringLaw : public JointLaw<S, JointSpring> {
 public:
  using JointLaw<S, JointSpring>::JointLaw;
  static constexpr std::array sweeps{PartSweep{Part::add, "spring_map", "springs, q, joint impulses", "joint impulses"}};
  void add(const StepView<S>& step, JointImpulses<S>& sum) const { spring_map(this->entries(), step.q_row, step.h, step.q, sum); }
  static S potential(const JointSpring& spring, const JointsView<S>& at) {
    const S stretch = at.q(at.q_row(spring.row)) - as<S>(spring.rest);
    return as<S>(0.5 * spring.stiffness) * stretch * stretch;
  }
  static void push(const JointSpring& spring, const Instant& now, Field<double>& force) {
    const double stretch = now.q(now.q_row(spring.row)) - spring.rest;
    force(spring.row) -= spring.stiffness * stretch;
  }
};

}  // namespace linden

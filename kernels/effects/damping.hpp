// kernels/effects/damping.hpp
// Viscous damping of joints.
//
//   force -c delta / h:    o = 0,  g = h c,  share of the beginning by h c / d (joint_impulses.hpp)
//
// Second order where a step is shorter than the time constant d / c; from there on it goes over to backward Euler, which brings the joint
// to rest at any c. Of a ball joint delta is the logarithm of its displacement: a torque against its mean angular velocity.
//
// units   c [N m s/rad, N s/m]
// energy  takes c delta work_displacement / h a step
// cost    some 2 operations an entry and step
// source  discrete d'Alembert principle: Marsden, West, Discrete mechanics and variational integrators (2001), 3.2
#pragma once

#include <span>
#include <vector>

#include "kernels/effects/law.hpp"

namespace linden {

/// share: one number an entry.
template <class S>
void damping_map(std::span<const JointDamping> dampers, std::span<const double> share, const S& h, JointImpulses<S>& sum) {
  for (std::size_t k = 0; k < dampers.size(); ++k) {
    add_impulse(sum, dampers[k].row, share[k], S(0.0), h * as<S>(dampers[k].coefficient));
  }
}

/// What the dampers took in a step: each(row, loss [J]).
template <class S, class Each>
void damping_loss(std::span<const JointDamping> dampers, std::span<const double> share, const S& h, const Field<S>& delta,
                  const Field<S>& before, const Each& each) {
  for (std::size_t k = 0; k < dampers.size(); ++k) {
    const Index row = dampers[k].row;
    each(row, as<S>(dampers[k].coefficient) * delta(row) * work_displacement(share[k], delta(row), before(row)) / h);
  }
}

template <class S>
class DampingLaw : public JointLaw<S, JointDamping> {
 public:
  static constexpr std::array sweeps{PartSweep{Part::add, "damping_map", "damping, joint impulses", "joint impulses"}};
  explicit DampingLaw(const LawSetup& setup) : JointLaw<S, JointDamping>(setup) {
    for (const JointDamping& damper : this->entries()) share_.push_back(begin_share(ratio(damper, setup.step, setup.inertia_at(damper.row))));
  }
  static double ratio(const JointDamping& damper, double step, double inertia) { return step * damper.coefficient / inertia; }
  static bool on_ball(const JointDamping& damper, const LawSetup& setup) { return setup.q_row(damper.row) < 0; }
  void add(const StepView<S>& step, JointImpulses<S>& sum) const { damping_map(this->entries(), std::span(share_), step.h, sum); }
  void account(const StepView<S>& step, const SolvedStep<S>& solved, const auto& book) const {
    damping_loss(this->entries(), std::span(share_), step.h, solved.delta, solved.before, book);
  }
  static void push(const JointDamping& damper, const Instant& now, Field<double>& force) {
    force(damper.row) -= damper.coefficient * now.v(damper.row);
  }

 private:
  std::vector<double> share_;  // s of each
};

}  // namespace linden

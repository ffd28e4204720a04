// kernels/effects/torque.hpp
// Forces on joints that are given over time.
//
//   force tau(t), its mean over the step:    o = -h^2 tau,  g = 0,  share 1/2
//
// so that the impulse is that of the table whatever the step. Its halves meet the velocities before and after them: what the two give is
// tau delta, of one step that is pushed alone too.
//
// units   [N m, N]
// energy  gives tau delta a step
// cost    one look into a table an entry and step
#pragma once

#include <span>

#include "kernels/effects/law.hpp"

namespace linden {

/// force: one number an entry, its mean over the step.
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

template <class S>
class TorqueLaw : public JointLaw<S, JointTorque> {
 public:
  static constexpr std::array sweeps{PartSweep{Part::begin, "begin_torques", "torques, time", "torques"},
                                     PartSweep{Part::add, "torque_map", "torques, joint impulses", "joint impulses"}};
  explicit TorqueLaw(const LawSetup& setup) : JointLaw<S, JointTorque>(setup) { force_.allocate(static_cast<Index>(this->entries().size())); }
  void begin(const StepView<S>&, const StepStart<S>& start, Field<S>&) {
    for (Index k = 0; k < force_.rows(); ++k) {
      const JointTorque& torque = this->entries()[static_cast<std::size_t>(k)];
      force_(k) = at_each_time<S>(start.times, [&](double t) LINDEN_INLINE_LAMBDA { return torque.force.mean(t, t + start.step); });
    }
  }
  void add(const StepView<S>& step, JointImpulses<S>& sum) const { torque_map(this->entries(), force_, step.h, sum); }
  void account(const StepView<S>&, const SolvedStep<S>& solved, const auto& book) const {
    book(-1, torque_work(this->entries(), force_, solved.delta));
  }
  static void push(const JointTorque& torque, const Instant& now, Field<double>& force) { force(torque.row) += torque.force.at(now.time); }

 private:
  Field<S> force_;  // of each, its mean over the step
};

}  // namespace linden

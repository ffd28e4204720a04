// kernels/effects/given_motion.hpp
// Joints whose motion is given over time: their displacement is known, the force that makes it is what is found.
//
//   delta = g(t^{k+1}) - q^k,    held (joint_impulses.hpp),    impulse of the drive = residual / h
//
// The position is that of the curve at the end of every step, whatever the joint did before and however the step is split; nothing adds
// up. The impulse acts at the beginning of the step, where the motion changes, as that of all that is held. At the end of the step the
// joint has the velocity with which its curve comes there, and the others' are read beside it.
//
// units   g, delta [rad, m]; residual [kg m^2, kg m]
// energy  gives residual x work_displacement / h^2. Velocities at the end of a step have seen half of the next impulse, too: h/2 v force,
//         of the force that lasted from step to step, which no blow has. The first step's impulse is half of one: it has half a step behind it.
// cost    two looks into a table an entry and step
// source  constraints of a discrete Euler-Lagrange equation: Marsden, West, Discrete mechanics and variational integrators (2001), 3.4
#pragma once

#include <algorithm>
#include <array>
#include <span>

#include "kernels/effects/law.hpp"

namespace linden {

template <class S>
struct GivenMotions {
  std::span<const JointMotion> entries;
  Field<S> end;            // g of each at the end of the step [rad, m]
  Field<S> next_velocity;  // of each there [rad/s, m/s]
  Field<S> velocity;       // the same of the last step, which has ended
  Field<S> force;          // that made that step [N m, N]
  Field<S> steady;         // as much of it as lasted from the step before
  S per_force;             // of an impulse, times h [1/s^2]
  S first;                 // 1 where there is no step before, else 0

  Index row(Index k) const { return entries[static_cast<std::size_t>(k)].row; }
};

/// Displacements that lead to `end`.
template <class S>
void given_motion_map(const GivenMotions<S>& motions, const Field<Index>& q_row, const Field<S>& q, Field<S>& delta) {
  for (Index k = 0; k < motions.end.rows(); ++k) delta(motions.row(k)) = motions.end(k) - q(q_row(motions.row(k)));
}

/// known: whether there is a step before.
template <class S, class Mask>
void begin_motions(const S& h, const Mask& known, GivenMotions<S>& motions) {
  motions.per_force = select(known, S(1.0), S(2.0)) / (h * h);
  motions.first = select(known, S(0.0), S(1.0));
}

template <class S>
void hold_motions(const GivenMotions<S>& motions, JointImpulses<S>& sum) {
  for (Index k = 0; k < motions.end.rows(); ++k) hold(sum, motions.row(k), S(0.0) < S(1.0));
}

/// Of a force what lasted.
template <class S>
S steady_force(const GivenMotions<S>& motions, Index k, const S& force) {
  return select(motions.first > S(0.5), force, persistent(force, motions.force(k)));
}

/// After a step: what it took, and where its end is.
template <class S>
void end_motions(const Field<S>& residual, GivenMotions<S>& motions) {
  for (Index k = 0; k < motions.end.rows(); ++k) {
    const S force = motions.per_force * residual(motions.row(k));
    motions.velocity(k) = motions.next_velocity(k);
    motions.steady(k) = steady_force(motions, k, force);
    motions.force(k) = force;
  }
}

/// Work from the end of the last step to that of this one, before end_motions [J].
template <class S>
S motion_work(const GivenMotions<S>& motions, const S& h, const Field<S>& residual, const Field<S>& delta, const Field<S>& before) {
  S sum(0.0);
  for (Index k = 0; k < motions.end.rows(); ++k) {
    const Index row = motions.row(k);
    const S steady = steady_force(motions, k, motions.per_force * residual(row));
    sum = sum + residual(row) * work_displacement(1.0, delta(row), before(row)) / (h * h);
    sum = sum + S(0.5) * h * (steady * motions.next_velocity(k) - motions.steady(k) * motions.velocity(k));
  }
  return sum;
}

/// Where within a step the velocity of a given motion is that with which it comes to the end: but for the rounding of times, there.
inline constexpr double kComing = 1 - 1e-6;

template <class S>
class MotionLaw : public JointLaw<S, JointMotion> {
 public:
  static constexpr std::array sweeps{PartSweep{Part::begin, "given_motion_map", "motions, time, q", "motions, delta"},
                                     PartSweep{Part::add, "hold_motions", "motions, joint impulses", "joint impulses"}};
  explicit MotionLaw(const LawSetup& setup) : JointLaw<S, JointMotion>(setup), curves_(setup.curves) {
    motions_.entries = this->entries();
    for (Field<S>* field : {&motions_.end, &motions_.next_velocity, &motions_.velocity, &motions_.force, &motions_.steady}) {
      field->allocate(static_cast<Index>(this->entries().size()));
    }
  }

  void begin(const StepView<S>& step, const StepStart<S>& start, Field<S>& delta) {
    begin_motions(step.h, start.known, motions_);
    for (Index k = 0; k < motions_.end.rows(); ++k) {
      const SmoothCurve& curve = curves_[static_cast<std::size_t>(k)];
      motions_.end(k) = at_each_time<S>(start.times, [&](double t) LINDEN_INLINE_LAMBDA { return curve.at(t + start.step); });
      motions_.next_velocity(k) =
          at_each_time<S>(start.times, [&](double t) LINDEN_INLINE_LAMBDA { return curve.slope(t + kComing * start.step); });
    }
    put(step, delta);
  }
  /// What is given stays where a guess is given up for another.
  void put(const StepView<S>& step, Field<S>& delta) const { given_motion_map(motions_, step.q_row, step.q, delta); }
  void add(const StepView<S>&, JointImpulses<S>& sum) const { hold_motions(motions_, sum); }
  void account(const StepView<S>& step, const SolvedStep<S>& solved, const auto& book) const {
    book(-1, motion_work(motions_, step.h, solved.residual, solved.delta, solved.before));
  }
  void keep(const Field<S>& residual) { end_motions(residual, motions_); }

  KeptNumbers<S, 3> memory() { return {motions_.velocity.flat(), motions_.force.flat(), motions_.steady.flat()}; }
  /// Velocities, steady forces and forces, each of all motions.
  static Index kept_numbers(const LawSetup& setup) { return 3 * static_cast<Index>(setup.curves.size()); }
  S kept(Index k) const { return (*std::array{&motions_.velocity, &motions_.steady, &motions_.force}[which(k)])(k % motions_.end.rows()); }
  void set_kept(Index k, const S& number) {
    (*std::array{&motions_.velocity, &motions_.steady, &motions_.force}[which(k)])(k % motions_.end.rows()) = number;
  }
  void forget() {
    for (Field<S>* field : {&motions_.velocity, &motions_.force, &motions_.steady}) std::ranges::fill(field->flat(), S(0.0));
  }

  const GivenMotions<S>& motions() const { return motions_; }

 private:
  std::size_t which(Index k) const { return static_cast<std::size_t>(k / motions_.end.rows()); }

  GivenMotions<S> motions_;
  std::span<const SmoothCurve> curves_;
};

}  // namespace linden

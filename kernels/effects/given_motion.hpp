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
// energy  gives residual x worked / h^2. Velocities at the end of a step have seen half of the next impulse, too: h/2 v force, of the
//         force that lasted from step to step, which no blow has. The first step's impulse is half of one: it has half a step behind it.
// cost    two looks into a table an entry and step
// source  constraints of a discrete Euler-Lagrange equation: Marsden, West, Discrete mechanics and variational integrators (2001), 3.4
#pragma once

#include <span>

#include "kernels/effects/joint_impulses.hpp"
#include "layout/effects.hpp"

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
  return select(motions.first > S(0.5), force, lasting(force, motions.force(k)));
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
    sum = sum + residual(row) * worked(1.0, delta(row), before(row)) / (h * h);
    sum = sum + S(0.5) * h * (steady * motions.next_velocity(k) - motions.steady(k) * motions.velocity(k));
  }
  return sum;
}

}  // namespace linden

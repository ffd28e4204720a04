// kernels/effects/ball_spring.hpp
// Springs that pull ball joints towards an orientation.
//
//   P = 1/2 k |log(rest^-1 R)|^2, torque -k log(rest^-1 R), taken at the middle of the step: R_mid = R^k exp(delta / 2)
//
// With t = v / (1 + w) of the joint's own displacement M (v, w), tan of a quarter of its angle along its axis, a change eta of the
// orientation at k+1 changes the middle by 1/2 (1 + t^) eta, one at k by 1/2 (1 - t^) eta. Hence, tau = k log(rest^-1 R_mid),
//
//   h r += h^2/2 (tau + t x tau)  at the beginning,    h p -= h^2/2 (tau - t x tau)  at the end,    d += h^2/4 k
//
// the exact derivatives of a discrete potential: symplectic, and angular momentum is passed on exactly. d is that of small turns.
//
// units   k [N m/rad]
// energy  P, conservative
// cost    one logarithm an entry and evaluation
// source  Marsden, West, Discrete mechanics and variational integrators (2001), 2.3.1; the half of a turn: this header
#pragma once

#include <span>

#include "kernels/effects/law.hpp"
#include "kernels/values/se3.hpp"

namespace linden {

template <class S>
LINDEN_INLINE Quaternion<S> rest_inverse(const BallSpring& spring) {
  return {{as<S>(-spring.rest[0]), as<S>(-spring.rest[1]), as<S>(-spring.rest[2])}, as<S>(spring.rest[3])};
}

/// Rotation vector of a unit quaternion, of the shorter way.
template <class S>
LINDEN_INLINE Vec3<S> shorter_turn(const Quaternion<S>& q) {
  const S zero(0.0), sign = select(q.w < zero, S(-1.0), S(1.0));
  return log(Displacement<S>{{sign * q.v, sign * q.w}, {zero, zero, zero}}).w;
}

template <class S>
struct BallPull {
  Vec3<S> tau, t;
};

template <class S>
LINDEN_INLINE BallPull<S> ball_pull(const BallSpring& spring, const Tree& tree, const Field<S>& q, const Field<S, 7>& motion) {
  const Index row = tree.first_q(spring.slot);
  const Quaternion<S> before{load3<S>(q, row), q(row + 3)};
  const auto M = load<Displacement, S>(motion, spring.slot).r;
  // M = cos + sin; half of it: (v, 1 + w), made unit
  using std::sqrt;
  const S length = S(1.0) / sqrt(S(2.0) + S(2.0) * M.w);
  const Quaternion<S> half{length * M.v, length * (S(1.0) + M.w)};
  return {as<S>(spring.stiffness) * shorter_turn(rest_inverse<S>(spring) * before * half), S(1.0) / (S(1.0) + M.w) * M.v};
}

template <class S>
void ball_spring_stiffness(std::span<const BallSpring> springs, const Tree& tree, const S& h, JointImpulses<S>& sum) {
  for (const BallSpring& spring : springs) {
    const S d = h * h * as<S>(0.25 * spring.stiffness);
    for (Index row = tree.first_v(spring.slot); row < tree.first_v(spring.slot) + 3; ++row) {
      sum.stiffness(row) = sum.stiffness(row) + d;
    }
  }
}

/// At each evaluation, once joint_impulses_map has set the target.
template <class S>
void ball_spring_map(std::span<const BallSpring> springs, const Tree& tree, const S& h, const Field<S>& q, const Field<S, 7>& motion,
                     Field<S>& target) {
  for (const BallSpring& spring : springs) {
    const BallPull<S> pull = ball_pull(spring, tree, q, motion);
    const Index row = tree.first_v(spring.slot);
    store3(target, row, load3<S>(target, row) - S(0.5) * h * h * (pull.tau + cross(pull.t, pull.tau)));
  }
}

template <class S>
void ball_spring_end_map(std::span<const BallSpring> springs, const Tree& tree, const S& h, const Field<S>& q, const Field<S, 7>& motion,
                         Field<S>& end) {
  for (const BallSpring& spring : springs) {
    const BallPull<S> pull = ball_pull(spring, tree, q, motion);
    const Index row = tree.first_v(spring.slot);
    store3(end, row, load3<S>(end, row) - S(0.5) * h * (pull.tau - cross(pull.t, pull.tau)));
  }
}

template <class S>
class BallSpringLaw : public JointLaw<S, BallSpring> {
 public:
  using JointLaw<S, BallSpring>::JointLaw;
  static constexpr std::array sweeps{PartSweep{Part::add, "ball_spring_stiffness", "ball springs, joint impulses", "joint impulses"},
                                     PartSweep{Part::evaluate, "ball_spring_map", "ball springs, q, motion, momentum_target", "momentum_target"}};
  static bool on_ball(const BallSpring&, const LawSetup&) { return true; }
  void add(const StepView<S>& step, JointImpulses<S>& sum) const { ball_spring_stiffness(this->entries(), step.tree, step.h, sum); }
  void evaluate(const StepView<S>& step, const Field<S, 7>& motion, Field<S>& target) const {
    ball_spring_map(this->entries(), step.tree, step.h, step.q, motion, target);
  }
  void end(const StepView<S>& step, const Field<S, 7>& motion, Field<S>& end) const {
    ball_spring_end_map(this->entries(), step.tree, step.h, step.q, motion, end);
  }
  static S potential(const BallSpring& spring, const JointsView<S>& at) {
    const Index row = at.tree.first_q(spring.slot);
    const Vec3<S> turn = shorter_turn(rest_inverse<S>(spring) * Quaternion<S>{load3<S>(at.q, row), at.q(row + 3)});
    return as<S>(0.5 * spring.stiffness) * dot(turn, turn);
  }
  static void push(const BallSpring& spring, const Instant& now, Field<double>& force) {
    const Index from = now.tree.first_q(spring.slot), row = now.tree.first_v(spring.slot);
    const Vec3<double> turn = shorter_turn(rest_inverse<double>(spring) * Quaternion<double>{load3<double>(now.q, from), now.q(from + 3)});
    store3(force, row, load3<double>(force, row) - spring.stiffness * turn);
  }
};

}  // namespace linden

// kernels/block/evaluate_down.hpp
// The downward half of an evaluation in one sweep, for a block of instances: lane = instance.
//
//   start_down     M_i = exp(S_i delta_i)
//   correct_down   eta_i = Ad_{(X_i M_i)^-1} eta_parent + S_i Delta_i,   M_i <- M_i exp(-S_i Delta_i)         (increment_down)
//   move_down      the same where Delta is there
//   and in both    dT_i = X_i^-1 dT_parent X_i M_i,   hV_i = log dT_i,   h mu_i                               (displacement_down, momentum_map)
//
// The same arithmetic as the sweeps named at the right, body by body. One tree over its bodies is best served by those, whose maps can put
// a body in every lane; where the lanes hold instances already, one sweep spares the trips to memory between them: a block of eight
// 30-body humanoids touches 190 KB a step, four times the nearest cache.
//
// reads   screw 2 x n, inertia 10 x n, placement 12 x n, delta nv; (gains, innovation nv, `active`: lanes that are corrected)
// writes  motion 7 x n (of a screw's only z, w and shift), displacement 7 x n, turn 3 x n, impulse 6 x n (h mu), (delta, variation 6 x n)
// returns least w of any body (see displacement_down), h^2 x kinetic energy of the mean motion
// source  the paper, Algorithm 2, lines 3 to 7
#pragma once

#include "kernels/tree/displacement_down.hpp"
#include "kernels/tree/increment_down.hpp"
#include "kernels/tree/momentum_map.hpp"
#include "kernels/tree/motion_map.hpp"
#include "layout/workspace.hpp"

namespace linden {

template <class S>
struct Evaluation {
  S least_w;
  S energy;
};

/// A screw's motion is three numbers.
template <JointKind Kind, class S>
LINDEN_INLINE Displacement<S> load_motion(Joint<Kind>, const Field<S, 7>& motion, Index i) {
  if constexpr (Kind == JointKind::screw) {
    const S zero(0.0);
    return {{{zero, zero, motion(i, 2)}, motion(i, 3)}, {zero, zero, motion(i, 6)}};
  } else {
    return load<Displacement, S>(motion, i);
  }
}

template <JointKind Kind, class S>
LINDEN_INLINE void store_motion(Joint<Kind>, Field<S, 7>& motion, Index i, const Displacement<S>& M) {
  if constexpr (Kind == JointKind::screw) {
    motion(i, 2) = M.r.v.z;
    motion(i, 3) = M.r.w;
    motion(i, 6) = M.p.z;
  } else {
    store(motion, i, M);
  }
}

/// motion_of(joint, i, X) yields M_i.
template <class S, class MotionOf, class Element>
LINDEN_INLINE Evaluation<S> evaluate_down(const Tree& tree, const BodyConstants<Element>& constants, Workspace<S>& work,
                                          const MotionOf& motion_of) {
  using std::min;
  const S zero(0.0), one(1.0);
  store(work.displacement, 0, Displacement<S>{{{zero, zero, zero}, one}, {zero, zero, zero}});
  S least = one, energy = zero;
  down(tree, [&](auto joint, Index i) {
    const auto X = load<Placement, S>(work.placement, i);
    const Displacement<S> M = motion_of(joint, i, X);
    store_motion(joint, work.motion, i, M);
    const auto D = moved(joint, load<Displacement, S>(work.displacement, tree.parent(i)), X, M);
    store(work.displacement, i, D);
    least = min(least, min(D.r.w, M.r.w));
    const auto body = body_momentum_of(load<Inertia, S>(constants.inertia, i), D);
    store(work.turn, i, body.u.w);
    store(work.impulse, i, body.mu);
    energy = energy + S(0.5) * dot(body.m, body.u);
  });
  return {least, energy};
}

template <class S, class Element>
[[gnu::noinline]] Evaluation<S> start_down(const Tree& tree, const BodyConstants<Element>& constants, Workspace<S>& work) {
  return evaluate_down(tree, constants, work, [&](auto joint, Index i, const Placement<S>&) {
    return joint_motion(joint, constants, i, tree.first_v(i), work.delta, S(1.0));
  });
}

/// The motion of joint i less its increment, in the lanes that are corrected.
template <JointKind Kind, class S, class Mask, class Element>
LINDEN_INLINE Displacement<S> corrected_motion(Joint<Kind> joint, const BodyConstants<Element>& constants, Index i, Index row,
                                               const Displacement<S>& M, const Wrench<S>& increment, const Mask& active,
                                               Workspace<S>& work) {
  if constexpr (Kind == JointKind::screw) {
    const S delta = work.delta(row) - select(active, increment.n.x, S(0.0));
    work.delta(row) = delta;
    return screw_motion(load_screw<S>(constants, i), delta);
  } else {
    const Displacement<S> N = M * joint_motion(joint, constants, i, row, work.increment, S(-1.0));
    const auto pick = [&](const Vec3<S>& a, const Vec3<S>& b) {
      return Vec3<S>{select(active, a.x, b.x), select(active, a.y, b.y), select(active, a.z, b.z)};
    };
    return Displacement<S>{{pick(N.r.v, M.r.v), select(active, N.r.w, M.r.w)}, pick(N.p, M.p)};
  }
}

template <class S, class Mask, class Element>
[[gnu::noinline]] Evaluation<S> correct_down(const Tree& tree, const BodyConstants<Element>& constants, const Mask& active,
                                             Workspace<S>& work) {
  const S zero(0.0);
  store(work.variation, 0, Twist<S>{{zero, zero, zero}, {zero, zero, zero}});
  const Gains<S> gains{work.gain_up, work.gain_down, work.joint_inverse};
  return evaluate_down(tree, constants, work, [&](auto joint, Index i, const Placement<S>& X) {
    const Index row = tree.first_v(i);
    const Displacement<S> M = load_motion(joint, work.motion, i);
    const Twist<S> xi = to_child(after_motion(joint, X, M), load<Twist, S>(work.variation, tree.parent(i)));
    const Wrench<S> increment = joint_increment(joint, tree, gains, i, load_joint(joint, work.innovation, row), xi);
    store_joint(joint, work.increment, row, increment);
    store(work.variation, i, add_motion(joint, constants, i, increment, xi));
    return corrected_motion(joint, constants, i, row, M, increment, active, work);
  });
}

template <class S, class Mask, class Element>
[[gnu::noinline]] Evaluation<S> move_down(const Tree& tree, const BodyConstants<Element>& constants, const Mask& active,
                                          Workspace<S>& work) {
  return evaluate_down(tree, constants, work, [&](auto joint, Index i, const Placement<S>&) {
    const Index row = tree.first_v(i);
    return corrected_motion(joint, constants, i, row, load_motion(joint, work.motion, i), load_joint(joint, work.increment, row), active, work);
  });
}

}  // namespace linden

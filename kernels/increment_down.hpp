// kernels/increment_down.hpp
// Second half of a solve with a factored matrix: joints yield to the impulses and to the motion of their parents, root to leaves.
//
//   xi_i = Ad_{M_i^-1} Ad_{X_i^-1} eta_parent,   Delta_i = d_i^-1 u_i - gain_down_i^T xi_i,   eta_i = xi_i + S_i Delta_i
//
//   increment_down  with the motions M of the step: Newton's correction of the displacement
//   rate_down       M = 1: applies M(q)^-1, the velocity of a momentum or RIQN's correction
//
// reads   screw 2 x n, placement 12 x n, (motion 7 x n,) gains, innovation nv (u)
// writes  variation 6 x n (eta), increment nv (Delta)
// cost    one pass; the bodies of one level are independent
// source  Featherstone, Rigid Body Dynamics Algorithms, 7.3, pass 3, for impulses
#pragma once

#include "kernels/impulse_pass_up.hpp"

namespace linden {

template <class S, class Element, class BeforeJoint>
void yield_down(const Tree& tree, const BodyConstants<Element>& constants, const Field<S, 12>& placement, const Gains<S>& gains,
                const Field<S>& innovation, BeforeJoint&& before_joint, Field<S, 6>& variation, Field<S>& increment) {
  const Vec3<S> zero{S(0.0), S(0.0), S(0.0)};
  store(variation, 0, Twist<S>{zero, zero});
  down(tree, [&](auto joint, Index i) {
    const Index row = tree.first_v(i);
    const auto carried = to_child(load<Placement, S>(placement, i), load<Twist, S>(variation, tree.parent(i)));
    const Twist<S> xi = before_joint(joint, i, carried);
    Wrench<S> delta = yield(joint, gains.inverse, tree.first_block(i), load_joint(joint, innovation, row));
    const auto along = [&](Index k) {
      const auto gain = load<Twist, S>(gains.down, row + k);
      return dot(gain.w, xi.w) + dot(gain.v, xi.v);
    };
    if constexpr (joint == JointKind::screw) {
      delta.n.x = delta.n.x - along(0);
    } else if constexpr (joint == JointKind::ball) {
      delta.n = delta.n - Vec3<S>{along(0), along(1), along(2)};
    } else {
      delta = delta - Wrench<S>{xi.w, xi.v};
    }
    store_joint(joint, increment, row, delta);
    store(variation, i, add_motion(joint, constants, i, row, increment, xi));
  });
}

template <class S, class Element>
void increment_down(const Tree& tree, const BodyConstants<Element>& constants, const Field<S, 12>& placement,
                    const Field<S, 7>& motion, const Gains<S>& gains, const Field<S>& innovation, Field<S, 6>& variation,
                    Field<S>& increment) {
  const auto before_joint = [&](auto joint, Index i, const Twist<S>& carried) {
    const auto M = load<Displacement, S>(motion, i);
    if constexpr (joint == JointKind::screw) {
      const S c = S(1.0) - S(2.0) * M.r.v.z * M.r.v.z, s = S(2.0) * M.r.v.z * M.r.w, t = M.p.z;
      const auto back = [&](const Vec3<S>& a) { return Vec3<S>{c * a.x + s * a.y, c * a.y - s * a.x, a.z}; };
      const Vec3<S>& w = carried.w;
      return Twist<S>{back(w), back(Vec3<S>{carried.v.x + t * w.y, carried.v.y - t * w.x, carried.v.z})};
    } else {
      return to_child(M, carried);
    }
  };
  yield_down(tree, constants, placement, gains, innovation, before_joint, variation, increment);
}

template <class S, class Element>
void rate_down(const Tree& tree, const BodyConstants<Element>& constants, const Field<S, 12>& placement, const Gains<S>& gains,
               const Field<S>& innovation, Field<S, 6>& variation, Field<S>& rate) {
  const auto before_joint = [](auto, Index, const Twist<S>& carried) { return carried; };
  yield_down(tree, constants, placement, gains, innovation, before_joint, variation, rate);
}

}  // namespace linden

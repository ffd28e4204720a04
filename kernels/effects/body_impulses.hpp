// kernels/effects/body_impulses.hpp
// What the effects of bodies amount to within a step: forces at points of a body, implicit in its displacement.
//
//   a force F at the point a of body i       a in the body frame at k, F in its directions
//   share s of it at the beginning           h mu_i -= s h^2 (a x F, F)
//   the rest at the end, at a + D            D = displacement of the point, body frame at k
//   Jacobian                                 K_i += s h^2 J_a^T H R J_c,    H = -dF/dD,  J_c = [-c^ 1],  R of dT
//
// Both shares as one wrench in space, in the body frame at k, are `given`: summed over subtrees they turn the impulses of the beginning
// of a step into those of its end (momentum_update_map). H is taken about the point c that F's law looks at.
//
// s is that of joint_impulses.hpp. The work of a force is F.D.
//
// reads   displacement 7 x n
// writes  impulse 6 x n, applied 6 x n, body_stiffness 36 x n of the bodies that effects touch
#pragma once

#include <span>

#include "kernels/effects/contact_geometry.hpp"
#include "kernels/effects/joint_impulses.hpp"
#include "kernels/values/se3.hpp"

namespace linden {

#define LINDEN_BODY_IMPULSES_FIELDS(FIELD)                                                                \
  FIELD(Scalar, pose, 12, slots, "T: body -> world at q; rotation row by row, shift [m]")                \
  FIELD(Scalar, applied, 6, slots, "h x impulses of both ends, body frame at k; moment, force")            \
  FIELD(Scalar, start_excess, 6, slots, "h x impulses times s - 1/2, where they act at the end, likewise")     \
  FIELD(Scalar, body_stiffness, 36, slots, "what K grows by, as a Mat6; zero of bodies that no effect touches")

template <class Scalar>
struct BodyImpulses {
  LINDEN_FIELDS(LINDEN_BODY_IMPULSES_FIELDS)
};

template <class S>
void clear_body(BodyImpulses<S>& sum, Index i) {
  for (int k = 0; k < 6; ++k) sum.applied(i, k) = sum.start_excess(i, k) = S(0.0);
  for (int k = 0; k < 36; ++k) sum.body_stiffness(i, k) = S(0.0);
}

/// impulse_i -= wrench
template <class S>
LINDEN_INLINE void take_wrench(Field<S, 6>& impulse, Index i, const Wrench<S>& wrench) {
  store(impulse, i, load<Wrench, S>(impulse, i) - wrench);
}

/// h^2 x wrenches of the beginning and of both ends; start_excess: (s - 1/2) x both, where it acts at the end of the step.
template <class S>
LINDEN_INLINE void add_wrenches(BodyImpulses<S>& sum, Field<S, 6>& impulse, Index i, const Wrench<S>& begin, const Wrench<S>& both,
                                const Wrench<S>& start_excess) {
  take_wrench(impulse, i, begin);
  store(sum.applied, i, load<Wrench, S>(sum.applied, i) + both);
  store(sum.start_excess, i, load<Wrench, S>(sum.start_excess, i) + start_excess);
}

/// force x h^2 at the point `arm`, which moves by `moved`.
template <class S>
LINDEN_INLINE void add_force(BodyImpulses<S>& sum, Field<S, 6>& impulse, Index i, const S& share, const Vec3<S>& arm, const Vec3<S>& moved,
                             const Vec3<S>& force) {
  const Vec3<S> middle = arm + (S(1.0) - share) * moved;
  add_wrenches(sum, impulse, i, share * Wrench<S>{cross(arm, force), force}, Wrench<S>{cross(middle, force), force},
               (share - S(0.5)) * Wrench<S>{cross(arm + moved, force), force});
}

/// H x h^2 s, of a force at `arm` that depends on how the point c moves.
template <class S>
LINDEN_INLINE void add_pull(BodyImpulses<S>& sum, Index i, const Vec3<S>& arm, const Vec3<S>& c, const Mat3<S>& R, const Mat3<S>& H) {
  const Mat3<S> bb = H * R, ab = hat_times(arm, bb);
  // columns (w, v): dD = R (v - c x w)
  const S minus(-1.0);
  const Mat6<S> more{minus * times_hat(ab, c), ab, minus * times_hat(bb, c), bb};
  (Mat6<S>::from(sum.body_stiffness.row(i)) + more).to(sum.body_stiffness.row(i));
}

/// Impulses of the beginning become those of the end, but for being seen from the new poses. Leaves `given` at zero.
template <class S>
void add_given_up(const Tree& tree, const Field<S, 12>& placement, Field<S, 6>& given, Field<S, 6>& impulse) {
  const Vec3<S> zero{S(0.0), S(0.0), S(0.0)};
  const Wrench<S> none{zero, zero};
  for (Index i = tree.shape.slots - 1; i > 0; --i) {
    const auto w = load<Wrench, S>(given, i);
    store(impulse, i, load<Wrench, S>(impulse, i) + w);
    const Index parent = tree.parent(i);
    store(given, parent, load<Wrench, S>(given, parent) + to_parent(load<Placement, S>(placement, i), w));
    store(given, i, none);
  }
  store(given, 0, none);
}

}  // namespace linden

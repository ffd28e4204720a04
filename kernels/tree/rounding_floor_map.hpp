// kernels/tree/rounding_floor_map.hpp
// How large a residual rounding alone may leave, in the energy norm: for every joint the impulses that meet there, squared, over its
// articulated inertia. A residual of a few epsilons of the root of this sum cannot be brought down any further.
//
// reads   screw 2 x n, impulse 6 x n (h F), momentum_target nv, joint_inverse
// returns the sum, to be multiplied by the square of some epsilons
#pragma once

#include "kernels/values/joints.hpp"

namespace linden {

template <class S, class Element>
S rounding_floor_map(const Tree& tree, const BodyConstants<Element>& constants, const Field<S>& momentum_target,
                     const Field<S, 6>& impulse, const Field<S>& joint_inverse) {
  using std::abs;
  using std::sqrt;
  S sum(0.0);
  const auto length = [](const Vec3<S>& a) { return sqrt(dot(a, a)); };
  down(tree, [&](auto joint, Index i) LINDEN_INLINE_LAMBDA {
    const auto F = load<Wrench, S>(impulse, i);
    const Index row = tree.first_v(i), block = tree.first_block(i);
    constexpr Index n = velocity_count(joint);
    for (Index k = 0; k < n; ++k) {
      S meets = abs(momentum_target(row + k));
      if constexpr (joint == JointKind::screw) {
        const Screw<S> screw = load_screw<S>(constants, i);
        meets = meets + abs(screw.r) * length(F.n) + abs(screw.t) * length(F.f);
      } else {
        meets = meets + (k < 3 ? length(F.n) : length(F.f));
      }
      sum = sum + meets * meets * abs(joint_inverse(block + k * n + k));
    }
  });
  return sum;
}

}  // namespace linden

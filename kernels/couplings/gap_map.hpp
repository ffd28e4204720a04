// kernels/couplings/gap_map.hpp
// The gap of a row, how the bodies of its coupling change it, and along the paths to them how every joint does.
//
// With the frames A and B of layout/couplings.hpp in the world. The gradient of each gap is one wrench: a force at x_B and a couple, as they
// are on body b and the other way round on body a. Never taken at two points, it leaves momentum alone to the last bit: a joint above both
// bodies does not see it at all.
//
//   shift     n = axis of A      gap n.(x_B - x_A)              force n
//   product   a of A, b of B     gap a.b                        couple b x a
//   length    n = d / |d|        gap |d| - length               force n
//
//   joint i on the way to b:  S_i^T Ad_{T_i}^T (couple + (x_B - o_i) x force, force);  on the way to a: minus that
//
// At q^k this is G, whose transpose a multiplier pushes along; at q^k+1 it is J, by which a correction of the displacement changes the gap.
//
// source  contact-free rows of Featherstone, Rigid Body Dynamics Algorithms, 8.1 to 8.3 (loop constraints)
#pragma once

#include <cmath>

#include "kernels/values/joints.hpp"
#include "layout/couplings.hpp"

namespace linden {

template <class S>
struct Gap {
  S gap;
  Vec3<S> force, couple;  // what one unit of the multiplier does to body b, at x_B; world frame
};

/// Column `axis` of R.
template <class S>
LINDEN_INLINE Vec3<S> axis_of(const Mat3<S>& R, int axis) {
  const auto of = [axis](const Vec3<S>& row) { return axis == 0 ? row.x : axis == 1 ? row.y : row.z; };
  return {of(R.x), of(R.y), of(R.z)};
}

/// Of any row but a sum.
template <class S>
Gap<S> gap_of(const GapRow& row, double length, const Placement<S>& A, const Placement<S>& B) {
  using std::sqrt;
  const Vec3<S> none{S(0.0), S(0.0), S(0.0)}, d = B.p - A.p;
  if (row.kind == GapKind::shift) {
    const Vec3<S> n = axis_of(A.R, row.a);
    return {dot(n, d), n, none};
  }
  if (row.kind == GapKind::product) {
    const Vec3<S> a = axis_of(A.R, row.a), b = axis_of(B.R, row.b);
    return {dot(a, b), none, cross(b, a)};
  }
  const S distance = sqrt(dot(d, d));
  return {distance - as<S>(length), d / distance, none};
}

/// A placement within another.
template <class S>
LINDEN_INLINE Placement<S> placed_in(const Placement<S>& T, const Placement<S>& frame) {
  return {T.R * frame.R, T.p + T.R * frame.p};
}

/// How joint i, whose body lies at T, changes a gap: velocity_count numbers.
template <JointKind Kind, class S, class Element>
LINDEN_INLINE void gap_along(Joint<Kind>, const BodyConstants<Element>& constants, Index i, const Placement<S>& T, const Vec3<S>& x_b,
                             const Gap<S>& gap, const S& sign, S* numbers) {
  const Vec3<S> moment = gap.couple + cross(x_b - T.p, gap.force);
  if constexpr (Kind == JointKind::screw) {
    const Screw<S> screw = load_screw<S>(constants, i);
    const Vec3<S> z = axis_of(T.R, 2);
    numbers[0] = sign * (screw.r * dot(z, moment) + screw.t * dot(z, gap.force));
  } else {
    (sign * transpose_times(T.R, moment)).to(numbers);
    if constexpr (Kind == JointKind::free) (sign * transpose_times(T.R, gap.force)).to(numbers + 3);
  }
}

}  // namespace linden

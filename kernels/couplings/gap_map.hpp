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
//   turn      u = sin(theta/2) l   gap 2 length a.u          couple length (cos(theta/2) a + u x a)
//   halfway   b = H a            gap b.(x_B - x_A)              force b, couple (m + t x m) / 2,   m = b x (x_B - x_A)
//   angle     R = A^T B          roll atan2(R_zy, R_zz)         couple (R_xx a_x + R_yx a_y) / (R_xx^2 + R_yx^2)
//                                pitch atan2(-R_zx, c)          couple (R_xx a_y - R_yx a_x) / c,   c^2 = R_xx^2 + R_yx^2
//                                yaw atan2(R_yx, R_xx)          couple a_z - R_zx (that of roll)
//
// B is turned against A by theta about l, their common axis. H turns by half of that, and t = tan(theta/4) l: where B turns against A by w, H does by
// (w - t x w) / 2. Without t x m what pushes is a force at the point half-way between x_A and x_B, as Drake's bushing does.
//
//   joint i on the way to b:  S_i^T Ad_{T_i}^T (couple + (x_B - o_i) x force, force);  on the way to a: minus that
//
// At q^k this is G, whose transpose a multiplier pushes along; at q^k+1 it is J, by which a correction of the displacement changes the gap.
//
// source  contact-free rows of Featherstone, Rigid Body Dynamics Algorithms, 8.1 to 8.3 (loop constraints); Drake, LinearBushingRollPitchYaw
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

/// Of an angle.
template <class S>
Gap<S> gap_of_angle(int angle, const Mat3<S>& A, const Mat3<S>& B) {
  using std::atan2, std::max, std::sqrt;
  constexpr double kUpright = 1e-12;  // square of the cosine of a pitch that has no roll
  const Vec3<S> none{S(0.0), S(0.0), S(0.0)}, a_x = axis_of(A, 0), a_y = axis_of(A, 1), a_z = axis_of(A, 2), x = axis_of(B, 0);
  const S xx = dot(a_x, x), yx = dot(a_y, x), zx = dot(a_z, x), square = max(xx * xx + yx * yx, as<S>(kUpright));
  if (angle == 1) {
    const S level = sqrt(square);
    return {atan2(S(0.0) - zx, level), none, (xx * a_y - yx * a_x) / level};
  }
  const Vec3<S> rolls = (xx * a_x + yx * a_y) / square;
  if (angle == 0) return {atan2(dot(a_z, axis_of(B, 1)), dot(a_z, axis_of(B, 2))), none, rolls};
  return {atan2(yx, xx), none, a_z - zx * rolls};
}

/// How B is turned against A: cos(theta/2), sin(theta/2) l.
template <class S>
struct HalfTurn {
  S w;
  Vec3<S> u;
  HalfTurn(const Mat3<S>& A, const Mat3<S>& B) {
    using std::max, std::sqrt;
    constexpr double kHalfTurn = 1e-12;  // 1 + trace, of a turn that has two axes
    S sum(1.0);
    Vec3<S> sine{S(0.0), S(0.0), S(0.0)};  // 2 sin(theta) l
    for (const int k : {0, 1, 2}) {
      const Vec3<S> a = axis_of(A, k), b = axis_of(B, k);
      sum = sum + dot(a, b);
      sine = sine + cross(a, b);
    }
    w = S(0.5) * sqrt(max(sum, as<S>(kHalfTurn)));
    u = sine / (S(4.0) * w);
  }
};

/// Of a shift along an axis of the frame half-way; d: from x_A to x_B.
template <class S>
Gap<S> gap_halfway(int axis, const Vec3<S>& d, const Mat3<S>& A, const Mat3<S>& B) {
  const HalfTurn<S> turn(A, B);
  const Vec3<S>& u = turn.u;
  const Vec3<S> t = u / (S(1.0) + turn.w);  // tan(theta/4) l
  const Vec3<S> a = axis_of(A, axis), turned = cross(u, a), b = a + turned + cross(t, turned), m = cross(b, d);
  return {dot(b, d), b, S(0.5) * (m + cross(t, m))};
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
  if (row.kind == GapKind::angle) return gap_of_angle(row.a, A.R, B.R);
  if (row.kind == GapKind::turn) {
    const HalfTurn<S> turn(A.R, B.R);
    const Vec3<S> a = axis_of(A.R, row.a);
    return {as<S>(2 * length) * dot(turn.u, a), none, as<S>(length) * (turn.w * a + cross(turn.u, a))};
  }
  if (row.kind == GapKind::halfway) return gap_halfway(row.a, d, A.R, B.R);
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

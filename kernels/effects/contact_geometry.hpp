// kernels/effects/contact_geometry.hpp
// Gaps between a shape on a body and a feature of what it may touch: how they change over a step, and the wrenches conjugate to them.
//
//   sphere, plane          g = n.c - o - r
//   sphere, line or point  g = |y| - r            y = c - e without its part along the line
//   circle, plane          g = n.c - o -+ rho s   s = |y|, y = n - (n.a) a: the lowest and the highest point of a disc
//   circle, line           g = (|v| - rho) k      v from c to where the line pierces the plane of the circle
//   line, line             g = w.(c - e) - r      w across both: an edge of a box, the axis of a cylinder or capsule
//   line, point            g = |y| - r            y = c - e without its part along the body's line
//   face, point            g = a.(c - e)          a into the body
//
// c centre, r radius of a sphere, a axis, rho radius of a circle. Features stand still; the body moves by D, its centre by D_c, and turns
// by the rotation vector phi. All in the body frame at k. Wrenches are about the centre: moment, force.
//
// A force N along a gap must give the body N (g^k+1 - g^k), no more and no less. `mean` is the wrench that does:
//
//   mean.f . D_c + mean.n . phi = g^k+1 - g^k
//
// exactly where only the centre moves, to a twelfth of the square of the turn where the body turns. Of a norm it is
// |y1| - |y0| = (y0 + y1) / (|y0| + |y1|) . (y1 - y0), which also holds where y passes through zero: a disc that lies flat has no lowest
// point, and its gap's gradient flips from one side to the other, but the sum over lowest and highest is as smooth as two springs.
//
// energy  a discrete gradient of the gap: Gonzalez, Time integration and discrete Hamiltonian systems (1996)
// cost    40 to 150 operations a gap
#pragma once

#include "kernels/values/se3.hpp"

namespace linden {

/// A circle that lies flat to less than this has no lowest point [rad].
inline constexpr double kFlat = 1e-9;

/// How far the point c of a body moves, in the body frame before it.
template <class S>
LINDEN_INLINE Vec3<S> point_displacement(const Displacement<S>& D, const Vec3<S>& c) {
  return D.p + S(2.0) * cross(D.r.v, D.r.w * c + cross(D.r.v, c));
}

/// How far the direction a of a body turns: a1 - a.
template <class S>
LINDEN_INLINE Vec3<S> turned_by(const Quaternion<S>& r, const Vec3<S>& a) {
  return S(2.0) * cross(r.v, r.w * a + cross(r.v, a));
}

/// Rotation vector of a turn below pi.
template <class S>
LINDEN_INLINE Vec3<S> rotation_vector(const Quaternion<S>& r) {
  const S ss = dot(r.v, r.v);
  S scale = small_angle_over_sine(ss);
  if (const auto wide = r.w < as<S>(kSmallTurnCosine); any(wide)) [[unlikely]] {
    const S t = S(1.0) / (S(1.0) + r.w);
    scale = select(wide, S(4.0) * atan_over_t(t * t * ss) * t, scale);
  }
  return scale * r.v;
}

/// A gap over a step.
template <class S>
struct GapChange {
  S rise;          // g^k+1 - g^k
  Wrench<S> mean;  // whose work it is
  Wrench<S> end;   // gradient of g at k+1
};

template <class S>
LINDEN_INLINE GapChange<S> sphere_over_plane(const Vec3<S>& n, const Vec3<S>& moved) {
  const S zero(0.0);
  const Wrench<S> along{{zero, zero, zero}, n};
  return {dot(n, moved), along, along};
}

/// `line`: its direction, zero for a point; `foot` = c - e at k. bend: d mean.f / d D_c.
template <class S>
LINDEN_INLINE GapChange<S> sphere_over_line(const Vec3<S>& line, const Vec3<S>& foot, const Vec3<S>& moved, Mat3<S>& bend) {
  using std::sqrt;
  const S zero(0.0), one(1.0);
  const auto off = [&](const Vec3<S>& x) { return x - dot(line, x) * line; };
  const Vec3<S> y0 = off(foot), more = off(moved), y1 = y0 + more;
  const S tiny = as<S>(kFlat * kFlat);
  const S l0 = sqrt(dot(y0, y0) + tiny), l1 = sqrt(dot(y1, y1) + tiny), per_sum = one / (l0 + l1);
  const Vec3<S> n = per_sum * (y0 + y1), n1 = (one / l1) * y1, none{zero, zero, zero};
  bend = per_sum * (diagonal(one) - outer(line, line) - outer(n, n1));
  return {dot(n, more), {none, n}, {none, n1}};
}

/// `side` -1: the lowest point of the disc, +1 the highest. bend: d mean.n / d (turn at k+1).
template <class S>
LINDEN_INLINE GapChange<S> circle_over_plane(const Vec3<S>& n, const Vec3<S>& axis, double radius, double side, const Quaternion<S>& turn,
                                             const Vec3<S>& moved, Mat3<S>& bend) {
  using std::sqrt;
  const S one(1.0), half(0.5), reach = as<S>(side * radius), tiny = as<S>(kFlat * kFlat);
  const Vec3<S> da = turned_by(turn, axis), end_axis = axis + da, mean_axis = axis + half * da;
  const S p0 = dot(n, axis), dp = dot(n, da), p1 = p0 + dp, mean_p = p0 + half * dp;
  const Vec3<S> y0 = n - p0 * axis, y1 = n - p1 * end_axis, y = n - mean_p * mean_axis;
  const S s0 = sqrt(dot(y0, y0) + tiny), s1 = sqrt(dot(y1, y1) + tiny), per_sum = one / (s0 + s1);
  const S rise = dot(n, moved) - reach * (per_sum * dp * (p0 + p1));
  const S twice = reach * per_sum * S(2.0);
  const Vec3<S> across = cross(end_axis, n);
  bend = -twice * hat_times(n, outer((p1 * per_sum / s1) * y - half * mean_axis, across) + (half * mean_p) * hat(end_axis));
  return {rise, {cross(twice * y, n), n}, {cross((reach / s1) * y1, n), n}};
}

/// The gap at k where the line is not along the circle's plane: k makes its gradient a unit force there. `foot` = c - e.
template <class S>
struct CircleAndLine {
  Vec3<S> v;          // from c to where the line pierces the plane of the circle
  S length;           // of v
  Wrench<S> gradient; // of |v|

  LINDEN_INLINE CircleAndLine(const Vec3<S>& line, const Vec3<S>& foot, const Vec3<S>& axis) {
    using std::sqrt;
    const S one(1.0), per_slope = one / dot(line, axis);
    v = (dot(foot, axis) * per_slope) * line - foot;
    length = sqrt(dot(v, v) + as<S>(kFlat * kFlat));
    const Vec3<S> out = (one / length) * v;
    const S lean = dot(out, line) * per_slope;
    gradient = {-lean * cross(axis, v), lean * axis - out};
  }
};

template <class S>
LINDEN_INLINE GapChange<S> circle_over_line(const Vec3<S>& line, const Vec3<S>& foot, const Vec3<S>& axis, const Quaternion<S>& turn,
                                            const Vec3<S>& moved) {
  using std::sqrt;
  const CircleAndLine<S> begin(line, foot, axis), end(line, foot + moved, axis + turned_by(turn, axis));
  const S scale = S(1.0) / sqrt(dot(begin.gradient.f, begin.gradient.f));
  return {scale * (end.length - begin.length), (S(0.5) * scale) * (begin.gradient + end.gradient), scale * end.gradient};
}

/// How lines and faces of a body meet edges and corners.
enum class BlockContact { crossing, corner_on_line, corner_on_face };

/// Of a line or face of a body through c: its direction a, of a face the normal into the body.
template <class S>
struct BlockTouch {
  S gap;
  Vec3<S> normal;  // unit length
  Vec3<S> arm;     // from c to where they touch, on the line or face

  LINDEN_INLINE Wrench<S> gradient() const { return {cross(arm, normal), normal}; }
};

/// `along`: direction of the edge; `foot` = c - e; `toward`: the normal's side.
template <class S>
LINDEN_INLINE BlockTouch<S> touch_block(BlockContact contact, const Vec3<S>& a, const Vec3<S>& along, const Vec3<S>& foot, double radius,
                                        const Vec3<S>& toward) {
  using std::sqrt;
  const S one(1.0), zero(0.0), tiny = as<S>(kFlat * kFlat);
  if (contact == BlockContact::corner_on_face) return {dot(a, foot), a, -foot};
  if (contact == BlockContact::corner_on_line) {
    const S t = dot(a, foot);
    const Vec3<S> y = foot - t * a;
    const S length = sqrt(dot(y, y) + tiny);
    return {length - as<S>(radius), (one / length) * y, -t * a};
  }
  const Vec3<S> across = cross(a, along);
  const S sense = select(dot(across, toward) < zero, -one, one);
  const Vec3<S> n = (sense / sqrt(dot(across, across) + tiny)) * across, between = cross(along, n);
  return {dot(n, foot) - as<S>(radius), n, -(dot(between, foot) / dot(between, a)) * a};
}

}  // namespace linden

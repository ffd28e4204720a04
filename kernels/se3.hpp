// kernels/se3.hpp
// exp and log of SE(3), dlog, its transpose, and the derivative of dlog^T (G u): branch-free, full relative accuracy from 1e-300 to
// just under pi.
//
// A twist is treated as one three-vector over the dual numbers, u~ = w + eps v (eps^2 = 0), since ad of (w, v) is the cross product
// with u~. A wrench is m~ = f + eps n. With x~ = u~.u~ and alpha as in kernels/polynomial.hpp
//
//   dlog_u   y~ = (1 - alpha~ x~) y~ - 1/2 u~ x y~ + alpha~ u~ (u~.y~)                        (12), closed form
//   dlog_u^T m~ = (1 - alpha~ x~) m~ + 1/2 u~ x m~ + alpha~ u~ (u~.m~)
//
// so SE(3) costs two copies of SO(3)'s formula and no 6 x 6 matrix is formed.
//
// range   the angle of a displacement is below pi exactly where the w of its quaternion is positive, as long as every joint turns by
//         less than pi; a sweep reports the least w it met
// source  the paper, (10)-(16); Murray, Li, Sastry (exp, log); Selig, Geometric Fundamentals of Robotics, ch. 9 (dual numbers)
#pragma once

#include "kernels/polynomial.hpp"
#include "kernels/spatial.hpp"

namespace linden {

/// exp(u), |w| < pi. The quaternion and the shift are within a few epsilon of their own size.
template <class S>
LINDEN_INLINE Displacement<S> exp(const Twist<S>& u) {
  const S x = dot(u.w, u.w);
  const S half_angle_squared = S(0.25) * x;
  const S half_sinc = S(0.5) * sinc(half_angle_squared);  // sin(theta/2) / theta
  const S cosine = S(1.0) - half_angle_squared * versine_over_square(half_angle_squared);
  // shift = v + (1 - cos)/theta^2 w x v + (theta - sin)/theta^3 w x (w x v), and (1 - cos)/theta^2 = 2 (sin(theta/2)/theta)^2
  const Vec3<S> wv = cross(u.w, u.v);
  const Vec3<S> shift = u.v + (S(2.0) * half_sinc * half_sinc) * wv + exp_second(x) * cross(u.w, wv);
  return {{half_sinc * u.w, cosine}, shift};
}

/// Rotation vector of a quaternion with w > 0: theta = 4 atan(tan(theta/4)), tan(theta/4) = |v| / (1 + w).
template <class S>
LINDEN_INLINE Vec3<S> rotation_log(const Quaternion<S>& q) {
  const S scale = S(1.0) / (S(1.0) + q.w);
  const Vec3<S> t = scale * q.v;
  return (S(4.0) * atan_over_t(dot(t, t))) * t;
}

/// log(D) for an angle below pi (w > 0).
template <class S>
LINDEN_INLINE Twist<S> log(const Displacement<S>& D) {
  const Vec3<S> w = rotation_log(D.r);
  const Vec3<S> wp = cross(w, D.p);
  return {w, D.p - S(0.5) * wp + alpha(dot(w, w)) * cross(w, wp)};
}

/// What dlog_u needs to know of u: the dual numbers alpha~ and 1 - alpha~ x~.
template <class S>
struct DlogFactors {
  S a, a_eps;  // alpha~ = a + eps a_eps
  S b, b_eps;  // 1 - alpha~ x~

  LINDEN_INLINE explicit DlogFactors(const Twist<S>& u) {
    const S x = dot(u.w, u.w);
    const S half_x_eps = dot(u.w, u.v);
    const S two(2.0);
    a = alpha(x);
    const S slope = alpha_slope(x);
    a_eps = two * slope * half_x_eps;
    b = S(1.0) - a * x;
    b_eps = -two * half_x_eps * (a + slope * x);
  }
};

/// dlog_u y
template <class S>
LINDEN_INLINE Twist<S> dlog(const Twist<S>& u, const Twist<S>& y) {
  const DlogFactors<S> k(u);
  const S half(0.5);
  const S s = dot(u.w, y.w), s_eps = dot(u.w, y.v) + dot(u.v, y.w);
  return {k.b * y.w - half * cross(u.w, y.w) + (k.a * s) * u.w,
          k.b * y.v + k.b_eps * y.w - half * (cross(u.w, y.v) + cross(u.v, y.w)) + (k.a * s) * u.v +
              (k.a_eps * s + k.a * s_eps) * u.w};
}

/// The part of dlog_u^T m that is even in u, and the odd part 1/2 u~ x m~.
/// mu = even + odd = dlog_u^T m (21b);  nu = even - odd = dlog_-u^T m = Ad_exp(u)^T mu.
template <class S>
struct TransposedDlog {
  Wrench<S> even, odd;
};

template <class S>
LINDEN_INLINE TransposedDlog<S> dlog_transpose(const Twist<S>& u, const Wrench<S>& m) {
  const DlogFactors<S> k(u);
  const S half(0.5);
  const S s = dot(u.w, m.f), s_eps = dot(u.w, m.n) + dot(u.v, m.f);
  TransposedDlog<S> result;
  result.even.f = k.b * m.f + (k.a * s) * u.w;
  result.even.n = k.b * m.n + k.b_eps * m.f + (k.a * s) * u.v + (k.a_eps * s + k.a * s_eps) * u.w;
  result.odd.f = half * cross(u.w, m.f);
  result.odd.n = half * (cross(u.w, m.n) + cross(u.v, m.f));
  return result;
}

/// K = d(dlog_u^T G u)/du  dlog_-u: change of h mu with the body's pose at k+1, in the body's frame. G + O(u); not symmetric.
///
/// With E = dlog_-w (3 x 3), F its eps part, C = [m c]^: dlog_-u = [E 0; F E], dlog_u^T = [E F; 0 E], G = [I C; -C m], and H~ the
/// derivative at constant m~ = G u,
///   H~ = -1/2 m~^ + alpha~ (u~ m~^T + (u~.m~) 1) + (2 alpha~' (u~.m~) u~ - 2 (alpha~ + alpha~' x~) m~) u~^T,
/// which acts on dual vectors: f = H w, n = H v + H_eps w.
template <class S>
LINDEN_INLINE Mat6<S> pose_derivative(const Inertia<S>& G, const Twist<S>& u, const Wrench<S>& m) {
  const S half(0.5), two(2.0);
  const S x = dot(u.w, u.w), y = dot(u.w, u.v);
  const S a = alpha(x), slope = alpha_slope(x), curvature = alpha_curvature(x);
  const S a_eps = two * slope * y, slope_eps = two * curvature * y;

  const Mat3<S> ww = outer(u.w, u.w);
  const Mat3<S> E = diagonal(S(1.0) - a * x) + half * hat(u.w) + a * ww;
  const Mat3<S> vw = outer(u.v, u.w);
  const Mat3<S> F = diagonal(-a_eps * x - two * a * y) + half * hat(u.v) + a_eps * ww + a * (vw + transpose(vw));

  const S s = dot(u.w, m.f), s_eps = dot(u.w, m.n) + dot(u.v, m.f);
  const S g = a + slope * x, g_eps = a_eps + slope_eps * x + two * slope * y;
  const Vec3<S> c = (two * slope * s) * u.w - (two * g) * m.f;
  const Vec3<S> c_eps =
      (two * (slope_eps * s + slope * s_eps)) * u.w + (two * slope * s) * u.v - (two * g_eps) * m.f - (two * g) * m.n;
  const Mat3<S> H = a * outer(u.w, m.f) + diagonal(a * s) + outer(c, u.w) - half * hat(m.f);
  const Mat3<S> H_eps = a_eps * outer(u.w, m.f) + a * (outer(u.v, m.f) + outer(u.w, m.n)) +
                        diagonal(a_eps * s + a * s_eps) + outer(c_eps, u.w) + outer(c, u.v) - half * hat(m.n);

  // d mu / du, block by block, then times dlog_-u
  const Mat3<S> EC = times_hat(E, G.mc);
  const Mat3<S> aa = E * G.rotational() - times_hat(F, G.mc) + H_eps;
  const Mat3<S> ab = EC + G.m * F + H;
  const Mat3<S> ba = H - EC;
  return {aa * E + ab * F, ab * E, ba * E + G.m * (E * F), G.m * (E * E)};
}

}  // namespace linden

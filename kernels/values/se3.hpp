// kernels/values/se3.hpp
// exp and log of SE(3), dlog, its transpose, and the derivative of dlog^T (G u): branch-free, full relative accuracy from 1e-300 to
// just under pi.
//
// A twist is treated as one three-vector over the dual numbers, u~ = w + eps v (eps^2 = 0), since ad of (w, v) is the cross product
// with u~. A wrench is m~ = f + eps n. With x~ = u~.u~ and alpha as in kernels/values/polynomial.hpp
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

#include "kernels/values/polynomial.hpp"
#include "kernels/values/spatial.hpp"

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

/// log(D) for an angle below pi (w > 0), and what dlog_u and its transpose need to know of u: the dual numbers alpha~ and 1 - alpha~ x~.
template <class S>
struct Logarithm {
  Twist<S> u;
  S a, a_eps;  // alpha~ = a + eps a_eps
  S b, b_eps;  // 1 - alpha~ x~

  LINDEN_INLINE explicit Logarithm(const Displacement<S>& D) {
    const S ss = dot(D.r.v, D.r.v);
    S scale = small_angle_over_sine(ss);
    S x = scale * scale * ss;
    a = small_alpha(x);
    S slope = small_alpha_slope(x);
    if (const auto wide = D.r.w < as<S>(kSmallTurnCosine); any(wide)) [[unlikely]] {
      // theta = 4 atan(tan(theta/4)), tan(theta/4) = |v| / (1 + w)
      const S t = S(1.0) / (S(1.0) + D.r.w);
      scale = select(wide, S(4.0) * atan_over_t(t * t * ss) * t, scale);
      x = scale * scale * ss;
      a = select(wide, alpha(x), a);
      slope = select(wide, alpha_slope(x), slope);
    }
    u.w = scale * D.r.v;
    const Vec3<S> wp = cross(u.w, D.p);
    u.v = D.p - S(0.5) * wp + a * cross(u.w, wp);
    set_factors(x, slope);
  }

  /// For a twist that is given.
  LINDEN_INLINE explicit Logarithm(const Twist<S>& given) : u(given) {
    const S x = dot(u.w, u.w);
    a = alpha(x);
    set_factors(x, alpha_slope(x));
  }

 private:
  LINDEN_INLINE void set_factors(const S& x, const S& slope) {
    const S two_half_x_eps = S(2.0) * dot(u.w, u.v);
    a_eps = slope * two_half_x_eps;
    b = S(1.0) - a * x;
    b_eps = -(two_half_x_eps * (a + slope * x));
  }
};

template <class S>
LINDEN_INLINE Twist<S> log(const Displacement<S>& D) {
  return Logarithm<S>(D).u;
}

/// dlog_u y
template <class S>
LINDEN_INLINE Twist<S> dlog(const Twist<S>& u, const Twist<S>& y) {
  const Logarithm<S> k(u);
  const S half(0.5);
  const S s = dot(u.w, y.w), s_eps = dot(u.w, y.v) + dot(u.v, y.w);
  return {k.b * y.w - half * cross(u.w, y.w) + (k.a * s) * u.w,
          k.b * y.v + k.b_eps * y.w - half * (cross(u.w, y.v) + cross(u.v, y.w)) + (k.a * s) * u.v +
              (k.a_eps * s + k.a * s_eps) * u.w};
}

/// dlog_u^T m
template <class S>
LINDEN_INLINE Wrench<S> dlog_transpose(const Logarithm<S>& k, const Wrench<S>& m) {
  const Twist<S>& u = k.u;
  const S half(0.5);
  const S s = dot(u.w, m.f), s_eps = dot(u.w, m.n) + dot(u.v, m.f);
  const S along = k.a * s;
  return {k.b * m.n + k.b_eps * m.f + along * u.v + (k.a_eps * s + k.a * s_eps) * u.w +
              half * (cross(u.w, m.n) + cross(u.v, m.f)),
          k.b * m.f + along * u.w + half * cross(u.w, m.f)};
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

/// K to first order in u: what is left out is O(u^2), 1e-5 of K at 5 rad/s and a millisecond, so one correction with it brings a
/// residual down by as much. For 45 operations instead of 350.
///
///   [ I + (1/2 tr(I) w - I w)^          C + w mc^T - (w.mc) 1 ]
///   [ -C - mc w^T + (w.mc) 1            m (1 + w^)            ]
///
/// from G + 1/2 (G ad_u - ad_u^T G - [G u]~), [m]~ eta = ad_eta^T m, with I w^ + w^ I = (tr(I) w - I w)^ and (a x b)^ = b a^T - a b^T.
template <class S>
LINDEN_INLINE Mat6<S> pose_derivative_first_order(const Inertia<S>& G, const Vec3<S>& w) {
  const Mat3<S> I = G.rotational();
  const S s = dot(w, G.mc);
  const Vec3<S> twice = (S(0.5) * (G.xx + G.yy + G.zz)) * w - I * w;
  const Mat3<S> C = hat(G.mc), shift = diagonal(s);
  return {I + hat(twice), C + outer(w, G.mc) - shift, shift - C - outer(G.mc, w), diagonal(G.m) + G.m * hat(w)};
}

}  // namespace linden

// tests/reference/se3_plain.hpp
// SE(3) as the paper writes it: 4 x 4 and 6 x 6 matrices, power series, Bernoulli numbers. Truth for kernels/values/se3.hpp.
//
//   exp V = sum [V]^j / j!          (5)     every angle; for angles up to pi no digit that counts is lost
//   dlog_V = sum B_j / j! ad_V^j    (13)    converges like (theta / 2 pi)^j
//   log                             (10)    rotation vector from the antisymmetric part, shift by dlog of SO(3)
//
// T is double, long double (11 bits more than double: they pay for the sums) or a Dual. Twists are (w, v), wrenches
// (n, f), angular first.
#pragma once

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <type_traits>

#include "tests/reference/dual.hpp"

namespace linden::reference {

template <class T>
using Vector3 = Eigen::Matrix<T, 3, 1>;
template <class T>
using Vector6 = Eigen::Matrix<T, 6, 1>;
template <class T>
using VectorX = Eigen::Matrix<T, Eigen::Dynamic, 1>;
template <class T>
using Matrix3 = Eigen::Matrix<T, 3, 3>;
template <class T>
using Matrix4 = Eigen::Matrix<T, 4, 4>;
template <class T>
using Matrix6 = Eigen::Matrix<T, 6, 6>;

template <class T>
T constant(long double c) {
  if constexpr (std::is_same_v<T, long double>) {
    return c;
  } else {
    return T(static_cast<double>(c));
  }
}

/// w^ with w^ a = w x a.
template <class T>
Matrix3<T> hat(const Vector3<T>& w) {
  Matrix3<T> result;
  result << T(0.0), -w[2], w[1], w[2], T(0.0), -w[0], -w[1], w[0], T(0.0);
  return result;
}

/// [V], (5).
template <class T>
Matrix4<T> bracket(const Vector6<T>& V) {
  Matrix4<T> result = Matrix4<T>::Zero();
  result.template topLeftCorner<3, 3>() = hat<T>(V.template head<3>());
  result.template topRightCorner<3, 1>() = V.template tail<3>();
  return result;
}

/// [ad_V], (13).
template <class T>
Matrix6<T> ad(const Vector6<T>& V) {
  Matrix6<T> result = Matrix6<T>::Zero();
  result.template topLeftCorner<3, 3>() = hat<T>(V.template head<3>());
  result.template bottomLeftCorner<3, 3>() = hat<T>(V.template tail<3>());
  result.template bottomRightCorner<3, 3>() = hat<T>(V.template head<3>());
  return result;
}

/// [Ad_X], (15).
template <class T>
Matrix6<T> adjoint(const Matrix4<T>& X) {
  const Matrix3<T> R = X.template topLeftCorner<3, 3>();
  const Vector3<T> p = X.template topRightCorner<3, 1>();
  Matrix6<T> result = Matrix6<T>::Zero();
  result.template topLeftCorner<3, 3>() = R;
  result.template bottomLeftCorner<3, 3>() = hat<T>(p) * R;
  result.template bottomRightCorner<3, 3>() = R;
  return result;
}

/// X^-1 of a rotation and a shift.
template <class T>
Matrix4<T> inverse(const Matrix4<T>& X) {
  const Matrix3<T> back = X.template topLeftCorner<3, 3>().transpose();
  Matrix4<T> result = Matrix4<T>::Identity();
  result.template topLeftCorner<3, 3>() = back;
  result.template topRightCorner<3, 1>() = -(back * X.template topRightCorner<3, 1>());
  return result;
}

inline constexpr int kSeriesTerms = 84;

/// B_j / j! for j = 0, 1, ...: 1, -1/2, then the even powers of x/2 coth(x/2), from
///   sum(b_2i x^2i) sinh(x/2) / (x/2) = cosh(x/2)
/// which loses no digits; the recursion over all j with the odd ones set to zero loses half of them by j = 30.
inline const std::array<long double, kSeriesTerms>& bernoulli_over_factorial() {
  static const auto table = [] {
    std::array<long double, kSeriesTerms> b{1.0L, -0.5L};
    for (std::size_t j = 2; j < b.size(); j += 2) {
      long double share = 1, sum = 0;  // share of x^k in cosh(x/2); a (k + 1)-th of it in sinh(x/2) / (x/2)
      for (std::size_t k = 2; k <= j; k += 2) {
        share /= static_cast<long double>(4 * k * (k - 1));
        sum -= b[j - k] * share / static_cast<long double>(k + 1);
      }
      b[j] = share + sum;
    }
    return b;
  }();
  return table;
}

/// sum B_j / j! A^j: dlog for A = ad_V (13), and the dlog of SO(3) for A = w^.
template <class T, int N>
Eigen::Matrix<T, N, N> bernoulli_series(const Eigen::Matrix<T, N, N>& A) {
  const Eigen::Matrix<T, N, N> square = A * A;
  Eigen::Matrix<T, N, N> power = Eigen::Matrix<T, N, N>::Identity();
  Eigen::Matrix<T, N, N> sum = power + constant<T>(-0.5L) * A;
  for (std::size_t j = 2; j < bernoulli_over_factorial().size(); j += 2) {
    power = (power * square).eval();
    sum += constant<T>(bernoulli_over_factorial()[j]) * power;
  }
  return sum;
}

/// [dlog_V], (13).
template <class T>
Matrix6<T> dlog(const Vector6<T>& V) {
  return bernoulli_series<T, 6>(ad<T>(V));
}

/// exp [V].
template <class T>
Matrix4<T> exp(const Vector6<T>& V) {
  const Matrix4<T> A = bracket<T>(V);
  Matrix4<T> term = Matrix4<T>::Identity(), sum = term;
  for (int j = 1; j < 48; ++j) {
    term = (term * A / T(static_cast<double>(j))).eval();
    bool nothing_left = true;
    for (const T& x : term.reshaped()) nothing_left = nothing_left && vanishes(x);
    if (nothing_left) break;
    sum += term;
  }
  return sum;
}

/// theta / sin(theta) from sin(theta)^2 and cos(theta), theta in [0, pi).
template <class T>
T angle_over_sine(const T& sine_squared, const T& cosine) {
  using std::atan2;
  using std::sqrt;
  if (cosine > T(0.0) && sine_squared < T(1e-2)) {
    // asin(s) / s = sum of (2j)! / (4^j j!^2 (2j + 1)) s^2j
    T power(1.0), sum(1.0);
    long double share = 1;
    for (int j = 1; j < 16; ++j) {
      share *= (2.0L * j - 1) / (2.0L * j);
      power = power * sine_squared;
      sum = sum + constant<T>(share / (2.0L * j + 1)) * power;
    }
    return sum;
  }
  const T sine = sqrt(sine_squared);
  return atan2(sine, cosine) / sine;
}

/// log X for a rotation by less than pi.
template <class T>
Vector6<T> log(const Matrix4<T>& X) {
  const Matrix3<T> R = X.template topLeftCorner<3, 3>();
  const T half = constant<T>(0.5L);
  const Vector3<T> sine(half * (R(2, 1) - R(1, 2)), half * (R(0, 2) - R(2, 0)), half * (R(1, 0) - R(0, 1)));
  const T cosine = half * (R.trace() - T(1.0));
  const Vector3<T> w = angle_over_sine<T>(sine.dot(sine), cosine) * sine;
  Vector6<T> V;
  V << w, bernoulli_series<T, 3>(hat<T>(w)) * X.template topRightCorner<3, 1>();
  return V;
}

/// Quaternion x y z w of the rotation exp w^: keeps small angles' digits, which a matrix does not.
template <class T>
Eigen::Matrix<T, 4, 1> rotation_quaternion(const Vector3<T>& w) {
  using std::cos;
  using std::sin;
  using std::sqrt;
  const T half = sqrt(w.dot(w)) / T(2.0);
  Eigen::Matrix<T, 4, 1> q;
  q << (half > T(0.0) ? sin(half) / half : T(1.0)) / T(2.0) * w, cos(half);
  return q;
}

/// Rotation vector of a quaternion x y z w of any length, w > 0.
template <class T>
Vector3<T> rotation_vector(const Eigen::Matrix<T, 4, 1>& q) {
  using std::atan2;
  using std::sqrt;
  const Vector3<T> v = q.template head<3>();
  const T length = sqrt(v.dot(v));
  return (length > T(0.0) ? T(2.0) * atan2(length, q[3]) / length : T(2.0)) * v;
}

/// Rotation matrix of a unit quaternion x y z w.
template <class T>
Matrix3<T> rotation_matrix(const Eigen::Matrix<T, 4, 1>& q) {
  const Vector3<T> v = q.template head<3>();
  const T two(2.0);
  return (q[3] * q[3] - v.dot(v)) * Matrix3<T>::Identity() + two * v * v.transpose() + two * q[3] * hat<T>(v);
}

}  // namespace linden::reference

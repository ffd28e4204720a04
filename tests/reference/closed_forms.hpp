// Motions of one body whose equations have been solved, in Jacobi's elliptic functions: what integrators are measured against.
//
//   Pendulum       hinge, any amplitude                sin(theta / 2) = k sn(K - omega t, k)
//   FreeBody       asymmetric, no forces               body rates a1 cn, a2 sn, a3 dn; the precession about L by a quadrature
//   LagrangeTop    symmetric, heavy, one point fixed   cos theta = u1 + (u2 - u1) sn^2(K - kappa t, k)
//
// Each says its model, its start, where it is at a time and how far from there given positions are. long double throughout, so
// that nothing is lost to double precision.
//
// source  Landau, Lifshitz, Mechanics, paragraphs 11, 36, 37; Whittaker, Analytical Dynamics, 44, 69, 71;
//         sn, cn, dn by the arithmetic-geometric mean: Abramowitz, Stegun, Handbook of Mathematical Functions, 16.4
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>

#include "models/build/builder.hpp"

namespace linden {

struct Elliptic {
  long double sn, cn, dn;
};

/// K(k)
inline long double quarter_period(long double k) {
  long double a = 1, b = std::sqrt(1 - k * k);
  while (std::abs(a - b) > 1e-19L * a) {
    const long double mean = (a + b) / 2;
    b = std::sqrt(a * b);
    a = mean;
    if (a == b || std::abs(a - b) < 2e-19L) break;
  }
  return std::numbers::pi_v<long double> / (2 * a);
}

inline Elliptic elliptic(long double u, long double k) {
  constexpr int kMost = 20;
  std::array<long double, kMost + 1> a{1}, c{k};
  long double b = std::sqrt(1 - k * k);
  int n = 0;
  for (; n < kMost && std::abs(c[static_cast<std::size_t>(n)]) > 1e-19L; ++n) {
    const auto i = static_cast<std::size_t>(n);
    a[i + 1] = (a[i] + b) / 2;
    c[i + 1] = (a[i] - b) / 2;
    b = std::sqrt(a[i] * b);
  }
  long double phi = std::ldexp(a[static_cast<std::size_t>(n)] * u, n);
  for (; n > 0; --n) {
    const auto i = static_cast<std::size_t>(n);
    phi = (phi + std::asin(c[i] / a[i] * std::sin(phi))) / 2;
  }
  const long double sn = std::sin(phi), cn = std::cos(phi);
  return {sn, cn, std::sqrt(1 - k * k * sn * sn)};
}

/// Let go at rest from an angle, 0 where it hangs.
class Pendulum {
 public:
  explicit Pendulum(double amplitude) : amplitude_(amplitude) {}

  static Model model() {
    TreeBuilder builder("pendulum");
    LinkSpec link;
    link.name = "bob";
    link.joint = "swing";
    link.axis = Eigen::Vector3d::UnitY();
    link.inertia = box_inertia(kMass, {0.1, 0.1, 0.6}, {0, 0, -kLength});
    builder.add(link);
    return builder.build();
  }
  double start() const { return amplitude_; }
  long double angle(long double time) const {
    const long double inertia = kMass * (kLength * kLength + (0.1L * 0.1L + 0.6L * 0.6L) / 12);
    const long double omega = std::sqrt(kMass * 9.81L * kLength / inertia),
                      k = std::sin(static_cast<long double>(amplitude_) / 2);
    return 2 * std::asin(k * elliptic(quarter_period(k) - omega * time, k).sn);
  }
  double error(double time, std::span<const double> q) const { return std::abs(static_cast<double>(q[0] - angle(time))); }

 private:
  static constexpr double kMass = 2, kLength = 0.4;
  double amplitude_;
};

/// A body that spins about its axis of middle inertia and turns over, again and again, about a centre of mass at rest. L points
/// along z.
class FreeBody {
 public:
  FreeBody() {
    const long double twice = kI[0] * kStart[0] * kStart[0] + kI[2] * kStart[2] * kStart[2];
    const long double square = kI[0] * kI[0] * kStart[0] * kStart[0] + kI[2] * kI[2] * kStart[2] * kStart[2];
    momentum_ = std::sqrt(square);
    rate_ = std::sqrt((kI[2] - kI[1]) * (square - twice * kI[0]) / (kI[0] * kI[1] * kI[2]));
    modulus_ = std::sqrt((kI[1] - kI[0]) * (twice * kI[2] - square) / ((kI[2] - kI[1]) * (square - twice * kI[0])));
    middle_ = std::sqrt((twice * kI[2] - square) / (kI[1] * (kI[2] - kI[1])));
  }

  static Model model() {
    TreeBuilder builder("free body");
    LinkSpec link;
    link.name = "body";
    link.joint = "turn";
    link.type = JointType::ball;
    link.inertia = {1, Eigen::Vector3d::Zero(), Eigen::Vector3d(kI[0], kI[1], kI[2]).asDiagonal()};
    builder.add(link);
    return builder.build();
  }
  /// From one turning over to the next [s].
  long double flip_time() const { return 2 * quarter_period(modulus_) / rate_; }
  /// Angular velocity in the body's frame [rad/s].
  std::array<long double, 3> velocity(long double time) const {
    const Elliptic e = elliptic(rate_ * time, modulus_);
    return {kStart[0] * e.cn, middle_ * e.sn, kStart[2] * e.dn};
  }
  /// x y z w; the sign of a quaternion is nobody's.
  std::array<long double, 4> orientation(long double time) const {
    const auto [w1, w2, w3] = velocity(time);
    const long double l1 = kI[0] * w1, l2 = kI[1] * w2, l3 = kI[2] * w3;
    // Euler's angles: about z by precession, about x by tilt, about z by spin
    const long double tilt = std::atan2(std::sqrt(l1 * l1 + l2 * l2), l3), spin = std::atan2(l1, l2), turned = precession(time);
    const long double c = std::cos(tilt / 2), s = std::sin(tilt / 2);
    return {s * std::cos((turned - spin) / 2), s * std::sin((turned - spin) / 2), c * std::sin((turned + spin) / 2),
            c * std::cos((turned + spin) / 2)};
  }
  /// Angle between the orientations, nearly.
  double error(double time, std::span<const double> q) const {
    const auto exact = orientation(time);
    long double along = 0, most = 0;
    for (std::size_t k = 0; k < 4; ++k) along += exact[k] * q[k];
    for (std::size_t k = 0; k < 4; ++k) most = std::max(most, std::abs(2 * (exact[k] - std::copysign(1.0L, along) * q[k])));
    return static_cast<double>(most);
  }

 private:
  static constexpr double kI[3] = {0.01, 0.02, 0.03};  // [kg m^2]
  static constexpr double kStart[3] = {3.5, 0, 2.1};   // [rad/s]; k = 0.98

  /// By Simpson's rule: nothing analytic is shorter, and the integrand is smooth.
  long double precession(long double time) const {
    constexpr int kIntervals = 20'000;
    const auto slope = [&](long double t) {
      const auto [w1, w2, w3] = velocity(t);
      return momentum_ * (kI[0] * w1 * w1 + kI[1] * w2 * w2) / (kI[0] * kI[0] * w1 * w1 + kI[1] * kI[1] * w2 * w2);
    };
    const long double h = time / kIntervals;
    long double sum = slope(0) + slope(time);
    for (int i = 1; i < kIntervals; ++i) sum += (i % 2 == 1 ? 4 : 2) * slope(h * i);
    return sum * h / 3;
  }

  long double momentum_, rate_, modulus_, middle_;
};

/// Let go tilted and spinning [rad/s], without precession: it falls, is caught by its spin, rises again.
class LagrangeTop {
 public:
  explicit LagrangeTop(double spin = 60) : spin_(spin) {}

  static Model model() {
    TreeBuilder builder("heavy top");
    LinkSpec link;
    link.name = "top";
    link.joint = "tip";
    link.type = JointType::ball;
    link.inertia = {kMass, {0, 0, kHeight}, Eigen::Vector3d(kAcross, kAcross, kAlong).asDiagonal()};
    builder.add(link);
    return builder.build();
  }
  /// x y z w
  static std::array<double, 4> start() { return {std::sin(kTilt / 2), 0, 0, std::cos(kTilt / 2)}; }
  std::array<double, 3> start_velocity() const { return {0, 0, spin_}; }
  /// Rate of nutation [rad/s], about, and of precession about the vertical where the axis stands at cosine u.
  double nutation() const { return static_cast<double>(kAlong * spin_ / (kAcross + kMass * kHeight * kHeight)); }
  long double precession(long double u) const { return nutation() * (std::cos(static_cast<long double>(kTilt)) - u) / (1 - u * u); }
  /// Cosine of the tilt.
  long double upright(long double time) const {
    const long double A = kAcross + static_cast<long double>(kMass) * kHeight * kHeight,
                      u0 = std::cos(static_cast<long double>(kTilt));
    const long double beta = 2 * kMass * 9.81L * kHeight / A, a = kAlong * static_cast<long double>(spin_) / A;
    // u'^2 = (u0 - u) (beta (1 - u^2) - a^2 (u0 - u))
    const long double root = std::sqrt(a * a * a * a - 4 * beta * (a * a * u0 - beta));
    const long double u3 = (a * a + root) / (2 * beta), u1 = (a * a * u0 - beta) / (beta * u3);
    const long double k = std::sqrt((u0 - u1) / (u3 - u1)), kappa = std::sqrt(beta * (u3 - u1)) / 2;
    const long double sn = elliptic(quarter_period(k) - kappa * time, k).sn;
    return u1 + (u0 - u1) * sn * sn;
  }
  double error(double time, std::span<const double> q) const {
    const long double x = q[0], y = q[1];
    return std::abs(static_cast<double>(1 - 2 * (x * x + y * y) - upright(time)));
  }

 private:
  static constexpr double kMass = 0.5, kHeight = 0.05;    // [kg, m] of the centre of mass above the tip
  static constexpr double kAcross = 4e-4, kAlong = 6e-4;  // [kg m^2] about it
  static constexpr double kTilt = 0.6;                    // [rad]

  double spin_;
};

}  // namespace linden

// tests/kernels/values.hpp
// The kernels' values as Eigen vectors and matrices, and random ones.
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <numbers>

#include "kernels/values/se3.hpp"
#include "models/build/random.hpp"
#include "tests/reference/se3_plain.hpp"

namespace linden {

template <class S>
reference::Vector3<S> eigen(const Vec3<S>& a) {
  return {a.x, a.y, a.z};
}

template <class S>
reference::Matrix3<S> eigen(const Mat3<S>& a) {
  reference::Matrix3<S> result;
  result << a.x.x, a.x.y, a.x.z, a.y.x, a.y.y, a.y.z, a.z.x, a.z.y, a.z.z;
  return result;
}

template <class S>
Eigen::Matrix<S, 4, 1> eigen(const Quaternion<S>& q) {
  return {q.v.x, q.v.y, q.v.z, q.w};
}

template <class S>
reference::Vector6<S> eigen(const Twist<S>& V) {
  reference::Vector6<S> result;
  result << eigen(V.w), eigen(V.v);
  return result;
}

template <class S>
reference::Vector6<S> eigen(const Wrench<S>& F) {
  reference::Vector6<S> result;
  result << eigen(F.n), eigen(F.f);
  return result;
}

template <class S>
reference::Matrix4<S> eigen(const Placement<S>& X) {
  reference::Matrix4<S> result = reference::Matrix4<S>::Identity();
  result.template topLeftCorner<3, 3>() = eigen(X.R);
  result.template topRightCorner<3, 1>() = eigen(X.p);
  return result;
}

template <class S>
reference::Matrix4<S> eigen(const Displacement<S>& D) {
  reference::Matrix4<S> result = reference::Matrix4<S>::Identity();
  result.template topLeftCorner<3, 3>() = reference::rotation_matrix<S>(eigen(D.r));
  result.template topRightCorner<3, 1>() = eigen(D.p);
  return result;
}

template <class S>
reference::Matrix6<S> eigen(const Inertia<S>& G) {
  const reference::Matrix3<S> C = reference::hat<S>(eigen(G.mc));
  reference::Matrix6<S> result;
  result << eigen(G.rotational()), C, C.transpose(), G.m * reference::Matrix3<S>::Identity();
  return result;
}

template <class S>
reference::Matrix6<S> eigen(const Mat6<S>& A) {
  reference::Matrix6<S> result;
  result << eigen(A.aa), eigen(A.ab), eigen(A.ba), eigen(A.bb);
  return result;
}

inline Vec3<double> vec3(const Eigen::Vector3d& a) { return {a[0], a[1], a[2]}; }

inline Mat3<double> mat3(const Eigen::Matrix3d& a) { return {vec3(a.row(0)), vec3(a.row(1)), vec3(a.row(2))}; }

inline Mat6<double> mat6(const reference::Matrix6<double>& a) {
  return {mat3(a.topLeftCorner<3, 3>()), mat3(a.topRightCorner<3, 3>()), mat3(a.bottomLeftCorner<3, 3>()),
          mat3(a.bottomRightCorner<3, 3>())};
}

inline Vec3<double> random_vec3(Random& random, double size) {
  const double x = random.uniform(-size, size), y = random.uniform(-size, size), z = random.uniform(-size, size);
  return {x, y, z};
}

/// A vector of the given length in a direction uniform over the sphere.
inline Vec3<double> random_direction(Random& random, double length) {
  return vec3(length * (random.rotation() * Eigen::Vector3d::UnitX()));
}

inline Twist<double> random_twist(Random& random, double size) {
  return {random_vec3(random, size), random_vec3(random, size)};
}

inline Wrench<double> random_wrench(Random& random, double size) {
  return {random_vec3(random, size), random_vec3(random, size)};
}

inline Quaternion<double> random_quaternion(Random& random) {
  const Eigen::Quaterniond q = random.rotation();
  return {{q.x(), q.y(), q.z()}, q.w()};
}

inline Placement<double> random_placement(Random& random) {
  return {mat3(random.rotation().toRotationMatrix()), random_vec3(random, 1)};
}

inline Displacement<double> random_displacement(Random& random) {
  return {random_quaternion(random), random_vec3(random, 1)};
}

/// Inertia of a body: three masses on random axes, away from the centre.
inline Inertia<double> random_inertia(Random& random) {
  const double mass = random.uniform(0.5, 2);
  const Eigen::Vector3d center = eigen(random_vec3(random, 0.5));
  const Eigen::Vector3d spread = eigen(random_vec3(random, 0.2)) + Eigen::Vector3d::Constant(0.3);
  const Eigen::Matrix3d turn = random.rotation().toRotationMatrix();
  const Eigen::Matrix3d second =
      mass * (turn * spread.cwiseAbs2().asDiagonal() * turn.transpose() + center * center.transpose());
  const Eigen::Matrix3d about = second.trace() * Eigen::Matrix3d::Identity() - second;
  return {mass, vec3(mass * center), about(0, 0), about(0, 1), about(0, 2), about(1, 1), about(1, 2), about(2, 2)};
}

/// A 6 x 6 matrix with a positive definite symmetric part: an inertia, and an antisymmetric part a fifth as large.
inline Mat6<double> random_matrix6(Random& random) {
  reference::Matrix6<double> root, skew;
  for (double& value : root.reshaped()) value = random.uniform(-1, 1);
  for (double& value : skew.reshaped()) value = random.uniform(-0.2, 0.2);
  return mat6(root * root.transpose() + 0.5 * reference::Matrix6<double>::Identity() + skew - skew.transpose());
}

/// Values and arrays of their numbers.
template <class Value, class S, std::size_t N>
Value unpacked(const std::array<S, N>& numbers, std::size_t first) {
  std::array<S, sizeof(Value) / sizeof(S)> part;
  for (std::size_t k = 0; k < part.size(); ++k) part[k] = numbers[first + k];
  return std::bit_cast<Value>(part);
}

template <class S, class Value>
std::array<S, sizeof(Value) / sizeof(S)> numbers_of(const Value& value) {
  return std::bit_cast<std::array<S, sizeof(Value) / sizeof(S)>>(value);
}

/// Arrays one behind the other.
template <class S, std::size_t... N>
auto joined(const std::array<S, N>&... parts) {
  std::array<S, (N + ...)> result{};
  std::size_t at = 0;
  const auto append = [&](const auto& part) {
    for (const S& value : part) result[at++] = value;
  };
  (append(parts), ...);
  return result;
}

/// |found - expected| / |expected|
template <class Found, class Expected>
double relative_error(const Eigen::MatrixBase<Found>& found, const Eigen::MatrixBase<Expected>& expected) {
  const double scale = static_cast<double>(expected.norm());
  const double error = static_cast<double>((found - expected).norm());
  return scale > 0 ? error / scale : error;
}

}  // namespace linden

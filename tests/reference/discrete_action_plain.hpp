// tests/reference/discrete_action_plain.hpp
// The discrete Lagrangian by brute force, and its two derivatives by dual numbers.
//
//   L_d(q^k, q^k+1) = sum over bodies of  h/2 L(T^k, V) + h/2 L(T^k+1, V),   L = 1/2 V.G V - P(T)     (6), (9)
//   V = 1/h log((T^k)^-1 T^k+1),  P = -m g.c                                                         (10)
//
// Every body is placed in the world by forward kinematics, at both ends of the step; no displacement is handed from
// parent to child, and no formula for a derivative is used. D1 and D2 are with respect to a variation of each joint's
// pose from the right.
#pragma once

#include "tests/reference/plain_tree.hpp"

namespace linden::reference {

/// P(q) [J].
template <class T>
T potential(const PlainTree& tree, const std::vector<Matrix4<T>>& pose, const Vector3<double>& gravity) {
  T sum(0.0);
  for (Index i = 1; i < tree.slots(); ++i) {
    const Matrix4<T>& X = pose[static_cast<std::size_t>(i)];
    const Vector3<T> moment = X.template topLeftCorner<3, 3>() * tree.body(i).moment().template cast<T>() +
                              T(tree.body(i).mass()) * X.template topRightCorner<3, 1>();
    sum = sum - gravity.template cast<T>().dot(moment);
  }
  return sum;
}

/// L_d of a step from poses `begin` to poses `end`.
template <class T>
T discrete_lagrangian(const PlainTree& tree, const std::vector<Matrix4<T>>& begin, const std::vector<Matrix4<T>>& end,
                      double h, const Vector3<double>& gravity) {
  T kinetic(0.0);
  for (std::size_t i = 1; i < begin.size(); ++i) {
    const Vector6<T> V = log<T>(inverse<T>(begin[i]) * end[i]) / T(h);
    const Vector6<T> m = tree.bodies[i].G.template cast<T>() * V;
    kinetic = kinetic + T(0.5) * m.dot(V);
  }
  return T(h) * kinetic - T(0.5 * h) * (potential<T>(tree, begin, gravity) + potential<T>(tree, end, gravity));
}

/// D1 L_d(q, q_next) [nv].
inline VectorXd action_slope_at_begin(const PlainTree& tree, const VectorXd& q, const VectorXd& q_next, double h,
                                      const Vector3<double>& gravity) {
  return gradient(tree.velocities, [&](const auto& eps) {
    using T = Dual<8>;
    return discrete_lagrangian<T>(tree, poses<T>(tree, q, eps), poses<T>(tree, q_next, eps * T(0.0)), h, gravity);
  });
}

/// D2 L_d(q_before, q) [nv].
inline VectorXd action_slope_at_end(const PlainTree& tree, const VectorXd& q_before, const VectorXd& q, double h,
                                    const Vector3<double>& gravity) {
  return gradient(tree.velocities, [&](const auto& eps) {
    using T = Dual<8>;
    return discrete_lagrangian<T>(tree, poses<T>(tree, q_before, eps * T(0.0)), poses<T>(tree, q, eps), h, gravity);
  });
}

/// Q = -dP/dq [nv].
inline VectorXd potential_force(const PlainTree& tree, const VectorXd& q, const Vector3<double>& gravity) {
  return -gradient(tree.velocities,
                   [&](const auto& eps) { return potential<Dual<8>>(tree, poses<Dual<8>>(tree, q, eps), gravity); });
}

}  // namespace linden::reference

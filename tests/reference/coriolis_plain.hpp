// tests/reference/coriolis_plain.hpp
// The Coriolis force from derivatives of the kinetic energy.
//
//   c = M' v - dK/dq - ad_v^T p           M' along v, K = 1/2 v.M v, p = M v: M v' + c = Q
//
// The last term is there because the velocities of ball and free joints are twists in the body's frame, not rates of
// coordinates (Euler-Poincare): w x p for a ball joint, (w x n + v x f, w x f) for a free one, nothing for a screw.
#pragma once

#include "tests/reference/mass_matrix_plain.hpp"

namespace linden::reference {

/// c(q, v) [nv].
inline VectorXd coriolis_force(const PlainTree& tree, const VectorXd& q, const VectorXd& v) {
  // K(q, v) = sum of 1/2 V.G V
  const VectorXd energy_slope = gradient(tree.velocities, [&](const auto& eps) {
    using T = Dual<8>;
    const auto pose = poses<T>(tree, q, eps);
    T sum(0.0);
    for (Index i = 1; i < tree.slots(); ++i) {
      const Vector6<T> V = body_jacobian<T>(tree, pose, i) * v.cast<T>();
      const Vector6<T> m = tree.body(i).G.cast<T>() * V;
      sum = sum + T(0.5) * V.dot(m);
    }
    return sum;
  });
  // p along q (+) v t
  using Time = Dual<1>;
  VectorX<Time> along(tree.velocities);
  for (Index row = 0; row < tree.velocities; ++row) along[row] = Time(v[row]) * Time(0.0, 0);
  const VectorX<Time> p = mass_matrix<Time>(tree, poses<Time>(tree, q, along)) * v.cast<Time>();
  VectorXd c(tree.velocities);
  for (Index row = 0; row < tree.velocities; ++row) c[row] = p[row].slope[0] - energy_slope[row];
  for (Index i = 1; i < tree.slots(); ++i) {
    const PlainBody& body = tree.body(i);
    if (body.kind == JointKind::screw) continue;
    Vector6<double> rate = Vector6<double>::Zero(), momentum = rate;
    for (Index k = 0; k < body.dofs(); ++k) {
      rate[k] = v[body.v + k];
      momentum[k] = p[body.v + k].value;
    }
    c.segment(body.v, body.dofs()) -= (ad<double>(rate).transpose() * momentum).head(body.dofs());
  }
  return c;
}

}  // namespace linden::reference

// tests/reference/del_literal.hpp
// Algorithm 2 of the paper (DRNEA), line by line, in plain matrices, with the terms of the step before written out.
//
//   dT_i^k = (T_lambda(i),i^k)^-1 dT_lambda(i)^k T_lambda(i),i^k+1                                       (19)
//   V_i^k = 1/h log dT_i^k                                                                              (10)
//   mu_i^k = [dlog_hV_i^k]^T G_i V_i^k                                                                  (21b)
//   F_i^k = mu_i^k - [Ad_exp(h V_i^k-1)]^T mu_i^k-1 + sum over c of [Ad_(T_i,c^k)^-1]^T F_c^k - F_i^ext  (21a)
//   f_i = S_i^T F_i^k                                                                                   (22)
//
// The sign is that of (22): f = -(D2 L_d(q^k-1, q^k) + D1 L_d(q^k, q^k+1)).
#pragma once

#include "tests/reference/plain_tree.hpp"

namespace linden::reference {

/// Mean velocity and momentum of every body over one step.
template <class T>
struct StepMomenta {
  std::vector<Vector6<T>> hV, mu;
};

/// Lines 1 to 5 and 7: from q to q_next, the latter varied by eps.
template <class T>
StepMomenta<T> step_momenta(const PlainTree& tree, const VectorXd& q, const VectorXd& q_next, const VectorX<T>& eps,
                            double h) {
  const VectorX<T> none = VectorX<T>::Zero(tree.velocities);
  std::vector<Matrix4<T>> dT(tree.bodies.size(), Matrix4<T>::Identity());
  StepMomenta<T> result;
  result.hV.assign(tree.bodies.size(), Vector6<T>::Zero());
  result.mu = result.hV;
  for (std::size_t i = 1; i < dT.size(); ++i) {
    const PlainBody& body = tree.bodies[i];
    const Matrix4<T> at_begin = joint_pose<T>(body, q, none), at_end = joint_pose<T>(body, q_next, eps);
    dT[i] = inverse<T>(at_begin) * dT[static_cast<std::size_t>(body.parent)] * at_end;
    result.hV[i] = log<T>(dT[i]);
    const Vector6<T> momentum = body.G.template cast<T>() * (result.hV[i] / T(h));
    result.mu[i] = dlog<T>(result.hV[i]).transpose() * momentum;
  }
  return result;
}

/// f of (22) [nv]: impulses that are missing at the joints, gravity being the only force.
template <class T>
VectorX<T> del_residual(const PlainTree& tree, const VectorXd& q_before, const VectorXd& q, const VectorXd& q_next,
                        const VectorX<T>& eps, double h, const Vector3<double>& gravity) {
  const StepMomenta<double> before = step_momenta<double>(tree, q_before, q, VectorXd::Zero(tree.velocities), h);
  const StepMomenta<T> now = step_momenta<T>(tree, q, q_next, eps, h);
  const std::vector<Matrix4<double>> pose = poses(tree, q);
  std::vector<Vector6<T>> F(tree.bodies.size(), Vector6<T>::Zero());
  VectorX<T> f(tree.velocities);
  for (std::size_t i = F.size(); i-- > 1;) {
    const PlainBody& body = tree.bodies[i];
    const Vector6<double> left_over = adjoint<double>(exp<double>(before.hV[i])).transpose() * before.mu[i];
    const Vector3<double> g = pose[i].topLeftCorner<3, 3>().transpose() * gravity;
    Vector6<double> external;
    external << h * body.moment().cross(g), h * body.mass() * g;
    F[i] += now.mu[i] - left_over.template cast<T>() - external.template cast<T>();
    f.segment(body.v, body.dofs()) = body.S.transpose().template cast<T>() * F[i];
    const Matrix4<double> X = joint_pose<double>(body, q, VectorXd::Zero(tree.velocities));
    F[static_cast<std::size_t>(body.parent)] +=
        adjoint<double>(inverse<double>(X)).transpose().template cast<T>() * F[i];
  }
  return f;
}

}  // namespace linden::reference

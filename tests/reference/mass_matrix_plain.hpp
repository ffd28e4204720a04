// tests/reference/mass_matrix_plain.hpp
// The mass matrix from the Jacobian of every body.
//
//   M(q) = sum over bodies of J_i^T G_i J_i,   columns of joint a in J_i: Ad_{T_i^-1 T_a} S_a for a above or at i
#pragma once

#include "tests/reference/plain_tree.hpp"

namespace linden::reference {

/// J_i: velocities of all joints -> twist of body i in its own frame.
template <class T>
Eigen::Matrix<T, 6, Eigen::Dynamic> body_jacobian(const PlainTree& tree, const std::vector<Matrix4<T>>& pose, Index i) {
  Eigen::Matrix<T, 6, Eigen::Dynamic> J = Eigen::Matrix<T, 6, Eigen::Dynamic>::Zero(6, tree.velocities);
  for (Index a = i; a != 0; a = tree.body(a).parent) {
    const PlainBody& body = tree.body(a);
    const Matrix4<T> relative = inverse<T>(pose[static_cast<std::size_t>(i)]) * pose[static_cast<std::size_t>(a)];
    J.middleCols(body.v, body.dofs()) = adjoint<T>(relative) * body.S.template cast<T>();
  }
  return J;
}

template <class T>
Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic> mass_matrix(const PlainTree& tree,
                                                             const std::vector<Matrix4<T>>& pose) {
  Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic> M;
  M.setZero(tree.velocities, tree.velocities);
  for (Index i = 1; i < tree.slots(); ++i) {
    const auto J = body_jacobian<T>(tree, pose, i);
    M += J.transpose() * tree.body(i).G.template cast<T>() * J;
  }
  return M;
}

inline MatrixXd mass_matrix(const PlainTree& tree, const VectorXd& q) {
  return mass_matrix<double>(tree, poses(tree, q));
}

}  // namespace linden::reference

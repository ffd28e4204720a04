// tests/reference/dense_jacobian_plain.hpp
// The derivative of h r(delta) as a dense matrix: Algorithm 2 of the paper in plain matrices, run on dual numbers.
//
// Column j is the change of h r when coordinate j of q_next varies from the right.
#pragma once

#include "tests/reference/del_literal.hpp"

namespace linden::reference {

/// d(h r)/d(Delta): neither the terms of the step before nor gravity depend on q_next.
inline MatrixXd dense_jacobian_plain(const PlainTree& tree, const VectorXd& q, const VectorXd& q_next) {
  return jacobian(tree.velocities, [&](const VectorX<Dual<8>>& eps) {
    // h f of a step of h = 1
    return del_residual<Dual<8>>(tree, q, q, q_next, eps, 1.0, Vector3<double>::Zero());
  });
}

}  // namespace linden::reference

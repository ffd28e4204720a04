// bench/comparators/drnea_derivative.hpp
// The exact derivative of the residual of DRNEA, column by column: the paper's Algorithm 4.
//
//   down, over the subtree of j:
//     eta_i = (dT_i)^-1 d(dT_i)/dq_j = Ad_{(X_i^k+1)^-1} eta_lambda(i) + S_i delta_ij         lines 3, 4
//   up, over the subtree of j and its path to the root:
//     d(h mu_i)/dq_j = K_i eta_i                                                              lines 5, 8
//     d(h F_i)/dq_j = d(h mu_i)/dq_j + sum over children c of Ad_{(X_c^k)^-1}^T d(h F_c)/dq_j  line 9
//     J_ij = S_i^T d(h F_i)/dq_j                                                              line 10
//
// The paper writes the derivative of dT as a 4 x 4 matrix; as a twist in the body's frame it obeys the same recursion in six
// numbers. Lines 5 and 8 are the same linear map for every column, K_i (kernels/values/se3.hpp, pose_derivative), and are formed once a
// body. Outside the subtree of j and its path all is zero.
//
// reads   placement 12 x n at q^k, motion 7 x n, displacement 7 x n, of the residual
// writes  J nv x nv, d(h r)/d(delta)
// cost    O(n^2) for a chain, O(n x depth) for a tree; zeroes n^2 numbers
// source  the paper, appendix, Algorithm 4
#pragma once

#include "bench/comparators/ancestry.hpp"
#include "bench/comparators/equation.hpp"

namespace linden::comparators {

void drnea_derivative(const Model& model, const Ancestry& ancestry, const Field<double, 12>& placement,
                      const Field<double, 7>& motion, const Field<double, 7>& displacement, Eigen::MatrixXd& J);

}  // namespace linden::comparators

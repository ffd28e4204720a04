// bench/comparators/svi.hpp
// The scalable variational integrator of Johnson and Murphey: its own discrete Lagrangian, evaluated in generalized coordinates.
//
//   L_d(q^k, q^k+1) = h L((q^k + q^k+1)/2, (q^k+1 - q^k)/h)
//   h r   = L_v - 1/2 L_q - h p                            L_v = h dL/dv, L_q = h^2 dL/dq at the mean position and velocity
//   h p'  = L_v + 1/2 L_q
//   J     = L_vv + 1/2 (L_vq - L_qv) - 1/4 L_qq            d(h r)/d(delta), L_vq = h d^2L/dv dq, ...
//
// Sums over bodies i and the coordinates j, l of their paths, of quantities handed from parent to child (carried by Ad_{X_i^-1}):
//
//   A_ij = dV_i/dv_j       carried; A_ii = S_i
//   U_ij = h dV_i/dq_j     carried; U_ii = -ad_{S_i} hV_i
//   L_v,j = sum A_ij.(G_i hV_i),   L_q,j = sum U_ij.(G_i hV_i) + h^2 A_ij.(G_i gamma_i),   gamma_i = (0, g) in the body's frame
//
//   dA_ij/dq_l, j above l  carried from l, there -ad_{S_l} A_lj
//   dU_ij/dq_l, j to l     carried from l, there -ad_{S_l} U_lj
//
// The discrete Lagrangian is not the paper's (9), (10): both are of second order, and what they compute differs by O(h^2).
// svi_log.hpp evaluates the paper's own equation the same way. What is published is kept: first and second derivatives of V are
// carried from body to body for every coordinate and pair of coordinates; only coordinates of a body's path are looked at, and
// symmetry is used.
//
// cost    residual O(n^2), with the Jacobian O(n^3), for a chain
// source  Johnson and Murphey, Scalable variational integrators for constrained mechanical systems in generalized coordinates,
//         IEEE Transactions on Robotics 25(6), 2009; the paper, 1 and 4.3
#pragma once

#include <vector>

#include "bench/comparators/ancestry.hpp"
#include "bench/comparators/equation.hpp"

namespace linden::comparators {

class Svi : public Equation {
 public:
  explicit Svi(const Model& model);

  void begin(const StepStart& start) override;
  bool residual(const Field<double>& delta, Field<double>& hr) override;
  void jacobian(Eigen::MatrixXd& J) override;
  void momentum(const StepStart& end, Field<double>& p) override;

 private:
  void second_derivatives(Eigen::MatrixXd& J);

  const Model& model_;
  Ancestry ancestry_;
  Field<double> q_, momentum_, middle_, by_rate_, by_position_;  // q^k, h p, mean position, L_v, L_q
  Field<double, 12> placement_;                                  // at the mean position
  Field<double, 3> field_;                                       // gravity in the body's frame
  std::vector<Twistd> rate_, A_, U_;                             // hV [slots]; pairs
  std::vector<Wrenchd> m_, weight_;                              // G hV, h^2 G gamma [slots]
  std::vector<Wrenchd> GA_, GU_, Gz_;                            // of one body and all coordinates of its path
  std::vector<Twistd> dA_, dU_;                                  // of one pair of coordinates and all bodies below
  Vec3d gravity_{};
  double h_ = 0;
  bool weightless_ = true;
};

}  // namespace linden::comparators

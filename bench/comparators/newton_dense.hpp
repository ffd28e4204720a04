// bench/comparators/newton_dense.hpp
// Newton's method with the exact derivative, anew at every iterate, and a dense factorisation: the paper's Algorithm 1.
//
//   delta <- delta - J(delta)^-1 h r
//
// J is the equation's own: Algorithm 4 of the paper with DRNEA (drnea_derivative.hpp), Johnson and Murphey's second derivatives
// with SVI. LU with partial pivoting, by Eigen.
//
// cost    the derivative, O(n^2) or O(n^3), and 2/3 n^3 operations for the LU
#pragma once

#include "bench/comparators/dense_lu.hpp"
#include "bench/comparators/root_finder.hpp"

namespace linden::comparators {

class NewtonDense : public RootFinder {
 private:
  void correct(Equation& equation, const Field<double>& hr, Field<double>& delta) override;

  Eigen::MatrixXd J_;
  Eigen::VectorXd increment_;
  DenseLu lu_;
};

}  // namespace linden::comparators

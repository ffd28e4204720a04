// bench/comparators/dense_lu.hpp
// A dense matrix factored by Eigen, LU with partial pivoting: compiled once, for it takes long to.
//
// cost    2/3 n^3 operations to factor, n^2 to solve, 4/3 n^3 more for the inverse
#pragma once

#include <Eigen/LU>

namespace linden::comparators {

class DenseLu {
 public:
  void factor(const Eigen::MatrixXd& A);
  /// x <- A^-1 x
  void solve(Eigen::VectorXd& x) const;
  void inverse(Eigen::MatrixXd& result) const;

 private:
  Eigen::PartialPivLU<Eigen::MatrixXd> factor_;
};

}  // namespace linden::comparators

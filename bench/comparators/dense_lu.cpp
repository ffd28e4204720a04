#include "bench/comparators/dense_lu.hpp"

namespace linden::comparators {

void DenseLu::factor(const Eigen::MatrixXd& A) { factor_.compute(A); }

void DenseLu::solve(Eigen::VectorXd& x) const { x = factor_.solve(x); }

void DenseLu::inverse(Eigen::MatrixXd& result) const { result = factor_.inverse(); }

}  // namespace linden::comparators

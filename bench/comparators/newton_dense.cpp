#include "bench/comparators/newton_dense.hpp"

namespace linden::comparators {

void NewtonDense::correct(Equation& equation, const Field<double>& hr, Field<double>& delta) {
  equation.jacobian(J_);
  factor_.compute(J_);
  vector(delta) -= factor_.solve(vector(hr));
}

}  // namespace linden::comparators

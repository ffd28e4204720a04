#include "bench/comparators/newton_dense.hpp"

namespace linden::comparators {

void NewtonDense::correct(Equation& equation, const Field<double>& hr, Field<double>& delta) {
  equation.jacobian(J_);
  lu_.factor(J_);
  increment_ = vector(hr);
  lu_.solve(increment_);
  vector(delta) -= increment_;
}

}  // namespace linden::comparators

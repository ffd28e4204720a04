#include "bench/comparators/newton_linear.hpp"

namespace linden::comparators {

void NewtonLinear::correct(Equation&, const Field<double>& hr, Field<double>& delta) {
  drnea_.factor();
  drnea_.apply_inverse(hr, increment_);
  vector(delta) -= vector(increment_);
}

}  // namespace linden::comparators

// bench/comparators/newton_linear.hpp
// linden's Newton method in O(n), bare: the iterates of newton_dense.hpp with DRNEA, without a matrix of the whole system.
//
//   delta <- delta - J(delta)^-1 h r, J factored by newton_factor_up
//
// The engine does better than this by extrapolating the first guess and factoring once a step; this one shares first guess and
// test with the paper's root finders.
//
// cost    O(n) an iteration
#pragma once

#include "bench/comparators/drnea.hpp"
#include "bench/comparators/root_finder.hpp"

namespace linden::comparators {

class NewtonLinear : public RootFinder {
 public:
  explicit NewtonLinear(Drnea& equation) : drnea_(equation) { increment_.allocate(equation.rows()); }

 private:
  void correct(Equation& equation, const Field<double>& hr, Field<double>& delta) override;

  Drnea& drnea_;
  Field<double> increment_;
};

}  // namespace linden::comparators

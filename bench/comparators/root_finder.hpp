// bench/comparators/root_finder.hpp
// How a root of a discrete Euler-Lagrange equation is looked for (the paper's Algorithm 1, lines 2 to 6), without globalisation:
// a root finder that leaves the range of the log map, or does not reach the tolerance, has failed, and says so.
#pragma once

#include <cmath>
#include <vector>

#include "bench/comparators/equation.hpp"

namespace linden::comparators {

struct Stop {
  double tolerance = 1e-9;  // |r| [N m s, N s], the paper's
  int max_iterations = 100;
};

struct Solved {
  bool converged = false;
  int iterations = 0;              // corrections of delta
  int evaluations = 0;             // of the residual, those for differences included
  std::vector<double>* residuals = nullptr;  // |r| at the guess and after every correction; null: not wanted
};

class RootFinder {
 public:
  virtual ~RootFinder() = default;
  /// Improves delta until |r| < tolerance.
  void solve(Equation& equation, double h, const Stop& stop, Field<double>& delta, Field<double>& hr, Solved& solved) {
    const auto evaluate = [&] {
      solved.evaluations += 1;
      if (!equation.residual(delta, hr)) return false;
      const double norm = vector(hr).norm() / h;
      if (solved.residuals != nullptr) solved.residuals->push_back(norm);
      solved.converged = norm < stop.tolerance;
      return std::isfinite(norm);
    };
    if (!evaluate() || solved.converged) return;
    begin(equation, delta, hr, solved);
    while (solved.iterations < stop.max_iterations) {
      solved.iterations += 1;
      correct(equation, hr, delta);
      if (!evaluate() || solved.converged) return;
    }
  }

 protected:
  /// Before the first correction of a step: h r at the guess.
  virtual void begin(Equation&, const Field<double>& /*delta*/, const Field<double>& /*hr*/, Solved&) {}
  /// delta <- delta less what is thought to be J^-1 h r.
  virtual void correct(Equation& equation, const Field<double>& hr, Field<double>& delta) = 0;
};

}  // namespace linden::comparators

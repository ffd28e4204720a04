// bench/comparators/broyden.hpp
// Broyden's first ("good") method: an inverse Jacobian that every correction improves by a matrix of rank one.
//
//   s = -H r,  y = r(delta + s) - r(delta),  H <- H + (s - H y) (s^T H) / (s^T H y)
//
// The first H of a step:
//   differences  a Jacobian by forward differences at the first guess, inverted: Broyden's own proposal, and what the GNU
//                Scientific Library does, which the paper's published code calls. n further evaluations and an inversion.
//   kept         the last H of the step before; differences in the very first step only. Not the paper's; shown because it is the
//                cheaper habit where one step is like the next.
//
// cost    O(n^2) an iteration; with differences n evaluations and O(n^3) a step
// source  Broyden, A class of methods for solving nonlinear simultaneous equations, 1965; inverse form by Sherman and Morrison
#pragma once

#include "bench/comparators/dense_lu.hpp"
#include "bench/comparators/root_finder.hpp"

namespace linden::comparators {

enum class FirstJacobian { differences, kept };

class Broyden : public RootFinder {
 public:
  explicit Broyden(FirstJacobian first) : first_(first) {}

 private:
  void begin(Equation& equation, const Field<double>& delta, const Field<double>& hr, Solved& solved) override;
  void correct(Equation& equation, const Field<double>& hr, Field<double>& delta) override;

  FirstJacobian first_;
  Eigen::MatrixXd J_, H_;
  DenseLu lu_;
  Eigen::VectorXd s_, before_, Hy_;
  Eigen::RowVectorXd sH_;
  Field<double> varied_, changed_;
  bool corrected_ = false;  // s_ and before_ are of this step
};

}  // namespace linden::comparators

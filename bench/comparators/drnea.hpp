// bench/comparators/drnea.hpp
// The paper's evaluation of its equation: Algorithm 2, by the kernels of the engine; its derivative by Algorithm 4.
//
//   L_d = h/2 L(T^k, V^k) + h/2 L(T^k+1, V^k),  V = 1/h log dT          (9), (10)
//
// cost    O(n); O(n^2) with the derivative
// source  the paper, (19)-(22), in the displacement form of kernels/tree/displacement_down.hpp
#pragma once

#include "bench/comparators/ancestry.hpp"
#include "bench/comparators/equation.hpp"

namespace linden::comparators {

class Drnea : public Equation {
 public:
  explicit Drnea(const Model& model);

  void begin(const StepStart& start) override;
  bool residual(const Field<double>& delta, Field<double>& hr) override;
  void jacobian(Eigen::MatrixXd& J) override;
  void momentum(const StepStart& end, Field<double>& p) override;

  Index rows() const { return target_.rows(); }
  /// Factors the exact derivative where the residual was taken last, in O(n) (kernels/tree/newton_factor_up.hpp) ...
  void factor();
  /// ... and applies its inverse.
  void apply_inverse(const Field<double>& r, Field<double>& x);

 private:
  const Model& model_;
  Ancestry ancestry_;
  Field<double, 12> placement_;
  Field<double, 7> motion_, displacement_;
  Field<double, 6> impulse_;
  Field<double> target_, residual_;
  Workspace<double> factor_;
};

}  // namespace linden::comparators

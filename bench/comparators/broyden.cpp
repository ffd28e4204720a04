#include "bench/comparators/broyden.hpp"

namespace linden::comparators {
namespace {

/// Root of the rounding unit, in radians or metres: joint positions are of the order of one.
constexpr double kDifference = 0x1p-26;

}  // namespace

void Broyden::begin(Equation& equation, const Field<double>& delta, const Field<double>& hr, Solved& solved) {
  corrected_ = false;
  if (first_ == FirstJacobian::kept && H_.size() > 0) return;
  const Index n = delta.rows();
  J_.resize(n, n);
  changed_ = hr;
  for (Index j = 0; j < n; ++j) {
    varied_ = delta;
    varied_(j) += kDifference;
    solved.evaluations += 1;
    if (!equation.residual(varied_, changed_)) break;  // the correction that follows will not be defined either
    J_.col(j) = (vector(changed_) - vector(hr)) / kDifference;
  }
  lu_.factor(J_);
  lu_.inverse(H_);
}

void Broyden::correct(Equation&, const Field<double>& hr, Field<double>& delta) {
  const auto r = vector(hr);
  if (corrected_) {
    Hy_.noalias() = H_ * (r - before_);
    sH_.noalias() = s_.transpose() * H_;
    H_.noalias() += ((s_ - Hy_) / s_.dot(Hy_)) * sH_;
  }
  s_.noalias() = -(H_ * r);
  before_ = r;
  corrected_ = true;
  vector(delta) += s_;
}

}  // namespace linden::comparators

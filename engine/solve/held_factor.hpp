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
// Of a block of instances each lane goes by its own numbers (engine/sweeps/lane_factor.hpp). Numbers are doubles or packs of them.
//
// Not so where effects stick, stop or saturate: their states are judged by forces that only exact corrections bring out in time. Held there,
// a resting arm was seen to break loose.
#pragma once

#include <array>

#include "kernels/values/lanes_of.hpp"

namespace linden {

template <class S>
class HeldFactor {
 public:
  using Mask = typename LanesOf<S>::Mask;
  static constexpr int kNumbers = 4;

  /// Whether a factor there is will do for the step that comes: one correction with it is likely to reach this relative residual, and that at
  /// an age of so many steps.
  Mask serves(const S& tolerance, const S& steps) const {
    using std::max;
    return age() > S(0.0) && steps <= as<S>(kOldest) && residual() * rate() * steps <= max(tolerance, floor());
  }

  /// A solve begins: the relative residual of its first guess; fresh: with a factor of its own.
  void begin(const S& residual_of_guess, const Mask& fresh) {
    residual() = residual_of_guess;
    rate() = select(fresh, rate() * as<S>(kForgotten), rate());
  }
  /// What its first correction left of the residual, where the factor was held; at_floor: rounding let it fall no further, so that it says
  /// no more than that the share was not larger.
  void corrected(const S& share, const Mask& at_floor) {
    using std::min;
    const S measured = min(S(1.0), share / age());
    rate() = select(at_floor, min(rate(), measured), measured);
  }
  /// It has converged, at this relative residual; made: with a factor made on the way.
  void end(const S& residual_left, const Mask& at_floor, const Mask& made) {
    age() = select(made, S(1.0), age() + S(1.0));
    floor() = select(at_floor, residual_left, S(0.0));
  }
  /// There is no factor of an earlier step.
  void drop() { age() = S(0.0); }

  S& age() { return numbers_[0]; }  // steps since the factor was made; 0: there is none
  const S& age() const { return numbers_[0]; }
  /// All there is to know of it, for a checkpoint.
  std::array<S, kNumbers>& numbers() { return numbers_; }
  const std::array<S, kNumbers>& numbers() const { return numbers_; }

 private:
  /// Steps that a factor is held at most: it is also the measure by which residuals are judged.
  static constexpr double kOldest = 32;
  /// What is left of the rate after each step with a factor of its own: where a motion has calmed down holding is tried again.
  static constexpr double kForgotten = 0.95;
  /// Of a wild motion: until it has been measured.
  static constexpr double kWild = 1e-3;

  S& rate() { return numbers_[1]; }
  S& residual() { return numbers_[2]; }  // of the last first guess
  S& floor() { return numbers_[3]; }     // residual at which the last step ended at the floor of rounding; else 0
  const S& rate() const { return numbers_[1]; }
  const S& residual() const { return numbers_[2]; }
  const S& floor() const { return numbers_[3]; }

  std::array<S, kNumbers> numbers_{S(0.0), as<S>(kWild), S(0.0), S(0.0)};
};

}  // namespace linden

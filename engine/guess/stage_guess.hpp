// engine/guess/stage_guess.hpp
// What the solves of a composed step begin with: a guess at the displacement of every sub-step.
//
//   d_i      cubic through the last four displacements of the same sub-step i, one step apart, extrapolated
//   m_i      (delta_i - d_i) / gamma_i                      what that missed, when the sub-step was taken last
//   guess_i  d_i + gamma_i sum_k w_ik m_(i-k)               k = 1, ..., 4: the four sub-steps before, those of the last step included
//
// The displacements of one sub-step change smoothly from step to step; from one sub-step to the next they do not, for each stands a
// little off the true motion, and differently so. What extrapolation misses, however, does change smoothly with the time in the middle of
// a sub-step: w_i takes the parabola through the last four of it, by least squares, to where sub-step i is.
//
// Measured on the ten-link chain over 10 s, order 4 solved to 1e-12: 2.0, 2.2, 3.0 evaluations of the residual a sub-step at steps of 1, 2,
// 4 ms, where displacements of the same sub-step alone, five of them, need 2.5, 3.2, 4.7. Fewer or more of either, and lines or cubics in
// place of the parabola, need up to a tenth more at one step or another.
//
// shapes  displacements and guess [nv; rad, m]
// cost    some 9 nv multiplications a sub-step; no allocation after construction
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "layout/state.hpp"

namespace linden {

class StageGuess {
 public:
  /// stages: gamma_1, ..., gamma_s (engine/compose/composition.hpp), which must outlive it.
  StageGuess(std::span<const double> stages, Index velocities);

  /// Writes the guess for a sub-step to the latest row of `history`, where the stepper takes it for the displacement of the step before.
  /// False where the sub-step is not known yet, or no more.
  bool predict(std::size_t stage, Field<double, kHistory>& history);
  /// The same, but the last displacement itself.
  bool repeat(std::size_t stage, Field<double, kHistory>& history);
  /// The displacement that solved the sub-step predicted last, in the latest row of `history`.
  void learn(std::size_t stage, const Field<double, kHistory>& history);
  /// The sub-step was taken in parts.
  void forget(std::size_t stage);
  void forget();
  /// Steps are so many times as long from now on: what is known of displacements is brought to that.
  void change_length(double times);

  /// For checkpoints: how many displacements of each sub-step are known; these, and what was missed.
  std::span<std::int64_t> known() { return known_; }
  std::span<double> numbers() { return numbers_; }
  static constexpr int kRows = 4;  // the most that are known

 private:
  static constexpr int kMisses = 4;

  /// Displacements of a sub-step, latest first; after them what was missed.
  double* row(std::size_t stage, int k) {
    return numbers_.data() + (stage * (kRows + 1) + static_cast<std::size_t>(k)) * velocities_;
  }

  std::span<const double> stages_;
  std::size_t velocities_;
  std::vector<std::array<double, kMisses>> weights_;  // w_i
  std::vector<std::int64_t> known_;
  std::vector<double> numbers_;       // rows of all sub-steps; zero where nothing is known
  std::vector<double> extrapolated_;  // d_i of the sub-step predicted last
};

}  // namespace linden

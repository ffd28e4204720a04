// What the sub-steps of a composed step begin with.
#include "engine/guess/stage_guess.hpp"

#include <cmath>

#include "engine/compose/composition.hpp"
#include "tests/engine/scenes.hpp"

namespace linden::stage_guess_test {
namespace {

/// A motion whose displacement in each sub-step is its length times a polynomial in the time of its middle.
double displacement(std::span<const double> stages, std::size_t stage, int step, int degree) {
  double begin = step;
  for (std::size_t k = 0; k < stage; ++k) begin += stages[k];
  return stages[stage] * std::pow((begin + stages[stage] / 2) / 10 - 1, degree);
}

/// Largest error of the guesses in a step after `steps` others.
double error_after(int order, int steps, int degree) {
  const std::span<const double> stages = composition(order);
  StageGuess guess(stages, 1);
  Field<double, kHistory> history;
  history.allocate(1);
  double largest = 0;
  for (int step = 0; step <= steps; ++step) {
    for (std::size_t stage = 0; stage < stages.size(); ++stage) {
      const double exact = displacement(stages, stage, step, degree);
      REQUIRE(guess.predict(stage, history) == (step > 0));
      if (step == steps) largest = std::max(largest, std::abs(history(0, 0) - exact));
      history(0, 0) = exact;
      guess.learn(stage, history);
    }
  }
  return largest;
}

TEST_CASE("displacements that are polynomials of time are guessed, the sixth degree included once all is known") {
  for (const int order : {4, 6, 8}) {
    for (int degree = 0; degree <= 6; ++degree) {
      CAPTURE(order, degree);
      CHECK(error_after(order, 10, degree) < 1e-13);
    }
    CHECK(error_after(order, 10, 7) > 1e-8);
    // after one step the last displacement, after two a line, after four a cubic
    CHECK(error_after(order, 1, 0) < 1e-13);
    CHECK(error_after(order, 2, 1) < 1e-13);
    CHECK(error_after(order, 4, 3) < 1e-13);
  }
}

TEST_CASE("a sub-step that was forgotten is guessed from its own past alone until that is full again") {
  const std::span<const double> stages = composition(4);
  StageGuess guess(stages, 1);
  Field<double, kHistory> history;
  history.allocate(1);
  for (int step = 0; step < 12; ++step) {
    for (std::size_t stage = 0; stage < stages.size(); ++stage) {
      const double exact = displacement(stages, stage, step, 3);
      const bool known = guess.predict(stage, history);
      CHECK(known == (step > 0 && !(stage == 2 && step == 6)));
      if (step >= 11) CHECK(history(0, 0) == Approx(exact).margin(1e-13));
      if (step > 0 && known) {
        double before = history(0, 0);
        REQUIRE(guess.repeat(stage, history));
        CHECK(history(0, 0) == displacement(stages, stage, step - 1, 3));
        history(0, 0) = before;
      }
      history(0, 0) = exact;
      if (stage == 2 && step == 5) {
        guess.forget(stage);
      } else {
        guess.learn(stage, history);
      }
    }
  }
}

}  // namespace
}  // namespace linden::stage_guess_test

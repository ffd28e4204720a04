#include "engine/guess/extrapolation.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <random>

namespace linden::extrapolation_test {
namespace {

constexpr Index kRows = 3000;

/// Row i of `history` is f(i, -1), f(i, -2), ...; its next is f(i, 0).
template <class Function>
Field<double, kHistory> history_of(const Function& f) {
  Field<double, kHistory> history;
  history.allocate(kRows);
  for (Index i = 0; i < kRows; ++i) {
    for (int k = 0; k < kHistory; ++k) history(i, k) = f(i, -1 - k);
  }
  return history;
}

double largest_error(const Field<double, kHistory>& history, int terms, const auto& f) {
  Field<double> delta;
  delta.allocate(kRows);
  const Extrapolation guess = extrapolation(history, terms);
  extrapolate(guess, history, {0, 1001}, delta);
  extrapolate(guess, history, {1001, kRows}, delta);
  double worst = 0;
  for (Index i = 0; i < kRows; ++i) worst = std::max(worst, std::abs(delta(i) - f(i, 0)));
  return worst;
}

TEST_CASE("polynomials through the last displacements are continued exactly") {
  for (int terms = 1; terms <= kHistory; ++terms) {
    const auto f = [&](Index i, int t) { return 1 + (terms > 1 ? 0.3 * std::pow(t + 0.001 * i, terms - 1) : 0.0); };
    CHECK(largest_error(history_of(f), terms, f) < 1e-11);
  }
}

TEST_CASE("of histories that are noise a cubic near them is taken, which multiplies it by 5 and not by 16") {
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(0, 1e-3);
  const auto smooth = [](Index i, int t) { return 1 + 0.1 * t + 0.02 * t * t + 1e-4 * t * t * t + 1e-4 * i; };
  const Field<double, kHistory> history = history_of([&](Index i, int t) { return smooth(i, t) + noise(random); });
  Field<double> delta;
  delta.allocate(kRows);
  extrapolate(extrapolation(history, kHistory), history, {0, kRows}, delta);
  double sum = 0;
  for (Index i = 0; i < kRows; ++i) sum += std::pow(delta(i) - smooth(i, 0), 2);
  CHECK(std::sqrt(sum / kRows) == Approx(4.92e-3).epsilon(0.1));
}

TEST_CASE("the choice is the same before the latest displacement has joined the history") {
  std::mt19937_64 random(2);
  std::normal_distribution<double> noise(0, 1e-3);
  for (const double amount : {0.0, 1.0}) {
    Field<double, kHistory> history = history_of([&](Index i, int t) { return 1 + 0.1 * t + 1e-4 * i + amount * noise(random); });
    Field<double> latest;
    latest.allocate(kRows);
    for (Index i = 0; i < kRows; ++i) latest(i) = 1 + 1e-4 * i + amount * noise(random);
    const Extrapolation before = extrapolation_after(latest, history, kHistory);
    remember(latest, {0, kRows}, history);
    CHECK(before.shares == extrapolation(history, kHistory).shares);
    CHECK((before.shares == polynomial_through(kHistory)) == (amount == 0));
  }
}

TEST_CASE("a displacement that is remembered comes first, and the oldest is forgotten") {
  const auto f = [](Index i, int t) { return 10 * i + t; };
  Field<double, kHistory> history = history_of(f);
  Field<double> delta;
  delta.allocate(kRows);
  for (Index i = 0; i < kRows; ++i) delta(i) = f(i, 0);
  remember(delta, {0, kRows}, history);
  CHECK(history == history_of([&](Index i, int t) { return f(i, t + 1); }));
}

}  // namespace
}  // namespace linden::extrapolation_test

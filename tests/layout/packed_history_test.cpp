#include "layout/packed_history.hpp"

#include <array>
#include <catch2/catch.hpp>
#include <cmath>

namespace linden::packed_history_test {
namespace {

constexpr int kLanes = 4;

template <class Real>
struct History {
  std::array<std::uint32_t, kHistoryWords<Real> * kLanes> past{};
  int taken = 0;

  void take(const std::array<Real, kLanes>& delta, int held_lane = -1) {
    std::array<std::int32_t, kLanes> known;
    for (int l = 0; l < kLanes; ++l) known[static_cast<std::size_t>(l)] = l == held_lane ? -1 : std::min(taken, 2);
    remember<kLanes>(delta.data(), known.data(), past.data());
    ++taken;
  }
  std::array<Real, kLanes> next() const {
    std::array<Real, kLanes> guess;
    extrapolate<kLanes>(past.data(), guess.data());
    return guess;
  }
};

/// Displacements of a smooth motion, one in each lane: what a hinge does that swings at 10 rad/s, sampled each millisecond.
template <class Real>
std::array<Real, kLanes> swing(int step) {
  std::array<Real, kLanes> delta;
  for (int l = 0; l < kLanes; ++l) {
    delta[static_cast<std::size_t>(l)] = static_cast<Real>(1e-3 * (l + 1) * std::cos(0.01 * step + 0.4 * l));
  }
  return delta;
}

template <class Real>
double worst_guess() {
  History<Real> history;
  for (int step = 0; step < 3; ++step) history.take(swing<Real>(step));
  double worst = 0;
  for (int step = 3; step < 100; ++step) {
    const auto guess = history.next(), truth = swing<Real>(step);
    for (std::size_t l = 0; l < kLanes; ++l) {
      worst = std::max(worst, std::abs(static_cast<double>(guess[l] - truth[l])) / (1e-3 * static_cast<double>(l + 1)));
    }
    history.take(truth);
  }
  return worst;
}

TEST_CASE("the first guess of a smooth motion is off by some 1e-6 of it, in single precision by 1e-3") {
  // the bare difference to the step before is 1e-2
  CHECK(worst_guess<double>() < 1e-5);
  CHECK(worst_guess<double>() > 1e-8);
  CHECK(worst_guess<float>() < 2e-3);
}

TEST_CASE("nothing known is no displacement, one displacement is repeated, two are continued") {
  History<double> history;
  CHECK(history.next() == std::array<double, kLanes>{0, 0, 0, 0});
  history.take({1, 2, -3, 0});
  CHECK(history.next() == std::array<double, kLanes>{1, 2, -3, 0});
  history.take({1.5, 2, -4, 0});
  CHECK(history.next() == std::array<double, kLanes>{2, 2, -5, 0});
}

TEST_CASE("a lane that is held remembers what it remembered") {
  History<double> history;
  history.take({1, 1, 1, 1});
  history.take({2, 2, 2, 2}, 2);
  CHECK(history.next() == std::array<double, kLanes>{3, 3, 1, 3});
}

TEST_CASE("two floats in a word keep their signs, their scales and their first digits") {
  for (const float fine : {0.0f, 1.0f, -0.1f, 3.14159f, 1e-20f, -1e20f}) {
    for (const float coarse : {0.0f, 0.5f, -0.01f, 7.7e-8f, -1e9f}) {
      const std::uint32_t word = packed(fine, coarse);
      CHECK(std::abs(fine_part(word) - fine) <= std::abs(fine) / 4096);
      CHECK(std::abs(coarse_part(word) - coarse) <= std::abs(coarse) / 16);
    }
  }
}

}  // namespace
}  // namespace linden::packed_history_test

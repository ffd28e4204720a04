#include "kernels/values/polynomial.hpp"

#include <catch2/catch.hpp>
#include <numbers>

#include "models/build/random.hpp"
#include "tests/kernels/lanes.hpp"
#include "tests/reference/se3_plain.hpp"

namespace linden::polynomial_test {
namespace {

using std::numbers::pi;

/// sum of (-1)^j x^j / (first (first + 1) ... as factorials): every second term of a Taylor series, in long double.
long double alternating_series(long double x, int first_factorial) {
  long double term = 1, sum = 0;
  for (int k = 2; k <= first_factorial; ++k) term /= k;
  for (int j = 0; j < 40; ++j) {
    sum += term;
    term *= -x / (static_cast<long double>(first_factorial + 2 * j + 1) * (first_factorial + 2 * j + 2));
  }
  return sum;
}

/// alpha (order 0), its slope (1) and its curvature (2) from the Bernoulli numbers of (12): ad^2 acts as -x.
long double alpha_series(long double x, int order) {
  const auto& b = reference::bernoulli_over_factorial();
  long double sum = 0;
  for (std::size_t j = b.size() / 2 - 1; j >= 1; --j) {
    // term c x^(j-1), differentiated `order` times
    const long double sign = j % 2 == 0 ? -1 : 1;
    long double term = sign * b[2 * j];
    const int power = static_cast<int>(j) - 1;
    if (power < order) continue;
    for (int k = 0; k < order; ++k) term *= power - k;
    sum += term * std::pow(x, static_cast<long double>(power - order));
  }
  return sum;
}

/// Worst relative error over [0, top], in epsilons of S.
template <class S, class Found, class Truth>
double worst_error(double top, const Found& found, const Truth& truth) {
  Random random(1);
  double worst = 0;
  for (int sample = 0; sample < 20000; ++sample) {
    // both ends, evenly between, and all decades above zero
    const double at = sample == 0   ? 0
                      : sample == 1 ? top
                      : sample % 4  ? random.uniform(0, top)
                                    : top * std::pow(10.0, random.uniform(-30, 0));
    const S x = static_cast<S>(at);
    const long double expected = truth(static_cast<long double>(x));
    see(worst, static_cast<double>(std::abs(static_cast<long double>(found(x)) - expected) / std::abs(expected)));
  }
  return worst / static_cast<double>(std::numeric_limits<S>::epsilon());
}

template <class S>
void check_all(double bound) {
  const auto check = [&](const char* name, double top, auto found, auto truth) {
    const double worst = worst_error<S>(top, found, truth);
    INFO(name << ": worst relative error " << worst << " epsilon");
    CHECK(worst <= bound);
  };
  const auto atan_truth = [](long double tt) {
    const long double t = std::sqrt(tt);
    return t > 0 ? std::atan(t) / t : 1.0L;
  };
  check(
      "atan_over_t", 1, [](S x) { return atan_over_t(x); }, atan_truth);
  check(
      "sinc", pi * pi / 4, [](S x) { return sinc(x); }, [](long double x) { return alternating_series(x, 1); });
  check(
      "versine_over_square", pi * pi / 4, [](S x) { return versine_over_square(x); },
      [](long double x) { return alternating_series(x, 2); });
  check(
      "exp_second", pi * pi, [](S x) { return exp_second(x); }, [](long double x) { return alternating_series(x, 3); });
  check(
      "alpha", pi * pi, [](S x) { return alpha(x); }, [](long double x) { return alpha_series(x, 0); });
  check(
      "alpha_slope", pi * pi, [](S x) { return alpha_slope(x); }, [](long double x) { return alpha_series(x, 1); });
  check(
      "alpha_curvature", pi * pi, [](S x) { return alpha_curvature(x); },
      [](long double x) { return alpha_series(x, 2); });
}

/// The short series, up to kSmallTurn.
template <class S>
void check_small(double bound, double slope_bound) {
  const auto check = [&](const char* name, double top, double most, auto found, auto truth) {
    const double worst = worst_error<S>(top, found, truth);
    INFO(name << ": worst relative error " << worst << " epsilon");
    CHECK(worst <= most);
  };
  const double x = kSmallTurn * kSmallTurn, ss = 1 - kSmallTurnCosine * kSmallTurnCosine;
  check("small_angle_over_sine", ss, bound, [](S y) { return small_angle_over_sine(y); }, [](long double y) {
    const long double s = std::sqrt(y);
    return s > 0 ? 2 * std::asin(s) / s : 2.0L;
  });
  check("small_alpha", x, bound, [](S y) { return small_alpha(y); }, [](long double y) { return alpha_series(y, 0); });
  check("small_alpha_slope", x, slope_bound, [](S y) { return small_alpha_slope(y); },
        [](long double y) { return alpha_series(y, 1); });
}

TEST_CASE("the short series are within two epsilon of their functions, the slope within what it is multiplied by") {
  check_small<double>(2, 2.5e-13 / kEpsilon);
  CHECK(kSmallTurnCosine == Approx(std::cos(kSmallTurn / 2)).epsilon(1e-16));
}

TEST_CASE("the short series of single precision leave what rounding of the rest covers") {
  check_small<float>(3, 3e-3 / 1.2e-7);
}

TEST_CASE("every polynomial is within two epsilon of its function over the whole range") { check_all<double>(2); }

TEST_CASE("every polynomial is within three epsilon of its function in float too") { check_all<float>(3); }

TEST_CASE("polynomials take their closed values at the ends of their ranges") {
  CHECK(sinc(0.0) == 1);
  CHECK(versine_over_square(0.0) == 0.5);
  CHECK(atan_over_t(0.0) == 1);
  CHECK(alpha(0.0) == Approx(1.0 / 12).epsilon(1e-15));
  CHECK(atan_over_t(1.0) == Approx(pi / 4).epsilon(1e-15));
  CHECK(sinc(pi * pi / 4) == Approx(2 / pi).epsilon(1e-15));
  CHECK(versine_over_square(pi * pi / 4) == Approx(4 / (pi * pi)).epsilon(1e-15));
  CHECK(exp_second(pi * pi) == Approx(1 / (pi * pi)).epsilon(1e-15));
  CHECK(alpha(pi * pi) == Approx(1 / (pi * pi)).epsilon(1e-15));
}

TEST_CASE("the slope and the curvature of alpha are its derivatives") {
  using reference::Dual;
  for (double x = 0; x < 9.8; x += 0.7) {
    const Dual<1> varied(x, 0);
    CHECK(alpha(varied).slope[0] == Approx(alpha_slope(x)).epsilon(1e-12));
    CHECK(alpha_slope(varied).slope[0] == Approx(alpha_curvature(x)).epsilon(1e-11));
  }
}

TEST_CASE("a polynomial of any length is its sum of powers") {
  const double x = 0.5;
  CHECK(polynomial(x, std::array<double, 2>{1, 2}) == 2);
  CHECK(polynomial(x, std::array<double, 3>{1, 2, 4}) == 3);
  CHECK(polynomial(x, std::array<double, 4>{1, 2, 4, 8}) == 4);
  CHECK(polynomial(x, std::array<double, 5>{1, 2, 4, 8, 16}) == 5);
}

TEST_CASE("polynomials give equal bits in every lane and allocate nothing") {
  Random random(3);
  std::vector<std::array<double, 1>> samples;
  for (std::size_t k = 0; k < 4 * Pack::size + 1; ++k) samples.push_back({random.uniform(0, 1)});
  check_value_lanes(
      [](const auto& in) {
        using S = std::decay_t<decltype(in[0])>;
        const S& x = in[0];
        return std::array<S, 7>{atan_over_t(x), sinc(x),        versine_over_square(x), exp_second(x),
                                alpha(x),       alpha_slope(x), alpha_curvature(x)};
      },
      samples, 4 * kEpsilon);
}

}  // namespace
}  // namespace linden::polynomial_test

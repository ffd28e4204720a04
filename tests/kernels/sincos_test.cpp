#include "kernels/values/sincos.hpp"

#include <catch2/catch.hpp>
#include <numbers>

#include "models/build/random.hpp"
#include "tests/kernels/lanes.hpp"

namespace linden::sincos_test {
namespace {

/// Largest absolute error of both, in epsilons of S, over angles up to `top`.
template <class S>
double worst_error(double top) {
  Random random(1);
  double worst = 0;
  for (int sample = 0; sample < 100000; ++sample) {
    const S x = static_cast<S>(sample % 2 ? random.uniform(-top, top) : top * std::pow(10.0, random.uniform(-20, 0)));
    const SinCos<S> found = sin_cos(x);
    const auto exact = static_cast<long double>(x);
    see(worst, static_cast<double>(std::abs(static_cast<long double>(found.sin) - std::sin(exact))),
        static_cast<double>(std::abs(static_cast<long double>(found.cos) - std::cos(exact))));
  }
  return worst / static_cast<double>(std::numeric_limits<S>::epsilon());
}

TEST_CASE("sine and cosine are within 1.5 epsilon up to a million rad, in float up to ten thousand") {
  for (const double top : {1.0, 10.0, 1e3, 1e6}) {
    INFO("up to " << top);
    CHECK(worst_error<double>(top) <= 1.5);
  }
  for (const double top : {1.0, 10.0, 1e3, 1e4}) {
    INFO("up to " << top);
    CHECK(worst_error<float>(top) <= 1.5);
  }
}

TEST_CASE("small angles keep their relative accuracy and quarter turns fall into their quadrants") {
  for (const double x : {1e-300, 1e-20, 1e-9, -1e-9}) CHECK(sin_cos(x).sin == x);
  CHECK((sin_cos(0.0).sin == 0 && sin_cos(0.0).cos == 1));
  for (int k = -9; k <= 9; ++k) {
    const SinCos<double> found = sin_cos(k * std::numbers::pi / 2 + 0.1);
    const double expected_sin[] = {std::sin(0.1), std::cos(0.1), -std::sin(0.1), -std::cos(0.1)};
    const double expected_cos[] = {std::cos(0.1), -std::sin(0.1), -std::cos(0.1), std::sin(0.1)};
    CHECK(found.sin == Approx(expected_sin[(k + 100) % 4]).epsilon(1e-13));
    CHECK(found.cos == Approx(expected_cos[(k + 100) % 4]).epsilon(1e-13));
  }
  CHECK(std::isnan(sin_cos(std::numeric_limits<double>::infinity()).sin));
}

TEST_CASE("sine and cosine give equal bits in every lane, whatever the angles beside it") {
  Random random(3);
  std::vector<std::array<double, 1>> samples;
  for (std::size_t k = 0; k < 4 * Pack::size + 1; ++k) samples.push_back({std::pow(10.0, random.uniform(-8, 8))});
  check_value_lanes(
      [](const auto& in) {
        using S = std::decay_t<decltype(in[0])>;
        const SinCos<S> found = sin_cos(in[0]);
        return std::array<S, 2>{found.sin, found.cos};
      },
      samples, 4 * kEpsilon);
}

}  // namespace
}  // namespace linden::sincos_test

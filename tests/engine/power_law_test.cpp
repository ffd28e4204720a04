// The exponent of a power law comes out exactly where there is one, and with an honest error where there is noise.
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <vector>

#include "engine/program/power_law.hpp"

namespace linden::power_law_test {
namespace {

const std::vector<double> kSizes{10, 20, 50, 100, 200, 500, 1000};

std::vector<double> costs(double factor, double exponent) {
  std::vector<double> result;
  for (const double size : kSizes) result.push_back(factor * std::pow(size, exponent));
  return result;
}

TEST_CASE("the exponent of an exact power law is found, in any order") {
  for (const double exponent : {0.5, 1.0, 3.0}) {
    std::vector<double> x = kSizes, y = costs(3e-6, exponent);
    std::swap(x[1], x[5]);
    std::swap(y[1], y[5]);
    const PowerLaw law = power_law(x, y, 0);
    CHECK(law.exponent == Approx(exponent).epsilon(1e-12));
    CHECK(law.error < 1e-7);
    CHECK(law.points == 7);
    CHECK(law.least == 10);
  }
}

TEST_CASE("small sizes are left out while three others remain") {
  std::vector<double> y = costs(1, 1);
  y[0] = y[1] = y[2] = 100;
  const PowerLaw law = power_law(kSizes, y, 100);
  CHECK(law.exponent == Approx(1).epsilon(1e-12));
  CHECK(law.points == 4);
  CHECK(law.least == 100);
  CHECK(power_law(kSizes, y, 500).points == 7);
}

TEST_CASE("the standard error is that of the textbook") {
  // log y = log x but for +-d at four sizes e^0, e^1, e^2, e^3: slope 1 - 0.4 d, squares left 3.2 d^2, error sqrt(3.2 / 2 / 5) d
  const double d = 0.1;
  std::vector<double> x, y;
  for (int k = 0; k < 4; ++k) {
    x.push_back(std::exp(k));
    y.push_back(std::exp(k + (k % 2 == 0 ? d : -d)));
  }
  const PowerLaw law = power_law(x, y, 0);
  CHECK(law.exponent == Approx(1 - 0.4 * d));
  CHECK(law.error == Approx(std::sqrt(0.32) * d));
}

TEST_CASE("costs that are unknown are left out, and too few points have no exponent") {
  constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> y = costs(2, 1.5);
  y[3] = unknown;
  y[4] = 0;
  CHECK(power_law(kSizes, y, 0).points == 5);
  CHECK(power_law(kSizes, y, 0).exponent == Approx(1.5));
  const std::vector<double> one{7}, two{7, 8};
  CHECK(std::isnan(power_law(one, one, 0).exponent));
  CHECK(power_law(two, two, 0).exponent == Approx(1));
  CHECK(std::isnan(power_law(two, two, 0).error));
  CHECK(power_law({}, {}, 0).points == 0);
}

}  // namespace
}  // namespace linden::power_law_test

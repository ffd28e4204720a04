#include "kernels/values/scalar.hpp"

#include <catch2/catch.hpp>
#include <new>

#include "tests/kernels/lanes.hpp"
#include "tests/reference/dual.hpp"

namespace linden::scalar_test {
namespace {

TEST_CASE("a constant keeps its value as a double and is rounded to nearest as a float") {
  CHECK(as<double>(0.1) == 0.1);
  CHECK(as<float>(0.1) == 0.1f);
  CHECK(as<double>(0.1f) == 0.10000000149011611938);
}

TEST_CASE("a constant is spread over all lanes of a pack") {
  const Pack pack = as<Pack>(0.1);
  for (std::size_t l = 0; l < Pack::size; ++l) CHECK(lane(pack, l) == 0.1);
}

TEST_CASE("a constant does not vary") {
  const auto dual = as<reference::Dual<2>>(0.1);
  CHECK(dual.value == 0.1);
  CHECK(dual.slope == std::array<double, 2>{0, 0});
}

TEST_CASE("the allocation counter counts") {
  const AllocationCounter counter;
  CHECK(counter.count() == 0);
  // called by name: a new-expression whose result is not used may be left out
  ::operator delete(::operator new(8));
  ::operator delete (::operator new (640, std::align_val_t{64}), std::align_val_t{64});
  CHECK(counter.count() == 2);
}

TEST_CASE("dual numbers differentiate") {
  using reference::Dual;
  const Dual<2> x(0.7, 0), y(0.3, 1);
  const auto check = [](const Dual<2>& found, double value, double by_x, double by_y) {
    CHECK(found.value == Approx(value).epsilon(1e-14));
    CHECK(found.slope[0] == Approx(by_x).epsilon(1e-14).margin(1e-15));
    CHECK(found.slope[1] == Approx(by_y).epsilon(1e-14).margin(1e-15));
  };
  check(x + 2 * y, 1.3, 1, 2);
  check(x - x * y, 0.49, 0.7, -0.7);
  check(x / y, 7 / 3.0, 1 / 0.3, -0.7 / 0.09);
  check(-x * sqrt(y), -0.7 * std::sqrt(0.3), -std::sqrt(0.3), -0.35 / std::sqrt(0.3));
  check(sin(x) * cos(y), std::sin(0.7) * std::cos(0.3), std::cos(0.7) * std::cos(0.3), -std::sin(0.7) * std::sin(0.3));
  check(atan2(x, y), std::atan2(0.7, 0.3), 0.3 / 0.58, -0.7 / 0.58);
  check(atan(x), std::atan(0.7), 1 / 1.49, 0);
  check(min(x, y) + abs(-x) + max(x, y), 1.7, 2, 1);
}

}  // namespace
}  // namespace linden::scalar_test

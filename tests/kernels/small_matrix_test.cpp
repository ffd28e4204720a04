#include "kernels/values/small_matrix.hpp"

#include <Eigen/Dense>
#include <catch2/catch.hpp>

#include "models/build/random.hpp"
#include "tests/kernels/lanes.hpp"

namespace linden::small_matrix_test {
namespace {

template <std::size_t N>
using Matrix = Eigen::Matrix<double, static_cast<int>(N), static_cast<int>(N), Eigen::RowMajor>;

/// Positive definite symmetric part, condition numbers up to 1e3, antisymmetric part of any share.
template <std::size_t N>
std::array<double, N * N> random_block(Random& random) {
  Matrix<N> root, skew;
  for (double& value : root.reshaped()) value = random.uniform(-1, 1);
  for (double& value : skew.reshaped()) value = random.uniform(-0.3, 0.3);
  std::array<double, N * N> block;
  Eigen::Map<Matrix<N>>(block.data()) =
      root * root.transpose() + 0.01 * Matrix<N>::Identity() + skew - skew.transpose();
  return block;
}

template <std::size_t N>
void check_against_lu() {
  Random random(N);
  double worst = 0;
  for (int sample = 0; sample < 200; ++sample) {
    const auto block = random_block<N>(random);
    auto inverse = block;
    invert<N>(inverse);
    const Matrix<N> A = Eigen::Map<const Matrix<N>>(block.data());
    const Matrix<N> expected = A.partialPivLu().inverse(), found = Eigen::Map<const Matrix<N>>(inverse.data());
    const double condition = A.norm() * expected.norm();
    see(worst, (found - expected).norm() / expected.norm() / condition);
  }
  INFO("worst error of the inverse in epsilons of the condition number: " << worst / kEpsilon);
  CHECK(worst < 8 * kEpsilon);
}

TEST_CASE("invert agrees with LU with pivoting on blocks whose symmetric part is positive definite") {
  check_against_lu<3>();
  check_against_lu<6>();
}

TEST_CASE("invert knows the inverse of a shear and of a scaling") {
  std::array<double, 9> shear{2, 0, 0, 1, 1, 0, 0, 3, 4};
  invert<3>(shear);
  CHECK(shear == std::array<double, 9>{0.5, 0, 0, -0.5, 1, 0, 0.375, -0.75, 0.25});
  std::array<double, 36> scaling{};
  for (std::size_t k = 0; k < 6; ++k) scaling[7 * k] = std::ldexp(1.0, static_cast<int>(k));
  invert<6>(scaling);
  for (std::size_t k = 0; k < 36; ++k)
    CHECK(scaling[k] == (k % 7 == 0 ? std::ldexp(1.0, -static_cast<int>(k / 7)) : 0.0));
}

TEST_CASE("invert of a singular block is not finite") {
  std::array<double, 9> block{1, 2, 3, 2, 4, 6, 3, 6, 9};
  invert<3>(block);
  CHECK(!std::all_of(block.begin(), block.end(), [](double value) { return std::isfinite(value); }));
}

TEST_CASE("invert gives equal bits in every lane and allocates nothing") {
  Random random(7);
  std::vector<std::array<double, 36>> samples;
  for (std::size_t k = 0; k < 2 * Pack::size + 1; ++k) samples.push_back(random_block<6>(random));
  check_value_lanes(
      [](auto block) {
        invert<6>(block);
        return block;
      },
      samples, 1e-12);
}

}  // namespace
}  // namespace linden::small_matrix_test

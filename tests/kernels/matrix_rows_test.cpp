#include "kernels/values/matrix_rows.hpp"

#include <catch2/catch.hpp>

#include "tests/kernels/rig.hpp"

namespace linden {
namespace {

reference::Matrix6<double> dense(const Rows6& a) {
  reference::Matrix6<double> m;
  for (int r = 0; r < 6; ++r) {
    for (int c = 0; c < 6; ++c) m(r, c) = a.r[r][c];
  }
  return m;
}

Rows6 random_rows(Random& random) {
  double numbers[36];
  for (double& number : numbers) number = random.uniform(-1, 1);
  return rows_of(numbers);
}

TEST_CASE("six rows turned over are six columns") {
  Random random(1);
  const Rows6 a = random_rows(random);
  CHECK(dense(turned_over(a)) == dense(a).transpose());
  CHECK(dense(turned_over(turned_over(a))) == dense(a));
}

TEST_CASE("rows mixed by a placement are Ad_{X^-1}^T times the matrix") {
  Random random(2);
  for (int sample = 0; sample < 20; ++sample) {
    const Placement<double> X = random_placement(random);
    double numbers[12];
    X.to(numbers);
    const Rows6 a = random_rows(random);
    const reference::Matrix6<double> Ad = reference::adjoint<double>(reference::inverse<double>(eigen(X)));
    CHECK(relative_error(dense(mixed(numbers, a)), Ad.transpose() * dense(a)) < 8 * kEpsilon);
  }
}

TEST_CASE("rows and the blocks of a Mat6 are the same matrix") {
  Random random(3);
  const Mat6<double> A = random_matrix6(random);
  double numbers[36], back[36];
  A.to(numbers);
  const Rows6 rows = rows_of(numbers);
  CHECK(dense(rows) == eigen(A));
  to_mat6(rows, back);
  for (int k = 0; k < 36; ++k) CHECK(back[k] == numbers[k]);
}

}  // namespace
}  // namespace linden

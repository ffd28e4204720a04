#include "kernels/values/matrix_rows.hpp"

#include <catch2/catch.hpp>

#include "tests/kernels/rig.hpp"

namespace linden::matrix_rows_test {
namespace {

// Rows in registers of every width, whatever this processor has.
template <int W>
reference::Matrix6<double> dense(const Rows6Of<W>& a) {
  reference::Matrix6<double> m;
  for (int r = 0; r < 6; ++r) {
    for (int c = 0; c < 6; ++c) m(r, c) = a.r[r][c];
  }
  return m;
}

template <int W>
Rows6Of<W> random_rows(Random& random) {
  double numbers[36];
  for (double& number : numbers) number = random.uniform(-1, 1);
  return rows_of<W>(numbers);
}

TEMPLATE_TEST_CASE_SIG("six rows turned over are six columns", "", ((int W), W), 2, 4, 8) {
  Random random(1);
  const Rows6Of<W> a = random_rows<W>(random);
  CHECK(dense(turned_over(a)) == dense(a).transpose());
  CHECK(dense(turned_over(turned_over(a))) == dense(a));
}

TEMPLATE_TEST_CASE_SIG("a number of a row is spread over it, and six are stored", "", ((int W), W), 2, 4, 8) {
  Random random(4);
  const Rows6Of<W> a = random_rows<W>(random);
  double stored[7] = {0, 0, 0, 0, 0, 0, 7};
  store_row6(stored, a.r[1]);
  CHECK(stored[6] == 7);
  const RowOf<W> third = spread<2>(a.r[1]), sixth = spread<5>(a.r[1]);
  for (int k = 0; k < 6; ++k) {
    CHECK(stored[k] == a.r[1][k]);
    CHECK(third[k] == a.r[1][2]);
    CHECK(sixth[k] == a.r[1][5]);
  }
}

TEMPLATE_TEST_CASE_SIG("rows mixed by a placement are Ad_{X^-1}^T times the matrix", "", ((int W), W), 2, 4, 8) {
  Random random(2);
  for (int sample = 0; sample < 20; ++sample) {
    const Placement<double> X = random_placement(random);
    double numbers[12];
    X.to(numbers);
    const Rows6Of<W> a = random_rows<W>(random);
    const reference::Matrix6<double> Ad = reference::adjoint<double>(reference::inverse<double>(eigen(X)));
    CHECK(relative_error(dense(mixed(numbers, a)), Ad.transpose() * dense(a)) < 8 * kEpsilon);
  }
}

TEMPLATE_TEST_CASE_SIG("rows and the blocks of a Mat6 are the same matrix", "", ((int W), W), 2, 4, 8) {
  Random random(3);
  const Mat6<double> A = random_matrix6(random);
  double numbers[36], back[36];
  A.to(numbers);
  const Rows6Of<W> rows = rows_of<W>(numbers);
  CHECK(dense(rows) == eigen(A));
  to_mat6(rows, back);
  for (int k = 0; k < 36; ++k) CHECK(back[k] == numbers[k]);
}

}  // namespace
}  // namespace linden::matrix_rows_test

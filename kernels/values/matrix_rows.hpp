// kernels/values/matrix_rows.hpp
// A 6 x 6 matrix as six rows (or six columns) of eight numbers, of which the last two do not count: one matrix in the lanes of six
// registers, where one tree leaves no instances to fill them.
//
// What acts on a matrix from the left mixes its rows, what acts from the right its columns. Held by rows, a left factor is additions of
// whole rows; turned over, a right factor is. Ad_{X^-1}^T A Ad_{X'^-1} is therefore: mix, turn over, mix.
//
// Compilers spread eight numbers over as many registers as the processor needs: one with AVX-512, two with AVX2, four with SSE2.
#pragma once

#include <cstring>

#include "kernels/values/spatial.hpp"

namespace linden {

using Row8 = double __attribute__((vector_size(64)));

struct Rows6 {
  Row8 r[6];
};

/// Room for a Rows6 in memory.
inline constexpr int kRowNumbers = 48;

LINDEN_INLINE Row8 load_row8(const double* from) {
  Row8 row;
  std::memcpy(&row, from, sizeof row);
  return row;
}
LINDEN_INLINE void store_row8(double* to, const Row8& row) { std::memcpy(to, &row, sizeof row); }
/// The same number in every lane.
LINDEN_INLINE Row8 spread(double x) { return x - Row8{}; }
/// The six numbers that count.
LINDEN_INLINE void store_row6(double* to, const Row8& row) { std::memcpy(to, &row, 6 * sizeof(double)); }

/// Rows become columns.
LINDEN_INLINE Rows6 turned_over(const Rows6& a) {
  const auto low = [](const Row8& x, const Row8& y) LINDEN_INLINE_LAMBDA { return __builtin_shufflevector(x, y, 0, 8, 2, 10, 4, 12, 6, 14); };
  const auto high = [](const Row8& x, const Row8& y) LINDEN_INLINE_LAMBDA { return __builtin_shufflevector(x, y, 1, 9, 3, 11, 5, 13, 7, 15); };
  const Row8 low01 = low(a.r[0], a.r[1]), low23 = low(a.r[2], a.r[3]), low45 = low(a.r[4], a.r[5]);
  const Row8 high01 = high(a.r[0], a.r[1]), high23 = high(a.r[2], a.r[3]), high45 = high(a.r[4], a.r[5]);
  const auto first = [](const Row8& x, const Row8& y, const Row8& z) LINDEN_INLINE_LAMBDA {
    return __builtin_shufflevector(__builtin_shufflevector(x, y, 0, 1, 8, 9, 0, 0, 0, 0), z, 0, 1, 2, 3, 8, 9, 6, 7);
  };
  const auto second = [](const Row8& x, const Row8& y, const Row8& z) LINDEN_INLINE_LAMBDA {
    return __builtin_shufflevector(__builtin_shufflevector(x, y, 2, 3, 10, 11, 0, 0, 0, 0), z, 0, 1, 2, 3, 10, 11, 6, 7);
  };
  const auto third = [](const Row8& x, const Row8& y, const Row8& z) LINDEN_INLINE_LAMBDA {
    return __builtin_shufflevector(__builtin_shufflevector(x, y, 4, 5, 12, 13, 0, 0, 0, 0), z, 0, 1, 2, 3, 12, 13, 6, 7);
  };
  return {{first(low01, low23, low45), first(high01, high23, high45), second(low01, low23, low45), second(high01, high23, high45),
           third(low01, low23, low45), third(high01, high23, high45)}};
}

/// Ad_{X^-1}^T applied to columns of wrenches (n; f), X as it lies in a row of placements: n' = R n + p x f', f' = R f.
LINDEN_INLINE Rows6 mixed(const double* X, const Rows6& a) {
  const double* p = X + 9;
  Rows6 b;
  for (int k = 0; k < 3; ++k) b.r[3 + k] = X[3 * k] * a.r[3] + X[3 * k + 1] * a.r[4] + X[3 * k + 2] * a.r[5];
  for (int k = 0; k < 3; ++k) {
    const int k1 = (k + 1) % 3, k2 = (k + 2) % 3;
    b.r[k] = (X[3 * k] * a.r[0] + X[3 * k + 1] * a.r[1] + X[3 * k + 2] * a.r[2]) + (p[k1] * b.r[3 + k2] - p[k2] * b.r[3 + k1]);
  }
  return b;
}

/// From and to the order of a Mat6 in memory.
LINDEN_INLINE Rows6 rows_of(const double* mat6) {
  Rows6 a;
  for (int k = 0; k < 6; ++k) {
    const double* row = mat6 + 18 * (k / 3) + 3 * (k % 3);
    a.r[k] = Row8{row[0], row[1], row[2], row[9], row[10], row[11], 0, 0};
  }
  return a;
}
LINDEN_INLINE void to_mat6(const Rows6& a, double* mat6) {
  for (int k = 0; k < 6; ++k) {
    double* row = mat6 + 18 * (k / 3) + 3 * (k % 3);
    for (int c = 0; c < 3; ++c) {
      row[c] = a.r[k][c];
      row[9 + c] = a.r[k][3 + c];
    }
  }
}

}  // namespace linden

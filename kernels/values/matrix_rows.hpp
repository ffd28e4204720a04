// kernels/values/matrix_rows.hpp
// A 6 x 6 matrix as six rows (or six columns) of eight numbers, of which the last two do not count: one matrix in the lanes of six
// registers, where one tree leaves no instances to fill them.
//
// What acts on a matrix from the left mixes its rows, what acts from the right its columns. Held by rows, a left factor is additions of
// whole rows; turned over, a right factor is. Ad_{X^-1}^T A Ad_{X'^-1} is therefore: mix, turn over, mix.
//
// A row is as many registers as it takes: one with AVX-512, two with AVX2, three with SSE2. Left to itself GCC 12 keeps rows of eight numbers
// in memory where no register holds them, at five times the cost of a step.
#pragma once

#include <cstring>

#include "kernels/values/spatial.hpp"

namespace linden {

#if defined(__AVX512F__)
inline constexpr int kRowPart = 8;
#elif defined(__AVX__)
inline constexpr int kRowPart = 4;
#else
inline constexpr int kRowPart = 2;
#endif
using RowPart = double __attribute__((vector_size(sizeof(double) * kRowPart)));

/// Eight numbers in memory, of which six count.
struct Row8 {
  static constexpr int kParts = (6 + kRowPart - 1) / kRowPart;
  RowPart part[kParts];

  double operator[](int k) const { return part[k / kRowPart][k % kRowPart]; }
};

/// Part by part.
template <class Action>
LINDEN_INLINE Row8 row_of(const Action& action) {
  Row8 row;
  for (int p = 0; p < Row8::kParts; ++p) row.part[p] = action(p);
  return row;
}
LINDEN_INLINE Row8 operator+(const Row8& a, const Row8& b) {
  return row_of([&](int p) LINDEN_INLINE_LAMBDA { return a.part[p] + b.part[p]; });
}
LINDEN_INLINE Row8 operator-(const Row8& a, const Row8& b) {
  return row_of([&](int p) LINDEN_INLINE_LAMBDA { return a.part[p] - b.part[p]; });
}
LINDEN_INLINE Row8 operator*(const Row8& a, const Row8& b) {
  return row_of([&](int p) LINDEN_INLINE_LAMBDA { return a.part[p] * b.part[p]; });
}
LINDEN_INLINE Row8 operator*(double a, const Row8& b) {
  return row_of([&](int p) LINDEN_INLINE_LAMBDA { return a * b.part[p]; });
}
LINDEN_INLINE Row8 operator/(double a, const Row8& b) {
  return row_of([&](int p) LINDEN_INLINE_LAMBDA { return a / b.part[p]; });
}
LINDEN_INLINE Row8& operator+=(Row8& a, const Row8& b) { return a = a + b; }

struct Rows6 {
  Row8 r[6];
};

/// Room for a Rows6 in memory.
inline constexpr int kRowNumbers = 48;

LINDEN_INLINE Row8 load_row8(const double* from) {
  Row8 row;
  std::memcpy(row.part, from, sizeof row);
  return row;
}
LINDEN_INLINE void store_row8(double* to, const Row8& row) { std::memcpy(to, row.part, sizeof row); }
/// The same number in every lane.
LINDEN_INLINE Row8 spread(double x) {
  return row_of([&](int) LINDEN_INLINE_LAMBDA { return x - RowPart{}; });
}
/// Number `at` of a part in all of it. A template, like what follows, as only the shuffles of its own length compile.
template <int at, class Part>
LINDEN_INLINE Part spread_part(const Part& from) {
  constexpr auto length = sizeof(Part) / sizeof(double);
  if constexpr (length == 8) {
    return __builtin_shufflevector(from, from, at, at, at, at, at, at, at, at);
  } else if constexpr (length == 4) {
    return __builtin_shufflevector(from, from, at, at, at, at);
  } else {
    return __builtin_shufflevector(from, from, at, at);
  }
}
/// Number k of the row in every lane.
template <int k>
LINDEN_INLINE Row8 spread(const Row8& row) {
  const RowPart all = spread_part<k % kRowPart>(row.part[k / kRowPart]);
  return row_of([&](int) LINDEN_INLINE_LAMBDA { return all; });
}
/// The six numbers that count.
LINDEN_INLINE void store_row6(double* to, const Row8& row) { std::memcpy(to, row.part, 6 * sizeof(double)); }

/// Rows become columns.
template <class P = RowPart>
LINDEN_INLINE Rows6 turned_over(const Rows6& a) {
  constexpr auto length = sizeof(P) / sizeof(double);
  Rows6 b;
  if constexpr (length == 8) {
    const auto low = [](P x, P y) LINDEN_INLINE_LAMBDA { return __builtin_shufflevector(x, y, 0, 8, 2, 10, 4, 12, 6, 14); };
    const auto high = [](P x, P y) LINDEN_INLINE_LAMBDA { return __builtin_shufflevector(x, y, 1, 9, 3, 11, 5, 13, 7, 15); };
    const P low01 = low(a.r[0].part[0], a.r[1].part[0]), low23 = low(a.r[2].part[0], a.r[3].part[0]), low45 = low(a.r[4].part[0], a.r[5].part[0]);
    const P high01 = high(a.r[0].part[0], a.r[1].part[0]), high23 = high(a.r[2].part[0], a.r[3].part[0]),
            high45 = high(a.r[4].part[0], a.r[5].part[0]);
    const auto first = [](P x, P y, P z) LINDEN_INLINE_LAMBDA {
      return __builtin_shufflevector(__builtin_shufflevector(x, y, 0, 1, 8, 9, 0, 0, 0, 0), z, 0, 1, 2, 3, 8, 9, 6, 7);
    };
    const auto second = [](P x, P y, P z) LINDEN_INLINE_LAMBDA {
      return __builtin_shufflevector(__builtin_shufflevector(x, y, 2, 3, 10, 11, 0, 0, 0, 0), z, 0, 1, 2, 3, 10, 11, 6, 7);
    };
    const auto third = [](P x, P y, P z) LINDEN_INLINE_LAMBDA {
      return __builtin_shufflevector(__builtin_shufflevector(x, y, 4, 5, 12, 13, 0, 0, 0, 0), z, 0, 1, 2, 3, 12, 13, 6, 7);
    };
    b.r[0].part[0] = first(low01, low23, low45);
    b.r[1].part[0] = first(high01, high23, high45);
    b.r[2].part[0] = second(low01, low23, low45);
    b.r[3].part[0] = second(high01, high23, high45);
    b.r[4].part[0] = third(low01, low23, low45);
    b.r[5].part[0] = third(high01, high23, high45);
  } else if constexpr (length == 4) {
    const auto low = [](P x, P y) LINDEN_INLINE_LAMBDA { return __builtin_shufflevector(x, y, 0, 4, 2, 6); };
    const auto high = [](P x, P y) LINDEN_INLINE_LAMBDA { return __builtin_shufflevector(x, y, 1, 5, 3, 7); };
    const auto front = [](P x, P y) LINDEN_INLINE_LAMBDA { return __builtin_shufflevector(x, y, 0, 1, 4, 5); };
    const auto back = [](P x, P y) LINDEN_INLINE_LAMBDA { return __builtin_shufflevector(x, y, 2, 3, 6, 7); };
    for (int half = 0; half < 2; ++half) {  // columns 0 to 3, then 4 and 5
      P lows[3], highs[3];
      for (int k = 0; k < 3; ++k) {
        lows[k] = low(a.r[2 * k].part[half], a.r[2 * k + 1].part[half]);
        highs[k] = high(a.r[2 * k].part[half], a.r[2 * k + 1].part[half]);
      }
      b.r[4 * half] = {front(lows[0], lows[1]), lows[2]};
      b.r[4 * half + 1] = {front(highs[0], highs[1]), highs[2]};
      if (half == 1) break;
      b.r[2] = {back(lows[0], lows[1]), back(lows[2], lows[2])};
      b.r[3] = {back(highs[0], highs[1]), back(highs[2], highs[2])};
    }
  } else {
    for (int k = 0; k < 3; ++k) {
      for (int p = 0; p < 3; ++p) {
        const P x = a.r[2 * p].part[k], y = a.r[2 * p + 1].part[k];
        b.r[2 * k].part[p] = __builtin_shufflevector(x, y, 0, 2);
        b.r[2 * k + 1].part[p] = __builtin_shufflevector(x, y, 1, 3);
      }
    }
  }
  return b;
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
    const double numbers[8] = {row[0], row[1], row[2], row[9], row[10], row[11], 0, 0};
    a.r[k] = load_row8(numbers);
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

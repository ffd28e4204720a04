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

/// Eight numbers in memory, of which six count; in registers of kWidth.
template <int kWidth>
struct RowOf {
  typedef double Part __attribute__((vector_size(sizeof(double) * kWidth)));  // GCC 12 forgets the width of `using`
  static constexpr int kParts = (6 + kWidth - 1) / kWidth;
  Part part[kParts];

  double operator[](int k) const { return part[k / kWidth][k % kWidth]; }
};
using Row8 = RowOf<kRowPart>;

/// Part by part.
template <int W, class Action>
LINDEN_INLINE RowOf<W> row_of(const Action& action) {
  RowOf<W> row;
  for (int p = 0; p < RowOf<W>::kParts; ++p) row.part[p] = action(p);
  return row;
}
template <int W>
LINDEN_INLINE RowOf<W> operator+(const RowOf<W>& a, const RowOf<W>& b) {
  return row_of<W>([&](int p) LINDEN_INLINE_LAMBDA { return a.part[p] + b.part[p]; });
}
template <int W>
LINDEN_INLINE RowOf<W> operator-(const RowOf<W>& a, const RowOf<W>& b) {
  return row_of<W>([&](int p) LINDEN_INLINE_LAMBDA { return a.part[p] - b.part[p]; });
}
template <int W>
LINDEN_INLINE RowOf<W> operator*(const RowOf<W>& a, const RowOf<W>& b) {
  return row_of<W>([&](int p) LINDEN_INLINE_LAMBDA { return a.part[p] * b.part[p]; });
}
template <int W>
LINDEN_INLINE RowOf<W> operator*(double a, const RowOf<W>& b) {
  return row_of<W>([&](int p) LINDEN_INLINE_LAMBDA { return a * b.part[p]; });
}
template <int W>
LINDEN_INLINE RowOf<W> operator/(double a, const RowOf<W>& b) {
  return row_of<W>([&](int p) LINDEN_INLINE_LAMBDA { return a / b.part[p]; });
}
template <int W>
LINDEN_INLINE RowOf<W>& operator+=(RowOf<W>& a, const RowOf<W>& b) {
  return a = a + b;
}

template <int kWidth>
struct Rows6Of {
  RowOf<kWidth> r[6];
};
using Rows6 = Rows6Of<kRowPart>;

/// Room for a Rows6 in memory.
inline constexpr int kRowNumbers = 48;

template <int W = kRowPart>
LINDEN_INLINE RowOf<W> load_row8(const double* from) {
  RowOf<W> row;
  std::memcpy(row.part, from, sizeof row);
  return row;
}
template <int W>
LINDEN_INLINE void store_row8(double* to, const RowOf<W>& row) { std::memcpy(to, row.part, sizeof row); }
/// The same number in every lane.
LINDEN_INLINE Row8 spread(double x) {
  return row_of<kRowPart>([&](int) LINDEN_INLINE_LAMBDA { return x - Row8::Part{}; });
}
/// Number k of the row in every lane.
template <int k, int W>
LINDEN_INLINE RowOf<W> spread(const RowOf<W>& row) {
  constexpr int at = k % W;
  const auto from = row.part[k / W];
  return row_of<W>([&](int) LINDEN_INLINE_LAMBDA {
    if constexpr (W == 8) {
      return __builtin_shufflevector(from, from, at, at, at, at, at, at, at, at);
    } else if constexpr (W == 4) {
      return __builtin_shufflevector(from, from, at, at, at, at);
    } else {
      return __builtin_shufflevector(from, from, at, at);
    }
  });
}
/// The six numbers that count.
template <int W>
LINDEN_INLINE void store_row6(double* to, const RowOf<W>& row) { std::memcpy(to, row.part, 6 * sizeof(double)); }

/// Rows become columns.
template <int W>
LINDEN_INLINE Rows6Of<W> turned_over(const Rows6Of<W>& a) {
  using P = typename RowOf<W>::Part;
  Rows6Of<W> b;
  if constexpr (W == 8) {
    const auto low = [](auto x, auto y) LINDEN_INLINE_LAMBDA { return __builtin_shufflevector(x, y, 0, 8, 2, 10, 4, 12, 6, 14); };
    const auto high = [](auto x, auto y) LINDEN_INLINE_LAMBDA { return __builtin_shufflevector(x, y, 1, 9, 3, 11, 5, 13, 7, 15); };
    const P low01 = low(a.r[0].part[0], a.r[1].part[0]), low23 = low(a.r[2].part[0], a.r[3].part[0]), low45 = low(a.r[4].part[0], a.r[5].part[0]);
    const P high01 = high(a.r[0].part[0], a.r[1].part[0]), high23 = high(a.r[2].part[0], a.r[3].part[0]),
            high45 = high(a.r[4].part[0], a.r[5].part[0]);
    const auto first = [](auto x, auto y, auto z) LINDEN_INLINE_LAMBDA {
      return __builtin_shufflevector(__builtin_shufflevector(x, y, 0, 1, 8, 9, 0, 0, 0, 0), z, 0, 1, 2, 3, 8, 9, 6, 7);
    };
    const auto second = [](auto x, auto y, auto z) LINDEN_INLINE_LAMBDA {
      return __builtin_shufflevector(__builtin_shufflevector(x, y, 2, 3, 10, 11, 0, 0, 0, 0), z, 0, 1, 2, 3, 10, 11, 6, 7);
    };
    const auto third = [](auto x, auto y, auto z) LINDEN_INLINE_LAMBDA {
      return __builtin_shufflevector(__builtin_shufflevector(x, y, 4, 5, 12, 13, 0, 0, 0, 0), z, 0, 1, 2, 3, 12, 13, 6, 7);
    };
    b.r[0].part[0] = first(low01, low23, low45);
    b.r[1].part[0] = first(high01, high23, high45);
    b.r[2].part[0] = second(low01, low23, low45);
    b.r[3].part[0] = second(high01, high23, high45);
    b.r[4].part[0] = third(low01, low23, low45);
    b.r[5].part[0] = third(high01, high23, high45);
  } else if constexpr (W == 4) {
    const auto low = [](auto x, auto y) LINDEN_INLINE_LAMBDA { return __builtin_shufflevector(x, y, 0, 4, 2, 6); };
    const auto high = [](auto x, auto y) LINDEN_INLINE_LAMBDA { return __builtin_shufflevector(x, y, 1, 5, 3, 7); };
    const auto front = [](auto x, auto y) LINDEN_INLINE_LAMBDA { return __builtin_shufflevector(x, y, 0, 1, 4, 5); };
    const auto back = [](auto x, auto y) LINDEN_INLINE_LAMBDA { return __builtin_shufflevector(x, y, 2, 3, 6, 7); };
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
template <int W>
LINDEN_INLINE Rows6Of<W> mixed(const double* X, const Rows6Of<W>& a) {
  const double* p = X + 9;
  Rows6Of<W> b;
  for (int k = 0; k < 3; ++k) b.r[3 + k] = X[3 * k] * a.r[3] + X[3 * k + 1] * a.r[4] + X[3 * k + 2] * a.r[5];
  for (int k = 0; k < 3; ++k) {
    const int k1 = (k + 1) % 3, k2 = (k + 2) % 3;
    b.r[k] = (X[3 * k] * a.r[0] + X[3 * k + 1] * a.r[1] + X[3 * k + 2] * a.r[2]) + (p[k1] * b.r[3 + k2] - p[k2] * b.r[3 + k1]);
  }
  return b;
}

/// From and to the order of a Mat6 in memory.
template <int W = kRowPart>
LINDEN_INLINE Rows6Of<W> rows_of(const double* mat6) {
  Rows6Of<W> a;
  for (int k = 0; k < 6; ++k) {
    const double* row = mat6 + 18 * (k / 3) + 3 * (k % 3);
    const double numbers[8] = {row[0], row[1], row[2], row[9], row[10], row[11], 0, 0};
    a.r[k] = load_row8<W>(numbers);
  }
  return a;
}
template <int W>
LINDEN_INLINE void to_mat6(const Rows6Of<W>& a, double* mat6) {
  for (int k = 0; k < 6; ++k) {
    double* row = mat6 + 18 * (k / 3) + 3 * (k % 3);
    for (int c = 0; c < 3; ++c) {
      row[c] = a.r[k][c];
      row[9 + c] = a.r[k][3 + c];
    }
  }
}

}  // namespace linden

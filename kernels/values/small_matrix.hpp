// kernels/values/small_matrix.hpp
// Inverse of the 3 x 3 and 6 x 6 blocks of ball and free joints.
//
// Gauss-Jordan without pivoting: the symmetric part of such a block is an inertia, hence positive definite, and elimination in any
// order is stable; a pivot search would branch. A singular block yields infinities or NaN, which the solver reports.
#pragma once

#include <array>
#include <cstddef>

#include "kernels/values/scalar.hpp"

namespace linden {

template <std::size_t N, class S>
LINDEN_INLINE void invert(std::array<S, N * N>& a) {
  for (std::size_t k = 0; k < N; ++k) {
    const S pivot = S(1.0) / a[k * N + k];
    a[k * N + k] = S(1.0);
    for (std::size_t j = 0; j < N; ++j) a[k * N + j] = pivot * a[k * N + j];
    for (std::size_t i = 0; i < N; ++i) {
      if (i == k) continue;
      const S factor = a[i * N + k];
      a[i * N + k] = S(0.0);
      for (std::size_t j = 0; j < N; ++j) a[i * N + j] = a[i * N + j] - factor * a[k * N + j];
    }
  }
}

}  // namespace linden

// layout/packed_history.hpp
// What an instance of a batch remembers of its last displacements: one number a degree of freedom, where a Simulation keeps five.
//
//   double   64 bits: delta as a float | first difference, 20 bits | second difference, 12 bits
//   float    32 bits:                    delta, 20 bits            | first difference, 12 bits
//
// 20 and 12 bits are a float's sign, exponent and first 11 or 3 digits. The first guess delta + difference (+ second difference) is off by
// some 1e-6 of delta where a motion is resolved by its step, 1e-3 in single precision: one correction is left to do, as it would be
// with all digits. A batch of a million humanoids stays under a gigabyte so.
//
// Rows are [word][lane]: W floats, then W words of differences; in single precision W words.
#pragma once

#include <bit>
#include <cstdint>

#include "layout/field.hpp"

namespace linden {

/// 32-bit words a degree of freedom and instance.
template <class Real>
inline constexpr int kHistoryWords = static_cast<int>(sizeof(Real) / sizeof(std::uint32_t));

/// A float's first 20 and another's first 12 bits, rounded.
constexpr std::uint32_t packed(float fine, float coarse) {
  const std::uint32_t high = (std::bit_cast<std::uint32_t>(fine) + 0x800u) & 0xFFFFF000u;
  const std::uint32_t low = (std::bit_cast<std::uint32_t>(coarse) + 0x80000u) >> 20;
  return high | low;
}
constexpr float fine_part(std::uint32_t word) { return std::bit_cast<float>(word & 0xFFFFF000u); }
constexpr float coarse_part(std::uint32_t word) { return std::bit_cast<float>(word << 20); }

/// The first guess for the next displacement, W lanes of one row.
template <int W, class Real>
[[gnu::always_inline]] inline void extrapolate(const std::uint32_t* past, Real* next) {
  for (int l = 0; l < W; ++l) {
    if constexpr (kHistoryWords<Real> == 2) {
      next[l] = static_cast<double>(std::bit_cast<float>(past[l])) + static_cast<double>(fine_part(past[W + l])) +
                static_cast<double>(coarse_part(past[W + l]));
    } else {
      next[l] = fine_part(past[l]) + coarse_part(past[l]);
    }
  }
}

/// One lane's displacement of the last step. past: word of that lane.
template <class Real>
[[gnu::always_inline]] inline Real remembered(const std::uint32_t* past) {
  if constexpr (kHistoryWords<Real> == 2) {
    return static_cast<double>(std::bit_cast<float>(past[0]));
  } else {
    return fine_part(past[0]);
  }
}

/// Takes up the displacement of a step in the lanes where `known` (how many displacements are known already, 0, 1, 2 or more) is not
/// negative.
template <int W, class Real>
[[gnu::always_inline]] inline void remember(const Real* delta, const std::int32_t* known, std::uint32_t* past) {
  for (int l = 0; l < W; ++l) {
    const float first_known = known[l] > 0 ? 1.0f : 0.0f;
    if constexpr (kHistoryWords<Real> == 2) {
      const float now = static_cast<float>(delta[l]);
      const float first = first_known * static_cast<float>(delta[l] - static_cast<double>(std::bit_cast<float>(past[l])));
      const float second = known[l] > 1 ? first - fine_part(past[W + l]) : 0.0f;
      const std::uint32_t word = packed(first, second);
      past[l] = known[l] < 0 ? past[l] : std::bit_cast<std::uint32_t>(now);
      past[W + l] = known[l] < 0 ? past[W + l] : word;
    } else {
      const std::uint32_t word = packed(delta[l], first_known * (delta[l] - fine_part(past[l])));
      past[l] = known[l] < 0 ? past[l] : word;
    }
  }
}

}  // namespace linden

// kernels/values/lanes_of.hpp
// A register of W instances, or one number, lane by lane.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#ifdef __SSE2__
#include <immintrin.h>
#endif

#include "kernels/values/scalar.hpp"

namespace linden {

/// One bit a lane.
using Lanes = std::uint32_t;

#ifdef __SSE2__
/// Sign bits of a register, which comparisons fill.
LINDEN_INLINE Lanes sign_bits(__m128d lanes) { return static_cast<Lanes>(_mm_movemask_pd(lanes)); }
LINDEN_INLINE Lanes sign_bits(__m128 lanes) { return static_cast<Lanes>(_mm_movemask_ps(lanes)); }
#endif
#ifdef __AVX__
LINDEN_INLINE Lanes sign_bits(__m256d lanes) { return static_cast<Lanes>(_mm256_movemask_pd(lanes)); }
LINDEN_INLINE Lanes sign_bits(__m256 lanes) { return static_cast<Lanes>(_mm256_movemask_ps(lanes)); }
#endif

template <class S>
struct LanesOf {
  static constexpr int count = 1;
  using Mask = bool;
  static S load(const S* from) { return *from; }
  static void store(const S& value, S* to) { *to = value; }
  static Lanes bits(bool mask) { return mask ? 1u : 0u; }
  static S lane(const S& value, int) { return value; }
  static void set_lane(S& value, int, double number) { value = static_cast<S>(number); }
  static bool mask(Lanes bits) { return bits != 0; }
};

template <class S>
  requires requires { typename S::arch_type; }
struct LanesOf<S> {
  static constexpr int count = static_cast<int>(S::size);
  using Real = typename S::value_type;
  using Mask = typename S::batch_bool_type;
  static S load(const Real* from) { return S::load_unaligned(from); }
  static void store(const S& value, Real* to) { value.store_unaligned(to); }
  static Lanes bits(const Mask& mask) {
    if constexpr (kMaskIsBits) {
      return static_cast<Lanes>(mask.data);
    } else if constexpr (requires { sign_bits(mask.data); }) {
      return sign_bits(mask.data);
    } else {
      std::array<bool, S::size> each;
      mask.store_unaligned(each.data());
      Lanes bits = 0;
      for (std::size_t l = 0; l < S::size; ++l) bits |= each[l] ? 1u << l : 0u;
      return bits;
    }
  }
  static Real lane(const S& value, int l) {
    std::array<Real, S::size> each;
    store(value, each.data());
    return each[static_cast<std::size_t>(l)];
  }
  static void set_lane(S& value, int l, double number) {
    std::array<Real, S::size> each;
    store(value, each.data());
    each[static_cast<std::size_t>(l)] = static_cast<Real>(number);
    value = load(each.data());
  }
  static Mask mask(Lanes bits) {
    if constexpr (kMaskIsBits) {
      return Mask(static_cast<typename Mask::register_type>(bits));
    } else {
      std::array<Real, S::size> each;
      for (std::size_t l = 0; l < S::size; ++l) each[l] = (bits >> l & 1u) != 0 ? Real(1) : Real(0);
      return S::load_unaligned(each.data()) > S(Real(0.5));
    }
  }

 private:
  static constexpr bool kMaskIsBits = sizeof(Mask) <= sizeof(Lanes);  // with AVX-512; else a register of numbers
};

}  // namespace linden

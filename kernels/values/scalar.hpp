// kernels/values/scalar.hpp
// What a Scalar is to the kernels: double, float, a pack of W of them (xsimd::batch), or in tests a number that carries its
// derivative. Anything with + - * /, comparisons, sqrt, min, abs, floor and a conversion from double.
//
// A comparison of packs is a mask: `select` takes from each lane what its own number calls for, `any` asks whether the work can be left
// out. What a lane computes never depends on the lanes beside it.
#pragma once

#include <type_traits>

/// On every function that works on values in registers: left to themselves compilers call them and pass 3 x 3 matrices through memory,
/// which costs a chain of 1,000 hinges a factor of two in time.
#define LINDEN_INLINE [[gnu::always_inline]] inline
#define LINDEN_INLINE_LAMBDA __attribute__((always_inline))  // behind a lambda's parameters

namespace linden {

/// The numbers a Scalar is made of.
template <class S>
struct ElementOf {
  using type = S;
};
template <class S>
  requires requires { typename S::arch_type; }
struct ElementOf<S> {
  using type = typename S::value_type;
};

/// A constant as a Scalar: rounded to float, spread over the lanes of a pack.
template <class S, class Constant>
LINDEN_INLINE S as(const Constant& constant) {
  if constexpr (std::is_arithmetic_v<Constant>) {
    return S(static_cast<typename ElementOf<S>::type>(constant));
  } else {
    return static_cast<S>(constant);
  }
}

template <class S>
LINDEN_INLINE S select(bool condition, const S& yes, const S& no) {
  return condition ? yes : no;
}
LINDEN_INLINE bool any(bool condition) { return condition; }

/// Whether a Scalar's numbers have single precision: shorter series do for them.
template <class S>
inline constexpr bool is_single = std::is_same_v<typename ElementOf<S>::type, float>;

}  // namespace linden

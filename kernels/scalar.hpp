// kernels/scalar.hpp
// What a Scalar is to the kernels: double, float, a pack of W of them (xsimd::batch), or in tests a number that carries its
// derivative. Anything with + - * /, sqrt, sin, cos, min and a conversion from double.
#pragma once

/// On every function that works on values in registers: left to themselves compilers call them and pass 3 x 3 matrices through memory,
/// which costs a chain of 1,000 hinges a factor of two in time.
#define LINDEN_INLINE [[gnu::always_inline]] inline

namespace linden {

/// A constant as a Scalar: rounded to float, spread over the lanes of a pack.
template <class S, class Constant>
LINDEN_INLINE S as(const Constant& constant) {
  return static_cast<S>(constant);
}

}  // namespace linden

// tests/reference/dual.hpp
// A number that carries its derivatives in N directions: forward differentiation, exact to rounding.
//
//   (a + a' e)(b + b' e) = a b + (a' b + a b') e,    f(a + a' e) = f(a) + f'(a) a' e
//
// A Scalar like any other: the kernels run on it, and so do Eigen's matrices. Comparisons look at the value alone.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstddef>

#include "kernels/values/sincos.hpp"

namespace linden::reference {

template <int N>
struct Dual {
  double value = 0;
  std::array<double, static_cast<std::size_t>(N)> slope{};

  Dual() = default;
  Dual(double constant) : value(constant) {}  // implicit: a plain number is a number that does not vary
  /// A variable that varies in one of the N directions.
  Dual(double at, int direction) : value(at) { slope[static_cast<std::size_t>(direction)] = 1; }

  /// f(x), given f and f' at x.
  [[gnu::noinline]] static Dual chain(double f, double derivative, const Dual& x) {
    Dual result(f);
    for (std::size_t k = 0; k < result.slope.size(); ++k) result.slope[k] = derivative * x.slope[k];
    return result;
  }

  [[gnu::noinline]] friend Dual operator+(const Dual& a, const Dual& b) {
    Dual result(a.value + b.value);
    for (std::size_t k = 0; k < result.slope.size(); ++k) result.slope[k] = a.slope[k] + b.slope[k];
    return result;
  }
  [[gnu::noinline]] friend Dual operator-(const Dual& a, const Dual& b) {
    Dual result(a.value - b.value);
    for (std::size_t k = 0; k < result.slope.size(); ++k) result.slope[k] = a.slope[k] - b.slope[k];
    return result;
  }
  [[gnu::noinline]] friend Dual operator*(const Dual& a, const Dual& b) {
    Dual result(a.value * b.value);
    for (std::size_t k = 0; k < result.slope.size(); ++k) result.slope[k] = a.slope[k] * b.value + a.value * b.slope[k];
    return result;
  }
  [[gnu::noinline]] friend Dual operator/(const Dual& a, const Dual& b) {
    Dual result(a.value / b.value);
    for (std::size_t k = 0; k < result.slope.size(); ++k) {
      result.slope[k] = (a.slope[k] - result.value * b.slope[k]) / b.value;
    }
    return result;
  }
  friend Dual operator-(const Dual& a) { return chain(-a.value, -1, a); }
  friend Dual operator+(const Dual& a) { return a; }
  Dual& operator+=(const Dual& b) { return *this = *this + b; }
  Dual& operator-=(const Dual& b) { return *this = *this - b; }
  Dual& operator*=(const Dual& b) { return *this = *this * b; }
  Dual& operator/=(const Dual& b) { return *this = *this / b; }

  friend bool operator<(const Dual& a, const Dual& b) { return a.value < b.value; }
  friend bool operator>(const Dual& a, const Dual& b) { return a.value > b.value; }
  friend bool operator<=(const Dual& a, const Dual& b) { return a.value <= b.value; }
  friend bool operator>=(const Dual& a, const Dual& b) { return a.value >= b.value; }
  friend bool operator==(const Dual& a, const Dual& b) { return a.value == b.value; }
  friend bool operator!=(const Dual& a, const Dual& b) { return a.value != b.value; }

  friend Dual min(const Dual& a, const Dual& b) { return b.value < a.value ? b : a; }
  friend Dual max(const Dual& a, const Dual& b) { return a.value < b.value ? b : a; }
  friend Dual abs(const Dual& a) { return a.value < 0 ? -a : a; }
  friend Dual sqrt(const Dual& a) {
    const double root = std::sqrt(a.value);
    return chain(root, 0.5 / root, a);
  }
  friend Dual sin(const Dual& a) { return chain(std::sin(a.value), std::cos(a.value), a); }
  friend Dual cos(const Dual& a) { return chain(std::cos(a.value), -std::sin(a.value), a); }
  friend SinCos<Dual> sin_cos(const Dual& a) { return {sin(a), cos(a)}; }
  friend Dual atan(const Dual& a) { return chain(std::atan(a.value), 1 / (1 + a.value * a.value), a); }
  friend Dual atan2(const Dual& y, const Dual& x) {
    const double square = x.value * x.value + y.value * y.value;
    Dual result(std::atan2(y.value, x.value));
    for (std::size_t k = 0; k < result.slope.size(); ++k) {
      result.slope[k] = (x.value * y.slope[k] - y.value * x.slope[k]) / square;
    }
    return result;
  }
};

/// Zero, and not about to change.
inline bool vanishes(double x) { return x == 0; }
inline bool vanishes(long double x) { return x == 0; }
template <int N>
bool vanishes(const Dual<N>& x) {
  return x.value == 0 && x.slope == std::array<double, static_cast<std::size_t>(N)>{};
}

}  // namespace linden::reference

namespace Eigen {

template <int N>
struct NumTraits<linden::reference::Dual<N>> : NumTraits<double> {
  using Real = linden::reference::Dual<N>;
  using NonInteger = linden::reference::Dual<N>;
  using Nested = linden::reference::Dual<N>;
  using Literal = linden::reference::Dual<N>;
  enum {
    IsComplex = 0,
    IsInteger = 0,
    IsSigned = 1,
    RequireInitialization = 1,
    ReadCost = 1,
    AddCost = N + 1,
    MulCost = 3 * N
  };
};

}  // namespace Eigen

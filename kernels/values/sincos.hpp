// kernels/values/sincos.hpp
// Sine and cosine together, for any number of lanes at once: the same operations for every angle, so a lane's result does not depend on
// its neighbours (those of the usual vector libraries do: they take a short cut where all lanes are small).
//
//   n = round(2 x / pi),  r = x - n pi/2 with pi/2 in three parts,  polynomials on [-pi/4, pi/4],  quadrant n mod 4
//
// range   below 2^20 turns exact to 1.5 epsilon; beyond, as exact as x itself is
// source  Cody and Waite, Software Manual for the Elementary Functions
#pragma once

#include <cmath>

#include "kernels/values/polynomial.hpp"

namespace linden {

template <class S>
struct SinCos {
  S sin, cos;
};

template <class S>
LINDEN_INLINE SinCos<S> sin_cos(const S& x) {
  using std::floor;
  const S n = floor(as<S>(0.63661977236758134308) * x + S(0.5));
  S r;
  if constexpr (is_single<S>) {
    // 11, 11 and 24 bits of pi/2: n times the first two is exact below 2^13 quarter turns
    r = ((x - n * as<S>(1.5703125)) - n * as<S>(4.837512969970703125e-4)) - n * as<S>(7.54978995489188e-8);
  } else {
    // 33, 33 and 53 bits
    r = ((x - n * as<S>(1.57079632673412561417)) - n * as<S>(6.07710050630396597660e-11)) - n * as<S>(2.02226624879595063154e-21);
  }
  const S rr = r * r;
  S sine, versine;  // sin r, (1 - cos r) / r^2
  if constexpr (is_single<S>) {
    sine = r * polynomial(rr, std::array{0.99999999691770355501, -0.16666650673996773426, 0.0083320357855973083665, -1.9503904250840798846e-4});
    versine = polynomial(rr, std::array{0.49999999969119310597, -0.041666650644517032888, 0.0013887589155600575, -2.4463788293265744293e-5});
  } else {
    sine = r * polynomial(rr, std::array{1.0, -0.1666666666666666663, 0.0083333333333333207182, -1.9841269841253478229e-4,
                                         2.7557319213562224107e-6, -2.5052104779095043735e-8, 1.6058352428871255339e-10,
                                         -7.5780901609226864184e-13});
    versine = polynomial(rr, std::array{0.5, -0.041666666666666646, 0.0013888888888888881875, -2.4801587301578204651e-5,
                                        2.7557319218191050045e-7, -2.0876754983065436486e-9, 1.1470361263661414216e-11,
                                        -4.7410866985075199656e-14});
  }
  const S cosine = S(1.0) - rr * versine;
  const S half = S(0.5) * n, quadrant = half - floor(half);                // 0 or 1/2: even or odd
  const S quarter = S(0.25) * n, turn = quarter - floor(quarter);          // 0, 1/4, 1/2, 3/4
  const auto odd = quadrant > S(0.25);
  const S s = select(odd, cosine, sine), c = select(odd, sine, cosine);
  const auto lower = turn > S(0.375);                                      // quadrants 2 and 3
  const auto left = (turn > S(0.125)) == (turn > S(0.625));                // not quadrants 1 and 2
  return {select(lower, -s, s), select(left, c, -c)};
}

}  // namespace linden

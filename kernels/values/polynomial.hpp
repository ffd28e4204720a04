// kernels/values/polynomial.hpp
// The even functions behind exp, log and dlog, as polynomials of the squared angle.
//
// Each is analytic at zero and needs no mask, no branch and no division by a small angle: relative error below 2^-56 of the
// function over the stated range, so a few epsilon after rounding. Coefficients: interpolation at Chebyshev nodes with 50 digits.
//
// `small_...` are for the turns a body makes in a step as a rule, theta <= kSmallTurn: a third of the terms, and of those half for
// single precision. Whoever uses them puts the long series in where `any` lane turns further.
#pragma once

#include <array>
#include <cstddef>

#include "kernels/values/scalar.hpp"

namespace linden {

/// c0 + c1 x + c2 x^2 + ..., even and odd powers apart: half the latency of Horner's rule.
template <class S, std::size_t N>
LINDEN_INLINE S polynomial(const S& x, const std::array<double, N>& c) {
  const S xx = x * x;
  constexpr std::size_t last_even = (N - 1) / 2 * 2, last_odd = N / 2 * 2 - 1;
  S even = as<S>(c[last_even]);
  for (std::size_t i = last_even; i >= 2; i -= 2) even = even * xx + as<S>(c[i - 2]);
  S odd = as<S>(c[last_odd]);
  for (std::size_t i = last_odd; i >= 3; i -= 2) odd = odd * xx + as<S>(c[i - 2]);
  return even + odd * x;
}

/// 1/4 rad a step: 250 rad/s at a millisecond.
inline constexpr double kSmallTurn = 0.25;
inline constexpr double kSmallTurnCosine = 0.99219766722932905;  // cos(kSmallTurn / 2): w of such a turn's quaternion

/// theta / sin(theta/2) = 2 asin(s) / s as a function of s^2 = sin(theta/2)^2, theta <= kSmallTurn.
template <class S>
LINDEN_INLINE S small_angle_over_sine(const S& ss) {
  if constexpr (is_single<S>) {
    return polynomial(ss, std::array{2.00000001064702396, 0.333321011134839726, 0.152106824126246700});
  } else {
    return polynomial(ss, std::array{2.00000000000000000, 0.333333333333328403, 0.150000000005071171, 0.0892857123308336825,
                                     0.0607642473736170339, 0.0447106366827856210, 0.0362674437741006191});
  }
}

/// alpha, for x = theta^2, theta <= kSmallTurn.
template <class S>
LINDEN_INLINE S small_alpha(const S& x) {
  if constexpr (is_single<S>) {
    return polynomial(x, std::array{8.33333171612022321e-2, 1.39095851736018682e-3});
  } else {
    return polynomial(x, std::array{8.33333333333333343e-2, 1.38888888888809838e-3, 3.30687831699508360e-5, 8.26715046068846880e-7,
                                    2.09595352815819417e-8});
  }
}

/// d alpha / dx, theta <= kSmallTurn; relative error 2e-13, enough for what it is multiplied by.
template <class S>
LINDEN_INLINE S small_alpha_slope(const S& x) {
  if constexpr (is_single<S>) {
    return polynomial(x, std::array{1.38888888888857273e-3, 6.61375662994313785e-5});
  } else {
    return polynomial(x, std::array{1.38888888888857273e-3, 6.61375662994313785e-5, 2.48014578508955853e-6, 8.38381542678687928e-8});
  }
}

/// atan(t) / t as a function of t^2 in [0, 1].
template <class S>
LINDEN_INLINE S atan_over_t(const S& tt) {
  static constexpr std::array<double, 21> c{
      9.99999999999999994619e-1, -3.33333333333328582407e-1, 1.99999999999299471689e-1,  -1.42857142815926923885e-1,
      1.11111109820871252539e-1, -9.09090660565689876233e-2, 7.69227555520562998625e-2,  -6.66637118772109809486e-2,
      5.88034200240154313529e-2, -5.25272555732257478349e-2, 4.71972399232111232664e-2,  -4.21257239638553240365e-2,
      3.6510813527210350853e-2,  -2.97007177362342316028e-2, 2.17402138307581331583e-2,  -1.36741392883994782789e-2,
      7.03864620298981318847e-3, -2.80476555317013145935e-3, 8.03360418162602640991e-4,  -1.46170881636250127658e-4,
      1.26311784304774257171e-5};
  return polynomial(tt, c);
}

/// sin(a) / a as a function of a^2 in [0, (pi/2)^2].
template <class S>
LINDEN_INLINE S sinc(const S& aa) {
  static constexpr std::array<double, 9> c{
      9.99999999999999999793e-1, -1.66666666666666653072e-1, 8.33333333333318638401e-3,
      -1.984126984120867517e-4,  2.7557319211229606622e-6,   -2.50521068905695195395e-8,
      1.60589408784865599308e-10, -7.64302655797163266348e-13, 2.72157494229834428263e-15};
  return polynomial(aa, c);
}

/// (1 - cos(a)) / a^2 as a function of a^2 in [0, (pi/2)^2].
template <class S>
LINDEN_INLINE S versine_over_square(const S& aa) {
  static constexpr std::array<double, 9> c{
      4.9999999999999999999e-1,  -4.16666666666666659853e-2, 1.38888888888888152386e-3,
      -2.48015873015566464287e-5, 2.75573192175930449263e-7, -2.08767562387702246535e-9,
      1.14706940108749790584e-11, -4.77740488969535420422e-14, 1.51691669672611241948e-16};
  return polynomial(aa, c);
}

/// (theta - sin theta) / theta^3 as a function of theta^2 in [0, pi^2].
template <class S>
LINDEN_INLINE S exp_second(const S& xx) {
  static constexpr std::array<double, 10> c{
      1.66666666666666666071e-1,  -8.33333333333332125644e-3, 1.98412698412658015405e-4, -2.75573192234615564851e-6,
      2.50521083508661628689e-8,  -1.60590425264616962398e-10, 7.64713347081763932016e-13, -2.81102403060576201101e-15,
      8.18303436606220098219e-18, -1.77516505561240591902e-20};
  return polynomial(xx, c);
}

/// alpha(x) = (1 - (theta/2) cot(theta/2)) / theta^2 with x = theta^2 in [0, pi^2]: 1/12 at zero.
template <class S>
LINDEN_INLINE S alpha(const S& x) {
  static constexpr std::array<double, 15> c{
      8.33333333333333340368e-2,  1.38888888888885683024e-3,  3.3068783069024925345e-5,   8.2671957600119219044e-7,
      2.08767581022563229e-8,     5.28417976151346136734e-10, 1.3383164807589782143e-11,  3.38708456605504435503e-13,
      8.66136429555911909548e-15, 2.01934942161758134148e-16, 7.79650339505252682621e-18, -9.65449908244833799219e-20,
      2.00062339425060584826e-20, -6.27155229986024639717e-22, 1.81554600773240263081e-23};
  return polynomial(x, c);
}

/// d alpha / dx
template <class S>
LINDEN_INLINE S alpha_slope(const S& x) {
  static constexpr std::array<double, 17> c{
      1.38888888888888889078e-3,  6.61375661375660266353e-5,  2.48015873015980670802e-6,  8.35070279473447086485e-8,
      2.64209507765650258851e-9,  8.02952090507157833564e-11, 2.37278433106330340946e-12, 6.86839838063296002645e-14,
      1.95917832079719710677e-15, 5.45666668971930607948e-17, 1.64777734876760983666e-18, 2.4407901443401152415e-20,
      3.27640850407535543778e-21, -1.46362864177936892195e-22, 1.11976191236182225847e-23, -3.54847704269771388099e-25,
      7.6435676461956256467e-27};
  return polynomial(x, c);
}

/// d^2 alpha / dx^2
template <class S>
LINDEN_INLINE S alpha_curvature(const S& x) {
  static constexpr std::array<double, 18> c{
      6.61375661375661374826e-5,  4.96031746031746579737e-6,  2.50521083854357534188e-7,  1.0568380277631876899e-8,
      4.01476095338241862892e-10, 1.42366580459409855793e-11, 4.8081874682968744246e-13,  1.56595157978042146091e-14,
      4.95599492306964730967e-16, 1.54210525924214012322e-17, 4.48600477704569507412e-19, 1.73900819314894335335e-20,
      -7.68088256247091145979e-23, 6.40926659309373522047e-23, -3.65992865626923811385e-24, 2.23974471478000596804e-25,
      -6.93281018473128651157e-27, 1.3094378453169390417e-28};
  return polynomial(x, c);
}

}  // namespace linden

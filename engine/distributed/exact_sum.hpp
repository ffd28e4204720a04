// engine/distributed/exact_sum.hpp
// A sum of doubles without rounding, so that it does not depend on their order or on who adds which: a number of 2,176 binary digits in
// integers, to be added up over ranks (Ranks::sum), rounded once in the end.
//
//   sum = sum_k limbs[k] 2^(32 k - 1074)
//
// A double of 53 digits lies across up to three limbs. Each limb has 64 digits, 32 of them for carries: 2^30 doubles may be added between two
// calls of carry().
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace linden {

class ExactSum {
 public:
  /// A number that is not finite makes the sum NaN.
  void add(double number);
  /// To be added up over ranks, element by element; at most 2^30 of them.
  std::span<std::int64_t> limbs();
  /// The double nearest to the sum, ties to even.
  double value() const;

 private:
  static constexpr int kLimbs = 68;  // 2^-1074 .. 2^1024, and 2^78 as many
  void carry();

  std::array<std::int64_t, kLimbs + 1> limbs_{};  // the last counts what was not finite
  std::int64_t room_ = 0;  // numbers added since the last carry
};

}  // namespace linden

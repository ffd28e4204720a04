#include "engine/distributed/exact_sum.hpp"

#include <bit>
#include <cmath>
#include <limits>

namespace linden {
namespace {

constexpr std::uint64_t kLow = 0xffffffff;  // of a limb, without what is carried
constexpr int kLimbBits = 32, kLeastExponent = -1074;

}  // namespace

void ExactSum::add(double number) {
  if (!std::isfinite(number)) {
    limbs_[kLimbs] += 1;
    return;
  }
  if (number == 0) return;
  if (++room_ >= std::int64_t{1} << 28) carry();
  int exponent = 0;
  const auto mantissa = static_cast<std::uint64_t>(std::ldexp(std::frexp(std::abs(number), &exponent), 53));
  // of numbers below 2^-1022 the last digits are zeros, which lie below the first limb
  int place = exponent - 53 - kLeastExponent;
  const std::uint64_t digits = place < 0 ? mantissa >> -place : mantissa;
  place = place < 0 ? 0 : place;
  const int shift = place % kLimbBits;
  const std::uint64_t low = (digits & kLow) << shift, high = (digits >> kLimbBits) << shift;
  const std::uint64_t parts[] = {low & kLow, (low >> kLimbBits) + (high & kLow), high >> kLimbBits};
  std::int64_t* limb = limbs_.data() + place / kLimbBits;
  for (const std::uint64_t part : parts) *limb++ += number < 0 ? -static_cast<std::int64_t>(part) : static_cast<std::int64_t>(part);
}

void ExactSum::carry() {
  for (int k = 0; k + 1 < kLimbs; ++k) {
    const auto at = static_cast<std::size_t>(k);
    const std::int64_t over = limbs_[at] >> kLimbBits;  // towards minus infinity: what stays is never negative
    limbs_[at] -= over * (std::int64_t{1} << kLimbBits);
    limbs_[at + 1] += over;
  }
  room_ = 0;
}

std::span<std::int64_t> ExactSum::limbs() {
  carry();
  return limbs_;
}

double ExactSum::value() const {
  if (limbs_[kLimbs] != 0) return std::numeric_limits<double>::quiet_NaN();
  ExactSum size = *this;
  size.carry();
  const bool negative = size.limbs_[kLimbs - 1] < 0;
  if (negative) {
    for (std::int64_t& limb : size.limbs_) limb = -limb;
    size.carry();
  }
  int top = kLimbs - 1;
  while (top > 0 && size.limbs_[static_cast<std::size_t>(top)] == 0) --top;
  const auto limb = [&](int k) { return k < 0 ? std::uint64_t{0} : static_cast<std::uint64_t>(size.limbs_[static_cast<std::size_t>(k)]); };
  // the first 64 digits, and whether there is anything behind them
  std::uint64_t digits = limb(top) << kLimbBits | limb(top - 1), rest = limb(top - 2);
  if (digits == 0) return 0;
  const int shift = std::countl_zero(digits);
  digits = digits << shift | rest >> (kLimbBits - shift);  // shift < 32, as the first limb is not zero
  rest = rest << shift & kLow;
  for (int k = top - 3; k >= 0; --k) rest |= limb(k);
  if (rest != 0) digits |= 1;
  const double value = std::ldexp(static_cast<double>(digits), (top - 1) * kLimbBits + kLeastExponent - shift);
  return negative ? -value : value;
}

}  // namespace linden

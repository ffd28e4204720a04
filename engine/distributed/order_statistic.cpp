#include "engine/distributed/order_statistic.hpp"

#include <array>
#include <bit>

namespace linden {

// digits of the bits from the highest on: of numbers that are not negative they are in order as the numbers are
double nth_smallest(Ranks& ranks, std::span<const double> own, std::int64_t n) {
  constexpr int kDigitBits = 8;
  std::uint64_t known = 0, mask = 0;
  for (int shift = 64 - kDigitBits; shift >= 0; shift -= kDigitBits) {
    std::array<std::int64_t, 1 << kDigitBits> counts{};
    for (const double number : own) {
      const auto bits = std::bit_cast<std::uint64_t>(number);
      if ((bits & mask) == known) counts[bits >> shift & 0xff] += 1;
    }
    ranks.sum(counts);
    std::uint64_t digit = 0;
    while (digit < 0xff && n >= counts[digit]) n -= counts[digit++];
    known |= digit << shift;
    mask |= std::uint64_t{0xff} << shift;
  }
  return std::bit_cast<double>(known);
}

}  // namespace linden

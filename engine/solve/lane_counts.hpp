// engine/solve/lane_counts.hpp
// A small count for every lane, kept digit by digit: one word holds digit k of all lanes. What happens to many lanes at once is counted in a
// few instructions, and so is asked who has counted as much as somebody else.
#pragma once

#include <array>
#include <bit>
#include <cstddef>

#include "kernels/values/lanes_of.hpp"

namespace linden {

/// Lanes in which a bit is what it is in this one.
LINDEN_INLINE Lanes same_lanes(Lanes bits, int lane) { return (bits >> lane & 1u) != 0 ? bits : ~bits; }

/// Of W lanes. Every function is inlined where it is called: code for one set of instructions is not shared with that for another.
template <int W>
class LaneCounts {
 public:
  /// One more in these lanes; from 2^12 on a count begins anew.
  LINDEN_INLINE void add(Lanes lanes) {
    for (std::size_t k = 0; lanes != 0 && k < digits_.size(); ++k) {
      const Lanes carry = digits_[k] & lanes;
      digits_[k] ^= lanes;
      lanes = carry;
      if (k >= used_) used_ = k + 1;
    }
  }
  LINDEN_INLINE int of(int lane) const {
    int count = 0;
    for (std::size_t k = 0; k < used_; ++k) count |= static_cast<int>(digits_[k] >> lane & 1u) << k;
    return count;
  }
  /// Lanes that have counted as much as this one.
  LINDEN_INLINE Lanes same_as(int lane) const {
    Lanes same = ~Lanes(0);
    for (std::size_t k = 0; k < used_; ++k) same &= same_lanes(digits_[k], lane);
    return same;
  }
  /// visit(lane, count) for each of these lanes.
  template <class Visit>
  LINDEN_INLINE void each(Lanes lanes, const Visit& visit) const {
    while (lanes != 0) {
      const int count = of(std::countr_zero(lanes));
      Lanes same = lanes & same_as(std::countr_zero(lanes));
      lanes &= ~same;
      for (; same != 0; same &= same - 1) visit(std::countr_zero(same), count);
    }
  }

 private:
  std::array<Lanes, 12> digits_{};
  std::size_t used_ = 0;  // digits that are not zero in every lane
};

/// Of one lane a number: a tree of ten bodies is stepped in some thousands of instructions.
template <>
class LaneCounts<1> {
 public:
  LINDEN_INLINE void add(Lanes lanes) { count_ += static_cast<int>(lanes); }
  LINDEN_INLINE int of(int) const { return count_; }
  LINDEN_INLINE Lanes same_as(int) const { return 1; }
  template <class Visit>
  LINDEN_INLINE void each(Lanes lanes, const Visit& visit) const {
    if (lanes != 0) visit(0, count_);
  }

 private:
  int count_ = 0;
};

}  // namespace linden

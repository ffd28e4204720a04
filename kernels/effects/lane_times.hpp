// kernels/effects/lane_times.hpp
// What goes by the time or the gravity of an instance, where a Scalar holds several of them, each with its own.
#pragma once

#include <array>
#include <cstddef>
#include <type_traits>

#include "kernels/values/scalar.hpp"

namespace linden {

/// Numbers in a Scalar.
template <class S>
inline constexpr std::size_t kLanesOf = sizeof(S) / sizeof(typename ElementOf<S>::type);

/// When a step begins, in each lane [s]: in double precision whatever that of the lanes is, or tables would be looked up beside it.
template <class S>
using LaneTimes = std::array<double, kLanesOf<S>>;

/// Gravity in each lane [m/s^2], world frame.
template <class S>
using LaneGravity = std::array<std::array<double, 3>, kLanesOf<S>>;

/// f of what each lane has.
template <class S, class Each, class Function>
S of_each_lane(const Each& each, const Function& f) {
  if constexpr (std::is_arithmetic_v<S>) {
    return static_cast<S>(f(each[0]));
  } else {
    using Real = typename ElementOf<S>::type;
    std::array<Real, kLanesOf<S>> numbers;
    for (std::size_t l = 0; l < numbers.size(); ++l) numbers[l] = static_cast<Real>(f(each[l]));
    return S::load_unaligned(numbers.data());
  }
}

/// f of each lane's time.
template <class S, class Function>
LINDEN_INLINE S at_each_time(const LaneTimes<S>& times, const Function& f) {
  if constexpr (std::is_arithmetic_v<S>) {
    return static_cast<S>(f(times[0]));
  } else {
    using Real = typename ElementOf<S>::type;
    std::array<Real, kLanesOf<S>> each;
    for (std::size_t l = 0; l < each.size(); ++l) {
      each[l] = l > 0 && times[l] == times[l - 1] ? each[l - 1] : static_cast<Real>(f(times[l]));
    }
    return S::load_unaligned(each.data());
  }
}

/// The same of each lane's time and a number of its own.
template <class S, class Function>
LINDEN_INLINE S at_each_time(const LaneTimes<S>& times, const S& numbers, const Function& f) {
  if constexpr (std::is_arithmetic_v<S>) {
    return static_cast<S>(f(times[0], numbers));
  } else {
    using Real = typename ElementOf<S>::type;
    std::array<Real, kLanesOf<S>> own, each;
    numbers.store_unaligned(own.data());
    for (std::size_t l = 0; l < each.size(); ++l) {
      const bool again = l > 0 && times[l] == times[l - 1] && own[l] == own[l - 1];
      each[l] = again ? each[l - 1] : static_cast<Real>(f(times[l], static_cast<double>(own[l])));
    }
    return S::load_unaligned(each.data());
  }
}

}  // namespace linden

// kernels/couplings/row_lanes.hpp
// Rows of a coupling side by side, a row in every lane: what is done along a path is done for all of them at once.
//
// Of one tree, of doubles, as many as a register of this compilation holds; where the lanes hold instances already, one. In memory a
// number of all rows comes before the next number, `room` numbers in all. Row by row, most of a sweep is waiting for one joint's numbers
// before the next joint's can begin.
#pragma once

#include <array>
#include <type_traits>

#include "kernels/values/body_lanes.hpp"
#include "kernels/values/joints.hpp"

namespace linden {

/// What holds rows side by side. Classes that keep rows in memory take it as a template parameter: files compiled for other processors have other
/// registers, and must not share a class of another layout.
template <class S>
using RowPack = std::conditional_t<std::is_same_v<S, double>, BodyPack, S>;

template <class S, class Pack>
struct RowLanes {
  static constexpr bool kMany = !std::is_same_v<S, Pack>;
  static constexpr std::size_t count = kMany ? sizeof(Pack) / sizeof(S) : 1;

  /// Of this many rows, or other numbers that are side by side.
  static constexpr std::size_t room(std::size_t rows) { return (rows + count - 1) / count * count; }
  static Pack load(const S* from) {
    if constexpr (kMany) {
      return Pack::load_unaligned(from);
    } else {
      return *from;
    }
  }
  static void store(const Pack& value, S* to) {
    if constexpr (kMany) {
      value.store_unaligned(to);
    } else {
      *to = value;
    }
  }
  /// The same in these lanes of instances.
  template <class Mask>
  static void store(const Mask& lanes, const Pack& value, S* to) {
    if constexpr (kMany) {
      if (lanes) store(value, to);
    } else {
      *to = select(lanes, value, *to);
    }
  }
};

/// The same number in every lane.
template <class R, class S>
LINDEN_INLINE Vec3<R> spread(const Vec3<S>& v) {
  return {R(v.x), R(v.y), R(v.z)};
}
template <class R, class S>
LINDEN_INLINE Wrench<R> spread(const Wrench<S>& w) {
  return {spread<R>(w.n), spread<R>(w.f)};
}
template <class R, class S>
LINDEN_INLINE Placement<R> spread(const Placement<S>& X) {
  return {{spread<R>(X.R.x), spread<R>(X.R.y), spread<R>(X.R.z)}, spread<R>(X.p)};
}

}  // namespace linden

// kernels/collision/broad_phase.hpp
// Which of n boxes along the world's axes meet: sorted by where they begin along the axis on which their middles are spread the widest, each is
// compared with those that begin before it ends.
//
// Boxes without end, of planes, are left out of that and compared with all.
//
// Pairs are (a, b), a < b, in the order of a and then b, whatever the axis: what comes after hangs on the boxes alone.
//
// cost    O(n log n) and the pairs that overlap along the axis, O(n) for each box without end; memory of the last call is used again
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "kernels/collision/placed_convex.hpp"

namespace linden {

class BroadPhase {
 public:
  /// Pairs of boxes that are no farther apart than the margin along any axis. A view until the next call.
  std::span<const std::pair<std::uint32_t, std::uint32_t>> pairs(std::span<const Bounds> bounds, double margin);

 private:
  std::vector<std::uint32_t> order_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs_;
};

}  // namespace linden

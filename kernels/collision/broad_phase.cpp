#include "kernels/collision/broad_phase.hpp"

#include <algorithm>

namespace linden {

std::span<const std::pair<std::uint32_t, std::uint32_t>> BroadPhase::pairs(std::span<const Bounds> bounds, double margin) {
  std::size_t axis = 0;
  double widest = -1;
  for (std::size_t k = 0; k < 3; ++k) {
    double sum = 0, squares = 0;
    for (const Bounds& box : bounds) {
      const double middle = 0.5 * (box.low[k] + box.high[k]);
      sum += middle;
      squares += middle * middle;
    }
    const double spread = squares - sum * sum / static_cast<double>(std::max<std::size_t>(bounds.size(), 1));
    if (spread > widest) widest = spread, axis = k;
  }
  order_.resize(bounds.size());
  for (std::uint32_t k = 0; k < order_.size(); ++k) order_[k] = k;
  std::sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) {
    return bounds[a].low[axis] != bounds[b].low[axis] ? bounds[a].low[axis] < bounds[b].low[axis] : a < b;
  });
  pairs_.clear();
  for (std::size_t i = 0; i < order_.size(); ++i) {
    const Bounds& one = bounds[order_[i]];
    for (std::size_t j = i + 1; j < order_.size(); ++j) {
      const Bounds& other = bounds[order_[j]];
      if (other.low[axis] > one.high[axis] + margin) break;
      bool meet = true;
      for (std::size_t k = 0; k < 3; ++k) meet = meet && other.low[k] <= one.high[k] + margin && one.low[k] <= other.high[k] + margin;
      if (meet) pairs_.emplace_back(std::min(order_[i], order_[j]), std::max(order_[i], order_[j]));
    }
  }
  std::sort(pairs_.begin(), pairs_.end());
  return pairs_;
}

}  // namespace linden

#include "kernels/collision/broad_phase.hpp"

#include <algorithm>
#include <cmath>

namespace linden {
namespace {

bool has_end(const Bounds& box) {
  bool has = true;
  for (std::size_t k = 0; k < 3; ++k) has = has && std::isfinite(box.low[k]) && std::isfinite(box.high[k]);
  return has;
}

bool meet(const Bounds& one, const Bounds& other, double margin) {
  bool do_meet = true;
  for (std::size_t k = 0; k < 3; ++k) do_meet = do_meet && other.low[k] <= one.high[k] + margin && one.low[k] <= other.high[k] + margin;
  return do_meet;
}

}  // namespace

std::span<const std::pair<std::uint32_t, std::uint32_t>> BroadPhase::pairs(std::span<const Bounds> bounds, double margin) {
  order_.clear();
  for (std::uint32_t k = 0; k < bounds.size(); ++k) {
    if (has_end(bounds[k])) order_.push_back(k);
  }
  const std::size_t ended = order_.size();
  std::size_t axis = 0;
  double widest = -1;
  for (std::size_t k = 0; k < 3; ++k) {
    double sum = 0, squares = 0;
    for (const std::uint32_t one : order_) {
      const double middle = 0.5 * (bounds[one].low[k] + bounds[one].high[k]);
      sum += middle;
      squares += middle * middle;
    }
    const double spread = squares - sum * sum / static_cast<double>(std::max<std::size_t>(order_.size(), 1));
    if (spread > widest) widest = spread, axis = k;
  }
  std::sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) {
    return bounds[a].low[axis] != bounds[b].low[axis] ? bounds[a].low[axis] < bounds[b].low[axis] : a < b;
  });
  pairs_.clear();
  for (std::size_t i = 0; i < order_.size(); ++i) {
    const Bounds& one = bounds[order_[i]];
    for (std::size_t j = i + 1; j < order_.size(); ++j) {
      const Bounds& other = bounds[order_[j]];
      if (other.low[axis] > one.high[axis] + margin) break;
      if (meet(one, other, margin)) pairs_.emplace_back(std::min(order_[i], order_[j]), std::max(order_[i], order_[j]));
    }
  }
  for (std::uint32_t one = 0; ended < bounds.size() && one < bounds.size(); ++one) {
    if (has_end(bounds[one])) continue;
    for (const std::uint32_t other : order_) {
      if (meet(bounds[one], bounds[other], margin)) pairs_.emplace_back(std::min(one, other), std::max(one, other));
    }
    order_.push_back(one);
  }
  std::sort(pairs_.begin(), pairs_.end());
  return pairs_;
}

}  // namespace linden

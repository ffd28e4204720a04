// engine/distributed/order_statistic.hpp
// Numbers by their rank in order, of numbers that lie with several processes: found by counting, without sending them.
#pragma once

#include <cstdint>
#include <span>

#include "engine/distributed/ranks.hpp"

namespace linden {

/// The n-th smallest, from 0 on, of the numbers of all ranks, of which there are more than n; none is negative. NaN comes last. Eight times
/// 256 counts go from rank to rank.
double nth_smallest(Ranks& ranks, std::span<const double> own, std::int64_t n);

}  // namespace linden

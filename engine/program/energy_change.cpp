#include "engine/program/energy_change.hpp"

#include <cmath>
#include <limits>
#include <vector>

#include "engine/distributed/exact_sum.hpp"
#include "engine/distributed/order_statistic.hpp"

namespace linden {

EnergyChange energy_change(Ranks& ranks, InstanceRange own, std::int64_t instances, std::span<const double> first, std::span<const double> last,
                           std::span<const double> kinetic) {
  EnergyChange result{.worst = own.first};
  ExactSum sum;
  std::vector<double> sizes;
  for (std::size_t i = 0; i < first.size(); ++i) {
    const double change = kinetic[i] > 0 ? (last[i] - first[i]) / kinetic[i] : 0, size = std::abs(change);
    sum.add(change);
    sizes.push_back(size);
    if (!(size > result.most)) continue;
    result.most = size;
    result.worst = own.first + static_cast<std::int64_t>(i);
  }
  const double most_here = result.most;
  ranks.most({&result.most, 1});
  if (most_here != result.most) result.worst = std::numeric_limits<std::int64_t>::max();
  ranks.least({&result.worst, 1});
  ranks.sum(sum.limbs());
  result.mean = sum.value() / static_cast<double>(instances);
  result.median = nth_smallest(ranks, sizes, instances / 2);
  return result;
}

}  // namespace linden

#include "layout/effects.hpp"

#include <algorithm>

namespace linden {

double Course::at(double time) const {
  const auto after = std::ranges::upper_bound(times, time);
  if (after == times.begin()) return values.front();
  if (after == times.end()) return values.back();
  const auto k = static_cast<std::size_t>(after - times.begin());
  const double share = (time - times[k - 1]) / (times[k] - times[k - 1]);
  return values[k - 1] + share * (values[k] - values[k - 1]);
}

}  // namespace linden

#include "engine/program/power_law.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/drift.hpp"

namespace linden {
namespace {

PowerLaw fit(std::span<const double> x, std::span<const double> y, double from) {
  LineFit line;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < x.size(); ++i) {
    const bool usable = x[i] > 0 && y[i] > 0 && std::isfinite(x[i]) && std::isfinite(y[i]);
    if (!usable || x[i] < from) continue;
    line.add(std::log(x[i]), std::log(y[i]));
    least = std::min(least, x[i]);
  }
  return {line.slope(), line.slope_error(), line.points(), least};
}

}  // namespace

PowerLaw power_law(std::span<const double> x, std::span<const double> y, double from) {
  constexpr std::int64_t kFewest = 3;
  const PowerLaw law = fit(x, y, from);
  return law.points >= kFewest ? law : fit(x, y, 0);
}

}  // namespace linden

// engine/program/power_law.hpp
// How a cost grows with a size: y ~ x^exponent, the line through (log x, log y) by least squares.
#pragma once

#include <cstdint>
#include <span>

namespace linden {

struct PowerLaw {
  double exponent = 0;  // NaN below two points
  double error = 0;     // its standard error; NaN below three points
  std::int64_t points = 0;
  double least = 0;  // smallest x that was used
};

/// Through the points with x >= `from`, where costs that do not grow no longer count; through all where fewer than three are left.
/// Points with an x or y that is not positive and finite are left out. Sizes may come in any order.
PowerLaw power_law(std::span<const double> x, std::span<const double> y, double from);

}  // namespace linden

// layout/effects/time_table.hpp
// A number over time.
#pragma once

#include <vector>

namespace linden {

/// A number over time [s]: straight lines between the given points, held before the first and after the last. Times ascend; where
/// two are equal the number jumps.
struct TimeTable {
  std::vector<double> times{0};
  std::vector<double> values{0};
  double at(double time) const;
  /// Mean over [begin, end], exactly. What lies at one of its ends but for the rounding of times lies there: a jump at 0.3 s is that of
  /// the step from 3 x 0.1 s on.
  double mean(double begin, double end) const;
};

/// By how much the ends of a step and the times that people give may miss each other by rounding alone: each is a product or a sum of few.
double rounding_of(double begin, double end);

}  // namespace linden

// engine/program/plot_scale.hpp
// Where a value lies along an axis, and the few round ticks that a person reads it by: multiples of 1, 2 or 5 times a power of ten,
// decades on a log axis.
#pragma once

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "engine/program/plot.hpp"

namespace linden::plot {

struct Tick {
  double at;          // 0 … 1 along the axis
  std::string label;  // empty for a minor tick
};

struct Scale {
  bool log = false;
  double lo = 0, hi = 1;  // of log10(value) on a log axis
  std::string label;
  std::vector<Tick> ticks;

  double operator()(double value) const {  // 0 … 1 along the axis, NaN where nothing can be drawn
    if (!(std::abs(value) < 1e300) || (log && value <= 0)) return std::numeric_limits<double>::quiet_NaN();
    return ((log ? std::log10(value) : value) - lo) / (hi - lo);
  }
};

/// A scale over the values lo … hi, widened by the share `pad` on both sides, with ticks at least `spacing` (of 1) apart.
Scale make_scale(const Axis& axis, double lo, double hi, double pad, double spacing);

}  // namespace linden::plot

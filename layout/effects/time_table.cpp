#include "layout/effects/time_table.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace linden {
namespace {

/// The first point after `time`.
std::size_t first_after(const TimeTable& table, double time) {
  return static_cast<std::size_t>(std::ranges::upper_bound(table.times, time) - table.times.begin());
}

/// The line that ends at point k, at `time`; before the first point and after the last it is level.
double on_piece(const TimeTable& table, std::size_t k, double time) {
  if (k == 0) return table.values.front();
  if (k == table.times.size()) return table.values.back();
  const double share = (time - table.times[k - 1]) / (table.times[k] - table.times[k - 1]);
  return table.values[k - 1] + share * (table.values[k] - table.values[k - 1]);
}

}  // namespace

double rounding_of(double begin, double end) {
  constexpr double kRoundings = 8;
  return kRoundings * std::numeric_limits<double>::epsilon() * std::max(std::abs(begin), std::abs(end));
}

double TimeTable::at(double time) const { return on_piece(*this, first_after(*this, time), time); }

double TimeTable::mean(double begin, double end) const {
  const double slack = rounding_of(begin, end), length = end - begin, last = end - slack;
  std::size_t k = first_after(*this, begin + slack);
  const auto ends = [&] { return k == times.size() || times[k] >= last; };
  if (ends()) return on_piece(*this, k, begin + 0.5 * length);
  double sum = 0;
  for (double from = begin;; ++k) {
    const bool whole = ends();
    const double to = whole ? end : times[k];
    if (to > from) sum += (to - from) * on_piece(*this, k, from + 0.5 * (to - from));
    if (whole) return sum / length;
    from = to;
  }
}

}  // namespace linden

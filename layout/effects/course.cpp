#include "layout/effects/course.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace linden {
namespace {

/// The first point after `time`.
std::size_t first_after(const Course& course, double time) {
  return static_cast<std::size_t>(std::ranges::upper_bound(course.times, time) - course.times.begin());
}

/// The line that ends at point k, at `time`; before the first point and after the last it is level.
double on_piece(const Course& course, std::size_t k, double time) {
  if (k == 0) return course.values.front();
  if (k == course.times.size()) return course.values.back();
  const double share = (time - course.times[k - 1]) / (course.times[k] - course.times[k - 1]);
  return course.values[k - 1] + share * (course.values[k] - course.values[k - 1]);
}

}  // namespace

double rounding_of(double begin, double end) {
  constexpr double kRoundings = 8;
  return kRoundings * std::numeric_limits<double>::epsilon() * std::max(std::abs(begin), std::abs(end));
}

double Course::at(double time) const { return on_piece(*this, first_after(*this, time), time); }

double Course::mean(double begin, double end) const {
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

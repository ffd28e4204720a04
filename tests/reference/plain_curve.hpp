// tests/reference/plain_curve.hpp
// The curve that a joint's given motion follows, as the polynomial of each piece: a second reading of layout/smooth_curve.hpp.
#pragma once

#include <array>
#include <cmath>
#include <vector>

#include "layout/effects.hpp"

namespace linden::reference {

class PlainCurve {
 public:
  explicit PlainCurve(const Course& points) : times_(points.times), last_(points.values.back()), first_(points.values.front()) {
    const int n = static_cast<int>(times_.size());
    std::vector<double> d;  // d[k + 2]: slope of the line from point k on
    for (int k = -2; k < n + 1; ++k) d.push_back(line(points, k));
    for (int k = 0; k + 1 < n; ++k) {
      const double from = slope(d, k), to = slope(d, k + 1);
      const double length = at(times_, k + 1) - at(times_, k), rise = at(points.values, k + 1) - at(points.values, k);
      pieces_.push_back({at(points.values, k), from, (3 * rise / length - 2 * from - to) / length, (from + to - 2 * rise / length) / (length * length)});
    }
  }

  /// The derivative of that order, 0 to 2.
  double derivative(int order, double time) const {
    if (pieces_.empty() || time < times_.front()) return order == 0 ? first_ : 0;
    if (time >= times_.back()) return order == 0 ? last_ : 0;
    std::size_t k = 0;
    while (times_[k + 1] <= time) ++k;
    const auto& [a, b, c, e] = pieces_[k];
    const double t = time - times_[k];
    if (order == 0) return a + b * t + c * t * t + e * t * t * t;
    return order == 1 ? b + 2 * c * t + 3 * e * t * t : 2 * c + 6 * e * t;
  }

 private:
  static double at(const std::vector<double>& list, int k) { return list[static_cast<std::size_t>(k)]; }

  /// Beyond the ends lines go on as the last two bend.
  static double line(const Course& points, int k) {
    const int lines = static_cast<int>(points.times.size()) - 1;
    if (lines < 1) return 0;
    if (k >= 0 && k < lines) return (at(points.values, k + 1) - at(points.values, k)) / (at(points.times, k + 1) - at(points.times, k));
    if (lines == 1) return line(points, 0);
    return k < 0 ? 2 * line(points, k + 1) - line(points, k + 2) : 2 * line(points, k - 1) - line(points, k - 2);
  }

  /// At point k, with Akima's weights; what goes straight on both before and after it, the slower.
  static double slope(const std::vector<double>& d, int k) {
    const auto weigh = [](double x, double y) { return std::abs(x - y) + 1e-9 * std::abs(x + y); };
    const double before = at(d, k + 1), after = at(d, k + 2);
    const double w_before = weigh(at(d, k + 3), after), w_after = weigh(before, at(d, k));
    return w_before + w_after == 0 ? 0 : (w_before * before + w_after * after) / (w_before + w_after);
  }

  std::vector<double> times_;
  double last_, first_;
  std::vector<std::array<double, 4>> pieces_;  // powers of the time since each began
};

}  // namespace linden::reference

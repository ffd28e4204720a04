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
  explicit PlainCurve(const JointMotion& motion)
      : times_(motion.position.times), first_(motion.position.values.front()), last_(motion.position.values.back()) {
    const std::vector<double>& values = motion.position.values;
    const std::size_t n = times_.size();
    std::vector<double> rise(n, 0.0);  // of the line from each point to the next, per second
    for (std::size_t k = 0; k + 1 < n; ++k) rise[k] = (values[k + 1] - values[k]) / (times_[k + 1] - times_[k]);
    std::vector<double> slope = motion.velocities;
    if (slope.empty()) {
      for (std::size_t k = 0; k < n; ++k) slope.push_back(slope_at(k, rise));
    }
    for (std::size_t k = 0; k + 1 < n; ++k) {
      const double T = times_[k + 1] - times_[k];
      pieces_.push_back({values[k], slope[k], (3 * rise[k] - 2 * slope[k] - slope[k + 1]) / T, (slope[k] + slope[k + 1] - 2 * rise[k]) / (T * T)});
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
  double length(std::size_t k) const { return times_[k + 1] - times_[k]; }

  double slope_at(std::size_t k, const std::vector<double>& rise) const {
    const std::size_t n = times_.size();
    if (n == 1) return 0;
    if (n == 2) return rise[0];
    if (k == 0) return at_end(rise[0], rise[1], length(0), length(1));
    if (k == n - 1) return at_end(rise[n - 2], rise[n - 3], length(n - 2), length(n - 3));
    const double before = rise[k - 1], after = rise[k];
    if ((before > 0) != (after > 0) || before == 0 || after == 0) return 0;
    // the longer side weighs less
    const double share = (length(k - 1) + 2 * length(k)) / (3 * (length(k - 1) + length(k)));
    return 1 / (share / before + (1 - share) / after);
  }

  static double at_end(double near, double far, double h, double next) {
    // derivative of the parabola through three points at the outer one
    const double parabola = near + (near - far) * h / (h + next);
    if (near == 0 || (parabola > 0) != (near > 0)) return 0;
    const bool turns = (near > 0) != (far > 0) && far != 0;
    return turns && std::abs(parabola) > 3 * std::abs(near) ? 3 * near : parabola;
  }

  std::vector<double> times_;
  double first_, last_;
  std::vector<std::array<double, 4>> pieces_;  // powers of the time since each began
};

}  // namespace linden::reference

#include "layout/smooth_curve.hpp"

#include <algorithm>
#include <cmath>

namespace linden {
namespace {

/// Where lines go straight on at both sides of a point: the share by which the one that stands still, or the slower, is preferred.
constexpr double kStill = 1e-9;

}  // namespace

SmoothCurve::SmoothCurve(const Course& points) : points_(points), slopes_(points.times.size(), 0.0) {
  const std::size_t pieces = points.times.size() - 1;
  if (pieces == 0) return;
  // of the lines between the points, and of two more at either end that go on as the last two bend
  std::vector<double> d(pieces + 4);
  for (std::size_t k = 0; k < pieces; ++k) {
    d[k + 2] = (points.values[k + 1] - points.values[k]) / (points.times[k + 1] - points.times[k]);
  }
  const double first_bend = pieces > 1 ? d[3] - d[2] : 0, last_bend = pieces > 1 ? d[pieces + 1] - d[pieces] : 0;
  d[1] = d[2] - first_bend;
  d[0] = d[1] - first_bend;
  d[pieces + 2] = d[pieces + 1] + last_bend;
  d[pieces + 3] = d[pieces + 2] + last_bend;
  const auto weight = [](double a, double b) { return std::abs(a - b) + kStill * std::abs(a + b); };
  for (std::size_t k = 0; k <= pieces; ++k) {
    const double w1 = weight(d[k + 3], d[k + 2]), w2 = weight(d[k + 1], d[k]);
    if (w1 + w2 > 0) slopes_[k] = (w1 * d[k + 1] + w2 * d[k + 2]) / (w1 + w2);
  }
}

SmoothCurve::Piece SmoothCurve::piece_at(double time) const {
  const auto next = static_cast<std::size_t>(std::ranges::upper_bound(points_.times, time) - points_.times.begin());
  const double begin = points_.times[next - 1], length = points_.times[next] - begin;
  return {(time - begin) / length, length, points_.values[next - 1], points_.values[next], slopes_[next - 1], slopes_[next]};
}

double SmoothCurve::at(double time) const {
  if (!within(time)) return time < points_.times.front() ? points_.values.front() : points_.values.back();
  const Piece p = piece_at(time);
  const double s = p.share, rise = p.to - p.from;
  // what it differs from a line by
  const double bend = s * (1 - s) * ((1 - s) * (p.leaves * p.length - rise) - s * (p.comes * p.length - rise));
  return p.from + s * rise + bend;
}

double SmoothCurve::slope(double time) const {
  if (!within(time)) return 0;
  const Piece p = piece_at(time);
  const double s = p.share, mean = (p.to - p.from) / p.length;
  return mean + (1 - s) * (1 - 3 * s) * (p.leaves - mean) + s * (3 * s - 2) * (p.comes - mean);
}

}  // namespace linden

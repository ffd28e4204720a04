#include "layout/smooth_curve.hpp"

#include <algorithm>
#include <cmath>

namespace linden {
namespace {

/// At the first of three points, of the parabola through them; lines of slope d0, then d1, over h0 and h1.
double end_slope(double d0, double d1, double h0, double h1) {
  const double slope = ((2 * h0 + h1) * d0 - h0 * d1) / (h0 + h1);
  if (slope * d0 <= 0) return 0;
  return d0 * d1 < 0 && std::abs(slope) > 3 * std::abs(d0) ? 3 * d0 : slope;
}

/// Between lines of slope d0 over h0 and d1 over h1.
double inner_slope(double d0, double d1, double h0, double h1) {
  if (d0 * d1 <= 0) return 0;
  const double w0 = h0 + 2 * h1, w1 = 2 * h0 + h1;
  return (w0 + w1) / (w0 / d0 + w1 / d1);
}

/// What keeps each piece within the range of its ends.
std::vector<double> level_slopes(const TimeTable& points) {
  const std::size_t pieces = points.times.size() - 1;
  std::vector<double> slopes(pieces + 1, 0.0), h(pieces), d(pieces);
  for (std::size_t k = 0; k < pieces; ++k) {
    h[k] = points.times[k + 1] - points.times[k];
    d[k] = (points.values[k + 1] - points.values[k]) / h[k];
  }
  if (pieces == 1) return {d[0], d[0]};
  for (std::size_t k = 1; k < pieces; ++k) slopes[k] = inner_slope(d[k - 1], d[k], h[k - 1], h[k]);
  if (pieces > 1) {
    slopes.front() = end_slope(d[0], d[1], h[0], h[1]);
    slopes.back() = end_slope(d[pieces - 1], d[pieces - 2], h[pieces - 1], h[pieces - 2]);
  }
  return slopes;
}

}  // namespace

SmoothCurve::SmoothCurve(const TimeTable& points, std::span<const double> slopes)
    : points_(points), slopes_(slopes.empty() ? level_slopes(points) : std::vector<double>(slopes.begin(), slopes.end())) {}

SmoothCurve::Piece SmoothCurve::piece(std::size_t k, double time) const {
  const double begin = points_.times[k], length = points_.times[k + 1] - begin;
  return {(time - begin) / length, length, points_.values[k], points_.values[k + 1], slopes_[k], slopes_[k + 1]};
}

SmoothCurve::Piece SmoothCurve::piece_at(double time) const {
  const auto next = static_cast<std::size_t>(std::ranges::upper_bound(points_.times, time) - points_.times.begin());
  return piece(next - 1, time);
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

std::vector<std::pair<double, double>> SmoothCurve::extremes() const {
  std::vector<std::pair<double, double>> found;
  for (std::size_t k = 0; k < points_.times.size(); ++k) {
    found.push_back({points_.times[k], points_.values[k]});
    if (k + 1 == points_.times.size()) break;
    // the slope is a s^2 + b s + c
    const Piece p = piece(k, points_.times[k]);
    const double mean = (p.to - p.from) / p.length, a = 3 * (p.leaves + p.comes - 2 * mean), b = 6 * mean - 4 * p.leaves - 2 * p.comes, c = p.leaves;
    const double inner = b * b - 4 * a * c;
    if (!(inner > 0)) continue;
    const double q = -0.5 * (b + std::copysign(std::sqrt(inner), b));
    for (const double s : {a != 0 ? q / a : -1, q != 0 ? c / q : -1}) {
      if (!(s > 0 && s < 1)) continue;
      const double time = points_.times[k] + s * p.length;
      found.push_back({time, at(time)});
    }
  }
  return found;
}

}  // namespace linden

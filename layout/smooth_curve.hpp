// layout/smooth_curve.hpp
// A smooth curve through the points of a TimeTable: cubic between them, with one slope at each, so that what moves along it has no jump of
// velocity but at its ends. Before the first point and after the last it is level.
//
//   slopes given    those
//   else            0 at a point where the lines before and after it do not go the same way, or one is level; else their weighted harmonic
//                   mean; at the ends that of the parabola through three points, as far as it goes the way of the first line
//
// Without slopes the curve never leaves the range of the two points around it: what a table holds stands still, however long, and there is
// no overshoot. The price is paid where a smooth motion turns: it comes to rest at a point there, and its acceleration is off by as much as it
// is, for one point's time. Slopes given take that away. Tried instead: Akima's slopes, to second order everywhere, but a joint that a table
// held for a second by two points and then moved in a tenth swung out by three quarters of the move before it.
//
// source  Fritsch, Butland, A method for constructing local monotone piecewise cubic interpolants (1984), as SciPy's and Matlab's pchip
#pragma once

#include <span>
#include <utility>
#include <vector>

#include "layout/effects.hpp"

namespace linden {

class SmoothCurve {
 public:
  /// Times must ascend, no two of them equal; slopes: none, or one a point.
  explicit SmoothCurve(const TimeTable& points, std::span<const double> slopes = {});

  double at(double time) const;
  /// To the right of a time where it jumps, as at the first point and the last.
  double slope(double time) const;
  /// Time and value of all points, and of where the curve turns between them: no value lies beyond all of these.
  std::vector<std::pair<double, double>> extremes() const;

 private:
  struct Piece {
    double share, length;            // of the way through it; in time [s]
    double from, to, leaves, comes;  // values and slopes at its ends
  };
  /// Where `time` is within the points.
  Piece piece_at(double time) const;
  Piece piece(std::size_t k, double time) const;
  bool within(double time) const { return points_.times.size() > 1 && time >= points_.times.front() && time < points_.times.back(); }

  TimeTable points_;
  std::vector<double> slopes_;
};

}  // namespace linden

// layout/smooth_curve.hpp
// A smooth curve through the points of a Course: cubic between them, with one slope at each, so that what moves along it has no jump of
// velocity but at its ends.
//
//   slope at point k     (w1 d_{k-1} + w2 d_k) / (w1 + w2),    d_k slope of the line from point k to k + 1
//                        w1 = |d_{k+1} - d_k| + e |d_{k+1} + d_k|,    w2 = |d_{k-1} - d_{k-2}| + e |d_{k-1} + d_{k-2}|,    e = 1e-9
//
// The weights let a point follow the side that is straighter: what stands still for three points does so exactly, and there is no overshoot
// beside it, while points of a smooth motion get their slopes to second order. With e = 1/2, which is better known, the slope of a sine
// with 40 points a second is off by 2 % where it turns. Before the first point and after the last the curve is level.
//
// source  Akima, A new method of interpolation and smooth curve fitting based on local procedures (1970); e after Moler, Ionita, Makima
//         piecewise cubic interpolation (2019)
#pragma once

#include <vector>

#include "layout/effects.hpp"

namespace linden {

class SmoothCurve {
 public:
  /// Times must ascend, no two of them equal.
  explicit SmoothCurve(const Course& points);

  double at(double time) const;
  /// To the right of a time where it jumps, as at the first point and the last.
  double slope(double time) const;

 private:
  struct Piece {
    double share, length;           // of the way through it; in time [s]
    double from, to, leaves, comes;  // values and slopes at its ends
  };
  /// Where `time` is within the points.
  Piece piece_at(double time) const;
  bool within(double time) const { return points_.times.size() > 1 && time >= points_.times.front() && time < points_.times.back(); }

  Course points_;
  std::vector<double> slopes_;
};

}  // namespace linden

// tests/reference/convex_plain.hpp
// Convex shapes and their signed distance, slowly: a shape is points, with a disc, an ellipsoid and a ball added to their hull, so its support
// function is a sum of four; the distance of two is the largest of -h over unit directions, which are sampled all around, and the best of them
// refined by turning them a little until nothing is better. Nothing is a special case, and no face or edge is known.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "layout/convex.hpp"
#include "layout/pose.hpp"

namespace linden::reference {

struct PlainConvex {
  std::vector<Eigen::Vector3d> points;                           // in the world
  Eigen::Vector3d disc_axis{0, 0, 1};
  double disc_radius = 0;
  Eigen::Matrix3d ellipsoid = Eigen::Matrix3d::Zero();           // image of the unit ball
  double ball = 0;

  double reach(const Eigen::Vector3d& n) const {
    double farthest = -1e300;
    for (const Eigen::Vector3d& p : points) farthest = std::max(farthest, p.dot(n));
    return farthest + disc_radius * n.cross(disc_axis).norm() + (ellipsoid.transpose() * n).norm() + ball * n.norm();
  }
};

inline PlainConvex plain_convex(const ConvexShape& shape, const Pose& pose) {
  const Eigen::Matrix3d R = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(pose.rotation.data());
  const Eigen::Vector3d p(pose.shift[0], pose.shift[1], pose.shift[2]), half(shape.half[0], shape.half[1], shape.half[2]);
  PlainConvex plain;
  plain.ball = shape.radius;
  const auto add = [&](double x, double y, double z) { plain.points.push_back(p + R * Eigen::Vector3d(x, y, z)); };
  switch (shape.kind) {
    case ConvexKind::point: add(0, 0, 0); break;
    case ConvexKind::segment: add(0, 0, -half.z()), add(0, 0, half.z()); break;
    case ConvexKind::box:
      for (int k = 0; k < 8; ++k) add(k & 1 ? half.x() : -half.x(), k & 2 ? half.y() : -half.y(), k & 4 ? half.z() : -half.z());
      break;
    case ConvexKind::cylinder:
      add(0, 0, -half.z()), add(0, 0, half.z());
      plain.disc_axis = R.col(2);
      plain.disc_radius = half.x();
      break;
    case ConvexKind::ellipsoid:
      add(0, 0, 0);
      plain.ellipsoid = R * half.asDiagonal();
      break;
    case ConvexKind::hull:
      for (const auto& x : shape.hull->points) add(x[0], x[1], x[2]);
      break;
    case ConvexKind::plane:
    case ConvexKind::heights: break;  // no hulls of points: tests have other twins of them
  }
  return plain;
}

/// -h(n): how far the shapes are apart along n, from a to b.
inline double distance_along(const PlainConvex& a, const PlainConvex& b, const Eigen::Vector3d& n) { return -a.reach(n) - b.reach(-n); }

struct SearchedDirection {
  double value;
  Eigen::Vector3d n;
};

/// A function of a unit direction all around, its largest values first.
template <class Function>
std::vector<SearchedDirection> directions_around(const Function& value, int count) {
  std::vector<SearchedDirection> all;
  for (int k = 0; k < count; ++k) {
    // a spiral from pole to pole
    const double z = 1 - (2.0 * k + 1) / count, turn = k * 2.399963229728653;
    const double rho = std::sqrt(1 - z * z);
    const Eigen::Vector3d n(rho * std::cos(turn), rho * std::sin(turn), z);
    all.push_back({value(n), n});
  }
  constexpr int kept = 4;
  std::partial_sort(all.begin(), all.begin() + kept, all.end(),
                    [](const SearchedDirection& x, const SearchedDirection& y) { return x.value > y.value; });
  return all;
}

/// From there up, by turns of `step` at first, until none leads higher.
template <class Function>
SearchedDirection climbed(const Function& value, SearchedDirection best, double step) {
  double phase = 0;
  int in_vain = 0;  // along a ridge few directions lead up: several sets are tried before a shorter step
  while (step > 1e-9) {
    const Eigen::Vector3d s = best.n.unitOrthogonal(), t = best.n.cross(s);
    SearchedDirection better = best;
    for (int j = 0; j < 8; ++j) {
      const double turn = phase + j * M_PI / 4;
      const Eigen::Vector3d n = (best.n + step * (std::cos(turn) * s + std::sin(turn) * t)).normalized();
      if (const double v = value(n); v > better.value) better = {v, n};
    }
    phase += 0.1;
    if (better.value > best.value) best = better, in_vain = 0;
    else if (++in_vain == 6) step *= 0.6, in_vain = 0;
  }
  return best;
}

/// The largest value of a function of a unit direction, to some 1e-9 of how it varies where it has no narrow peaks.
template <class Function>
double largest_over_directions(const Function& value) {
  const std::vector<SearchedDirection> all = directions_around(value, 1500);
  double largest = -1e300;
  for (std::size_t k = 0; k < 4; ++k) largest = std::max(largest, climbed(value, all[k], 0.05).value);
  return largest;
}

inline double signed_distance(const PlainConvex& a, const PlainConvex& b) {
  return largest_over_directions([&](const Eigen::Vector3d& n) { return distance_along(a, b, n); });
}

/// How far a place is outside a shape; negative inside.
inline double outside(const PlainConvex& a, const Eigen::Vector3d& x) {
  return largest_over_directions([&](const Eigen::Vector3d& n) { return n.dot(x) - a.reach(n); });
}

}  // namespace linden::reference

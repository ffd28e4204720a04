// tests/reference/random_convex.hpp
// Convex shapes of every kind and poses, at random, for tests.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <string>
#include <vector>

#include "layout/convex.hpp"
#include "models/build/isometry.hpp"
#include "models/build/random.hpp"
#include "models/shapes/convex_hull.hpp"

namespace linden::reference {

inline ConvexShape hull_shape(const std::vector<Eigen::Vector3d>& points, double radius = 0) {
  return {.kind = ConvexKind::hull, .radius = radius, .hull = convex_hull(points)};
}

/// A box's corners as a hull.
inline ConvexShape box_as_hull(const std::array<double, 3>& half) {
  std::vector<Eigen::Vector3d> points;
  for (int k = 0; k < 8; ++k) points.emplace_back(k & 1 ? half[0] : -half[0], k & 2 ? half[1] : -half[1], k & 4 ? half[2] : -half[2]);
  return hull_shape(points);
}

inline constexpr int kRandomKinds = 8;

/// Some decimetres large. 0 to 7: sphere, capsule, box, cylinder, ellipsoid, hull, hull of many points with a radius, box with round edges.
inline ConvexShape random_shape(Random& random, int kind) {
  const auto length = [&] { return random.uniform(0.05, 0.35); };
  switch (kind) {
    case 0: return {.kind = ConvexKind::point, .radius = length()};
    case 1: return {.kind = ConvexKind::segment, .half = {0, 0, length()}, .radius = length()};
    case 2: return {.kind = ConvexKind::box, .half = {length(), length(), length()}};
    case 3: {
      const double r = length();
      return {.kind = ConvexKind::cylinder, .half = {r, r, length()}};
    }
    case 4: return {.kind = ConvexKind::ellipsoid, .half = {length(), length(), length()}};
    case 5:
    case 6: {
      std::vector<Eigen::Vector3d> points;
      const Eigen::Vector3d scale(length(), length(), length());
      for (int k = kind == 5 ? 12 : 200; k > 0; --k) points.push_back(scale.cwiseProduct(random.rotation() * Eigen::Vector3d::UnitX()));
      return hull_shape(points, kind == 5 ? 0 : 0.02);
    }
    default: return {.kind = ConvexKind::box, .half = {length(), length(), length()}, .radius = 0.03};
  }
}

inline Pose pose_at(const Eigen::Matrix3d& R, const Eigen::Vector3d& p) {
  Isometry T = Isometry::Identity();
  T.linear() = R;
  T.translation() = p;
  return pose_of(T);
}

}  // namespace linden::reference

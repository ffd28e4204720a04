// models/shapes/convex_hull.hpp
// The convex hull of points (layout/convex.hpp), by Qhull. Faces that lie in one plane to rounding are one face, so a box of points has six.
//
// Points that lie in a plane or on a line to 1e-12 of their size have the hull of that: a polygon with two sides, two points, one.
//
// source  Barber, Dobkin, Huhdanpaa, The Quickhull algorithm for convex hulls (1996)
#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <vector>

#include "layout/convex.hpp"

namespace linden {

/// Nothing where there are no points, or some are not finite, or Qhull gives up.
std::shared_ptr<const ConvexHull> convex_hull(const std::vector<Eigen::Vector3d>& points);

}  // namespace linden

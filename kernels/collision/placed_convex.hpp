// kernels/collision/placed_convex.hpp
// A convex core where it lies, and what is asked of it. Its support function
//
//   h(n) = max n.x over the core,    x(n) the place where it is reached
//
// has the gradient x(n); along a smooth part of the surface the derivative of x(n) is `bend`, whose eigenvalues are the radii of curvature.
//
//   core       h(n), n in its own axes                       bend t
//   box        |n_x| a + |n_y| b + |n_z| c                   0
//   cylinder   r rho + l |n_z|,  rho = |(n_x, n_y)|          r / rho (t less its shares along z and along (n_x, n_y))
//   ellipsoid  |A n|,  A = diag(a, b, c)                     (A^2 t - x (x.t)) / h,  x = A^2 n / h
//   hull       max over its points                           0
//
// h has *kinks* where x(n) jumps: great circles n _|_ e for edges e and for the axis of a cylinder, which its side makes; and points, where n is the
// normal of a face or of a disc.
//
// A plane has none of these, it is as high as it is along its normal alone (convex_pair.hpp); nor have heights (height_contacts.hpp).
//
// cost    support: some 10 operations, of a hull one product a point, or a climb along edges where there are over kClimbFrom of them
#pragma once

#include <array>
#include <cstdint>

#include "kernels/values/spatial.hpp"
#include "layout/convex.hpp"
#include "layout/pose.hpp"

namespace linden {

struct PlacedConvex {
  const ConvexShape& shape;
  Mat3<double> R;  // its axes as columns, in the directions of the world
  Vec3<double> p;  // its origin, from where the pair is seen from [m]
};

/// Point of the core that lies farthest along n, which need not have unit length.
Vec3<double> support(const PlacedConvex& convex, const Vec3<double>& n);

/// Derivative of the support point along t _|_ n, both of unit length, where n is at no kink; 0 at the middle of a disc.
Vec3<double> bend(const PlacedConvex& convex, const Vec3<double>& n, const Vec3<double>& t);

/// Whether bend is 0 everywhere.
inline bool is_polyhedron(const ConvexShape& shape) { return shape.kind != ConvexKind::cylinder && shape.kind != ConvexKind::ellipsoid; }

/// Distance of the core's farthest point from its origin [m]; infinite of a plane and of heights.
double core_reach(const ConvexShape& shape);

/// Kinks of h within kNear of a direction n, of those whose edges and faces meet at the support point of n. What does not fit is left out.
struct Kinks {
  static constexpr std::size_t kMost = 24;
  std::array<Vec3<double>, kMost> edges, faces;  // unit length
  std::size_t edge_count = 0, face_count = 0;
};
inline constexpr double kNear = 0.02;  // [rad]
void kinks_near(const PlacedConvex& convex, const Vec3<double>& n, Kinks& kinks);

/// What of a core faces the other: the face whose normal is within kFacing (its sine) of n, else the edge that is as near to a right angle with
/// n, else the support point. So what touches along a face or an edge does so before it lies flat and after.
inline constexpr double kFacing = 0.3;

struct Feature {
  enum class Kind : std::uint8_t { point, line, face, disc };
  static constexpr std::size_t kMost = 64;  // corners; of a hull's face that has more every so many-th is taken

  Kind kind;
  std::uint32_t id;                        // what it is of its shape
  std::size_t count;                       // corners: 1, 2, or of a face; of a disc none
  std::array<Vec3<double>, kMost> corner;  // of a face anticlockwise, seen from outside
  std::array<std::uint32_t, kMost> corner_id, side_id;  // side k: from corner k to the next
  Vec3<double> normal;                     // of face and disc, outward
  Vec3<double> center, low, aside;         // of a disc: middle, direction of the rim's place that is farthest along n, and the one across
  double radius;                           // of a disc; of a line that of the round side that it is a generator of [m]
};
void feature_along(const PlacedConvex& convex, const Vec3<double>& n, Feature& feature);

/// Box along the world's axes about a shape with its radius, at a pose. That of a plane has no end but where the plane lies square to an axis,
/// that of heights has none: their highest is not looked for.
struct Bounds {
  std::array<double, 3> low, high;  // [m]
};
Bounds bounds_of(const ConvexShape& shape, const Pose& pose);

}  // namespace linden

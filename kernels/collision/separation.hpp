// kernels/collision/separation.hpp
// How far two convex cores are apart, and along which direction. With w(n) = x_A(n) - x_B(-n), the difference of their support points, and
//
//   h(n) = n.w(n) = h_A(n) + h_B(-n),      signed distance = max over unit n of -h(n)
//
// for cores that are apart (there -h(n) has one maximum, their distance) and for such that overlap (there the largest is the least shift that parts
// them). Every n gives a bound below it.
//
//   apart      GJK: the point of A - B nearest to the origin, by simplices of support points; n = -v / |v|
//   overlap    EPA: the face of a polytope of support points that is nearest to the origin, until none lies farther out
//   polished   n of both is near, not exact where surfaces are round. The minimum of h lies at one of few places beside it: where two kinks of h
//              cross (a face's normal, the cross product of two edges), along a kink (Newton over one angle) or where h is smooth (Newton over two);
//              each is tried, and the least h taken. So n of faces and of edges is exact, and of round ones right to rounding.
//
//   Newton     with g = w - h n and H the sum of both bends: (H - h) t = -g for t _|_ n, n <- n + t
//
// limits     EPA ends after kMostCorners: of two bodies that overlap by their whole curvature radius, where all directions are nearly alike, it
//            then has one that is least nearby, not everywhere. GJK calls apart what is apart by more than 1e-7 of the size; EPA takes the rest, whose normals
//            do not come from a vanishing difference.
// cost       no allocation; GJK some 5 to 15 supports of both, EPA 10 to 100
// source     Gilbert, Johnson, Keerthi, A fast procedure for computing the distance between complex objects (1988); van den Bergen, Collision
//            Detection in Interactive 3D Environments (2003), ch. 4
#pragma once

#include "kernels/collision/placed_convex.hpp"

namespace linden {

struct Separation {
  Vec3<double> n;   // from A to B, unit length
  double distance;  // of the cores, negative where they overlap; where `beyond`, a bound below it
  bool beyond;      // it is more than the margin: n is then only near
};

/// size: a length as the cores and their distance are, for what counts as nothing.
Separation separation(const PlacedConvex& a, const PlacedConvex& b, double size, double margin);

/// Of two boxes, whose halves may be 0, by the fifteen axes that can part them: exact where they overlap, else a bound below.
Separation box_separation(const PlacedConvex& a, const PlacedConvex& b, double size);

/// Signed distance along n alone.
double distance_along(const PlacedConvex& a, const PlacedConvex& b, const Vec3<double>& n);

/// The best direction beside n, and its distance.
Separation polished(const PlacedConvex& a, const PlacedConvex& b, const Vec3<double>& n, double size);

}  // namespace linden

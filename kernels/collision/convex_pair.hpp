// kernels/collision/convex_pair.hpp
// How two convex shapes meet (contact_patch.hpp), for any two of them and for a half space and any.
//
//   cores                       by
//   point, segment              nearest points in closed form
//   point, box or cylinder      nearest point of the surface in closed form
//   segment or box, box         separating axes where they overlap (exact); GJK and polish where they are apart
//   all else                    separation.hpp
//   half space (plane), any     support along its normal
//
// The radii about cores are taken off the distance afterwards, so spheres, capsules and round edges stay exact as long as the cores are apart, and
// are the cores' overlap and the radii where they are not.
//
// All is computed as seen from A's origin: how far both are from the world's does not matter to what is between them. The result hangs on the
// arguments alone, to the bit.
//
// A capsule is a line with two ends that touches along its length, a sphere a point: patch_points.hpp says how many points a patch has.
//
// accuracy   distances of points, segments, boxes: a few roundings of the size (a length as the shapes and what lies between them are); others
//            1e-12 of it where n is settled (separation.hpp)
// cost       no allocation
#pragma once

#include "kernels/collision/contact_patch.hpp"
#include "kernels/collision/placed_convex.hpp"

namespace linden {

/// margin: patches are wanted up to this gap [m]; infinite for the distance whatever it is. One of both at most is a plane.
ContactPatch contact_patch(const ConvexShape& a, const Pose& pose_a, const ConvexShape& b, const Pose& pose_b, double margin);

/// The half space n.x <= offset as A: normal n, of unit length.
ContactPatch plane_patch(const Vec3<double>& n, double offset, const ConvexShape& b, const Pose& pose_b, double margin);

}  // namespace linden

// kernels/collision/patch_points.hpp
// Where two features meet along a direction n: their common part, seen along n, and its corners.
//
//   point        with anything: itself
//   line, line   where they cross; where they are nearly parallel two places, see below
//   line, face   the ends of what of the line lies over the face; a disc likewise
//   face, face   corners of either over the other, and where their sides cross
//   disc         as a face, whose corners are four places of its rim: that which is farthest along n, those a quarter turn away and the opposite
//
// A place of a face is as high along n as the plane of that face is there, so faces that are tilted have gaps of their own at each place.
//
// Lines that run past each other at an angle theta, round ones (capsules, cylinders lying), touch at one place, but as they turn to parallel that
// place runs along them without end. Two places stand for it there, this far to either side of it along the lines, cut off where one line ends:
//
//   delta = kLinesApart r (1 / sin theta - 1 / kLinesParallel),     r the sum of the radii across the lines
//
// So they part at sin theta = kLinesParallel and are the ends of the common part in the end. Beside the crossing the surfaces are farther apart than
// there by no more than (kLinesApart r)^2 / 2 r, which is left aside: both have the gap of the crossing.
//
// Of more than four corners four are kept: one that lies farthest in a direction, the one farthest from it, and those that are farthest on either
// side of the line between these; and the deepest.
#pragma once

#include "kernels/collision/contact_patch.hpp"
#include "kernels/collision/placed_convex.hpp"

namespace linden {

inline constexpr double kLinesParallel = 0.1;
inline constexpr double kLinesApart = 0.01;

/// Points with a gap of no more than the margin, sorted, into a patch whose normal and distance (of the shapes, with their radii) are set. size: as
/// in separation(). Places are those from where the pair is seen from.
void patch_points(const PlacedConvex& a, const PlacedConvex& b, double size, double margin, ContactPatch& patch);

/// The same of the half space on the other side of the plane n.x = offset, n the patch's normal, and a shape.
void plane_points(double offset, const PlacedConvex& b, double size, double margin, ContactPatch& patch);

}  // namespace linden

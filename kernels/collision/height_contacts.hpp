// kernels/collision/height_contacts.hpp
// Where a convex shape meets what lies below a height field. That surface is faces (two triangles a cell), edges and vertices, and each has normals
// of its own, along which alone it pushes:
//
//   of the field    has the normals                                  meets
//   face            its own                                          the corners of the shape's feature along it (patch_points.hpp) that lie over it
//   edge            those between the normals of both its faces,     the shape's edges and round sides that cross it
//                   where it turns down
//   vertex          those that no neighbour of it is higher along,   the shape's faces and round sides
//                   where it is a peak
//
// So an edge within a plane, which has one normal, is none, and whatever slides or rolls on level or tilted triangles does so as on one plane. A normal
// that is found outside of those of an edge or vertex is another feature's; that of a face of the shape, up to kFacing outside, is taken as the nearest
// one inside, so that what lies along a face does so before it lies flat and after.
//
// Over an edge that turns up a face goes on under the next one, by the margin and a quarter of a cell at most: what touches that comes to it next. What
// lies below the surface belongs to the face straight above it. Beyond the edge of the map cells go on as HeightField says.
//
// Features: what touches with one corner or round place of the shape is called by that, and by its place in the order of its normals where it touches
// several times: it keeps its name from face to face, over edges and peaks. Else by edge and end, or vertex.
//
// accuracy   on faces a few roundings of a length as the shape and its distance from the field's origin are; else as convex_pair.hpp
// limits     kMostHeightContacts places, of more the deepest and those that are farthest from the others in place and normal; of over 128 the deepest.
//            Farther than 1e8 cells off nothing is met.
// cost       no allocation; each cell under the shape some 100 to 500 operations, edges and peaks near it as a pair of convex shapes each
#pragma once

#include <array>
#include <cstddef>

#include "kernels/collision/contact_patch.hpp"
#include "kernels/collision/placed_convex.hpp"

namespace linden {

/// One place where they meet.
struct HeightContact {
  Vec3<double> normal;  // from the field to the shape, unit length, in the world
  PatchPoint point;
  bool on_face = false;  // of the field: what is round rolls there, and does not turn about an edge or a peak
};

inline constexpr std::size_t kMostHeightContacts = 16;

struct HeightContacts {
  std::array<HeightContact, kMostHeightContacts> at;
  std::size_t count = 0;  // none where they are farther apart than the margin; sorted by feature
};

/// A field at a pose, and a shape that has an end; up to this gap [m], which is finite.
void height_contacts(const HeightField& field, const Pose& pose, const ConvexShape& shape, const Pose& pose_of_shape, double margin, HeightContacts& found);

/// Whether two shapes of any kind, one with an end at least, are no farther apart than a gap [m].
bool are_near(const ConvexShape& a, const Pose& pose_a, const ConvexShape& b, const Pose& pose_b, double margin);

}  // namespace linden

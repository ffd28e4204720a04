// layout/contacts.hpp
// Where bodies may touch the ground: the collision shapes of a robot's file, reduced to what a plane can meet first. The gap between one of
// these and the ground is that of the shape (kernels/effects/contact_geometry.hpp): a sphere or rim that rolls is met at its lowest place, whatever
// material that is.
//
//   shape      spheres                         rims               blocks
//   sphere     one
//   box        one of radius 0 a corner                           itself
//   capsule    one at each end                                    what lies between them
//   cylinder                                   one at each end
//   mesh       the corners of its bounding box                    that box
//
// Blocks are for what a plane never meets first: ridges and peaks of a terrain.
//
// What coincides where a size is 0 is in here once. models/shapes/contacts_of.hpp works them out.
//
// All in the frame of the body that carries the link (slot 0: fixed to the world, never in here).
#pragma once

#include <array>
#include <string>
#include <vector>

#include "layout/field.hpp"

namespace linden {

/// A ball of matter; radius 0: a corner.
struct ContactSphere {
  Index slot;
  std::array<double, 3> center;  // [m]
  double radius;                 // [m]
  std::array<double, 3> outward{};  // of the end of a capsule: along its axis, unit length
};

/// The edge of a disc: its lowest place touches first, and the places a quarter turn away and opposite hold it where it lies flat.
struct ContactRim {
  Index slot;
  std::array<double, 3> center;  // [m]
  std::array<double, 3> axis;    // unit length
  double radius;                 // [m]
};

/// A box, or a line with a radius about it: two of its halves are 0.
struct ContactBlock {
  Index slot;
  std::array<double, 3> center;                // [m]
  std::array<std::array<double, 3>, 3> axes;   // unit length, orthogonal
  std::array<double, 3> half;                  // edges along them [m]
  double radius = 0;                           // [m]
};

struct Contacts {
  std::vector<ContactSphere> spheres;  // sorted by slot
  std::vector<ContactRim> rims;        // sorted by slot
  std::vector<ContactBlock> blocks;    // sorted by slot
  bool empty() const { return spheres.empty() && rims.empty(); }
};

}  // namespace linden

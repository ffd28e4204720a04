// layout/body_constants.hpp
// What never changes about the bodies of a tree while it moves. Read by nearly every sweep.
//
// Scalar is double or float where all instances share one robot, a pack where masses differ from instance to instance.
#pragma once

#include "layout/tree.hpp"

namespace linden {

#define LINDEN_BODY_CONSTANTS_FIELDS(FIELD)                                                                        \
  FIELD(Scalar, screw, 2, slots, "r [rad per unit], t [m per unit] of a screw joint; 0 0 for other kinds")         \
  FIELD(Scalar, tree_placement, 12, slots, "body frame at q = 0 in the parent's: rotation row by row, shift [m]")  \
  FIELD(Scalar, inertia, 10, slots, "m [kg], m c [kg m], Ixx Ixy Ixz Iyy Iyz Izz [kg m^2] about the frame's origin") \
  FIELD(Scalar, subtree_mass, 1, slots, "mass of the body and all its descendants [kg]")

template <class Scalar>
struct BodyConstants {
  LINDEN_FIELDS(LINDEN_BODY_CONSTANTS_FIELDS)
};

/// Rows of the masses of one body where instances have their own: inertia, subtree_mass.
inline constexpr Index kMassRows = 11;

/// subtree_mass from the masses of the bodies.
template <class Constants>
void sum_subtree_masses(const Tree& tree, Constants& constants) {
  for (Index i = tree.shape.slots - 1; i >= 0; --i) constants.subtree_mass(i) = constants.inertia(i, 0);
  for (Index i = tree.shape.slots - 1; i > 0; --i) {
    constants.subtree_mass(tree.parent(i)) = constants.subtree_mass(tree.parent(i)) + constants.subtree_mass(i);
  }
}

}  // namespace linden

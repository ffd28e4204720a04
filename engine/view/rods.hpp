// engine/view/rods.hpp
// What stands for a body of which no shape is known: rods from its own joint to the joints that it carries, or, where it carries none, to
// twice its centre of mass.
//
//   radius   that of rods of 2500 kg/m^3 with the body's mass, within 3 to 12 percent of the longest; of a body whose rods have no length
//            that of a ball of its mass
#pragma once

#include <Eigen/Core>
#include <vector>

#include "layout/model.hpp"

namespace linden {

struct BodyRods {
  std::vector<Eigen::Vector3d> ends;  // of rods from the origin of the body's frame [m]
  double radius = 0;                  // [m]; 0: there is nothing to be seen
  bool carries = false;               // its ends are joints of other bodies
};

/// children: slots of the bodies that hang on this one.
BodyRods rods_of(const Model& model, Index slot, const std::vector<Index>& children);

}  // namespace linden

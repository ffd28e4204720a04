// models/urdf/urdf_shapes.hpp
// The <collision> elements of a link, or its <visual> ones where a mass is to come from them: an <origin> and the first known shape within <geometry>.
//
//   <sphere radius/>  <box size/>  <cylinder radius length/>  <mesh filename scale/>     as the URDF standard has them
//   <capsule radius length/>                                                             an extension; length without the ends
//
// Sizes are zero or more; a mesh may be mirrored by a negative scale. Files of meshes are not opened. Where there is no shape the
// element is left out with a warning; a number or name that is missing or wrong throws InputError, as in models/urdf/urdf_check.hpp.
#pragma once

#include <vector>

#include "layout/shapes.hpp"
#include "models/urdf/urdf_structure.hpp"

namespace linden {

/// `tag`: collision or visual.
std::vector<LinkShape> shapes_of(const UrdfLink& link, UrdfReport& report, const char* tag = "collision");

}  // namespace linden

// models/urdf/urdf_shapes.hpp
// The <collision> elements of a link: an <origin> and the first known shape within <geometry>. <visual> has its shape written the same way.
//
//   <sphere radius/>  <box size/>  <cylinder radius length/>  <mesh filename scale/>     as the URDF standard has them
//   <capsule radius length/>                                                             an extension; length without the ends
//
// Sizes are zero or more; a mesh may be mirrored by a negative scale. Files of meshes are not opened. Where there is no shape the
// element is left out with a warning; a number or name that is missing or wrong throws InputError, as in models/urdf/urdf_check.hpp.
#pragma once

#include <optional>
#include <vector>

#include "layout/shapes.hpp"
#include "models/urdf/urdf_structure.hpp"

namespace linden {

std::vector<LinkShape> shapes_of(const UrdfLink& link, UrdfReport& report);

/// The shape of one <collision> or <visual> of a link; nothing, with a warning, where it holds none.
std::optional<LinkShape> shape_of(const tinyxml2::XMLElement& holder, const UrdfLink& link, UrdfReport& report);

}  // namespace linden

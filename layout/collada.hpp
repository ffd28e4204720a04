// layout/collada.hpp
// The box about what a COLLADA file shows; layout/mesh_box.hpp says what is read and what is not.
//
//   <scene> -> <visual_scene> -> <node>, each within another: matrix, translate, rotate, scale, in the order they stand
//           -> <instance_geometry>, <instance_node> -> <geometry><mesh><vertices> -> <source> of its positions
#pragma once

#include <string>

#include "layout/mesh_box.hpp"

namespace linden {

/// Throws InputError: `file: what was found; what was expected`.
MeshBox collada_box(const std::string& file);

}  // namespace linden

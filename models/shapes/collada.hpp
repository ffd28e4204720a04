// models/shapes/collada.hpp
// What a COLLADA file shows; models/shapes/mesh_file.hpp says what is read and what is not.
//
//   <scene> -> <visual_scene> -> <node>, each within another: matrix, translate, rotate, scale, in the order they stand
//           -> <instance_geometry>, <instance_node> -> <geometry><mesh><vertices> -> <source> of its positions
//                                                           -> <triangles>, <polylist>, <polygons>, <tristrips>, <trifans> of these
#pragma once

#include <string>

#include "models/shapes/mesh_file.hpp"

namespace linden {

/// Throws InputError: `file: what was found; what was expected`.
void read_collada(const std::string& file, MeshSink& sink);

}  // namespace linden

// models/shapes/mesh_box.hpp
// The box about the points of a mesh file, along the file's axes. models/shapes/mesh_file.hpp says what is read and what is not.
#pragma once

#include <Eigen/Geometry>
#include <string>

namespace linden {

using MeshBox = Eigen::AlignedBox<double, 3>;

/// Throws InputError: `file: what was found; what was expected`.
MeshBox mesh_box(const std::string& file);

/// Throws InputError where there are no points, or they lie too far apart.
void require_extent(const MeshBox& box, const std::string& file);

}  // namespace linden

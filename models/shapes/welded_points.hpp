// models/shapes/welded_points.hpp
// Points of a mesh that are one: files write a corner once for each face, and round it.
//
// Points nearer than 1e-5 of the mesh's size count as one, but for those that lie to both sides of a line of the grid that they are sorted
// by.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "models/shapes/mesh_box.hpp"

namespace linden {

/// For each point the number of the first that lies where it does. Empty where all of them do. box: about the points.
std::vector<std::uint32_t> welded(const std::vector<Eigen::Vector3d>& points, const MeshBox& box);

}  // namespace linden

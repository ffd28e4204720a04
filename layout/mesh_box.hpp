// layout/mesh_box.hpp
// The box about the points of a mesh file, along the file's axes.
//
//   .stl  binary or text: the corners of its triangles
//   .obj  its vertices, the w and colours behind them left aside
//   .dae  COLLADA: the positions of all geometries that its scene shows, as its nodes place them; of all there are, where it has
//         no scene. In metres, as <unit> says. <up_axis> is not obeyed: robots' files take meshes as they stand, as RViz and
//         MoveIt do, and many call y up where they mean z.
//
// reads   STL and OBJ a piece at a time; COLLADA whole, with the memory of some times its size
// bounds  a count in a file is believed only where the file is long enough for it; scenes that show themselves, or one geometry
//         over and over, are refused
// source  COLLADA 1.4.1, Digital Asset Schema Release, ch. 5
#pragma once

#include <Eigen/Geometry>
#include <string>

namespace linden {

using MeshBox = Eigen::AlignedBox<double, 3>;

/// Throws InputError: `file: what was found; what was expected`.
MeshBox mesh_box(const std::string& file);

}  // namespace linden

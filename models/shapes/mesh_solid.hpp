// models/shapes/mesh_solid.hpp
// The solid that the triangles of a mesh file enclose: volume, centre and second moments of it, of density one.
//
//   tetrahedron (0, a, b, c), d = a . (b x c):   V = d / 6,   int x dV = d / 24 s,   int x x^T dV = d / 120 (s s^T + a a^T + b b^T + c c^T)
//   with s = a + b + c, summed over the triangles with their signs; I = tr(C) 1 - C
//
// A mesh is closed where every edge is run along as often one way as the other: the sums are then those of a solid wherever the origin lies.
// Points nearer than 1e-5 of the mesh's size count as one, as files round them. A mesh turned inside out is turned back.
//
// reads   models/shapes/mesh_file.hpp
// cost    memory of all points and triangles; one pass over these
// source  Mirtich, Fast and accurate computation of polyhedral mass properties (1996); Tonon, Explicit exact formulas for the 3-D
//         tetrahedron inertia tensor (2004)
#pragma once

#include <Eigen/Core>
#include <string>

#include "models/shapes/mesh_box.hpp"

namespace linden {

struct MeshSolid {
  MeshBox box;          // scaled [m]
  bool closed = false;  // else the rest is not known
  double volume = 0;    // [m^3]
  Eigen::Vector3d center = Eigen::Vector3d::Zero();        // [m]
  Eigen::Matrix3d about_center = Eigen::Matrix3d::Zero();  // [m^5]
};

/// Points are multiplied by `scale`, which may mirror. Throws InputError: `file: what was found; what was expected`.
MeshSolid mesh_solid(const std::string& file, const Eigen::Vector3d& scale);

}  // namespace linden

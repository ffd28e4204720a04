// engine/view/corner_normals.hpp
// Normals for triangles that come without, or with ones that are not to be relied upon.
//
//   An edge is smooth where two triangles run along it in opposite directions and their normals differ by less than the crease angle.
//   Corners at one point that smooth edges connect share a normal, the mean of their triangles' weighted by the angles at the point; the
//   others have their own. Where more than two triangles meet at an edge, those whose normals are nearest go together.
//   Triangles without area have no normal and are left out. A closed mesh that was turned inside out is turned back.
//
// cost    sorting of the edges
// source  Thuermer and Wuethrich, Computing vertex normals from polygonal facets (1998), for the weights
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "engine/view/drawing.hpp"

namespace linden {

inline constexpr double kCreaseDegrees = 40;

/// Points with a normal each, once for each normal that there is at a place.
struct ShadedTriangles {
  std::vector<Eigen::Vector3d> places, normals;
  std::vector<std::array<std::uint32_t, 3>> triangles;  // as they came; three times the same point where there is no area
};

/// Triangles that touch must name the same points.
ShadedTriangles shaded(const std::vector<Eigen::Vector3d>& points, const std::vector<std::array<std::uint32_t, 3>>& triangles);

/// The triangles of these numbers as a mesh of their own. Numbers too large for float become infinite.
TriangleMesh mesh_of(const ShadedTriangles& all, const std::vector<std::uint32_t>& which);
TriangleMesh mesh_of(const ShadedTriangles& all);

}  // namespace linden

// layout/convex.hpp
// Convex shapes that bodies touch each other with: a core, and a radius about it. Plain values; models/shapes/convex_of.hpp works them out from
// the shapes of a robot's file, kernels/collision/ says how far two of them are apart.
//
//   kind       half                                      with a radius
//   point      -                                         sphere
//   segment    half length along z in [2]                capsule
//   box        half edges along x, y, z                  box with round edges
//   cylinder   radius in [0], half length along z in [2] cylinder with round rims
//   ellipsoid  semi-axes along x, y, z
//   hull       -                                         hull with round edges
//   plane      -                                         the half space below z = 0, without end; of the world alone
//   heights    -                                         not convex: what lies below a height field's surface, z up; of the world alone
//
// Any half may be 0: a box is then a plate or a line, a cylinder a disc.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "layout/field.hpp"
#include "layout/height_field.hpp"
#include "layout/pose.hpp"

namespace linden {

/// The convex hull of points, with what is a corner of what. models/shapes/convex_hull.hpp makes it. Where all points lie in a plane it has two
/// faces, one a side; where they lie on a line two points and no faces.
struct ConvexHull {
  struct Face {
    std::array<double, 3> normal;  // unit length, outward
    std::uint32_t first, count;    // in corners
  };
  std::vector<std::array<double, 3>> points;  // corners of the hull alone [m]
  std::vector<Face> faces;
  std::vector<std::uint32_t> corners;  // of faces, anticlockwise seen from outside
  // of point k: [first_face[k], first_face[k + 1]) of face_of, the faces that it is a corner of; likewise the points that its edges lead to
  std::vector<std::uint32_t> first_face, face_of;
  std::vector<std::uint32_t> first_neighbour, neighbour;
  std::array<std::uint32_t, 6> extreme{};  // the points that lie farthest along -x, x, -y, y, -z, z
  double reach = 0;                        // distance of the farthest point from the origin [m]
};

enum class ConvexKind : std::uint8_t { point, segment, box, cylinder, ellipsoid, hull, plane, heights };

struct ConvexShape {
  ConvexKind kind = ConvexKind::point;
  std::array<double, 3> half{};                    // [m]
  double radius = 0;                               // about the core [m]
  std::shared_ptr<const ConvexHull> hull{};        // of that kind alone; never empty there
  std::shared_ptr<const HeightField> heights{};    // likewise
};

/// Whether it goes on without end.
constexpr bool is_endless(ConvexKind kind) { return kind == ConvexKind::plane || kind == ConvexKind::heights; }

/// One of a model.
struct ConvexBody {
  Index slot;        // body that carries it; 0: fixed to the world
  std::string link;  // that has it
  Pose pose;         // of the shape's axes in the body's frame
  ConvexShape shape;
};

}  // namespace linden

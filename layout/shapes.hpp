// layout/shapes.hpp
// Collision shapes and visuals as a robot's file gives them: plain values, nothing worked out yet. What a ground makes of the first stands
// in layout/contacts.hpp, what is drawn of both in engine/view/drawing.hpp.
//
//   kind       size
//   sphere     radius
//   box        edges along x, y, z
//   cylinder   radius, length along z
//   capsule    radius, length along z from the centre of one round end to that of the other
//   mesh       scale along x, y, z of the points in its file; a negative one mirrors
//   ellipsoid  semi-axes along x, y, z; of the world alone
//   plane      -; all that lies below z = 0, without end; of the world alone
//   heights    -; all that lies below a height field, z up; of the world alone
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "layout/field.hpp"
#include "layout/height_field.hpp"
#include "layout/pose.hpp"

namespace linden {

enum class ShapeKind : std::uint8_t { sphere, box, cylinder, capsule, mesh, ellipsoid, plane, heights };

/// Links that move have none of these.
constexpr bool is_of_world_alone(ShapeKind kind) { return kind == ShapeKind::ellipsoid || kind == ShapeKind::plane || kind == ShapeKind::heights; }

struct CollisionShape {
  ShapeKind kind = ShapeKind::sphere;
  std::array<double, 3> size{};  // [m], of a mesh [1]; what a kind does not use is 0
  std::string mesh;              // the file, as the source calls it
  std::shared_ptr<const HeightField> heights{};  // of that kind alone
};

/// A shape of a link; the centre of all but meshes is the pose's.
struct LinkShape {
  Pose pose;  // in the link's frame
  CollisionShape shape;
};

/// The same once links are merged into bodies.
struct BodyShape {
  Index slot;
  std::string link;  // that had it
  Pose pose;         // in the body's frame
  CollisionShape shape;
};

/// How a visual looks. Files of textures are not opened.
struct Material {
  std::string name;                             // as the source calls it; may be empty
  std::optional<std::array<double, 4>> rgba{};  // red, green, blue in sRGB, opacity, 0 to 1; none: the source gives no colour
  std::string texture{};                        // file, as the source calls it; may be empty
};

/// A shape that is seen and touches nothing.
struct LinkVisual {
  LinkShape shape;
  Material material;
};

struct BodyVisual {
  BodyShape shape;
  Material material;
};

}  // namespace linden

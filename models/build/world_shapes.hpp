// models/build/world_shapes.hpp
// Shapes that stand in the world beside what a model's files fix to it: floors, walls, tables, posts. Bodies touch them by contact
// (layout/effects/contact.hpp), and they are drawn and found by name as the shapes of links are.
//
// They are links of slot 0 called "world/NAME". No joint sits on one of them, so bodies that hang on the world touch them too
// (models/shapes/collision_pairs.hpp).
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "layout/model.hpp"
#include "layout/support/input_error.hpp"

namespace linden {

/// Where a plane is (ShapeKind::plane) that lies square to a normal, of any length, as far along it from the origin as its height [m]. Throws
/// InputError for a normal that is zero, or numbers that are not finite.
Pose plane_pose(const std::array<double, 3>& normal, double height);

struct WorldShape {
  std::string name;      // without "world/"
  CollisionShape shape;  // a mesh by the whole path of its file; it stands as the convex hull of its points
  Pose pose{};           // in the world
};

/// The model with these standing in its world. Throws InputError where a name is empty or there already, a size is not above zero (a scale of a
/// mesh: zero), or a number is not finite.
Model with_world(Model model, const std::vector<WorldShape>& shapes);

/// Whether a link of slot 0 is such a shape.
bool stands_in_world(std::string_view link);

/// What such a shape is called as a link.
std::string world_link(std::string_view name);

}  // namespace linden

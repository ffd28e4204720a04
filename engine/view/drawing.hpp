// engine/view/drawing.hpp
// What a model looks like: triangle meshes, and parts that put them on bodies. Made when somebody looks; no step reads it.
//
//   Drawing drawing = drawing_of(model, effects);
//
//   layer      parts
//   visual     the <visual> elements of a URDF with their colours; of a tree of bodies, or a model in it, that has none its collision
//              shapes; where it has none of these either a rod from each joint to those behind it, as thick as the body's mass tells
//   collision  the shapes that touch the ground and each other
//   inertia    of each body with mass the box of even density that has its mass and inertia
//   ground     the plane or terrain of a scene, and planes and heights that stand in the world, on slot 0, as large as the model can reach
//
// A colour in a mesh file counts before that of its <material>, as in RViz. Where a file cannot be drawn the link's collision shapes stand
// in for it, or if they cannot be drawn either, and nothing else is seen of the body, the box of its inertia.
//
// Sphere, box, cylinder and each colour of a mesh file are a mesh each, however many parts show them: who draws them can draw all parts of
// a mesh at once. A file that a scale mirrors is a mesh of its own, so that no part mirrors its mesh. The more bodies there are, the fewer
// triangles a sphere and a cylinder have. Coordinates are as everywhere: metres, z up.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "layout/effects.hpp"
#include "layout/model.hpp"

namespace linden {

/// Triangles with a normal at each corner; a corner that two faces share with different normals is there twice.
struct TriangleMesh {
  std::vector<float> positions;        // [3 x points, m or units of a part's scale]
  std::vector<float> normals;          // [3 x points], unit length
  std::vector<std::uint32_t> indices;  // [3 x triangles], counter-clockwise seen from outside
};

enum class Layer : std::uint8_t { visual, collision, inertia, ground };

using Colour = std::array<float, 4>;  // red, green, blue in sRGB, opacity; 0 to 1

struct DrawnPart {
  std::string link;             // that it belongs to
  Index slot = 0;               // body that carries it; 0: fixed to the world
  std::uint32_t mesh = 0;       // of Drawing::meshes
  Layer layer = Layer::visual;
  Pose pose{};                   // in the body's frame
  std::array<double, 3> scale{1, 1, 1};  // of the mesh along its own axes, before the pose; above 0
  Colour colour{0.7F, 0.7F, 0.7F, 1};
};

struct Drawing {
  std::vector<TriangleMesh> meshes;
  std::vector<DrawnPart> parts;       // sorted by slot
  std::vector<std::string> warnings;  // what is not drawn as the model says, each once: files that are missing, and what stands in for them
};

/// Opens the files of meshes that the model names, each once. Nothing that is missing or wrong is an error: it is told and drawn as what is
/// known of it.
Drawing drawing_of(const Model& model, const Effects& effects = {});

}  // namespace linden

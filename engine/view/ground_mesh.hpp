// engine/view/ground_mesh.hpp
// The surface that bodies touch, in the frame of its plane (engine/effects/plane_frame.hpp).
//
// A terrain goes on beyond its map as layout/effects/ground.hpp says. Of a map of over 250,000 points every second, third, ... along x and y
// is drawn, and its last ones.
#pragma once

#include "engine/view/drawing.hpp"

namespace linden {

struct GroundMesh {
  TriangleMesh mesh;
  Pose pose;       // of the plane in the world
  Index step = 1;  // how many points of a terrain on from one another are drawn
};

/// reach: half the edge of a plane, and how far a terrain goes on beyond its map [m].
GroundMesh ground_mesh(const Ground& ground, double reach);

}  // namespace linden

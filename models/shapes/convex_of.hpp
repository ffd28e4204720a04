// models/shapes/convex_of.hpp
// The convex shapes that a model's links touch each other with, from the collision shapes of its file (layout/convex.hpp).
//
//   shape                   becomes
//   sphere, box, cylinder   itself; an ellipsoid, a plane and heights likewise
//   capsule                 a segment with a radius
//   mesh                    the convex hull of its points: what is hollow or bent inward is filled
#pragma once

#include <string>
#include <vector>

#include "layout/convex.hpp"
#include "layout/model.hpp"

namespace linden {

/// Of all shapes of a model, those fixed to the world first, in the order of its slots. Notes say which meshes were not found or not read, and so
/// touch nothing, and how many stand as their hulls.
std::vector<ConvexBody> convex_of(const Model& model, std::vector<std::string>& notes);

}  // namespace linden

// engine/effects/plane_frame.hpp
// The frame of a ground's plane: what x and y of a terrain are, in the world.
#pragma once

#include <array>

namespace linden {

/// Axes x, y, z of the plane, each in the world frame. normal: unit length; it is z.
std::array<std::array<double, 3>, 3> plane_frame(const std::array<double, 3>& normal);

}  // namespace linden

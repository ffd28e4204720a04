// kernels/effects/terrain_height.hpp
// The height of a terrain at one place of its plane: what lies straight below.
#pragma once

#include "layout/effects.hpp"

namespace linden {

/// x, y in the plane's frame; above the plane [m]. Beyond the map as HeightField says; -infinity where it lies too far off for numbers.
double height_below(const HeightField& field, double x, double y);

}  // namespace linden

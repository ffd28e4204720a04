// kernels/collision/contact_patch.hpp
// Where two convex shapes meet.
//
// The gap of a pair is the signed distance of its shapes: that of their nearest points, or less than zero by the least shift that would part them.
// Its derivative is n.(v_B - v_A) at the place where they meet.
//
// A *feature* is a number made of what touches, a corner, an edge, a face, a rim of either shape: as long as the same touch, the same points keep it
// while they wander. No number comes twice in a patch.
#pragma once

#include <array>
#include <cstdint>

#include "kernels/values/spatial.hpp"

namespace linden {

struct PatchPoint {
  Vec3<double> place;     // midway between the two surfaces, in the world [m]
  double gap;             // along the normal; negative where they overlap [m]
  std::uint64_t feature;  // of A in the upper half, of B in the lower
};

struct ContactPatch {
  double distance;      // signed [m]; where it is more than the margin it may be a bound below it
  Vec3<double> normal;  // from A to B, unit length, in the world
  int count = 0;        // none where the distance is more than the margin
  std::array<PatchPoint, 4> points;  // by feature

  /// The point that is the nearest.
  const PatchPoint& nearest() const {
    int best = 0;
    for (int k = 1; k < count; ++k) {
      if (points[static_cast<std::size_t>(k)].gap < points[static_cast<std::size_t>(best)].gap) best = k;
    }
    return points[static_cast<std::size_t>(best)];
  }
};

}  // namespace linden

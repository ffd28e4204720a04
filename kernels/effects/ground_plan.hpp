// kernels/effects/ground_plan.hpp
// The ground as its sweeps read it: where shapes may touch it, and the numbers that do not change. Plain data; the law stands in
// kernels/effects/ground.hpp.
//
// A candidate is a sphere (radius 0: a corner), a rim or a block. On a plane a sphere is one point, a rim four: the lowest of its circle, the
// highest, and the two between; a block is none. On a terrain, where a candidate may rest on several features at once, each has some ranks of
// them: a sphere one point a rank, a rim its four on the first and its lowest on each further one, a block one a rank.
#pragma once

#include <array>
#include <vector>

#include "layout/effects.hpp"

namespace linden {

/// Features of a terrain that one candidate can rest on at once: three hold a ball in a corner.
inline constexpr int kTerrainRanks = 3;

/// The same of a block: two ridges that cross two of its edges each, and two peaks between them.
inline constexpr int kBlockRanks = 6;

struct GroundPoint {
  Index slot;
  std::array<double, 3> center;
  double radius;
  std::array<double, 3> axis{};  // of the rim; of the end of a capsule, outward
  double rim_radius = 0;         // 0: a sphere
  int quarter = 0;               // 0 the lowest, 2 the highest, 1 and 3 between
  int rank = 0;                  // which of the features that are near
  int block = -1;                // of the ground's contacts; -1: none
  bool begins_candidate() const { return rank == 0 && quarter == 0; }
};

struct GroundPlan {
  Ground ground;
  std::array<std::array<double, 3>, 3> frame{};  // x, y and normal of the plane, world frame
  double least_load = 0;                         // N_least [N], under the gravity of the options
  double highest = 0;                            // of the terrain over the plane [m]
  std::vector<GroundPoint> points;               // sorted by slot; those of one candidate together
  std::vector<double> share;                     // s of the normal force, one number a point
  double recovery = 0;                           // depth that may come back in a step without having been there before [m]
  /// Numbers that the points keep from step to step (EffectSweeps::kept).
  Index kept() const { return static_cast<Index>(points.size()) * (ground.terrain ? 2 : 1); }
};

}  // namespace linden

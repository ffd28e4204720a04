// What contact between bodies costs on this machine, by how many places touch: what it does in a step depends on that, so no sweep of a
// fixed cost stands for it (engine/sweeps/schedule.hpp).
//
//   find    at the beginning of a step: which pairs of shapes are near, and where they meet      with the pairs
//   rows    three for each place, and what the tree feels of them, in each factor                with the places, and the joints to the world
//   solve   which of them press, stick or slide, all together, after each factor                 grows faster than the places that touch each other
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/scene/scene.hpp"

namespace linden {

/// Steps in which `least` to `most` places pressed.
struct TouchingSteps {
  std::size_t least, most;
  std::int64_t count;
  double seconds;  // of one, all of it; mean
};

struct ContactCost {
  std::size_t pairs = 0;  // of shapes that may touch
  std::size_t near = 0;   // places where some are near each other, after the last step
  double find = 0;        // of a call there [s]
  std::vector<TouchingSteps> steps{};  // those that were taken, in ascending order of places
};

/// Takes the scene, which has contact, from its start for up to half a second by the clock, or its duration.
ContactCost contact_cost(const Scene& scene);

}  // namespace linden

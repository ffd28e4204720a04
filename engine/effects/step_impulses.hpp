// engine/effects/step_impulses.hpp
// What effects did in a step: their impulses, kept only where somebody asks (Stepper::keep_impulses). A step that is split, or has sub-steps,
// adds up its parts. Blows at limits are not among them: they have no duration.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace linden {

struct StepImpulses {
  std::vector<double> joints;         // [nv; N m s, N s] of all effects, conjugate to the velocities
  std::vector<double> servos;         // of each, in the order of Effects::servos
  std::vector<double> ground;         // of each contact point, along the normal [N s]
  std::vector<unsigned char> closed;  // contact points that the ground pushes in the part taken last

  void clear() {
    for (std::vector<double>* numbers : {&joints, &servos, &ground}) std::ranges::fill(*numbers, 0.0);
    std::ranges::fill(closed, static_cast<unsigned char>(0));
  }
  void add(const StepImpulses& part) {
    const auto sum = [](std::vector<double>& mine, const std::vector<double>& more) {
      for (std::size_t k = 0; k < mine.size(); ++k) mine[k] += more[k];
    };
    sum(joints, part.joints);
    sum(servos, part.servos);
    sum(ground, part.ground);
    closed = part.closed;
  }
};

}  // namespace linden

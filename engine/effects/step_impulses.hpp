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
  std::vector<double> bodies;         // [slots x 6; N m s, N s] of all effects on each body: moment about its origin, force; in its frame
                                      // at the beginning of the part
  std::vector<double> ground;         // of each contact point, along the normal [N s]
  std::vector<double> pushes;         // [points x 3; N s] of each contact point, friction with it; world frame
  std::vector<double> normals;        // [points x 3] of the ground there, world frame; where the part taken last ended
  std::vector<double> places;         // [points x 3; m] of contact, body frame; likewise
  std::vector<unsigned char> closed;  // contact points that the ground pushes in the part taken last

  void clear() {
    for (std::vector<double>* numbers : {&joints, &servos, &bodies, &ground, &pushes}) std::ranges::fill(*numbers, 0.0);
    std::ranges::fill(closed, static_cast<unsigned char>(0));
  }
  void add(const StepImpulses& part) {
    const auto sum = [](std::vector<double>& mine, const std::vector<double>& more) {
      for (std::size_t k = 0; k < mine.size(); ++k) mine[k] += more[k];
    };
    sum(joints, part.joints);
    sum(servos, part.servos);
    sum(bodies, part.bodies);
    sum(ground, part.ground);
    sum(pushes, part.pushes);
    normals = part.normals;
    places = part.places;
    closed = part.closed;
  }
};

}  // namespace linden

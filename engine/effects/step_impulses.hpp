// engine/effects/step_impulses.hpp
// What effects did in a step: their impulses, kept only where somebody asks (Stepper::keep_impulses). A step that is split, or has sub-steps,
// adds up its parts. Blows at limits are not among them: they have no duration.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "layout/field.hpp"

namespace linden {

/// Of a place where two bodies touch.
struct TouchImpulse {
  std::size_t pair;                  // of the effect's pairs of shapes
  std::uint64_t feature;             // which of its places
  Index slot_a, slot_b;              // bodies; 0: the world
  std::array<double, 3> place{};     // world frame [m]
  std::array<double, 3> normal{};    // from a to b, world frame
  std::array<double, 3> impulse{};   // on b, world frame [N s]
  std::array<double, 3> moment{};    // likewise, against rolling and spinning, beside that of the impulse at its place [N m s]
};

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
  std::vector<TouchImpulse> touches;  // places where bodies pushed each other in the part taken last, with what they did before

  void clear() {
    for (std::vector<double>* numbers : {&joints, &servos, &bodies, &ground, &pushes}) std::ranges::fill(*numbers, 0.0);
    std::ranges::fill(closed, static_cast<unsigned char>(0));
    touches.clear();
  }
  /// Of a part that follows.
  void add_touches(std::vector<TouchImpulse> part) {
    for (TouchImpulse& touch : part) {
      const auto before = std::ranges::find_if(touches, [&](const TouchImpulse& one) { return one.pair == touch.pair && one.feature == touch.feature; });
      for (std::size_t k = 0; before != touches.end() && k < 3; ++k) {
        touch.impulse[k] += before->impulse[k];
        touch.moment[k] += before->moment[k];
      }
    }
    touches = std::move(part);
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
    add_touches(part.touches);
  }
};

}  // namespace linden

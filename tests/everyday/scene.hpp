// tests/everyday/scene.hpp
// Random scenes as people make them: small robots and things, any mixture of effects, at rest, pushed or let go.
//
//   models   1 to 12 joints in chains, trees and stars; hinges, slides, screws, ball joints, planar ones, free bodies; ties
//            masses 0.05 to 10 kg, lengths 0.05 to 0.5 m
//   steps    1e-4 to 1e-2 s, log-uniform; to the end of the motion: what settles is run until it has
//   gains    by the inertia that they act on, so that a step resolves them: rates x h up to 0.3; one scene in eight is stiff
//
// A scene follows from seed and number alone.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "engine/initial_state.hpp"
#include "engine/options.hpp"
#include "layout/effects.hpp"
#include "layout/model.hpp"

namespace linden {

struct EverydayScene {
  std::uint64_t seed = 0, number = 0;
  std::shared_ptr<const Model> model;
  Options options;
  Effects effects;
  InitialState start;
  std::int64_t steps = 0;    // of a run to the end of the motion
  std::int64_t horizon = 0;  // of the comparison with the plain simulator
  bool stiff = false;        // a rate of it is faster than the step: it must be stable, but is not compared at this step
  bool bends = false;        // forces that jump or bend between steps
  bool sudden = false;       // friction, limits or ground
  bool coupled = false;      // bodies are tied that are no neighbours in the tree
  bool rough = false;        // the ground is a terrain, which the plain simulator does not know
  std::string kind;          // what it is mostly about

  /// "servo: 3 joints, 2 kinds, fixed base, h = 1.2 ms, 400 steps; gravity, servos"
  std::string text() const;
};

EverydayScene everyday_scene(std::uint64_t seed, std::uint64_t number);

/// Whether the scene of this number is one of bodies that touch each other, which touching.cpp makes: one in six.
bool touches(std::uint64_t number);
EverydayScene touching_scene(std::uint64_t seed, std::uint64_t number);

}  // namespace linden

// engine/initial_state.hpp
// A random place to start from, the same on every machine for the same seed.
//
//   screw  position uniform in [-R, R] (rad or m) and moved into the joint's limits; speed uniform in [-R, R] / sqrt(depth) (per s)
//   ball   turned from neutral about a random axis by an angle uniform in [0, R], angular speed up to R / sqrt(depth) about another
//   free   as ball; position zero, linear speed up to R in a random direction
//
// depth: the number of levels of the tree. Down a chain the rates of joints add up like a random walk, so this lets the bodies of a
// chain of 10,000 links turn no faster than those of a short one; without it their tips would move at a kilometre per second.
//
// Where a scene has limits in effect (JointLimit) they are kept too, those of followers with their leaders': a draw that falls outside is moved
// onto the limit, all others stay as they are drawn.
//
// Followers of mimic joints follow their leaders when a Simulation takes the numbers.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "layout/effects.hpp"
#include "layout/model.hpp"

namespace linden {

struct InitialState {
  std::vector<double> positions;   // [nq]
  std::vector<double> velocities;  // [nv]
};

inline constexpr std::uint64_t kDefaultSeed = 1;
inline constexpr double kDefaultSpread = 0.1;

/// `limits`: in effect, one a row, as Effects has them. Here and below couplings are closed from there; InputError where they cannot be.
InitialState random_state(const Model& model, std::uint64_t seed, double spread, std::span<const JointLimit> limits = {});

/// A given start with those numbers on top: positions of screws, within their limits and no farther outside than the start is, and all
/// velocities; orientations and places of ball and free joints stay. Where there are couplings, joints whose motion is given are where it begins.
InitialState random_around(const Model& model, const InitialState& start, std::uint64_t seed, double spread, const Effects& effects = {});

}  // namespace linden

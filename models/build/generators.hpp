// models/build/generators.hpp
// Chains and trees of any size, made in code: the same ones for tests, benchmarks, examples and the command line.
#pragma once

#include <cstdint>
#include <string>

#include "layout/model.hpp"
#include "layout/support/input_error.hpp"

namespace linden {

/// `links` boxes of 0.1 x 0.02 x 0.02 m and 0.1 kg along x, hinges every 0.1 m, axes alternating y and z. The base is turned by 45
/// degrees about x so that gravity acts on both axes; at zero the chain is horizontal.
Model chain(Index links);

/// Planar chain of the paper's published code: `links` rods of 1.5 m and 1 kg, hinges about y.
Model paper_chain(Index links);

/// Chain of `links` ball joints: the boxes of `chain`.
Model ball_chain(Index links);

/// Balanced tree of hinges: every body carries `branching` others, axes cycling x y z; the boxes of `chain`.
Model balanced_tree(Index bodies, Index branching = 2);

/// `count` humanoids in one system, each a tree of its own: a pelvis on a free joint, waist and neck of three hinges, arms and legs of six;
/// 31 bodies, 36 degrees of freedom and 75 kg each, a metre apart along x. All boxes but the small ones between two hinges are
/// collision shapes too; the other models have none.
Model humanoids(Index count);
inline constexpr Index kHumanoidBodies = 31, kHumanoidFreedom = 36;

/// What a random tree is made of.
struct RandomTree {
  Index bodies = 30;
  std::uint64_t seed = 1;
  bool screws = true, balls = true, frees = true;  // kinds that may occur; screws: hinges, slides and helices
  bool floating = false;                           // the first body on a free joint
  double mass_decades = 0;                         // masses spread over this many powers of ten
};

/// Random topology, placements, axes, masses and full inertias; the same tree for the same seed on every machine.
Model random_tree(const RandomTree& recipe);

/// "chain:100", "paper-chain:100", "ball-chain:100", "tree:1023", "random:50", "humanoids:3". Throws InputError for anything else.
Model generate(const std::string& name);

/// Whether `name` has the form of a generated model, as against a file.
bool is_generated(const std::string& name);

}  // namespace linden

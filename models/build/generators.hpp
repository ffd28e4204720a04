// models/build/generators.hpp
// Chains, trees and mechanisms of any size, made in code: the same ones for tests, benchmarks, examples and the command line.
#pragma once

#include <cstdint>
#include <string>

#include "layout/model.hpp"
#include "layout/support/input_error.hpp"

namespace linden {

/// Of the boxes that most of them are made of.
inline constexpr double kRodLength = 0.1, kRodThickness = 0.02;  // [m]
inline constexpr double kRodMass = 0.1;                          // [kg]

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

/// `rods` boxes of `chain` in a regular polygon in the xz plane, hinges about y; it hangs on the world by the first corner, where a hinge closes
/// it. From three rods on; rods - 2 of its degrees of freedom are left.
Model hanging_ring(Index rods);

/// `count` four-bars along x, one carried by the coupler of the other, each with the loop of its own: a ground of 0.15 m and three boxes of
/// `chain`, hinges about y. 3 count bodies, 5 count rows, count degrees of freedom left. No bar ever turns past the others: there are no change
/// points.
Model four_bars(Index count);

/// Two rails of `cells` boxes of `chain` along x and rungs of half their size, hinges about y; it stands out from the world, with both rails
/// pinned. The left rail is the trunk of the tree; the right one is closed by a hinge a cell. 3 cells bodies, 5 cells rows, cells degrees of
/// freedom left.
Model ladder(Index cells);

/// A bicycle chain of `links` links along x, 12.7 mm each, hung on the world by its first plates: two plates of 0.9 g, 5 mm apart, and a pin of
/// 0.6 g at their far end, on which the next plates turn; bushings and rollers are left out. Every link is like every other, as of a half-link
/// chain. In the tree a pin carries both plates, and the left plate the next pin, by hinges about y; a weld presses that pin into the right plate. 3
/// links bodies, 6 links rows, of which 4 links follow from the others; links degrees of freedom left. So short a pendulum wants steps of 0.1 to
/// 0.2 ms where it swings freely.
Model roller_chain(Index links);

/// `ropes` ball-chains of `knots` boxes along x, 0.1 m apart along y and held at one end, with boxes across between neighbours, tied by a ball
/// coupling each. 2 ropes knots - knots bodies, 3 (ropes - 1) knots rows. From two ropes on.
Model rope_net(Index ropes, Index knots);

// Loose solids, each on a free joint, on a floor that stands in the world ("world/floor", its top at z = 0). What touches does so without a gap at
// zero. They fall through each other where there is no contact: see needs_contact.

/// A stack of `boxes` cubes of 0.1 m and 1 kg, each on the one before.
Model box_stack(Index boxes);

/// A wall of `bricks` along x, 0.2 x 0.1 x 0.1 m and 2 kg, courses shifted by half a brick against the one below, with halves at the ends of every
/// other; about as high as long.
Model brick_wall(Index bricks);

/// The cubes of a stack above each other in layers, 0.18 m apart, each turned at random: they drop and come to lie in a heap.
Model box_pile(Index boxes);

/// A house of `storeys` storeys of cards of 0.1 x 0.06 x 0.002 m and 5 g, which lean at 0.35 rad; n (3 n + 1) / 2 cards. With a friction of 0.6 it
/// stands.
Model card_house(Index storeys);

/// `count` dominoes along x, 0.01 x 0.03 x 0.06 m and 20 g, 0.03 m apart. The first leans beyond where it stands, and fells the others.
Model domino_row(Index count);

/// "chain:100", "paper-chain:100", "ball-chain:100", "tree:1023", "random:50", "humanoids:3", "ring:10", "fourbars:3", "ladder:5",
/// "roller-chain:100", "net:4x6", "boxes:10", "wall:20", "pile:20", "cards:3", "dominoes:10". Throws InputError for
/// anything else. Nets take memory and time that grow with the square of their rows and more:
/// several hundred rows take long.
Model generate(const std::string& name);

/// About how large the model of this name is; zeros where the name is none, or holds no number.
struct GeneratedSize {
  double bodies = 0;
  double rows = 0, together = 0;  // of couplings; of those that are solved together (engine/sweeps/coupling_paths.hpp)
};
GeneratedSize generated_size(const std::string& name);

/// Whether the model of this name is loose solids, which are nothing without contact: `linden run boxes:10` has it then.
bool needs_contact(const std::string& name);

/// Whether `name` has the form of a generated model, as against a file.
bool is_generated(const std::string& name);

}  // namespace linden

// layout/tree.hpp
// The topology of a system of bodies, flat and in topological order.
//
//   slot        0      1       2        3       4       5
//   body      world  pelvis  thigh_l  thigh_r  shin_l  shin_r
//   parent      0      0       1        1       2       3        parent[i] < i
//   level       0      1       2        2       3       3
//   kind        -     free    screw    screw   screw   screw
//   first_v     -      0       6        7       8       9        first row in p, v, residual, ...
//   first_q     -      0       7        8       9      10        first row in q
//
// Bodies are sorted by level, within a level by joint kind. A *run* is a maximal stretch of one kind: a sweep is a loop over
// runs, and within a run there is no branch on the kind. Runs cross levels (a chain of 10,000 hinges is one run), which is safe for every
// loop that goes slot by slot, since parents precede children.
//
// A tree of more than kBranch bodies is sorted in pieces. Bodies whose subtree has more than kTwig bodies come first: the *trunk*. What is
// left are small subtrees; neighbours are gathered into *branches* of at most kBranch bodies, one branch after the other, each sorted like
// the trunk:
//
//            1 ---- 2 ---- 3 -- ...      trunk      1 2 3 ...
//           /|\    /|\    |             branches   those below 1 and 2, those below 3, ...
//
// The parent of a body lies in its own branch or in the trunk. A sweep from the root and the sweep back can therefore go over one branch
// both ways while its memory is in the cache, and then over the next. Subtrees smaller than a branch make its levels wide: scans put
// bodies of one level in the lanes (kernels/values/body_lanes.hpp). Children of one body of the trunk are kept together where they fit: branches
// that add to nothing in common can be gone over by several threads at once, with the same result to the bit.
//
// Three joint kinds, three loops. A body's frame sits at its joint, turned so that the joint's axis is z:
//   screw  1 DOF  turn by r q about z and shift by t q along z: revolute (r=1, t=0), prismatic (0, 1), helical (1, pitch)
//   ball   3 DOF  q: unit quaternion x y z w;  v: angular velocity in the body frame [rad/s]
//   free   6 DOF  q: position x y z [m] in the parent's frame, unit quaternion x y z w;  v: (w, v) in the body frame
#pragma once

#include <vector>

#include "layout/field.hpp"

namespace linden {

enum class JointKind : std::uint8_t { screw, ball, free };

/// Most bodies of a branch, some 900 bytes each, and of a subtree in it. Both ways over one branch and then the next, a step of a binary
/// tree of 16,383 takes 85 ns a body instead of 87, of 65,535 133 instead of 142 (EPYC Zen 5, 1 MB of second cache).
inline constexpr Index kBranch = 1024;
inline constexpr Index kTwig = 32;

/// Fewer branches than these are gone over by one thread. Two threads instead of one (EPYC Zen 5) take 50 ns a body instead of 64 on a
/// binary tree of 5,000, 57 to 67 instead of 112 on one of 65,535.
inline constexpr std::size_t kFewestBranches = 4;

constexpr Index position_count(JointKind kind) { return kind == JointKind::screw ? 1 : kind == JointKind::ball ? 4 : 7; }
constexpr Index velocity_count(JointKind kind) { return kind == JointKind::screw ? 1 : kind == JointKind::ball ? 3 : 6; }

/// Slots [begin, end). Arrays of what is made and used up within one way over a branch and back hold the trunk and one branch a thread, so
/// that they never leave the cache: there bodies from slot `branch` on lie `back` rows lower. 0: every body has a row of its own.
struct Slots {
  Index begin, end;
  Index branch = 0, back = 0;
  Index pending_offset = 0;  // what is added to Tree::pending from slot `branch` on: each thread has rows of its own
  /// Row of a body among these, and of one of these or of the trunk.
  Index row(Index i) const { return i - back; }
  Index row_of_parent(Index i) const { return i < branch ? i : i - back; }
  Slots part(Index first, Index last) const { return {first, last, branch, back, pending_offset}; }
  bool operator==(const Slots&) const = default;
};

/// Slots [begin, end), all of one kind.
struct Run {
  Index begin;
  Index end;
  JointKind kind;
  Index widest = 1;  // most of them that are of one level
  bool operator==(const Run&) const = default;
};

#define LINDEN_TREE_FIELDS(FIELD)                                                              \
  FIELD(Index, parent, 1, slots, "slot of the parent body; parent[i] < i; the world is its own") \
  FIELD(Index, level, 1, slots, "number of joints up to the world")                            \
  FIELD(Index, run, 1, slots, "number of the run that the body is in")                         \
  FIELD(Index, first_v, 1, slots, "first row of this joint in arrays of velocities")           \
  FIELD(Index, first_q, 1, slots, "first row of this joint in arrays of positions")            \
  FIELD(Index, first_block, 1, slots, "first row of this joint's nv x nv block")               \
  FIELD(Index, is_leaf, 1, slots, "1 where a body has no children, else 0")                    \
  FIELD(Index, pending, 1, slots, "row for what children pass while a sweep goes up; free again once the body has been met") \
  FIELD(Index, is_last_child, 1, slots, "1 where no child of the same parent comes after: the first that an upward sweep meets")

struct Tree {
  LINDEN_FIELDS(LINDEN_TREE_FIELDS)

  Shape shape;
  std::vector<Run> runs;
  Slots trunk{1, 1};
  std::vector<Slots> branches;  // empty where the whole tree has no more than kBranch bodies: it is all trunk
  bool branches_apart = false;  // no body has children in two branches, and the world none in any
  Index pending_rows = 0;       // rows that bodies of a branch wait in, of any but the trunk; they come after all others

  Index bodies() const { return shape.slots - 1; }
  Index levels() const;  // the world's, 0, is one of them
  JointKind kind(Index slot) const { return runs[static_cast<std::size_t>(run(slot))].kind; }
  std::vector<Index> roots() const;  // slots of the bodies that hang on the world
  /// How many threads may go over branches at once: 1 where these are few or not apart, else as many as there are rows for.
  Index most_threads() const;
  /// Row of what waits for a body.
  Index pending_row(Slots slots, Index i) const { return pending(i) + (i < slots.branch ? 0 : slots.pending_offset); }

  /// Lays out `parent` and `kind` (one entry a slot, slot 0 the world), as sorted_bodies leaves them.
  /// Throws std::invalid_argument where the order is not topological.
  static Tree from_sorted(const std::vector<Index>& parent, const std::vector<JointKind>& kind);
};

/// Which body of a list belongs in slots 1, 2, ...: trunk and branches. parent: number of a body before it, -1 the world.
std::vector<Index> sorted_bodies(const std::vector<Index>& parent, const std::vector<JointKind>& kind);

}  // namespace linden

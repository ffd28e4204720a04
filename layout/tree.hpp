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
// Three joint kinds, three loops. A body's frame sits at its joint, turned so that the joint's axis is z:
//   screw  1 DOF  turn by r q about z and shift by t q along z: revolute (r=1, t=0), prismatic (0, 1), helical (1, pitch)
//   ball   3 DOF  q: unit quaternion x y z w;  v: angular velocity in the body frame [rad/s]
//   free   6 DOF  q: position x y z [m] in the parent's frame, unit quaternion x y z w;  v: (w, v) in the body frame
#pragma once

#include <vector>

#include "layout/field.hpp"

namespace linden {

enum class JointKind : std::uint8_t { screw, ball, free };

constexpr Index position_count(JointKind kind) { return kind == JointKind::screw ? 1 : kind == JointKind::ball ? 4 : 7; }
constexpr Index velocity_count(JointKind kind) { return kind == JointKind::screw ? 1 : kind == JointKind::ball ? 3 : 6; }

/// Slots [begin, end), all of one kind.
struct Run {
  Index begin;
  Index end;
  JointKind kind;
  bool operator==(const Run&) const = default;
};

#define LINDEN_TREE_FIELDS(FIELD)                                                              \
  FIELD(Index, parent, 1, slots, "slot of the parent body; parent[i] < i; the world is its own") \
  FIELD(Index, level, 1, slots, "number of joints up to the world")                            \
  FIELD(Index, first_v, 1, slots, "first row of this joint in arrays of velocities")           \
  FIELD(Index, first_q, 1, slots, "first row of this joint in arrays of positions")            \
  FIELD(Index, first_block, 1, slots, "first row of this joint's nv x nv block")               \
  FIELD(Index, is_leaf, 1, slots, "1 where a body has no children, else 0")                    \
  FIELD(Index, is_last_child, 1, slots, "1 where no child of the same parent comes after: the first that an upward sweep meets")

struct Tree {
  LINDEN_FIELDS(LINDEN_TREE_FIELDS)

  Shape shape;
  std::vector<Run> runs;
  std::vector<Index> level_begin;  // slots of level l are [level_begin[l], level_begin[l+1]); level 0 is the world alone

  Index bodies() const { return shape.slots - 1; }
  Index levels() const { return static_cast<Index>(level_begin.size()) - 1; }
  JointKind kind(Index slot) const;  // by search through the runs; for messages and set-up, not for sweeps

  /// Lays out `parent` and `kind` (one entry a slot, slot 0 the world, sorted by level, then kind).
  /// Throws std::invalid_argument where the order is not topological.
  static Tree from_sorted(const std::vector<Index>& parent, const std::vector<JointKind>& kind);
};

}  // namespace linden

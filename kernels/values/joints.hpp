// kernels/values/joints.hpp
// The three joint kinds as compile-time tags, the loop over runs, and what a joint does to twists and wrenches.
//
// A sweep hands `down` or `up` a body of code that is compiled once a kind; within a run it loops without a branch. Parents precede
// children, so `down` meets every parent before its children and `up` every child before its parent.
//
//            S                       S^T F                 S a
//   screw    (0 0 r; 0 0 t)          r n_z + t f_z         one number
//   ball     (1; 0)                  n                     three
//   free     (1 0; 0 1)              n, f                  six
#pragma once

#include <algorithm>
#include <type_traits>

#include "kernels/values/spatial.hpp"
#include "layout/body_constants.hpp"
#include "layout/tree.hpp"

namespace linden {

template <JointKind Kind>
using Joint = std::integral_constant<JointKind, Kind>;

template <class Body>
LINDEN_INLINE void with_joint(JointKind kind, Body&& body) {
  switch (kind) {
    case JointKind::screw: return body(Joint<JointKind::screw>{});
    case JointKind::ball: return body(Joint<JointKind::ball>{});
    case JointKind::free: return body(Joint<JointKind::free>{});
  }
}

inline Slots all_slots(const Tree& tree) { return {1, tree.shape.slots}; }

/// Rows of the velocities of some bodies.
inline Slots velocities(const Tree& tree, Slots slots) {
  if (slots.begin == slots.end) return {0, 0};
  return {tree.first_v(slots.begin), slots.end < tree.shape.slots ? tree.first_v(slots.end) : tree.shape.velocities};
}

/// part_of_run(joint, slots) for every part of the slots that is of one kind, root to leaves.
template <class RunPart>
LINDEN_INLINE void run_parts_down(const Tree& tree, Slots slots, RunPart&& part_of_run) {
  for (Index begin = slots.begin; begin < slots.end;) {
    const Run& run = tree.runs[static_cast<std::size_t>(tree.run(begin))];
    const Slots part = slots.part(begin, std::min(run.end, slots.end));
    with_joint(run.kind, [&](auto joint) LINDEN_INLINE_LAMBDA { part_of_run(joint, part); });
    begin = part.end;
  }
}

/// The same, leaves to root.
template <class RunPart>
LINDEN_INLINE void run_parts_up(const Tree& tree, Slots slots, RunPart&& part_of_run) {
  for (Index end = slots.end; end > slots.begin;) {
    const Run& run = tree.runs[static_cast<std::size_t>(tree.run(end - 1))];
    const Slots part = slots.part(std::max(run.begin, slots.begin), end);
    with_joint(run.kind, [&](auto joint) LINDEN_INLINE_LAMBDA { part_of_run(joint, part); });
    end = part.begin;
  }
}

/// body(joint, i) for slots begin ... end - 1, root to leaves.
template <class Body>
LINDEN_INLINE void down(const Tree& tree, Slots slots, Body&& body) {
  run_parts_down(tree, slots, [&](auto joint, Slots part) LINDEN_INLINE_LAMBDA {
    for (Index i = part.begin; i < part.end; ++i) body(joint, i);
  });
}

/// body(joint, i) for every slot but the world, root to leaves.
template <class Body>
LINDEN_INLINE void down(const Tree& tree, Body&& body) {
  down(tree, all_slots(tree), body);
}

/// body(joint, i) for slots end - 1 ... begin, leaves to root.
template <class Body>
LINDEN_INLINE void up(const Tree& tree, Slots slots, Body&& body) {
  run_parts_up(tree, slots, [&](auto joint, Slots part) LINDEN_INLINE_LAMBDA {
    for (Index i = part.end - 1; i >= part.begin; --i) body(joint, i);
  });
}

/// body(joint, i) for every slot but the world, leaves to root.
template <class Body>
LINDEN_INLINE void up(const Tree& tree, Body&& body) {
  up(tree, all_slots(tree), body);
}

/// r and t of a screw joint.
template <class S>
struct Screw {
  S r, t;

  template <class E>
  LINDEN_INLINE static Screw from(const E* row) {
    return {as<S>(row[0]), as<S>(row[1])};
  }
};

template <class S, class Element>
LINDEN_INLINE Screw<S> load_screw(const BodyConstants<Element>& constants, Index i) {
  return load<Screw, S>(constants.screw, i);
}

/// V + S a; of `a` the first nv numbers count, a screw's one number is in n.x.
template <JointKind Kind, class S, class Element>
LINDEN_INLINE Twist<S> add_motion(Joint<Kind>, const BodyConstants<Element>& constants, Index i, const Wrench<S>& a, Twist<S> V) {
  if constexpr (Kind == JointKind::screw) {
    const Screw<S> screw = load_screw<S>(constants, i);
    V.w.z = V.w.z + screw.r * a.n.x;
    V.v.z = V.v.z + screw.t * a.n.x;
  } else {
    V.w += a.n;
    if constexpr (Kind == JointKind::free) V.v += a.f;
  }
  return V;
}

/// S^T F as a wrench-sized value of which the first nv numbers count: a screw's one number is in n.x.
template <JointKind Kind, class S, class Element>
LINDEN_INLINE Wrench<S> project(Joint<Kind>, const BodyConstants<Element>& constants, Index i, const Wrench<S>& F) {
  if constexpr (Kind == JointKind::screw) {
    const Screw<S> screw = load_screw<S>(constants, i);
    return {{screw.r * F.n.z + screw.t * F.f.z, S(0.0), S(0.0)}, {S(0.0), S(0.0), S(0.0)}};
  } else {
    return F;
  }
}

/// The first nv numbers of `value` to or from rows row, row + 1, ...
template <JointKind Kind, class S>
LINDEN_INLINE void store_joint(Joint<Kind>, Field<S>& field, Index row, const Wrench<S>& value) {
  if constexpr (Kind == JointKind::screw) {
    field(row) = value.n.x;
  } else {
    store3(field, row, value.n);
    if constexpr (Kind == JointKind::free) store3(field, row + 3, value.f);
  }
}

template <JointKind Kind, class S>
LINDEN_INLINE Wrench<S> load_joint(Joint<Kind>, const Field<S>& field, Index row) {
  const Vec3<S> zero{S(0.0), S(0.0), S(0.0)};
  if constexpr (Kind == JointKind::screw) {
    return {{field(row), S(0.0), S(0.0)}, zero};
  } else if constexpr (Kind == JointKind::ball) {
    return {load3<S>(field, row), zero};
  } else {
    return {load3<S>(field, row), load3<S>(field, row + 3)};
  }
}

}  // namespace linden

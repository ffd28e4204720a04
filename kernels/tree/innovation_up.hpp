// kernels/tree/innovation_up.hpp
// The upward half of an evaluation and of a solve in one sweep. Of a block of instances: lane = instance; of one tree: lane = body, where
// a level has screws enough.
//
//   E_i = h mu_i + sum over children c of Ad_{X_c^-1}^T (E_c - gain_up_c u_c),    u_i = S_i^T E_i - h (p + h/2 Q)_i
//
// Impulses F of the residual and impulses b of joints that yield (residual_up, impulse_pass_up) travel by the same road, so their
// difference E = F - b does, at half the cost. Where the residual vanishes E is F; what is left of u is handed on as r is
// (momentum_update_map): the momentum of the whole tree stays exact.
//
// reads   screw 2 x n, placement 12 x n, gains, momentum_target nv, impulse 6 x n holding h mu
// writes  impulse 6 x n (E), innovation nv (u)
// returns sum of |u.(d^-1 u)|, the squared energy norm of the residual (see impulse_pass_up)
// source  the paper, Algorithm 2, lines 8 and 9; Featherstone, Rigid Body Dynamics Algorithms, 7.3
#pragma once

#include "kernels/tree/impulse_pass_up.hpp"
#include "kernels/values/body_lanes.hpp"
#include "layout/workspace.hpp"

namespace linden {

/// The world has no momentum of its own.
template <class S>
void clear_world(Field<S, 6>& impulse) {
  const Vec3<S> zero{S(0.0), S(0.0), S(0.0)};
  store(impulse, 0, Wrench<S>{zero, zero});
}

/// What travels up, on its way: to a parent that comes next in registers, to others through memory.
template <class S>
class UpAccumulator {
 public:
  UpAccumulator(Field<S, 6>& impulse, Slots slots) : impulse_(impulse), slots_(slots) {
    const Vec3<S> zero{S(0.0), S(0.0), S(0.0)};
    none_ = pending_ = {zero, zero};
  }
  /// The body's own impulse and all that its children passed.
  LINDEN_INLINE Wrench<S> arrived(Index i) {
    const Index row = slots_.row(i);
    const Wrench<S> sum = load<Wrench, S>(impulse_, row) + pending_;
    store(impulse_, row, sum);
    return sum;
  }
  /// Bodies up to i are next, several at once: all that goes up is to be in memory.
  LINDEN_INLINE void unload(Index i) {
    const Index row = slots_.row(i);
    store(impulse_, row, load<Wrench, S>(impulse_, row) + pending_);
    pending_ = none_;
  }
  LINDEN_INLINE void pass(const Tree& tree, Index i, const Wrench<S>& passed) {
    const Index parent = tree.parent(i);
    if (parent == i - 1 && i > slots_.begin) {
      pending_ = passed;
    } else {
      pending_ = none_;
      const Index row = slots_.row_of_parent(parent);
      store(impulse_, row, load<Wrench, S>(impulse_, row) + passed);
    }
  }

 private:
  Field<S, 6>& impulse_;
  Slots slots_;
  Wrench<S> none_, pending_;
};

/// slots: all, or parts of a large tree in the order of Tree: whatever hangs in other parts has been met before.
template <class S, class Element>
[[gnu::noinline]] S innovation_up(const Tree& tree, const BodyConstants<Element>& constants, Slots slots, Workspace<S>& work) {
  const Gains<S> gains{work.gain_up, work.gain_down, work.joint_inverse};
  if (slots.end == tree.shape.slots) clear_world(work.impulse);
  UpAccumulator<S> sum_up(work.impulse, slots);
  S norm(0.0);
  const auto one_by_one = [&](auto joint, Slots part) LINDEN_INLINE_LAMBDA {
    for (Index i = part.end - 1; i >= part.begin; --i) {
      const Index row = tree.first_v(i);
      const Wrench<S> E = sum_up.arrived(i);
      const Wrench<S> u = project(joint, constants, i, E) - load_joint(joint, work.momentum_target, row);
      store_joint(joint, work.innovation, row, u);
      const Wrench<S> passed = bias_to_parent(joint, tree, gains, i, E, -u, norm);
      sum_up.pass(tree, i, to_parent(load<Placement, S>(work.placement, slots.row(i)), passed));
    }
  };
  run_parts_up(tree, slots, [&](auto joint, Slots part) LINDEN_INLINE_LAMBDA {
    if constexpr (joint == JointKind::screw && std::is_same_v<S, double>) {
      const auto many = [&](auto bodies, Index i) LINDEN_INLINE_LAMBDA {
        using std::abs;
        sum_up.unload(i + kBodies - 1);
        const Index row = tree.first_v(i);
        const auto E = gather<Wrench>(bodies, work.impulse, slots.row(i));
        const auto screw = gather<Screw>(bodies, constants.screw, i);
        const auto u = screw.r * E.n.z + screw.t * E.f.z - gather_row(bodies, work.momentum_target, row);
        scatter_row(bodies, work.innovation, row, u);
        norm = norm + summed(bodies, abs(u * gather_row(bodies, gains.inverse, tree.first_block(i)) * u));
        const auto passed = E - u * gather<Wrench>(bodies, gains.up, row);
        add_at(bodies, work.impulse, rows_of_parents(tree, slots, i).data(), to_parent(gather<Placement>(bodies, work.placement, slots.row(i)), passed));
      };
      for_same_level_up(tree, part, many, [&](Slots few) LINDEN_INLINE_LAMBDA { one_by_one(joint, few); });
    } else {
      one_by_one(joint, part);
    }
  });
  return norm;
}

template <class S, class Element>
S innovation_up(const Tree& tree, const BodyConstants<Element>& constants, Workspace<S>& work) {
  return innovation_up(tree, constants, all_slots(tree), work);
}

}  // namespace linden

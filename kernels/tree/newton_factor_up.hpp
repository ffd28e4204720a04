// kernels/tree/newton_factor_up.hpp
// Factor of the exact Jacobian of the discrete Euler-Lagrange residual of one tree, leaves to root, O(n) for all joint kinds.
//
// With eta the change of a body's pose at k+1 (body frame), h delta mu_i = K_i eta_i, a matrix of the body alone. Momenta travel up
// through X^k, which the step does not change; pose changes travel down through X^k+1 = X^k M. Hence
//
//   Pi_i = K_i + sum over children c of Ad_{X_c^-1}^T (Pi_c - U_c d_c^-1 W_c^T) Ad_{M_c^-1} Ad_{X_c^-1}
//   U = Pi S,  W^T = S^T Pi,  d = S^T U
//
// K is a map: a body in every lane, some tens of bodies at a time so that it is used while it is in the nearest cache. The scan keeps Pi
// in registers, by rows on even levels and by columns on odd ones, so that it is turned over once a joint (matrix_rows.hpp); where a
// parent comes next and has no other child it never leaves them. A chain takes 28 ns a body so, bound by the latency of the 6 x 6 passes;
// number by number it took 83 (EPYC Zen 5, AVX-512). Screws of one level, where there are enough, are factored each in a lane, K and all: a
// binary tree of 1,023 takes 30 ns a body instead of 40.
//
// reads   inertia 10 x n, screw 2 x n, placement 12 x n at q^k, motion 7 x n, displacement 7 x n
// writes  gains; articulated is scratch: what waits for a body, in its row tree.pending
// slots   all, or parts of a large tree as for innovation_up
// source  derivative of Algorithm 2 of the paper with respect to q^k+1, arranged as Featherstone's ABI
#pragma once

#include "kernels/tree/articulated.hpp"
#include "kernels/values/body_lanes.hpp"
#include "kernels/values/matrix_rows.hpp"
#include "kernels/values/se3.hpp"

namespace linden {

/// K of bodies, each by rows, on odd levels by columns, kRowNumbers a body.
inline void pose_derivative_rows(const Tree& tree, const BodyConstants<double>& constants, const Field<double, 7>& displacement, Slots slots,
                                 double* rows) {
  for_bodies<double>(slots.begin, slots.end, [&](auto bodies, Index i) {
    using S = typename decltype(bodies)::Scalar;
    const auto G = gather<Inertia>(bodies, constants.inertia, i);
    const auto u = log(gather<Displacement>(bodies, displacement, slots.row(i)));
    const auto K = pose_derivative(G, u, G * u);
    S a[36];
    K.to(a);
    const auto odd = odd_levels(bodies, tree, i);
    double* const to = rows + (i - slots.begin) * kRowNumbers;
    for (int row = 0; row < 6; ++row) {
      S numbers[6];
      for (int column = 0; column < 6; ++column) {
        const S& straight = a[row_start(row) + column_start(column)];
        const S& across = a[row_start(column) + column_start(row)];
        numbers[column] = select(odd, across, straight);
      }
      store_rows<6, 8>(bodies, numbers, to + 8 * row, kRowNumbers);
    }
  });
}

/// What the joint of a body passes to its parent, and its gains. A: Pi by rows, or by columns.
template <bool ByColumns, class Added>
LINDEN_INLINE Rows6 pass_screw(const Tree& tree, const BodyConstants<double>& constants, Index i, const Rows6& A, const double* X,
                               const double* X_pose, const Gains<double>& gains, const Added& added) {
  const double r = constants.screw(i, 0), t = constants.screw(i, 1);
  alignas(kAlignment) double numbers[kRowNumbers];
  for (int k = 0; k < 6; ++k) store_row8(numbers + 8 * k, A.r[k]);
  // along: S^T A by rows, A S by columns; across: the other one, its numbers each in a register
  const Row8 along = r * A.r[2] + t * A.r[5];
  Row8 d = r * spread<2>(along) + t * spread<5>(along);
  if constexpr (Added::to_joints) d += spread(added.stiffness(tree.first_v(i)));
  const Row8 inverse = 1.0 / d;
  spill_here();
  Row8 across[6];
  for (int k = 0; k < 6; ++k) across[k] = r * spread(numbers[8 * k + 2]) + t * spread(numbers[8 * k + 5]);
  const Row8 gain = inverse * along;
  const Index row = tree.first_v(i);
  store_row6(ByColumns ? gains.up.row(row) : gains.down.row(row), gain);
  double* const other = ByColumns ? gains.down.row(row) : gains.up.row(row);
  for (int k = 0; k < 6; ++k) other[k] = (inverse * across[k])[0];
  gains.inverse(tree.first_block(i)) = inverse[0];
  Rows6 reduced;
  for (int k = 0; k < 6; ++k) reduced.r[k] = A.r[k] - across[k] * gain;
  return mixed(ByColumns ? X : X_pose, turned_over(mixed(ByColumns ? X_pose : X, reduced)));
}

/// Ball and free joints, number by number.
template <JointKind Kind, class Added>
LINDEN_INLINE Rows6 pass_joint(Joint<Kind> joint, const Tree& tree, const BodyConstants<double>& constants, Index i, bool by_columns,
                               const Rows6& A, const Placement<double>& X, const Placement<double>& X_pose,
                               const Gains<double>& gains, const Added& added) {
  double numbers[36], reduced[36], passed[36];
  to_mat6(by_columns ? turned_over(A) : A, numbers);
  eliminate_joint(joint, tree, constants, i, numbers, gains, reduced, added);
  to_parent(X, X_pose, reduced, [&](int at, double value) LINDEN_INLINE_LAMBDA { passed[at] = value; });
  const Rows6 rows = rows_of(passed);
  return by_columns ? rows : turned_over(rows);  // the parent is held the other way
}

/// Screws i ... i + W - 1 of one level, each in a lane: their gains, and to their parents what they pass.
template <bool ByColumns, class Added>
void factor_same_level(const Tree& tree, const BodyConstants<double>& constants, const Field<double, 12>& placement,
                    const Field<double, 7>& motion, const Field<double, 7>& displacement, Slots slots, Index i,
                    Field<double, kRowNumbers>& articulated, const Gains<double>& gains, const Added& added) {
  constexpr ManyBodies bodies;
  /// Where number k of row `line` is in a Mat6.
  const auto place = [](bool by_columns, int line, int k) LINDEN_INLINE_LAMBDA {
    return by_columns ? row_start(k) + column_start(line) : row_start(line) + column_start(k);
  };
  BodyPack A[36], reduced[36];
  const auto u = log(gather<Displacement>(bodies, displacement, slots.row(i)));
  const auto G = gather<Inertia>(bodies, constants.inertia, i);
  pose_derivative(G, u, G * u).to(A);
  spill_here();
  if constexpr (Added::to_bodies) {
    BodyPack body_stiffness[36];
    turning::rows_to_lanes<36>([&](int l) LINDEN_INLINE_LAMBDA { return added.body_stiffness.row(i + l); }, body_stiffness);
    for (int k = 0; k < 36; ++k) A[k] = A[k] + body_stiffness[k];
  }
  if (const Index* const leaf = tree.is_leaf.row(i); !std::all_of(leaf, leaf + kBodies, [](Index flag) { return flag != 0; })) {
    const auto has_children = at_bodies(bodies, tree.is_leaf, i) < BodyPack(0.5);
    for (int line = 0; line < 6; ++line) {
      BodyPack left[6];
      turning::rows_to_lanes<6>([&](int l) LINDEN_INLINE_LAMBDA { return articulated.row(tree.pending_row(slots, i + l)) + 8 * line; }, left);
      for (int k = 0; k < 6; ++k) {
        BodyPack& number = A[place(ByColumns, line, k)];
        number = select(has_children, number + left[k], number);
      }
    }
  }
  spill_here();
  eliminate_screw(bodies, tree, constants, i, A, gains, reduced, added);
  spill_here();
  const auto X = gather<Placement>(bodies, placement, slots.row(i));
  const auto X_pose = after_motion(Joint<JointKind::screw>{}, X, gather<Displacement>(bodies, motion, slots.row(i)));
  to_parent(X, X_pose, reduced, [&](int at, const BodyPack& value) LINDEN_INLINE_LAMBDA { A[at] = value; });
  spill_here();
  alignas(kAlignment) double passed[kBodies * kRowNumbers];
  for (int line = 0; line < 6; ++line) {
    BodyPack numbers[6];
    for (int k = 0; k < 6; ++k) numbers[k] = A[place(!ByColumns, line, k)];
    store_rows<6, 8>(bodies, numbers, passed + 8 * line, kRowNumbers);
  }
  for (Index l = kBodies - 1; l >= 0; --l) {
    const double* const from = passed + l * kRowNumbers;
    double* const kept = articulated.row(tree.pending_row(slots, tree.parent(i + l)));
    const bool first = tree.is_last_child(i + l) != 0;
    for (int k = 0; k < 48; k += 8) store_row8(kept + k, first ? load_row8(from + k) : load_row8(from + k) + load_row8(kept + k));
  }
}

template <class Added = NothingAdded>
void newton_factor_up(const Tree& tree, const BodyConstants<double>& constants, const Field<double, 12>& placement,
                      const Field<double, 7>& motion, const Field<double, 7>& displacement, Slots slots,
                      Field<double, kRowNumbers>& articulated, const Gains<double>& gains, const Added& added = {}) {
  constexpr Index kTile = 32;  // 12 KiB of K
  alignas(kAlignment) double K[kTile * kRowNumbers];
  Index tile = slots.end;
  const auto left_for = [&](Index i) LINDEN_INLINE_LAMBDA {
    Rows6 rows{};
    if (tree.is_leaf(i) != 0) return rows;
    for (int k = 0; k < 6; ++k) rows.r[k] = load_row8(articulated.row(tree.pending_row(slots, i)) + 8 * k);
    return rows;
  };
  const auto one_by_one = [&](auto joint, Slots part) LINDEN_INLINE_LAMBDA {
    Rows6 pending = left_for(part.end - 1);  // what the children of the body that comes next pass to it
    for (Index i = part.end - 1; i >= part.begin; --i) {
      if (i < tile) {
        // full registers of bodies; no more where those that follow lie on one level
        const Index most = is_wide(tree, i) ? (i - part.begin) / kBodies * kBodies + kBodies : kTile;
        tile = std::max(slots.begin, i + 1 - std::min(kTile, most));
        pose_derivative_rows(tree, constants, displacement, slots.part(tile, i + 1), K);
      }
      Rows6 A;
      for (int k = 0; k < 6; ++k) A.r[k] = load_row8(K + (i - tile) * kRowNumbers + 8 * k) + pending.r[k];
      const bool by_columns = tree.level(i) % 2 != 0;
      if constexpr (Added::to_bodies) {
        const Rows6 body_stiffness = rows_of(added.body_stiffness.row(i));
        const Rows6 turned = by_columns ? turned_over(body_stiffness) : body_stiffness;
        for (int k = 0; k < 6; ++k) A.r[k] += turned.r[k];
      }
      const auto X = load<Placement, double>(placement, slots.row(i));
      const auto X_pose = after_motion(joint, X, load<Displacement, double>(motion, slots.row(i)));
      Rows6 passed;
      if constexpr (joint == JointKind::screw) {
        double after[12];
        X_pose.to(after);
        passed = by_columns ? pass_screw<true>(tree, constants, i, A, placement.row(slots.row(i)), after, gains, added)
                            : pass_screw<false>(tree, constants, i, A, placement.row(slots.row(i)), after, gains, added);
      } else {
        passed = pass_joint(joint, tree, constants, i, by_columns, A, X, X_pose, gains, added);
      }
      // a parent that comes next and has no other child takes it from the registers
      const Index parent = tree.parent(i);
      const bool first = tree.is_last_child(i) != 0;
      if (parent == i - 1 && first && i > part.begin) {
        pending = passed;
        continue;
      }
      double* const kept = articulated.row(tree.pending_row(slots, parent));
      for (int k = 0; k < 6; ++k) store_row8(kept + 8 * k, first ? passed.r[k] : passed.r[k] + load_row8(kept + 8 * k));
      if (i > part.begin) pending = left_for(i - 1);
    }
  };
  run_parts_up(tree, slots, [&](auto joint, Slots part) LINDEN_INLINE_LAMBDA {
    if constexpr (joint == JointKind::screw) {
      const auto many = [&](auto, Index i) LINDEN_INLINE_LAMBDA {
        const auto factor = tree.level(i) % 2 != 0 ? factor_same_level<true, Added> : factor_same_level<false, Added>;
        factor(tree, constants, placement, motion, displacement, slots, i, articulated, gains, added);
      };
      for_same_level_up(tree, part, many, [&](Slots few) LINDEN_INLINE_LAMBDA { one_by_one(joint, few); });
    } else {
      one_by_one(joint, part);
    }
  });
}

template <class Added = NothingAdded>
void newton_factor_up(const Tree& tree, const BodyConstants<double>& constants, const Field<double, 12>& placement,
                      const Field<double, 7>& motion, const Field<double, 7>& displacement,
                      Field<double, kRowNumbers>& articulated, const Gains<double>& gains, const Added& added = {}) {
  newton_factor_up(tree, constants, placement, motion, displacement, all_slots(tree), articulated, gains, added);
}

/// What a body feels beside its own inertia and that of bodies beyond, where slots of a part begin after it: once those have been met, and it has
/// not. It has children. felt: as Mat6 has it.
inline void add_inertia(const Tree& tree, Slots slots, Index i, const std::array<double, 36>& felt, Field<double, kRowNumbers>& articulated) {
  double* const kept = articulated.row(tree.pending_row(slots, i));
  const bool by_columns = tree.level(i) % 2 != 0;
  for (int line = 0; line < 6; ++line) {
    for (int k = 0; k < 6; ++k) kept[8 * line + k] += felt[static_cast<std::size_t>(by_columns ? row_start(k) + column_start(line) : row_start(line) + column_start(k))];
  }
}

}  // namespace linden

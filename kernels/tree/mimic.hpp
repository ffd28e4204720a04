// kernels/tree/mimic.hpp
// One coordinate that moves several joints: q_f = a q_l + b, in O(n k) for k coordinates, whatever each of the joints moves by itself.
//
// Z_c is the motion of coordinate c: 1 on its leader's row, a on its followers'. The tree is factored with all tied rows held. Then
//
//   X_c       what all joints do while coordinate c moves by one and the others are held: one tree solve each, once a factor
//   T         Z^T A X, k x k: what each coordinate feels, with the stiffness that effects give its joints
//   Delta     Delta_0 + X y,  T y = Z^T (r - A Delta_0),  Delta_0 the solve with tied rows held
//
// exact for the symmetric and the unsymmetric factor alike. No joint that is tied is asked to resist alone: where Z^T A Z is positive
// definite for all free coordinates, so is what is left with the tied ones held, and T. A coordinate that an effect holds has an infinite
// stiffness, like any row, and y = 0. Momenta of followers are kept at zero, folded into their leaders'.
//
// A tied row is held by d = kHold, a power of two beside which all else is rounding. Gains of such a row are A S and S^T A times 1 / kHold,
// to the bit: a right side of kHold moves the row by one, and a row moves by 1 / kHold times the impulse that it is left with.
//
// cost    k tree solves a factor, k n additions a solve
// source  Featherstone, Rigid Body Dynamics Algorithms, 8.2 (constraints on generalized coordinates), ch. 9 (hybrid dynamics: joints of
//         given motion)
#pragma once

#include <algorithm>
#include <limits>
#include <span>
#include <vector>

#include "kernels/tree/articulated.hpp"
#include "kernels/values/scalar.hpp"
#include "layout/attributes.hpp"

namespace linden {

/// r_leader += a r_follower; r_follower = 0.
template <class S>
void fold_mimics(std::span<const Mimic> mimics, Field<S>& impulse) {
  for (const Mimic& mimic : mimics) {
    impulse(mimic.leader_v) = impulse(mimic.leader_v) + as<S>(mimic.multiplier) * impulse(mimic.follower_v);
    impulse(mimic.follower_v) = S(0.0);
  }
}

/// Delta_follower = a Delta_leader.
template <class S>
void spread_mimics(std::span<const Mimic> mimics, Field<S>& rate) {
  for (const Mimic& mimic : mimics) rate(mimic.follower_v) = as<S>(mimic.multiplier) * rate(mimic.leader_v);
}

/// What holds a tied row: far above what any joint feels, far below where numbers end.
template <class S>
inline constexpr double kHold = is_single<S> ? 0x1p60 : 0x1p300;

/// After a solve with tied rows held: the impulse at joint i for which its body moved as it did, S^T (A eta + b).
template <class S, class Element>
S tied_load(const Tree& tree, const BodyConstants<Element>& constants, const Gains<S>& gains, const Field<S, 6>& bias,
            const Field<S, 6>& variation, Index i) {
  const auto gain = load<Twist, S>(gains.down, tree.first_v(i));
  const auto eta = load<Twist, S>(variation, i);
  const Wrench<S> b = project(Joint<JointKind::screw>{}, constants, i, load<Wrench, S>(bias, i));
  return as<S>(kHold<S>) * (dot(gain.w, eta.w) + dot(gain.v, eta.v)) + b.n.x;
}

template <class S>
class MimicTies {
 public:
  MimicTies() = default;
  MimicTies(std::span<const Mimic> mimics, const Tree& tree) : mimics_(mimics.begin(), mimics.end()) {
    if (mimics.empty()) return;
    const auto member = [&](Index slot, double multiplier, std::size_t coordinate) {
      members_.push_back({slot, tree.first_v(slot), tree.first_block(slot), multiplier, coordinate});
    };
    std::vector<std::size_t> led(static_cast<std::size_t>(tree.shape.slots), 0);  // number of the coordinate that a joint leads, from 1
    for (const Mimic& mimic : mimics) {
      std::size_t& coordinate = led[static_cast<std::size_t>(mimic.leader_slot)];
      if (coordinate == 0) {
        leader_rows_.push_back(mimic.leader_v);
        coordinate = leader_rows_.size();
        member(mimic.leader_slot, 1, coordinate - 1);
      }
      member(mimic.follower_slot, mimic.multiplier, coordinate - 1);
    }
    const std::size_t k = leader_rows_.size();
    response_.resize(k);
    for (Field<S>& column : response_) column.allocate(tree.shape.velocities);
    felt_.assign(k * k, S(0.0));
    pull_.assign(k, S(0.0));
    felt_now_.assign(k, S(0.0));
    stiffness_.allocate(tree.shape.velocities);
    given_.assign(k, S(0.0));
    inverse_.allocate(tree.shape.blocks);
  }

  bool empty() const { return mimics_.empty(); }
  std::span<const Mimic> mimics() const { return mimics_; }

  /// What a factor is to have added to it: the same with tied rows held.
  template <class Added>
  EffectsAdded<S, true, Added::to_bodies> held(const Added& added) {
    if constexpr (Added::to_joints) {
      std::ranges::copy(added.stiffness.flat(), stiffness_.flat().begin());
    } else {
      std::ranges::fill(stiffness_.flat(), S(0.0));
    }
    std::ranges::fill(given_, S(0.0));
    for (const Member& member : members_) {
      S& given = given_[member.coordinate];
      if (member.multiplier != 0) given = given + as<S>(member.multiplier * member.multiplier) * stiffness_(member.row);
      stiffness_(member.row) = as<S>(kHold<S>);
    }
    if constexpr (Added::to_bodies) {
      return {stiffness_, added.body_stiffness};
    } else {
      return {stiffness_, no_pull_};
    }
  }

  /// After the tree was factored so. solve(r, x): x = A^-1 r with that factor; load(slot): tied_load after it; `column` is scratch of nv
  /// rows.
  template <class Solve, class Load>
  void factor(const Solve& solve, const Load& load, Field<S>& column) {
    const std::size_t k = leader_rows_.size();
    for (std::size_t c = 0; c < k; ++c) {
      std::ranges::fill(column.flat(), S(0.0));
      for (const Member& member : members_) {
        if (member.coordinate == c) column(member.row) = as<S>(kHold<S> * member.multiplier);
      }
      solve(column, response_[c]);
      for (std::size_t i = 0; i < k; ++i) felt_[i * k + c] = S(0.0);
      for (const Member& member : members_) {
        S& felt = felt_[member.coordinate * k + c];
        felt = felt + as<S>(member.multiplier) * load(member.slot);
      }
      felt_[c * k + c] = felt_[c * k + c] + given_[c];
    }
    // LU in place; T is positive definite but for the small antisymmetric part of the Jacobian, so no pivoting
    for (std::size_t c = 0; c < k; ++c) {
      for (std::size_t i = c + 1; i < k; ++i) {
        felt_[i * k + c] = felt_[i * k + c] / felt_[c * k + c];
        for (std::size_t j = c + 1; j < k; ++j) felt_[i * k + j] = felt_[i * k + j] - felt_[i * k + c] * felt_[c * k + j];
      }
    }
  }

  /// Delta_0 -> Delta. Returns what the coordinates add to the squared energy norm of the residual, as impulse_pass_up has it.
  S complete(Field<S>& increment) {
    std::ranges::fill(pull_, S(0.0));
    for (const Member& member : members_) {
      S& pull = pull_[member.coordinate];
      pull = pull + as<S>(member.multiplier) * (as<S>(kHold<S>) * increment(member.row));
    }
    felt_now_ = pull_;
    solve();
    for (std::size_t c = 0; c < coordinates(); ++c) {
      for (Index row = 0; row < increment.rows(); ++row) increment(row) = increment(row) + pull_[c] * response_[c](row);
    }
    using std::abs;
    S norm(0.0);
    for (std::size_t c = 0; c < coordinates(); ++c) {
      increment(leader_rows_[c]) = pull_[c];
      norm = norm + abs(felt_now_[c] * pull_[c]);
    }
    spread_mimics<S>(mimics_, increment);
    return norm;
  }
  /// y of Z^T (r - A Delta_0), a number a coordinate.
  const std::vector<S>& moved_by(std::span<const S> pulls) {
    std::ranges::copy(pulls, pull_.begin());
    solve();
    return pull_;
  }
  /// visit(slot, row, multiplier, coordinate) of every joint that is tied.
  template <class Visit>
  void each_member(const Visit& visit) const {
    for (const Member& member : members_) visit(member.slot, member.row, member.multiplier, member.coordinate);
  }

  std::size_t coordinates() const { return leader_rows_.size(); }
  /// X_c of the factor there is.
  const Field<S>& response(std::size_t c) const { return response_[c]; }

  /// visit(numbers) of all that a factor leaves here: numbers is a span.
  template <class Visit>
  void each(const Visit& visit) {
    for (Field<S>& column : response_) visit(column.flat());
    visit(std::span(felt_));
  }

  /// 1 / d of the factor's rows, where a tied row's is that of its coordinate times a^2: how far an impulse on the row moves it.
  const Field<S>& yields(const Field<S>& inverse) {
    std::ranges::copy(inverse.flat(), inverse_.flat().begin());
    const std::size_t k = leader_rows_.size();
    for (const Member& member : members_) {
      inverse_(member.block) = as<S>(member.multiplier * member.multiplier) / felt_[member.coordinate * k + member.coordinate];
    }
    return inverse_;
  }

 private:
  /// T y = pull, in place.
  void solve() {
    const std::size_t k = coordinates();
    for (std::size_t i = 0; i < k; ++i) {
      for (std::size_t j = 0; j < i; ++j) pull_[i] = pull_[i] - felt_[i * k + j] * pull_[j];
    }
    for (std::size_t i = k; i-- > 0;) {
      for (std::size_t j = i + 1; j < k; ++j) pull_[i] = pull_[i] - felt_[i * k + j] * pull_[j];
      pull_[i] = pull_[i] / felt_[i * k + i];
    }
  }

  struct Member {
    Index slot, row, block;
    double multiplier;  // 1 of a leader
    std::size_t coordinate;
  };

  std::vector<Mimic> mimics_;
  std::vector<Member> members_;
  std::vector<Index> leader_rows_;  // of each coordinate
  std::vector<Field<S>> response_;  // X, a column a coordinate
  std::vector<S> felt_;             // T = L U
  std::vector<S> given_;            // stiffness that effects give each coordinate
  std::vector<S> pull_, felt_now_;  // of the solve there is: how the coordinates move, and what they felt
  Field<S> stiffness_, inverse_;
  Field<S, 36> no_pull_;
};

}  // namespace linden

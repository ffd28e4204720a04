// kernels/mimic.hpp
// One coordinate that moves several joints: q_f = a q_l + b, in O(n m) for m followers.
//
// The tree's equations are those of a system whose joints are all free; followers are tied by C Delta = 0, C Delta = Delta_f - a Delta_l.
// Impulses fold on the leader, r_l += a r_f, and a solve with the tree's factor A is completed by the Schur complement of the ties:
//
//   X = A^-1 C^T (one tree solve a follower, once a factor),  T = C X,  Delta = Delta_0 - X T^-1 C Delta_0,  Delta_0 = A^-1 r
//
// exact for the symmetric and the unsymmetric factor alike. Momenta of followers are kept at zero, folded into their leaders'.
//
// source  Featherstone, Rigid Body Dynamics Algorithms, 8.2 (constraints on generalized coordinates)
#pragma once

#include <span>
#include <vector>

#include "kernels/scalar.hpp"
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

template <class S>
class MimicTies {
 public:
  MimicTies() = default;
  MimicTies(std::span<const Mimic> mimics, Index velocities)
      : mimics_(mimics.begin(), mimics.end()), response_(mimics.size()), schur_(mimics.size() * mimics.size(), S(0.0)),
        pull_(mimics.size(), S(0.0)) {
    for (Field<S>& column : response_) column.allocate(velocities);
  }

  bool empty() const { return mimics_.empty(); }
  std::span<const Mimic> mimics() const { return mimics_; }

  /// After the tree was factored. solve(r, x): x = A^-1 r with that factor; `column` is scratch of nv rows.
  template <class Solve>
  void factor(Solve&& solve, Field<S>& column) {
    const std::size_t m = mimics_.size();
    for (std::size_t j = 0; j < m; ++j) {
      for (S& value : column.flat()) value = S(0.0);
      column(mimics_[j].follower_v) = S(1.0);
      column(mimics_[j].leader_v) = as<S>(-mimics_[j].multiplier);
      solve(column, response_[j]);
    }
    for (std::size_t i = 0; i < m; ++i) {
      for (std::size_t j = 0; j < m; ++j) schur_[i * m + j] = gap(mimics_[i], response_[j]);
    }
    // LU in place; T is positive definite but for the small antisymmetric part of the Jacobian, so no pivoting
    for (std::size_t k = 0; k < m; ++k) {
      for (std::size_t i = k + 1; i < m; ++i) {
        schur_[i * m + k] = schur_[i * m + k] / schur_[k * m + k];
        for (std::size_t j = k + 1; j < m; ++j) schur_[i * m + j] = schur_[i * m + j] - schur_[i * m + k] * schur_[k * m + j];
      }
    }
  }

  /// Delta_0 -> Delta.
  void complete(Field<S>& increment) {
    const std::size_t m = mimics_.size();
    for (std::size_t i = 0; i < m; ++i) {
      pull_[i] = gap(mimics_[i], increment);
      for (std::size_t j = 0; j < i; ++j) pull_[i] = pull_[i] - schur_[i * m + j] * pull_[j];
    }
    for (std::size_t i = m; i-- > 0;) {
      for (std::size_t j = i + 1; j < m; ++j) pull_[i] = pull_[i] - schur_[i * m + j] * pull_[j];
      pull_[i] = pull_[i] / schur_[i * m + i];
    }
    for (std::size_t j = 0; j < m; ++j) {
      for (Index row = 0; row < increment.rows(); ++row) increment(row) = increment(row) - pull_[j] * response_[j](row);
    }
    spread_mimics<S>(mimics_, increment);
  }

 private:
  static S gap(const Mimic& mimic, const Field<S>& x) { return x(mimic.follower_v) - as<S>(mimic.multiplier) * x(mimic.leader_v); }

  std::vector<Mimic> mimics_;
  std::vector<Field<S>> response_;  // X, one column a follower
  std::vector<S> schur_;            // T = L U
  std::vector<S> pull_;
};

}  // namespace linden

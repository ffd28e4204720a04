// Of tree_sweeps.hpp: positions that close couplings, as near to those that there are as the mass matrix measures.
#include <algorithm>
#include <cmath>

#include "engine/solve/judge.hpp"
#include "engine/sweeps/tree_kernels.hpp"
#include "engine/sweeps/tree_sweeps.hpp"

namespace linden {
namespace {

/// A turn that a correction may make at once [rad].
constexpr double kMostTurn = 0.5;
constexpr int kMostCorrections = 200;
/// Gaps are closed once they are this small beside their mechanism; what cannot be brought that far, at a position where rows are all but
/// parallel, is left to the first step from here on. What other rows hold already may be open by what steps allow (engine/solve/judge.hpp).
constexpr double kClosed = 1e-13, kNearEnough = 1e-9;

}  // namespace

template <bool kEffects>
Assembly TreeSweeps<kEffects>::openness() {
  Assembly worst;
  for (std::size_t row = 0; row < couplings_->rows(); ++row) {
    if (!couplings_->is_rigid(row)) continue;
    const double gap = std::abs(couplings_->gap(row)), relative = gap / couplings_->size(row);
    if (relative > worst.relative || worst.coupling.empty()) worst = {couplings_->coupling_of(row).name, gap, relative, true};
  }
  if (worst.relative > kNearEnough) {
    factor_for_start(Coupled::positions);
    worst.closed = is_closed_to(kNearEnough);
  }
  return worst;
}

template <bool kEffects>
template <class Visit>
void TreeSweeps<kEffects>::each_cable(const Visit& visit) const {
  for (std::size_t row = 0; const Coupling& coupling : model_.couplings) {
    if (coupling.kind == CouplingKind::cable) {
      const GearTerm& length = coupling.terms.front();
      bool is_given = false;
      if constexpr (kEffects) {
        is_given = std::ranges::find(effects_.plan().effects.motions, length.v_row, &JointMotion::row) != effects_.plan().effects.motions.end();
      }
      if (!is_given) visit(row, length);
    }
    row += rows_of(coupling).size();
  }
}

template <bool kEffects>
void TreeSweeps<kEffects>::measure_cables(Field<double>& q) {
  bool moved = false;
  each_cable([&](std::size_t row, const GearTerm& length) {
    moved = moved || couplings_->gap(row) != 0;
    q(length.q_row) += couplings_->gap(row);
  });
  if (moved) refresh(q);
}

template <bool kEffects>
Index TreeSweeps<kEffects>::widest_coupling() const {
  std::size_t row = 0;
  double widest = -1;
  for (std::size_t k = 0; k < couplings_->rows(); ++k) {
    const double open = std::abs(couplings_->gap(k)) / couplings_->size(k);
    if (!couplings_->is_rigid(k) || open <= widest) continue;
    widest = open;
    row = k;
  }
  return static_cast<Index>(&couplings_->coupling_of(row) - model_.couplings.data());
}

/// Whether all rows are, but for those that others hold by the factor made last.
template <bool kEffects>
bool TreeSweeps<kEffects>::is_closed_to(double enough) const {
  for (std::size_t row = 0; row < couplings_->rows(); ++row) {
    if (couplings_->is_rigid(row) && std::abs(couplings_->gap(row)) / couplings_->size(row) > (couplings_->is_held_already(row) ? kMostOpen : enough)) return false;
  }
  return true;
}

/// v <- v - M^-1 G^T (G M^-1 G^T)^-1 G v.
template <bool kEffects>
void TreeSweeps<kEffects>::close_velocities(Field<double>& v) {
  if (couplings_->empty()) return;
  each_cable([&](std::size_t row, const GearTerm& length) { v(length.v_row) += couplings_->opening(row, v); });
  factor_for_start(Coupled::velocities);
  std::ranges::fill(work_.residual.flat(), 0.0);
  apply_mass_inverse(work_.residual, work_.increment, &v);
  for (Index row = 0; row < v.rows(); ++row) v(row) += work_.increment(row);
}

/// q <- q (-) M^-1 G^T (G M^-1 G^T + damping)^-1 g.
template <bool kEffects>
void TreeSweeps<kEffects>::close_gaps(double damping, Field<double>& q) {
  factor_for_start(Coupled::positions, damping);
  std::ranges::fill(work_.residual.flat(), 0.0);
  apply_mass_inverse(work_.residual, work_.increment, nullptr, Coupled::positions);
  double most = 0;
  down(model_.tree, [&](auto joint, Index i) {
    const Index row = model_.tree.first_v(i);
    const auto moved = load_joint(joint, work_.increment, row);
    const double turn = joint == JointKind::screw ? std::abs(constants_->screw(i, 0) * moved.n.x) : std::sqrt(dot(moved.n, moved.n));
    most = std::max(most, turn);
  });
  const double share = most > kMostTurn ? kMostTurn / most : 1;
  for (Index row = 0; row < work_.delta.rows(); ++row) work_.delta(row) = -share * work_.increment(row);
  displace(q);
}

template <bool kEffects>
void TreeSweeps<kEffects>::displace(Field<double>& q) {
  motion_map(model_.tree, *constants_, work_.delta, work_.motion);
  advance_map(model_.tree, work_.motion, work_.delta, all_slots(model_.tree), q);
  for (const Mimic& mimic : mimics()) q(mimic.follower_q) = mimic.multiplier * q(mimic.leader_q) + mimic.offset;
  refresh(q);
}

/// Levenberg's and Marquardt's method: Gauss and Newton's as long as gaps get smaller, else damped, so that what cannot be closed ends where it
/// is least open.
template <bool kEffects>
Assembly TreeSweeps<kEffects>::assemble(Field<double>& q) {
  double damping = 0, open = couplings_->openness();
  couplings_->keep_scales(true);
  Field<double> good;
  good.allocate(q.rows());
  for (int k = 0; k < kMostCorrections && widest_gap() > kClosed; ++k) {
    std::ranges::copy(q.flat(), good.flat().begin());
    close_gaps(damping, q);
    if (damping == 0 && is_closed_to(kClosed)) break;
    const double now = couplings_->openness();
    if (now < open) {
      const bool stalls = now > (1 - 1e-12) * open;
      open = now;
      damping = damping < 1e-6 ? 0 : damping / 10;
      if (stalls) break;
    } else {
      std::ranges::copy(good.flat(), q.flat().begin());
      refresh(q);
      if (damping > 1e6 || widest_gap() < 1e-12) break;
      damping = std::max(1e-4, 10 * damping);
    }
  }
  couplings_->keep_scales(false);
  return openness();
}

template class TreeSweeps<LINDEN_ACTING>;

}  // namespace linden

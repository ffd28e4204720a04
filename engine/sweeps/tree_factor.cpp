// Of tree_sweeps.hpp: factors - of the Jacobian, of the mass matrix - with what ties joints to each other, and solves with them.
#include <algorithm>
#include <cmath>

#include "engine/sweeps/tree_kernels.hpp"
#include "engine/sweeps/tree_sweeps.hpp"

namespace linden {

/// action(added), with joints held that are tied.
template <bool kEffects>
template <class Added, class Action>
void TreeSweeps<kEffects>::with_ties(const Added& added, const Action& action) {
  if (ties_.empty()) return action(added);
  action(ties_.held(added));
}

/// Where joints are tied, what becomes of a factor of all joints with them held. down(x): the second half of a solve.
template <bool kEffects>
template <class Down>
void TreeSweeps<kEffects>::tie(const Gains<double>& gains, const Down& down) {
  if (ties_.empty()) return;
  const auto solve = [&](const Field<double>& r, Field<double>& x) {
    impulse_pass_up(model_.tree, *constants_, work_.placement, gains, r, all_slots(model_.tree), work_.bias, work_.innovation);
    down(x);
  };
  ties_.factor(solve, [&](Index i) { return tied_load(model_.tree, *constants_, gains, work_.bias, work_.variation, i); }, work_.increment);
}

/// What the body feels where couplings close, of the factor of a step or, with rates, of the mass matrix.
template <bool kEffects>
void TreeSweeps<kEffects>::close(std::size_t closure, Coupled of, const Gains<double>& gains, double damping) {
  const bool increments = of == Coupled::step && options_.solver == Solver::newton;
  const std::array<double, 36> felt =
      couplings_->close(closure, of, *constants_, work_.placement, increments ? &work_.motion : nullptr, gains, ties_, true, damping);
  const Index slot = couplings_->slot_of(closure);
  if (slot == 0) return;
  if (increments) {
    add_inertia(model_.tree, all_slots(model_.tree), slot, felt, work_.articulated);
  } else {
    add_inertia(slot, felt, work_.articulated);
  }
}

template <bool kEffects>
void TreeSweeps<kEffects>::factor() {
  const auto part_up = [&](Slots part) {
    effects_.with_added([&](const auto& given) {
      with_ties(given, [&](const auto& added) {
        if (options_.solver == Solver::riqn) {
          articulated_inertia_up(model_.tree, *constants_, work_.placement, part, work_.articulated, gains(), added);
        } else {
          newton_factor_up(model_.tree, *constants_, work_.placement, work_.motion, work_.displacement, part, work_.articulated, gains(), added);
        }
      });
    });
    tie(gains(), [&](Field<double>& x) { increments_down(part, x); });
  };
  couplings_->up_to_closures(part_up, [&](std::size_t closure) { close(closure, Coupled::step, gains()); });
}

template <bool kEffects>
double TreeSweeps<kEffects>::pass_residual() {
  couplings_->begin_solve(Coupled::step);
  double norm = 0;
  couplings_->up_to_closures(
      [&](Slots part) { norm += impulse_pass_up(model_.tree, *constants_, work_.placement, gains(), work_.residual, part, work_.bias, work_.innovation); },
      [&](std::size_t closure) { couplings_->yield(closure, Coupled::step, ties_, work_.innovation, work_.bias); });
  if (!solves_with_residual()) return norm;
  pass_down(work_.increment);
  if (!couplings_->empty()) {
    couplings_->subtract_push(work_.residual);
    fold_mimics(ties_.mimics(), work_.residual);
  }
  return std::abs(along(work_.increment) - couplings_->beyond_norm(work_.increment));
}

template <bool kEffects>
void TreeSweeps<kEffects>::increments_down(Slots part, Field<double>& x) {
  if (options_.solver == Solver::riqn) {
    rate_down(model_.tree, *constants_, work_.placement, gains(), work_.innovation, part, work_.variation, x);
  } else {
    increment_down<true>(model_.tree, *constants_, work_.placement, work_.motion, gains(), work_.innovation, part, work_.variation, x);
  }
}

template <bool kEffects>
void TreeSweeps<kEffects>::pass_down(Field<double>& correction) {
  couplings_->down_from_closures([&](Slots part) { increments_down(part, correction); },
                                [&](std::size_t closure) { couplings_->push(closure, Coupled::step, work_.variation, work_.innovation); });
  if (!ties_.empty()) ties_.complete(correction);
}

template <bool kEffects>
template <class Added>
void TreeSweeps<kEffects>::factor_mass(const Added& added, Coupled of, double damping) {
  place_all();
  const auto part_up = [&](Slots part) {
    with_ties(added, [&](const auto& all) {
      articulated_inertia_up(model_.tree, *constants_, work_.placement, part, work_.articulated, mass_gains(), all);
    });
    tie(mass_gains(), [&](Field<double>& x) { rates_down(part, x); });
  };
  couplings_->up_to_closures(part_up, [&](std::size_t closure) { close(closure, of, mass_gains(), damping); });
}

/// Of positions or velocities that are to close couplings; joints whose motion is given keep theirs.
template <bool kEffects>
void TreeSweeps<kEffects>::factor_for_start(Coupled of, double damping) {
  const auto factor = [&](const auto& added) { factor_mass(added, of, damping); };
  if constexpr (kEffects) {
    effects_.begin_blow();
    effects_.with_reading(factor);
  } else {
    factor(NothingAdded{});
  }
}

template <bool kEffects>
void TreeSweeps<kEffects>::rates_down(Slots part, Field<double>& v) {
  rate_down(model_.tree, *constants_, work_.placement, mass_gains(), work_.innovation, part, work_.variation, v);
}

template <bool kEffects>
void TreeSweeps<kEffects>::apply_mass_inverse(const Field<double>& p, Field<double>& v, const Field<double>* given, Coupled of) {
  couplings_->begin_solve(of, given);
  couplings_->up_to_closures(
      [&](Slots part) { impulse_pass_up(model_.tree, *constants_, work_.placement, mass_gains(), p, part, work_.bias, work_.innovation); },
      [&](std::size_t closure) { couplings_->yield(closure, of, ties_, work_.innovation, work_.bias); });
  couplings_->down_from_closures([&](Slots part) { rates_down(part, v); },
                                [&](std::size_t closure) { couplings_->push(closure, of, work_.variation, work_.innovation); });
  if (!ties_.empty()) ties_.complete(v);
}

template <bool kEffects>
void TreeSweeps<kEffects>::velocity_of(const Field<double>& p, Field<double>& v) {
  effects_.with_rotors([&](const auto& rotors) { factor_mass(rotors); });
  apply_mass_inverse(p, v);
}

template <bool kEffects>
void TreeSweeps<kEffects>::blow(Field<double>& change, Field<double>& impulse) {
  if constexpr (kEffects) {
    spread_mimics<double>(ties_.mimics(), change);
    momentum_of(change, impulse);
    for (double& value : impulse.flat()) value = -value;
    effects_.with_reading([&](const auto& added) { factor_mass(added); });
    apply_mass_inverse(impulse, work_.increment, &change);
    for (Index row = 0; row < change.rows(); ++row) change(row) += work_.increment(row);
    momentum_of(change, impulse);
    if (!couplings_->empty()) {
      couplings_->add_pull(impulse);
      fold_mimics(ties_.mimics(), impulse);
    }
  }
}

template <bool kEffects>
void TreeSweeps<kEffects>::momentum_of(const Field<double>& v, Field<double>& p) {
  place_all();
  velocity_down(model_.tree, *constants_, work_.placement, v, work_.twist);
  momentum_of_map(model_.tree, *constants_, work_.twist, work_.impulse);
  impulse_up(model_.tree, *constants_, work_.placement, work_.impulse, p);
  if constexpr (kEffects) add_armature<double>(effects_.plan().effects.armature, v, p);
  fold_mimics(ties_.mimics(), p);
}

template <bool kEffects>
const Field<double>& TreeSweeps<kEffects>::read_velocity(const Field<double>& p, Field<double>& v) {
  if (!kEffects && !couplings_->gives_way()) {
    velocity_of(p, v);
    return p;
  }
  read_ = p;
  if constexpr (kEffects) effects_.begin_reading(read_);
  couplings_->begin_reading(options_.step, read_);
  fold_mimics(ties_.mimics(), read_);
  const bool given = given_.rows() > 0;
  if constexpr (kEffects) {
    if (given) {
      effects_.given_velocities(given_);
      spread_mimics<double>(ties_.mimics(), given_);
      momentum_of(given_, work_.momentum);
      for (Index row = 0; row < read_.rows(); ++row) read_(row) -= work_.momentum(row);
    }
    effects_.with_reading([&](const auto& added) { factor_mass(added, Coupled::reading); });
  } else {
    factor_mass(NothingAdded{}, Coupled::reading);
  }
  apply_mass_inverse(read_, v, given ? &given_ : nullptr, Coupled::reading);
  for (Index row = 0; given && row < v.rows(); ++row) v(row) += given_(row);
  if (given || couplings_->gives_way()) momentum_of(v, read_);
  return read_;
}

template <bool kEffects>
double TreeSweeps<kEffects>::late_in_reading(const Field<double>& v) {
  if constexpr (kEffects) {
    if (!contacts_ || !contacts_->lasted()) return 0;
    // 1/2 (p - b).M^-1 (p - b) - 1/2 p.M^-1 p
    std::ranges::copy(contacts_->lasting_push(), work_.momentum.flat().begin());
    fold_mimics(ties_.mimics(), work_.momentum);
    apply_mass_inverse(work_.momentum, work_.increment, nullptr, Coupled::reading);
    double sum = 0;
    for (Index row = 0; row < v.rows(); ++row) sum += work_.momentum(row) * (0.5 * work_.increment(row) - v(row));
    return sum;
  }
  return 0;
}

template <bool kEffects>
std::vector<CouplingState> TreeSweeps<kEffects>::couplings(double h) const {
  std::vector<CouplingState> states;
  for (std::size_t row = 0; const Coupling& coupling : model_.couplings) {
    CouplingState& state = states.emplace_back();
    state.name = coupling.name;
    for (const std::size_t end = row + rows_of(coupling).size(); row < end; ++row) {
      state.gaps.push_back(couplings_->gap(row));
      state.forces.push_back(h != 0 ? couplings_->multiplier(row) / (h * h) : 0);
      state.redundant.push_back(couplings_->is_held_already(row));
    }
  }
  return states;
}

template class TreeSweeps<LINDEN_ACTING>;

}  // namespace linden

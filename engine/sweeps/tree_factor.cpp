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

/// down(x): the second half of a solve.
template <bool kEffects>
template <class Down>
void TreeSweeps<kEffects>::tie(const Gains<double>& gains, const Down& down) {
  if (ties_.empty()) return;
  ties_.factor(
      [&](const Field<double>& r, Field<double>& x) {
        impulse_pass_up(model_.tree, *constants_, work_.placement, gains, r, work_.bias, work_.innovation);
        down(x);
      },
      [&](Index i) { return tied_load(model_.tree, *constants_, gains, work_.bias, work_.variation, i); }, work_.increment);
}

template <bool kEffects>
void TreeSweeps<kEffects>::tie_rates(const Gains<double>& gains) {
  tie(gains, [&](Field<double>& x) {
    rate_down(model_.tree, *constants_, work_.placement, gains, work_.innovation, work_.variation, x);
  });
}

template <bool kEffects>
void TreeSweeps<kEffects>::factor() {
  effects_.with_added([&](const auto& given) {
    with_ties(given, [&](const auto& added) {
      if (options_.solver == Solver::riqn) {
        articulated_inertia_up(model_.tree, *constants_, work_.placement, work_.articulated, gains(), added);
      } else {
        newton_factor_up(model_.tree, *constants_, work_.placement, work_.motion, work_.displacement, work_.articulated, gains(),
                         added);
      }
    });
  });
  if (options_.solver == Solver::riqn) return tie_rates(gains());
  tie(gains(), [&](Field<double>& x) {
    increment_down(model_.tree, *constants_, work_.placement, work_.motion, gains(), work_.innovation, work_.variation, x);
  });
}

/// Ties between joints make the whole solve necessary for the norm.
template <bool kEffects>
double TreeSweeps<kEffects>::pass_residual() {
  const double norm =
      impulse_pass_up(model_.tree, *constants_, work_.placement, gains(), work_.residual, work_.bias, work_.innovation);
  if (ties_.empty()) return norm;
  pass_down(work_.increment);
  double tied = 0;
  for (Index row = 0; row < model_.tree.shape.velocities; ++row) tied += work_.residual(row) * work_.increment(row);
  return std::abs(tied);
}

template <bool kEffects>
void TreeSweeps<kEffects>::pass_down(Field<double>& correction) {
  if (options_.solver == Solver::riqn) {
    rate_down(model_.tree, *constants_, work_.placement, gains(), work_.innovation, work_.variation, correction);
  } else {
    increment_down(model_.tree, *constants_, work_.placement, work_.motion, gains(), work_.innovation, work_.variation, correction);
  }
  if (!ties_.empty()) ties_.complete(correction);
}

template <bool kEffects>
template <class Added>
void TreeSweeps<kEffects>::factor_mass(const Added& added) {
  place_all();
  with_ties(added, [&](const auto& all) {
    articulated_inertia_up(model_.tree, *constants_, work_.placement, work_.articulated, mass_gains(), all);
  });
  tie_rates(mass_gains());
}

template <bool kEffects>
void TreeSweeps<kEffects>::apply_mass_inverse(const Field<double>& p, Field<double>& v) {
  impulse_pass_up(model_.tree, *constants_, work_.placement, mass_gains(), p, work_.bias, work_.innovation);
  rate_down(model_.tree, *constants_, work_.placement, mass_gains(), work_.innovation, work_.variation, v);
  if (!ties_.empty()) ties_.complete(v);
}

template <bool kEffects>
void TreeSweeps<kEffects>::velocity_of(const Field<double>& p, Field<double>& v) {
  effects_.with_rotors([&](const auto& rotors) { factor_mass(rotors); });
  apply_mass_inverse(p, v);
}

template <bool kEffects>
void TreeSweeps<kEffects>::response_to(const Field<double>& impulse, Field<double>& v) {
  if constexpr (kEffects) {
    effects_.with_reading([&](const auto& added) { factor_mass(added); });
    apply_mass_inverse(impulse, v);
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
  if constexpr (kEffects) {
    read_ = p;
    effects_.begin_reading(read_);
    fold_mimics(ties_.mimics(), read_);
    const bool given = given_.rows() > 0;
    if (given) {
      effects_.given_velocities(given_);
      spread_mimics<double>(ties_.mimics(), given_);
      momentum_of(given_, work_.momentum);
      for (Index row = 0; row < read_.rows(); ++row) read_(row) -= work_.momentum(row);
    }
    effects_.with_reading([&](const auto& added) { factor_mass(added); });
    apply_mass_inverse(read_, v);
    if (given) {
      for (Index row = 0; row < v.rows(); ++row) v(row) += given_(row);
      momentum_of(v, read_);
    }
    return read_;
  } else {
    velocity_of(p, v);
    return p;
  }
}

template class TreeSweeps<LINDEN_ACTING>;

}  // namespace linden

#include "engine/queries/mass_matrix.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "engine/queries/fold.hpp"
#include "engine/queries/inverse_dynamics.hpp"
#include "kernels/queries/body_motion_down.hpp"
#include "kernels/queries/mass_matrix_up.hpp"
#include "kernels/tree/articulated_inertia_up.hpp"
#include "kernels/tree/increment_down.hpp"
#include "kernels/tree/mimic.hpp"
#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"
#include "layout/workspace.hpp"

namespace linden {
namespace {

/// The factor of M and what is solved with it.
class MassSolve {
 public:
  explicit MassSolve(const Kinematics& state) : state_(state), model_(state.model()), ties_(model_.mimics, model_.tree) {
    const Shape& shape = model_.tree.shape;
    work_.allocate(shape);
    rotor_.allocate(shape.velocities, 0.0);
    std::ranges::copy(state.armature(), rotor_.flat().begin());
    const EffectsAdded<double, true, false> rotors{rotor_, no_pull_};
    if (ties_.empty()) {
      factor(rotors);
      return;
    }
    factor(ties_.held(rotors));
    const auto load_of = [&](Index slot) {
      return tied_load(model_.tree, model_.constants, gains(), work_.bias, work_.variation, slot);
    };
    ties_.factor([&](const Field<double>& from, Field<double>& to) { solve_held(from, to); }, load_of, work_.residual);
  }

  std::vector<double> solve(std::span<const double> f) {
    Field<double>& right_side = work_.residual;
    std::ranges::copy(f, right_side.flat().begin());
    fold_mimics<double>(model_.mimics, right_side);
    solve_held(right_side, work_.increment);
    if (!ties_.empty()) ties_.complete(work_.increment);
    return {work_.increment.flat().begin(), work_.increment.flat().end()};
  }

 private:
  Gains<double> gains() { return {work_.gain_up, work_.gain_down, work_.joint_inverse}; }
  const Field<double, 12>& placement() const { return state_.bodies().placement; }

  template <class Added>
  void factor(const Added& added) {
    articulated_inertia_up(model_.tree, model_.constants, placement(), work_.articulated, gains(), added);
  }
  void solve_held(const Field<double>& from, Field<double>& to) {
    impulse_pass_up(model_.tree, model_.constants, placement(), gains(), from, work_.bias, work_.innovation);
    rate_down(model_.tree, model_.constants, placement(), gains(), work_.innovation, work_.variation, to);
  }

  const Kinematics& state_;
  const Model& model_;
  MimicTies<double> ties_;
  Workspace<double> work_;
  Field<double> rotor_;
  Field<double, 36> no_pull_;
};

}  // namespace

Matrix mass_matrix(const Kinematics& state) {
  const Model& model = state.model();
  const Index nv = model.tree.shape.velocities;
  Field<double, 10> composite;
  composite.allocate(model.tree.shape.slots);
  Matrix M(nv, nv);
  mass_matrix_up(model.tree, model.constants, state.bodies().placement, composite, M.numbers.data());
  for (Index row = 0; row < static_cast<Index>(state.armature().size()); ++row) {
    M(row, row) += state.armature()[static_cast<std::size_t>(row)];
  }
  fold_columns(model, M);
  fold_rows(model, M);
  return M;
}

std::vector<double> solve_mass_matrix(const Kinematics& state, std::span<const double> f) {
  const Index nv = state.model().tree.shape.velocities;
  if (f.size() != static_cast<std::size_t>(nv)) {
    throw InputError(fmt::format("a vector of {} numbers was to be solved for with the mass matrix of model {}; expected {}", f.size(),
                                 quoted(state.model().names.model), nv));
  }
  return MassSolve(state).solve(f);
}

std::vector<double> forward_dynamics(const Kinematics& state, std::span<const double> tau) {
  if (!state.model().couplings.empty()) {
    throw InputError(fmt::format("forward dynamics of model {}: it has a coupling, {}, whose force is not known without a step; ask Simulation::accelerations "
                                 "for those of a motion, or a model without couplings for those of its tree",
                                 quoted(state.model().names.model), quoted(state.model().couplings.front().name)));
  }
  std::vector<double> f = bias_forces(state);
  if (tau.size() != f.size()) {
    throw InputError(
        fmt::format("joint forces: {} numbers given for model {}, expected {}", tau.size(), quoted(state.model().names.model), f.size()));
  }
  for (std::size_t k = 0; k < f.size(); ++k) f[k] = tau[k] - f[k];
  return MassSolve(state).solve(f);
}

}  // namespace linden

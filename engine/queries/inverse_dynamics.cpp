#include "engine/queries/inverse_dynamics.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "engine/queries/link_frames.hpp"
#include "kernels/queries/newton_euler_map.hpp"
#include "kernels/tree/impulse_up.hpp"
#include "kernels/tree/mimic.hpp"
#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"

namespace linden {
namespace {

struct Passed {
  Field<double, 6> wrench;  // across each joint
  Field<double> force;      // S^T of it
};

Passed newton_euler(const Kinematics& state, std::span<const double> outside) {
  const Model& model = state.model();
  const Shape& shape = model.tree.shape;
  const std::size_t expected = static_cast<std::size_t>(shape.slots) * 6;
  if (!outside.empty() && outside.size() != expected) {
    throw InputError(fmt::format("wrenches on the bodies of model {}: {} numbers given, expected {} (6 a slot)", quoted(model.names.model),
                                 outside.size(), expected));
  }
  Passed passed;
  Field<double, 6> given;
  given.allocate(shape.slots, 0.0);
  std::ranges::copy(outside, given.flat().begin());
  passed.wrench.allocate(shape.slots);
  passed.force.allocate(shape.velocities);
  newton_euler_map(model.tree, model.constants, state.bodies(), vec3_of(state.gravity()), given, passed.wrench);
  impulse_up(model.tree, model.constants, state.bodies().placement, passed.wrench, passed.force);
  return passed;
}

std::vector<double> folded(const Model& model, Field<double>& force) {
  fold_mimics<double>(model.mimics, force);
  return {force.flat().begin(), force.flat().end()};
}

}  // namespace

std::vector<double> inverse_dynamics(const Kinematics& state, std::span<const double> outside) {
  Passed passed = newton_euler(state, outside);
  for (std::size_t k = 0; k < state.armature().size(); ++k) passed.force.flat()[k] += state.armature()[k] * state.accelerations()[k];
  return folded(state.model(), passed.force);
}

std::vector<double> bias_forces(const Kinematics& state) {
  Kinematics still = state;
  still.set(state.positions(), state.velocities());
  return inverse_dynamics(still);
}

std::vector<double> gravity_forces(const Kinematics& state) {
  Kinematics rest = state;
  rest.set(state.positions());
  std::vector<double> forces = inverse_dynamics(rest);
  for (double& force : forces) force = -force;
  return forces;
}

std::vector<SpatialForce> joint_reactions(const Kinematics& state, std::span<const double> outside) {
  const Passed passed = newton_euler(state, outside);
  std::vector<SpatialForce> reactions;
  for (Index i = 0; i < state.model().tree.shape.slots; ++i) {
    const auto F = load<Wrench, double>(passed.wrench, i);
    reactions.push_back(force_of(i == 0 ? -F : F));
  }
  return reactions;
}

}  // namespace linden

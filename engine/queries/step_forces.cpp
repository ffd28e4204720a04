#include "engine/queries/step_forces.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/queries/link_frames.hpp"
#include "kernels/queries/motion_between_map.hpp"
#include "kernels/tree/displacement_down.hpp"
#include "kernels/tree/impulse_up.hpp"
#include "kernels/tree/mimic.hpp"
#include "kernels/tree/momentum_map.hpp"
#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"

namespace linden {
namespace {

/// h x momenta of the subtrees over one step.
struct StepMomenta {
  Field<double, 7> displacement;  // of every body
  Field<double, 6> momentum;      // of its subtree, in its frame at the beginning
};

Field<double> field_of(std::span<const double> numbers) {
  Field<double> field;
  field.allocate(static_cast<Index>(numbers.size()));
  std::ranges::copy(numbers, field.flat().begin());
  return field;
}

StepMomenta momenta(const Kinematics& from, const Kinematics& to) {
  const Model& model = from.model();
  const Tree& tree = model.tree;
  StepMomenta step;
  step.displacement.allocate(tree.shape.slots);
  step.momentum.allocate(tree.shape.slots);
  Field<double, 7> motion;
  motion.allocate(tree.shape.slots);
  Field<double> projected;
  projected.allocate(tree.shape.velocities);
  const Field<double, 12>& placement = from.bodies().placement;
  motion_between_map(tree, model.constants, field_of(from.positions()), field_of(to.positions()), motion);
  if (!(displacement_down(tree, placement, motion, step.displacement) > 0)) {
    throw InputError(
        fmt::format("forces of a step of model {}: a body turns by half a turn or more in it; expected configurations that lie "
                    "closer together",
                    quoted(model.names.model)));
  }
  momentum_map(tree, model.constants, step.displacement, step.momentum);
  impulse_up(tree, model.constants, placement, step.momentum, projected);
  return step;
}

/// Wrench of gravity on each body and all that hang on it, less those from outside.
Field<double, 6> loads(const Kinematics& state, std::span<const double> outside) {
  const Model& model = state.model();
  const std::size_t expected = static_cast<std::size_t>(model.tree.shape.slots) * 6;
  if (!outside.empty() && outside.size() != expected) {
    throw InputError(fmt::format("wrenches on the bodies of model {}: {} numbers given, expected {} (6 a slot)", quoted(model.names.model),
                                 outside.size(), expected));
  }
  Field<double, 6> load_of;
  load_of.allocate(model.tree.shape.slots, 0.0);
  std::ranges::copy(outside, load_of.flat().begin());
  for (Index i = 1; i < model.tree.shape.slots; ++i) {
    const Vec3<double> g = transpose_times(load<Placement, double>(state.bodies().pose, i).R, vec3_of(state.gravity()));
    const auto G = load<Inertia, double>(model.constants.inertia, i);
    store(load_of, i, load<Wrench, double>(load_of, i) + Wrench<double>{cross(G.mc, g), G.m * g});
  }
  Field<double> projected;
  projected.allocate(model.tree.shape.velocities);
  impulse_up(model.tree, model.constants, state.bodies().placement, load_of, projected);
  return load_of;
}

}  // namespace

StepForces step_forces(const Model& model, std::span<const double> q0, std::span<const double> q1, std::span<const double> q2, double h,
                       const std::array<double, 3>& gravity, std::span<const double> outside) {
  if (!(h > 0) || !std::isfinite(h)) throw InputError(fmt::format("forces of a step of {} s; expected a length above zero", h));
  const Kinematics first(model, q0), last(model, q2);
  Kinematics middle(model, q1);
  middle.set_gravity(gravity);
  const StepMomenta before = momenta(first, middle), after = momenta(middle, last);
  const Field<double, 6> load_of = loads(middle, outside);
  const double rate = 1 / h;
  Field<double> joints;
  joints.allocate(model.tree.shape.velocities);
  StepForces forces;
  // what is left for the world is the sum of what its bodies get, seen from its frame, which does not move
  forces.across.push_back(force_of(load<Wrench, double>(load_of, 0) -
                                   rate * (rate * (load<Wrench, double>(after.momentum, 0) - load<Wrench, double>(before.momentum, 0)))));
  down(model.tree, [&](auto joint, Index i) {
    const Wrench<double> at_end = carried(load<Displacement, double>(before.displacement, i), load<Wrench, double>(before.momentum, i));
    const Wrench<double> across = rate * (rate * (load<Wrench, double>(after.momentum, i) - at_end)) - load<Wrench, double>(load_of, i);
    store_joint(joint, joints, model.tree.first_v(i), project(joint, model.constants, i, across));
    forces.across.push_back(force_of(across));
  });
  fold_mimics<double>(model.mimics, joints);
  forces.joints.assign(joints.flat().begin(), joints.flat().end());
  return forces;
}

}  // namespace linden

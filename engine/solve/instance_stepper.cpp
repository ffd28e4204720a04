#include "engine/solve/instance_stepper.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/compose/composition.hpp"
#include "engine/effects/effect_plan.hpp"
#include "kernels/tree/mimic.hpp"
#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"

namespace linden {

InstanceStepper::InstanceStepper(const Model& model, const Options& options, const EffectPlan& plan)
    : model_(model), options_(options), stepper_(make_stepper(model, options, plan)) {
  state_.allocate(model.tree.shape);
  rate_.allocate(model.tree.shape.velocities);
}

InstanceStepper::~InstanceStepper() = default;

BodyConstants<double>& InstanceStepper::own_constants() {
  if (constants_.inertia.rows() == 0) {
    constants_ = model_.constants;
    stepper_->use(constants_);
  }
  return constants_;
}

std::span<double> InstanceStepper::applied() {
  applied_.resize(static_cast<std::size_t>(model_.tree.shape.velocities));
  return applied_;
}

void InstanceStepper::use_gravity(const std::array<double, 3>& gravity) { stepper_->use_gravity(gravity); }

void InstanceStepper::forget() {
  stepper_->forget();
  std::ranges::fill(state_.history.flat(), 0.0);
  state_.last_step(0) = 0;
}

void InstanceStepper::refresh() {
  if (!applied_.empty()) stepper_->apply(applied_);
  if (constants_.inertia.rows() > 0) sum_subtree_masses(model_.tree, constants_);
  stepper_->refresh(state_);
}

StepReport InstanceStepper::step(double time, int guessed) {
  refresh();
  StepReport whole;
  for (const double stage : composition(options_.order)) {
    int history = guessed;
    whole.add(stepper_->step(state_, history, time, stage * options_.step, Then::stop));
    if (!whole.ok()) break;
  }
  return whole;
}

Assembly InstanceStepper::close_nearly_closed() {
  if (model_.couplings.empty()) return {};
  refresh();
  stepper_->measure_cables(state_);
  const Assembly open = stepper_->openness();
  return open.relative > kOpenStart ? open : stepper_->assemble(state_);
}

void InstanceStepper::set_velocities(std::span<const double> v) {
  refresh();
  std::ranges::copy(v, rate_.flat().begin());
  spread_mimics<double>(model_.mimics, rate_);
  stepper_->momentum_of(rate_, state_.p);
}

Energy InstanceStepper::observe() {
  refresh();
  return stepper_->energy_of(state_, rate_);
}

void normalise_positions(const Model& model, std::span<double> q) {
  for (std::size_t i = 0; i < q.size(); ++i) {
    if (!std::isfinite(q[i])) throw InputError(fmt::format("position {} is {}", quoted(model.names.position[i]), q[i]));
  }
  const Tree& tree = model.tree;
  for (const Run& run : tree.runs) {
    if (run.kind == JointKind::screw) continue;
    for (Index i = run.begin; i < run.end; ++i) {
      const std::span<double> turn = q.subspan(static_cast<std::size_t>(tree.first_q(i) + (run.kind == JointKind::free ? 3 : 0)), 4);
      const double length = std::sqrt(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2] + turn[3] * turn[3]);
      if (!(length > 1e-3)) {
        throw InputError(fmt::format("the quaternion of joint {} has length {}; expected 1",
                                     quoted(model.names.joint[static_cast<std::size_t>(i)]), length));
      }
      for (double& number : turn) number /= length;
    }
  }
  for (const Mimic& mimic : model.mimics) {
    q[static_cast<std::size_t>(mimic.follower_q)] = mimic.multiplier * q[static_cast<std::size_t>(mimic.leader_q)] + mimic.offset;
  }
}

}  // namespace linden

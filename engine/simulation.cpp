#include "engine/simulation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/compose/composition.hpp"
#include "engine/effects/effect_plan.hpp"
#include "engine/effects/own_numbers.hpp"
#include "engine/required_model.hpp"
#include "engine/scene/scene.hpp"
#include "engine/solve/instance_stepper.hpp"
#include "engine/start_check.hpp"
#include "engine/threads.hpp"
#include "engine/variable_steps.hpp"
#include "kernels/tree/mimic.hpp"
#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"

namespace linden {

namespace {

Options checked(const Options& options, const Model& model, const Effects& effects) {
  check_accuracy(options);
  Options chosen = with_accuracy(options, model, effects);
  check_order(chosen.order, model, effects);
  return chosen;
}

/// Variable steps that fail are taken again, shorter, instead of being split.
Options of_each_step(const Options& options) {
  Options of_step = options;
  if (options.varies()) of_step.max_splits = 0;
  return of_step;
}

}  // namespace

Simulation::Simulation(Model model, const Options& options, const Effects& effects)
    : Simulation(std::make_shared<const Model>(std::move(model)), options, effects) {}

Simulation::Simulation(std::shared_ptr<const Model> model, const Options& options, const Effects& effects)
    : model_(required(std::move(model))), options_(checked(options, *model_, effects)), plan_(std::make_unique<EffectPlan>(*model_, options_, effects)),
      stepper_(make_stepper(*model_, of_each_step(options_), *plan_)) {
  if (model_->tree.most_threads() > 1) require_threads(threads_here());
  state_.allocate(model_->tree.shape);
  rate_.allocate(model_->tree.shape.velocities);
  std::ranges::copy(model_->neutral(), state_.q.flat().begin());
  if (const std::span<const double> stages = composition(options_.order); stages.size() > 1) {
    stage_guess_.emplace(stages, model_->tree.shape.velocities);
    good_q_ = state_.q;
    good_p_ = state_.p;
  }
  watch_.emplace(*model_, plan_->effects);
  if (options_.varies()) {
    varying_ = std::make_unique<Varying>(*model_, options_, plan_->effects);
    clock_ = 0;
  }
  for (const BodyWrench& wrench : plan_->effects.wrenches) own_wrenches_.push_back(numbers_of(wrench));
  changed();
  if (!plan_->curves.empty()) set_positions(model_->neutral());
  close_nearly_closed();
  if (!model_->couplings.empty()) set_velocities(std::vector(rate_.flat().size(), 0.0));
}

Simulation::Simulation(const Scene& scene)
    : Simulation(scene.randomization.any() ? std::make_shared<const Scene>(drawn(scene)) : std::shared_ptr<const Scene>(std::shared_ptr<void>(), &scene)) {}

Simulation::Simulation(const std::shared_ptr<const Scene>& instance) : Simulation(instance->model, instance->options, instance->effects) {
  if (const std::vector<double> positions = checked_start(*instance); !positions.empty()) set_positions(positions);
  if (!instance->initial.velocities.empty()) set_velocities(instance->initial.velocities);
}

Simulation::~Simulation() = default;
Simulation::Simulation(Simulation&&) noexcept = default;

const Effects& Simulation::effects() const { return plan_->effects; }

void Simulation::check_row_count(const char* what, std::size_t found, Index expected) const {
  if (found != static_cast<std::size_t>(expected)) {
    throw InputError(fmt::format("{}: {} numbers given for model {}, expected {}", what, found, quoted(model_->names.model),
                                 expected));
  }
}

/// A start: nothing is known of what was before.
void Simulation::changed() {
  forget_past();
  if (impulses_) impulses_->clear();
  if (varying_) varying_->begin();
  step_from_.reset();
}

void Simulation::forget_past() {
  history_ = 0;
  stepper_->forget();
  std::ranges::fill(state_.history.flat(), 0.0);
  if (stage_guess_) stage_guess_->forget();
  state_.last_step(0) = 0;
  stepper_->refresh(state_);
}

std::vector<double> Simulation::velocities() {
  stepper_->read_velocity(state_, rate_);
  return {rate_.flat().begin(), rate_.flat().end()};
}

void Simulation::set_positions(std::span<const double> q) {
  check_row_count("positions", q.size(), model_->tree.shape.positions);
  std::vector<double> given(q.begin(), q.end());
  plan_->put_positions(time(), given);
  normalise_positions(*model_, given);
  const std::vector<double> rates = velocities();
  std::ranges::copy(given, state_.q.flat().begin());
  changed();
  close_nearly_closed();
  set_velocities(rates);
}

/// A start that is open by what people round off, or more: see assemble.
void Simulation::close_nearly_closed() {
  if (model_->couplings.empty()) return;
  stepper_->measure_cables(state_);
  assembly_ = stepper_->openness();
  if (assembly_.relative <= kOpenStart) assembly_ = stepper_->assemble(state_);
}

Assembly Simulation::assemble() {
  if (model_->couplings.empty()) return {};
  const std::vector<double> rates = velocities();
  assembly_ = stepper_->assemble(state_);
  changed();
  set_velocities(rates);
  return assembly_;
}

void Simulation::set_velocities(std::span<const double> v) {
  check_row_count("velocities", v.size(), model_->tree.shape.velocities);
  for (std::size_t i = 0; i < v.size(); ++i) {
    if (!std::isfinite(v[i])) throw InputError(fmt::format("velocity {} is {}", quoted(model_->names.velocity[i]), v[i]));
  }
  std::ranges::copy(v, rate_.flat().begin());
  plan_->put_velocities(time(), rate_.flat());
  spread_mimics<double>(model_->mimics, rate_);
  stepper_->momentum_of(rate_, state_.p);
  changed();
}

void Simulation::set_forces(std::span<const double> force) {
  if (!force.empty()) check_row_count("forces", force.size(), model_->tree.shape.velocities);
  for (std::size_t i = 0; i < force.size(); ++i) {
    if (std::isfinite(force[i])) continue;
    throw InputError(fmt::format("the force on {} is {}", quoted(model_->names.velocity[i]), force[i]));
  }
  applied_.assign(force.begin(), force.end());
  stepper_->apply(applied_);
  stepper_->refresh(state_);
  if (varying_) varying_->choice.begin_energy();
}

std::vector<std::string> Simulation::servo_names() const { return joints_of(*model_, plan_->effects.servos); }

std::vector<std::string> Simulation::friction_names() const { return joints_of(*model_, plan_->effects.friction); }

void Simulation::set_servo_targets(std::span<const double> targets) {
  const std::span<double> to = stepper_->controls().servo_targets();
  check_row_count("servo targets", targets.size(), static_cast<Index>(to.size()));
  for (std::size_t k = 0; k < targets.size(); ++k) {
    const bool by_table = std::isnan(targets[k]) && plan_->effects.servos[k].target_moves();
    if (!std::isfinite(targets[k]) && !by_table) throw InputError(fmt::format("the target of servo {} is {}", k, targets[k]));
  }
  std::ranges::copy(targets, to.begin());
}

std::vector<double> Simulation::servo_targets() {
  const std::span<const double> now = stepper_->controls().servo_targets();
  std::vector<double> targets(now.begin(), now.end());
  for (std::size_t k = 0; k < targets.size(); ++k) {
    if (std::isnan(targets[k])) targets[k] = plan_->effects.servos[k].target_at(time());
  }
  return targets;
}

namespace {

void require_not_negative(const std::string& what, double number) {
  if (std::isfinite(number) && number >= 0) return;
  throw InputError(fmt::format("the {} is {}; expected a finite number, zero or more", what, number));
}

}  // namespace

void Simulation::set_gains(std::span<const double> factors) {
  check_row_count("factors of gains", factors.size(), static_cast<Index>(plan_->effects.servos.size()));
  for (std::size_t k = 0; k < factors.size(); ++k) require_not_negative(fmt::format("factor of the gains of servo {}", k), factors[k]);
  for (std::size_t k = 0; k < factors.size(); ++k) stepper_->controls().set_gain(static_cast<Index>(k), factors[k]);
}

void Simulation::set_friction(std::span<const double> forces) {
  const std::span<double> to = stepper_->controls().friction_forces();
  check_row_count("forces of friction", forces.size(), static_cast<Index>(to.size()));
  for (std::size_t k = 0; k < forces.size(); ++k) require_not_negative(fmt::format("force of friction {}", k), forces[k]);
  std::ranges::copy(forces, to.begin());
}

void Simulation::set_ground_friction(double coefficient) {
  if (!plan_->effects.ground) {
    throw InputError("the friction of the ground was set and there is no ground; expected one among the effects; name it there");
  }
  require_not_negative("friction of the ground", coefficient);
  stepper_->controls().set_ground_friction(coefficient);
}

std::vector<CouplingState> Simulation::couplings() const { return stepper_->couplings(state_.last_step(0)); }

std::vector<double> Simulation::motion_forces() const {
  std::vector<double> forces;
  const auto count = static_cast<Index>(plan_->curves.size());
  for (Index k = plan_->kept() - count; k < plan_->kept(); ++k) forces.push_back(stepper_->controls().kept(k));
  return forces;
}

void Simulation::set_wrench(Index slot, const std::array<double, 3>& force, const std::array<double, 3>& moment) {
  const auto wrench = std::ranges::find(plan_->effects.wrenches, slot, &BodyWrench::slot);
  if (wrench == plan_->effects.wrenches.end()) {
    const bool body = slot > 0 && slot < model_->tree.shape.slots;
    throw InputError(fmt::format("no wrench acts on {}; expected one among the effects; name it there, zero if need be",
                                 body ? fmt::format("body {}", quoted(model_->names.body[static_cast<std::size_t>(slot)]))
                                      : fmt::format("slot {}", slot)));
  }
  for (const double number : {force[0], force[1], force[2], moment[0], moment[1], moment[2]}) {
    if (!std::isfinite(number)) throw InputError(fmt::format("the wrench on slot {} holds {}; expected finite numbers", slot, number));
  }
  wrench->force = force;
  wrench->moment = moment;
}

StepReport Simulation::step() { return take_step(Then::stop); }

StepsReport Simulation::run(std::int64_t steps) {
  StepsReport report;
  while (report.steps < steps && report.ok()) report.add(take_step(report.steps + 1 < steps ? Then::step : Then::stop));
  return report;
}

StepReport Simulation::take_step(Then then) {
  require_closed(assembly_);
  const StepReport report = varying_ ? variable_step() : step_of(options_.step, then);
  if (report.ok()) {
    ++steps_;
    if (impulses_ && !stage_guess_) *impulses_ = stepper_->impulses();
    effect_work_.add(stepper_->effect_account().work);
    if (plan_->any()) watch_->add(stepper_->effect_account(), time());
    if (varying_ && varying_->choice.looks()) look_at_energy(stage_guess_ ? varying_->energy : energy());
  }
  return report;
}

StepReport Simulation::step_of(double h, Then then) {
  return stage_guess_ ? step_in_stages(h) : stepper_->step(state_, history_, time(), h, then);
}

StepReport Simulation::step_in_stages(double h) {
  std::ranges::copy(state_.q.flat(), good_q_.flat().begin());
  std::ranges::copy(state_.p.flat(), good_p_.flat().begin());
  StepReport whole;
  const std::span<const double> stages = composition(options_.order);
  const bool extrapolates = options_.guess == FirstGuess::extrapolation;
  for (std::size_t i = 0; i < stages.size(); ++i) {
    const bool known = extrapolates ? stage_guess_->predict(i, state_.history) : stage_guess_->repeat(i, state_.history);
    history_ = known ? 1 : 0;
    const StepReport report = stepper_->step(state_, history_, time(), stages[i] * h, Then::stop);
    whole.add(report);
    if (report.ok()) {
      if (impulses_) {
        if (i == 0) impulses_->clear();
        impulses_->add(stepper_->impulses());
      }
      if (history_ > 0) {
        stage_guess_->learn(i, state_.history);
      } else {
        stage_guess_->forget(i);  // it was split
      }
      continue;
    }
    // back to the beginning; sub-steps that were taken have lost part of their past, so all begin anew
    std::ranges::copy(good_q_.flat(), state_.q.flat().begin());
    std::ranges::copy(good_p_.flat(), state_.p.flat().begin());
    forget_past();
    if (impulses_) impulses_->clear();
    break;
  }
  return whole;
}

void Simulation::keep_forces() {
  if (impulses_) return;
  stepper_->keep_impulses();
  impulses_ = stepper_->impulses();
}

std::vector<double> Simulation::mean_forces(const std::vector<double>& impulses) const {
  std::vector<double> forces = impulses;
  for (double& number : forces) number /= last_step();
  return forces;
}

namespace {

const StepImpulses& kept(const std::optional<StepImpulses>& impulses) {
  if (!impulses) throw InputError("forces of effects were asked for and none are kept; call keep_forces before the step");
  return *impulses;
}

}  // namespace

std::vector<double> Simulation::joint_forces() const {
  std::vector<double> forces = mean_forces(kept(impulses_).joints);
  forces.resize(static_cast<std::size_t>(model_->tree.shape.velocities));  // without effects there are none
  return forces;
}

std::vector<double> Simulation::servo_torques() const { return mean_forces(kept(impulses_).servos); }

std::vector<BodyContact> Simulation::contacts() const {
  const StepImpulses& impulses = kept(impulses_);
  std::vector<BodyContact> bodies;
  for (std::size_t k = 0; k < impulses.ground.size(); ++k) {
    const Index slot = plan_->ground.points[k].slot;
    if (bodies.empty() || bodies.back().slot != slot) bodies.push_back({slot});
    bodies.back().closed += impulses.closed[k];
    bodies.back().normal_force += impulses.ground[k] / last_step();
  }
  return bodies;
}

std::vector<double> Simulation::accelerations() const {
  if (stage_guess_) {
    throw InputError(fmt::format("accelerations were asked for at order {}; expected order 2: sub-steps differ in length", options_.order));
  }
  std::vector<double> rows(static_cast<std::size_t>(model_->tree.shape.velocities), 0.0);
  if (history_ < 2) return rows;
  // rows of history are as of steps of the last one's length, which differ by as much as they were apart
  const double rate = 1 / last_step(), per = varying_ ? 1 / varying_->apart : rate;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const auto row = static_cast<Index>(k);
    rows[k] = per * (rate * (state_.history(row, 0) - state_.history(row, 1)));
  }
  return rows;
}

Energy Simulation::energy() { return stepper_->energy_of(state_, rate_); }

Momentum Simulation::momentum() {
  const Wrench<double> h = stepper_->total_momentum(state_, rate_);
  return {{h.n.x, h.n.y, h.n.z}, {h.f.x, h.f.y, h.f.z}};
}

}  // namespace linden

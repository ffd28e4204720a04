#include "tests/gallery/scenario.hpp"

#include <fmt/format.h>

#include <cmath>

#include "engine/program/progress.hpp"
#include "engine/text.hpp"
#include "kernels/tree/placement_map.hpp"
#include "kernels/tree/velocity_down.hpp"

namespace linden {
namespace {

/// Twists of all bodies, now and at the look before.
class TwistMeter {
 public:
  explicit TwistMeter(const Model& model) : model_(model) {
    placement_.allocate(model.tree.shape.slots);
    now_.allocate(model.tree.shape.slots);
    before_.allocate(model.tree.shape.slots);
    q_.allocate(model.tree.shape.positions);
    v_.allocate(model.tree.shape.velocities);
  }

  void look(Simulation& simulation) {
    std::swap(now_, before_);
    std::ranges::copy(simulation.positions(), q_.flat().begin());
    std::ranges::copy(simulation.velocities(), v_.flat().begin());
    placement_map(model_.tree, model_.constants, q_, placement_);
    velocity_down(model_.tree, model_.constants, placement_, v_, now_);
  }
  /// Kinetic energy of the change since the look before [J].
  double change() const {
    double sum = 0;
    for (Index i = 1; i < model_.tree.shape.slots; ++i) {
      const auto a = load<Twist, double>(now_, i), b = load<Twist, double>(before_, i);
      const Twist<double> d{a.w - b.w, a.v - b.v};
      sum += 0.5 * dot(load<Inertia, double>(model_.constants.inertia, i) * d, d);
    }
    return sum;
  }
  /// [rad/s]
  double fastest_turn() const {
    double most = 0;
    for (Index i = 1; i < model_.tree.shape.slots; ++i) {
      const auto w = load<Twist, double>(now_, i).w;
      most = std::max(most, dot(w, w));
    }
    return std::sqrt(most);
  }

 private:
  const Model& model_;
  Field<double, 12> placement_;
  Field<double, 6> now_, before_;
  Field<double> q_, v_;
};

}  // namespace

Scenario scenario(Model model, const Options& options, std::int64_t steps) {
  return {.model = std::make_shared<const Model>(std::move(model)), .options = options, .steps = steps};
}

Simulation simulation_of(const Scenario& scenario) {
  Simulation simulation(scenario.model, scenario.options, scenario.effects);
  if (!scenario.start.positions.empty()) simulation.set_positions(scenario.start.positions);
  if (!scenario.start.velocities.empty()) simulation.set_velocities(scenario.start.velocities);
  return simulation;
}

RunRecord run(Simulation& simulation, std::int64_t steps, int every, const std::function<void(Simulation&)>& watch) {
  RunRecord record;
  record.drift = EnergyDrift(steps / every + 1);
  record.momentum = MomentumDrift::of(simulation);
  TwistMeter meter(simulation.model());
  Progress progress(steps, 1, "steps");
  const double h = simulation.options().step, begin = simulation.time();
  const auto look = [&] {
    const Energy energy = simulation.energy();
    if (record.drift.samples() == 0) record.start_energy = energy.total();
    record.drift.add(simulation.time(), energy);
    const double change = energy.total() - record.start_energy;
    record.energy_error = std::max(record.energy_error, std::abs(change));
    record.energy_gain = std::max(record.energy_gain, change);
    if (std::isnan(change)) record.energy_error = change;
    if (record.momentum) record.momentum->add(simulation, energy);
    for (const CouplingState& coupling : simulation.couplings()) {
      for (const double gap : coupling.gaps) record.gap = std::max(record.gap, std::abs(gap));
    }
    if (watch) watch(simulation);
  };
  look();
  for (std::int64_t k = 0; k < steps; ++k) {
    const bool looks = (k + 1) % every == 0;
    if (looks && (every > 1 || k == 0)) meter.look(simulation);
    const StepReport report = simulation.step();
    if (!report.ok()) {
      record.failure = fmt::format("step {}: {}", k + 1, simulation.describe(report));
      break;
    }
    record.steps += 1;
    record.iterations += report.iterations;
    record.evaluations += report.evaluations;
    record.most_iterations = std::max(record.most_iterations, report.iterations);
    record.split += report.substeps > 1;
    record.at_floor += report.at_rounding_floor;
    record.residual = std::max(record.residual, report.residual);
    if (looks) {
      look();
      meter.look(simulation);
      record.second_order = std::max(record.second_order, meter.change());
      record.turn = std::max(record.turn, h * meter.fastest_turn());
    }
    progress.update(k + 1, Progress::Clock::now());
  }
  record.duration = simulation.time() - begin;
  return record;
}

RunRecord run(const Scenario& scenario) {
  Simulation simulation = simulation_of(scenario);
  return run(simulation, scenario.steps, scenario.every);
}

void promise_conservation(Report& report, const RunRecord& record, std::int64_t steps, bool slope) {
  report.at_most("steps that failed", static_cast<double>(steps - record.steps), 0, "every step has a solution");
  if (!record.failure.empty()) report.note(record.failure);
  const double kinetic = record.drift.scale();
  report.at_most("energy error / largest kinetic energy", record.energy_error / kinetic, record.second_order / kinetic,
                 "second order: energy of the change of twists in a step");
  if (slope) promise_no_slope(report, record);
  report.note(effort(record));
}

void promise_no_slope(Report& report, const RunRecord& record) {
  const double visible = std::max(0.0, std::abs(record.drift.slope()) - 5 * record.drift.slope_error());
  report.at_most("visible slope of energy x time / second order", visible * record.duration / record.second_order, 0.1,
                 "visible: beyond five standard errors; what is left is the wandering of a chaotic motion within its band");
  report.note(fmt::format("slope {:+.1e} ± {:.1e} of the largest kinetic energy a second",
                          record.drift.slope() / record.drift.scale(), record.drift.slope_error() / record.drift.scale()));
}

std::string effort(const RunRecord& record) {
  std::string text =
      fmt::format("{:.2f} iterations a step, {} at most",
                  static_cast<double>(record.iterations) / static_cast<double>(record.steps), record.most_iterations);
  if (record.split > 0) text += fmt::format("; {} of {} steps split", grouped(record.split), grouped(record.steps));
  if (record.at_floor > 0) text += fmt::format("; {} ended at the floor of rounding", grouped(record.at_floor));
  return text;
}

}  // namespace linden

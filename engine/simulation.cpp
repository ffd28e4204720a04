#include "engine/simulation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "layout/input_error.hpp"

namespace linden {

Simulation::Simulation(Model model, const Options& options)
    : Simulation(std::make_shared<const Model>(std::move(model)), options) {}

Simulation::Simulation(std::shared_ptr<const Model> model, const Options& options)
    : model_(std::move(model)), options_(options), stepper_(*model_, options) {
  state_.allocate(model_->tree.shape);
  rate_.allocate(model_->tree.shape.velocities);
  std::ranges::copy(model_->neutral(), state_.q.flat().begin());
  changed();
}

void Simulation::check_row_count(const char* what, std::size_t found, Index expected) const {
  if (found != static_cast<std::size_t>(expected)) {
    throw InputError(fmt::format("{}: {} numbers given for model \"{}\", expected {}", what, found, model_->names.model, expected));
  }
}

void Simulation::changed() {
  history_ = 0;
  std::ranges::fill(state_.history.flat(), 0.0);
  std::ranges::fill(state_.pace.flat(), std::numeric_limits<double>::quiet_NaN());
  stepper_.refresh(state_);
}

std::vector<double> Simulation::velocities() {
  stepper_.velocity_of(state_.p, rate_);
  return {rate_.flat().begin(), rate_.flat().end()};
}

void Simulation::set_positions(std::span<const double> q) {
  check_row_count("positions", q.size(), model_->tree.shape.positions);
  for (std::size_t i = 0; i < q.size(); ++i) {
    if (!std::isfinite(q[i])) throw InputError(fmt::format("position \"{}\" is {}", model_->names.position[i], q[i]));
  }
  const Tree& tree = model_->tree;
  std::vector<double> given(q.begin(), q.end());
  for (const Run& run : tree.runs) {
    if (run.kind == JointKind::screw) continue;
    for (Index i = run.begin; i < run.end; ++i) {
      const std::span<double> turn(given.data() + tree.first_q(i) + (run.kind == JointKind::free ? 3 : 0), 4);
      const double length = std::sqrt(turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2] + turn[3] * turn[3]);
      if (!(length > 1e-3)) {
        throw InputError(fmt::format("the quaternion of joint \"{}\" has length {}; expected 1",
                                     model_->names.joint[static_cast<std::size_t>(i)], length));
      }
      for (double& number : turn) number /= length;
    }
  }
  const std::vector<double> rates = velocities();
  std::ranges::copy(given, state_.q.flat().begin());
  for (const Mimic& mimic : model_->mimics) {
    state_.q(mimic.follower_q) = mimic.multiplier * state_.q(mimic.leader_q) + mimic.offset;
  }
  changed();
  set_velocities(rates);
}

void Simulation::set_velocities(std::span<const double> v) {
  check_row_count("velocities", v.size(), model_->tree.shape.velocities);
  for (std::size_t i = 0; i < v.size(); ++i) {
    if (!std::isfinite(v[i])) throw InputError(fmt::format("velocity \"{}\" is {}", model_->names.velocity[i], v[i]));
  }
  std::ranges::copy(v, rate_.flat().begin());
  spread_mimics<double>(model_->mimics, rate_);
  stepper_.momentum_of(rate_, state_.p);
  changed();
}

StepReport Simulation::step() {
  const StepReport report = stepper_.step(state_, history_, options_.step);
  if (report.ok()) ++steps_;
  return report;
}

Energy Simulation::energy() {
  stepper_.velocity_of(state_.p, rate_);
  double kinetic = 0;
  for (Index row = 0; row < state_.p.rows(); ++row) kinetic += 0.5 * state_.p(row) * rate_(row);
  return {kinetic, stepper_.potential()};
}

Momentum Simulation::momentum() {
  stepper_.velocity_of(state_.p, rate_);
  const Wrench<double> h = stepper_.total_momentum(rate_);
  return {{h.n.x, h.n.y, h.n.z}, {h.f.x, h.f.y, h.f.z}};
}

}  // namespace linden

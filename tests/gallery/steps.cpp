// How far a body may turn in a step, and how long or short a step may be.
#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include "models/build/builder.hpp"
#include "models/build/generators.hpp"
#include "tests/gallery/models.hpp"
#include "tests/gallery/scenario.hpp"
#include "tests/reference/closed_forms.hpp"

namespace linden {
namespace {

constexpr double kPi = std::numbers::pi;

/// Angle of a unit quaternion about z, from -pi to pi, with full relative accuracy near zero.
double angle_of(std::span<const double> q) { return 2 * std::atan2(q[q.size() - 2], q[q.size() - 1]); }

double wrapped(double angle) { return std::remainder(angle, 2 * kPi); }

/// A body turns about z by `turn` in every step, on this joint.
Simulation turning(JointType type, double turn, int max_splits) {
  const double h = 1e-3;
  const Model model = one_body(type, {1, Eigen::Vector3d::Zero(), moments(0.01, 0.02, 0.03)});
  Simulation simulation(model, {.step = h, .gravity = {0, 0, 0}, .tolerance = 1e-15, .max_splits = max_splits});
  std::vector<double> v(static_cast<std::size_t>(model.tree.shape.velocities), 0.0);
  v[type == JointType::revolute ? 0 : 2] = turn / h;
  simulation.set_velocities(v);
  return simulation;
}

void turn_per_step(Report& report) {
  constexpr JointType kinds[] = {JointType::revolute, JointType::ball, JointType::free};
  double worst = 0, kept = 0;
  for (const JointType kind : kinds) {
    for (const double turn : {1e-12, 1e-10, 1e-8, 1e-6, 1e-4, 1e-2, 0.1, 1.0, 2.0, 3.0, 0.99 * kPi, 0.999999 * kPi}) {
      Simulation simulation = turning(kind, turn, 0);
      constexpr int steps = 100;
      for (int k = 0; k < steps; ++k) {
        if (!simulation.step().ok()) worst = std::nan("");
      }
      const double found = kind == JointType::revolute ? simulation.positions()[0] : angle_of(simulation.positions());
      worst = std::max(worst, std::abs(wrapped(found - steps * turn)) / std::max(turn, 1e-3 * std::abs(wrapped(steps * turn))));
    }
  }
  report.at_most("error of 100 steps / turn of a step", worst, 100 * 4 * kEpsilon / 1e-3,
                 "four epsilons of the angle a step, a hundred steps; near half turns 1e-3 of the digits are the angle's");
  int reported = 0, asked = 0;
  double split_error = 0;
  for (const JointType kind : kinds) {
    for (const double turn : {1.000001 * kPi, 1.01 * kPi, 1.5 * kPi, 2.5 * kPi}) {
      asked += 1;
      const StepReport step = turning(kind, turn, 0).step();
      reported += step.status == StepStatus::past_pi || step.status == StepStatus::gains_energy;
      // given leave to split it finds the way round
      Simulation split = turning(kind, turn, 8);
      const StepReport parts = split.step();
      const double found = kind == JointType::revolute ? split.positions()[0] : angle_of(split.positions());
      split_error = std::max(split_error, parts.ok() ? std::abs(wrapped(found - turn)) : std::nan(""));
    }
  }
  // two hinges of 0.6 pi each: no joint turns too far, but the second body does
  LinkSpec first, second;
  first.name = first.joint = "first";
  second.name = second.joint = "second";
  second.parent = "first";
  first.inertia = second.inertia = {1, Eigen::Vector3d::Zero(), moments(0.01, 0.02, 0.03)};
  const Model two = TreeBuilder("two hinges").add(first).add(second).build();
  Simulation summed(two, {.step = 1e-3, .gravity = {0, 0, 0}, .max_splits = 0});
  summed.set_velocities(std::vector<double>{600 * kPi, 600 * kPi});
  const StepReport step = summed.step();
  asked += 1;
  reported += step.status == StepStatus::past_pi && step.slot == 2;
  kept = static_cast<double>(asked - reported);
  report.at_most("turns above pi that were not reported", kept, 0, "log has one value below half a turn and others above");
  report.at_most("error of a step that was split [rad]", split_error, 64 * kEpsilon * 2.5 * kPi,
                 "an epsilon of the angle each of 16 parts");
  if (!step.ok()) report.note(summed.describe(step));
}

/// Error at the end of `duration` over a ladder of steps.
using ErrorAt = std::function<double(double h)>;

/// Order from the errors at h and h / 2, worst over the ladder.
void promise_order(Report& report, const std::string& what, const ErrorAt& error, std::initializer_list<double> ladder,
                   double margin) {
  double worst = 0;
  std::string told;
  for (const double h : ladder) {
    const double order = std::log2(error(h) / error(h / 2));
    worst = std::max(worst, std::abs(order - 2));
    if (std::isnan(order)) worst = order;
    told += fmt::format("{}{:.0e} s: {:.3f}", told.empty() ? what + ": order at " : ", ", h, order);
  }
  report.at_most(what + ": |order - 2|", worst, margin, "h^2 (1 + c h^2): the next power shows at the largest step alone");
  report.note(told);
}

/// From 1e-7 s on the pendulum must follow its closed form: the h^2 of the method and a random walk of rounding.
void pendulum_steps(Report& report) {
  const Pendulum pendulum(2.0);
  const double most_steps = report.pick(2e3, 2e5, 1e7);
  const double omega = 5;  // [rad/s] of small swings, about
  double worst = 0;
  for (const double h : {1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.05, 0.1}) {
    Simulation simulation(Pendulum::model(), {.step = h, .tolerance = 1e-15});
    simulation.set_positions(std::vector<double>{pendulum.start()});
    const auto steps = static_cast<std::int64_t>(std::min(most_steps, 1.0 / h));
    bool ok = true;
    for (std::int64_t k = 0; k < steps && ok; ++k) ok = simulation.step().ok();
    const double t = simulation.time(), error = pendulum.error(t, simulation.positions());
    const double travelled = std::abs(simulation.positions()[0] - pendulum.start());
    // the local error of second order, summed; rounding of the angle walks, that of the momentum walks and is carried along
    const double method = omega * omega * h * h * std::max(travelled, omega * t);
    const double rounding = 4 * kEpsilon * std::sqrt(static_cast<double>(steps)) * (pendulum.start() + omega * t);
    worst = std::max(worst, ok ? error / (method * std::min(1.0, omega * t) + rounding) : std::nan(""));
    report.note(fmt::format("h = {:.0e} s, {} steps: error {:.1e} rad", h, steps, error));
  }
  report.at_most("pendulum: error / (second order + random walk of rounding)", worst, 1,
                 "(w h)^2 of the way, and four epsilons a step as a random walk");
}

/// End of a run of `duration` at a step, tight.
std::vector<double> end_of(const Model& model, int order, double h, double duration, double spread) {
  Simulation simulation(model, {.step = h, .order = order, .tolerance = 1e-15});
  const InitialState start = random_state(model, 3, spread);
  simulation.set_positions(start.positions);
  simulation.set_velocities(start.velocities);
  for (std::int64_t k = 0; k < std::llround(duration / h); ++k) {
    const StepReport step = simulation.step();
    if (!step.ok()) return std::vector<double>(start.positions.size(), std::nan(""));
  }
  return {simulation.positions().begin(), simulation.positions().end()};
}

double ends_apart_by(const std::vector<double>& a, const std::vector<double>& b) {
  double most = 0;
  for (std::size_t k = 0; k < a.size(); ++k) most = std::isnan(a[k]) ? a[k] : std::max(most, std::abs(a[k] - b[k]));
  return most;
}

void trees_over_steps(Report& report, const std::string& what, const Model& model, double largest) {
  const double duration = 0.256;
  const std::vector<double> exact = end_of(model, 8, 2e-3, duration, 0.2);
  const ErrorAt error = [&](double h) { return ends_apart_by(end_of(model, 2, h, duration, 0.2), exact); };
  if (report.form() == Form::quick) {
    promise_order(report, what, error, {largest, 2e-3}, 0.1);
  } else {
    promise_order(report, what, error, {largest, 4e-3, 1e-3, 2.5e-4, 6.25e-5}, 0.1);
  }
  // steps so short that the method is exact: what is left is rounding
  double worst = 0;
  for (const double h : {1e-5, 1e-6, 1e-7}) {
    const int steps = report.pick(100, 1000, 10'000);
    const std::vector<double> here = end_of(model, 8, h * steps / 10, h * steps, 0.2);
    const double off = ends_apart_by(end_of(model, 2, h, h * steps, 0.2), here);
    const double rounding = 10 * kEpsilon * std::sqrt(static_cast<double>(steps));
    // local error h^2 of second order at speeds and accelerations of up to 1e3
    const double method = h * h * 1e3 * h * steps;
    worst = std::max(worst, off / (rounding + method));
  }
  report.at_most(what + ": error of 1e-5, 1e-6, 1e-7 s / (second order + random walk of rounding)", worst, 1,
                 "ten epsilons a step as a random walk: no digit is lost as the step shrinks");
}

/// The ten-link chain from horizontal at steps too long for it: refused, or split, or right.
void beyond_steps(Report& report) {
  double silent = 0;
  for (const double h : {4e-3, 6e-3, 1e-2, 2e-2, 3e-2, 0.05, 0.1}) {
    Scenario falling = scenario(chain(10), {.step = h}, static_cast<std::int64_t>(10 / h));
    const RunRecord record = run(falling);
    const double off = record.energy_error / record.drift.scale();
    const bool told = !record.failure.empty() || record.split > 0;
    if (!told) silent = std::max(silent, off);
    report.note(fmt::format("chain at {:.0f} ms: {}, energy off by {:.2g} of the largest kinetic energy", 1e3 * h,
                            record.failure.empty()
                                ? fmt::format("{} of {} steps split", record.split, record.steps)
                                : fmt::format("refused at {:.2f} s, {} of {} steps before split",
                                              static_cast<double>(record.steps) * h, record.split, record.steps),
                            off));
  }
  report.at_most("energy error where no step was split or refused", silent, 0.25,
                 "a step that gains a quarter is refused (judge.hpp)");
}

}  // namespace

std::vector<Case> step_cases() {
  return {
      {"turn-per-step", "from 1e-12 rad to 0.99 pi in a step, and above: the branches of the logarithm", turn_per_step, ""},
      {"step-pendulum", "h from 1e-7 to 0.1 s", pendulum_steps, ""},
      {"step-chain", "h from 1e-7 s to 16 ms on a chain",
       [](Report& report) { trees_over_steps(report, "chain of 5", chain(5), 8e-3); }, ""},
      {"step-humanoid", "h from 1e-7 s to 16 ms on a floating humanoid",
       [](Report& report) { trees_over_steps(report, "humanoid", humanoids(1), 16e-3); }, ""},
      {"step-too-long", "the ten-link chain at steps of 4 ms to 0.1 s", beyond_steps, ""},
  };
}

}  // namespace linden

// What everybody does with a scene, to its end: it settles, is pushed, is held, comes to rest. No step is refused, and what rests reads zero.
#include <catch2/catch.hpp>
#include <cmath>

#include "engine/batch.hpp"
#include "models/build/builder.hpp"
#include "models/build/generators.hpp"
#include "scenes.hpp"

namespace linden::rest_test {
namespace {

/// A chain of `links` links of `mass`, hinged about y, that hang from the origin.
Model hanging(int links, double mass = 1, double length = 0.2) {
  TreeBuilder builder("hanging");
  for (int k = 0; k < links; ++k) {
    LinkSpec link;
    link.name = "l" + std::to_string(k);
    link.joint = "j" + std::to_string(k);
    if (k > 0) {
      link.parent = "l" + std::to_string(k - 1);
      link.placement.translation().z() = -length;
    }
    link.axis = Eigen::Vector3d::UnitY();
    link.inertia = {mass, Eigen::Vector3d(0, 0, -length / 2), mass * length * length / 12 * Eigen::Matrix3d::Identity()};
    builder.add(link);
  }
  return builder.build();
}

Model brick(double mass = 1) {
  LinkSpec link;
  link.name = "brick";
  link.joint = "base";
  link.type = JointType::free;
  link.inertia = {mass, Eigen::Vector3d::Zero(), 0.01 * mass * Eigen::Matrix3d::Identity()};
  return TreeBuilder("brick").add(link).build();
}

double largest(std::span<const double> numbers) {
  double most = 0;
  for (const double number : numbers) most = std::max(most, std::abs(number));
  return most;
}

/// Velocities of instance 2 of a batch of three.
template <class AnyBatch>
double largest_velocity(const AnyBatch& batch) {
  const auto seen = batch.observe();
  double most = 0;
  for (const auto value : seen.velocities().instance(2)) most = std::max(most, std::abs(static_cast<double>(value)));
  return most;
}

}  // namespace

TEST_CASE("damped pendulums come to rest, whatever the step", "[rest]") {
  for (const double h : {1e-3, 1e-2}) {
    for (const int links : {1, 3}) {
      const Model model = hanging(links);
      Effects effects;
      effects.damping = damping_everywhere(model, 0.2);
      Simulation simulation(model, {.step = h}, effects);
      simulation.set_positions(std::vector<double>(static_cast<std::size_t>(links), 0.7));
      run(simulation, static_cast<int>(150 / h));
      INFO(links << " links at " << h);
      CHECK(largest(simulation.positions()) < 1e-9);
      CHECK(largest(simulation.velocities()) < 1e-9);
      CHECK(simulation.passive_gifts().empty());
    }
  }
}

TEST_CASE("arms on servos come to rest at their sag, in simulations and batches", "[rest]") {
  for (const double h : {1e-3, 1e-2}) {
    for (const int joints : {1, 2, 4}) {
      const Model model = hanging(joints);
      Effects effects;
      effects.servos = servo_everywhere(model, 40, 4, std::vector<double>(static_cast<std::size_t>(joints), 0.5));
      Options options;
      options.step = h;
      Simulation simulation(model, options, effects);
      Batch batch(model, 3, options, effects);
      const int steps = static_cast<int>(120 / h);
      run(simulation, steps);
      batch.step(steps);
      INFO(joints << " joints at " << h);
      CHECK(largest(simulation.velocities()) < 1e-9);
      CHECK(batch.summary().frozen == 0);
      CHECK(largest_velocity(batch) < 1e-9);
      // k (target - q) carries the weight of what hangs below
      const auto q = simulation.positions();
      double tilt = 0, turned = 0;
      for (int k = 0; k < joints; ++k) {
        double torque = 0;
        tilt += q[static_cast<std::size_t>(k)];
        double at = tilt, arm = 0;
        for (int below = k; below < joints; ++below) {
          if (below > k) at += q[static_cast<std::size_t>(below)];
          torque += 9.81 * (arm + 0.1 * std::sin(at));
          arm += 0.2 * std::sin(at);
        }
        turned = 40 * (0.5 - q[static_cast<std::size_t>(k)]);
        CHECK(turned == Approx(torque).margin(1e-7));
      }
    }
  }
}

TEST_CASE("a push of any number of steps leaves its impulse", "[rest]") {
  for (const int pushed : {1, 2, 3, 10}) {
    for (const double force : {1e-3, 50.0, 1e5}) {
      Effects effects;
      effects.wrenches = {{.slot = 1, .force = {force, 0, 0}, .from = 0.01, .to = 0.01 + 1e-3 * pushed}};
      Simulation simulation(brick(), {.gravity = {0, 0, 0}}, effects);
      run(simulation, 30);
      INFO(force << " N for " << pushed << " steps");
      CHECK(simulation.velocities()[3] == Approx(1e-3 * pushed * force).epsilon(1e-9));
      CHECK(simulation.effect_work().of<BodyWrench>() == Approx(0.5 * std::pow(1e-3 * pushed * force, 2)).epsilon(1e-9));
    }
  }
}

TEST_CASE("a torque that changes every step is no reason to refuse one", "[rest]") {
  for (const int joints : {1, 3}) {
    Simulation simulation(hanging(joints, 0.05, 0.1), {.gravity = {0, 0, 0}});
    std::vector<double> force(static_cast<std::size_t>(joints));
    for (int k = 0; k < 2000; ++k) {
      for (std::size_t row = 0; row < force.size(); ++row) force[row] = ((k * 7919 + static_cast<int>(row) * 104729) % 201 - 100) * 2e-3;
      simulation.set_forces(force);
      const StepReport report = simulation.step();
      REQUIRE(report.ok());
      REQUIRE(report.substeps == 1);
    }
  }
}

TEST_CASE("what is held reads zero, whatever holds it and at any step", "[rest]") {
  const Model model = hanging(2);
  for (const double h : {1e-4, 1e-3, 1e-2}) {
    Options options;
    options.step = h;
    const std::vector<double> start{0.6, -0.2};
    Effects friction, limits, servos, one_each;
    friction.friction = friction_everywhere(model, 5);
    limits.limits = {{.row = 0, .lower = 0.6, .upper = 1}, {.row = 1, .lower = -0.2, .upper = 0}};
    servos.servos = {{.row = 0, .stiffness = 1e5, .damping = 1e3, .target = 0.6}, {.row = 1, .stiffness = 1e5, .damping = 1e3, .target = -0.2}};
    one_each.friction = {{.row = 0, .force = 5}};
    one_each.limits = {{.row = 1, .lower = -0.2, .upper = 0}};
    for (const Effects* effects : {&friction, &limits, &servos, &one_each}) {
      Simulation simulation(model, options, *effects);
      simulation.set_positions(start);
      Batch batch(model, 3, options, *effects);
      for (std::int64_t i = 0; i < 3; ++i) batch.reset(i, start, std::vector<double>{0, 0});
      const int steps = static_cast<int>(4 / h);
      run(simulation, steps);
      batch.step(steps);
      INFO("step " << h << ", effect " << (effects == &friction ? "friction" : effects == &limits ? "limits" : effects == &servos ? "servos" : "both"));
      // the solver's tolerance is one of the factor's norm: where stiff servos make that a thousandfold of the inertia it leaves more
      const double still = effects == &servos ? 3e-8 : 1e-9;
      CHECK(largest(simulation.velocities()) < still);
      CHECK(largest_velocity(batch) < still);
      CHECK(simulation.energy().kinetic < still * still);
    }
  }
}

TEST_CASE("a motion under friction, dampers and servos reads the velocity of its positions", "[rest]") {
  // against central differences, to first order of the step where effects act at the beginning of a step
  const Model model = hanging(2);
  for (const bool stiff : {false, true}) {
    double error[2];
    for (int halving = 0; halving < 2; ++halving) {
      const double h = 1e-3 / (1 + halving);
      Effects effects;
      effects.friction = {{.row = 0, .force = 0.3}};
      effects.damping = {{.row = 1, .coefficient = stiff ? 100.0 : 0.05}};
      effects.servos = {{.row = 0, .stiffness = 5, .damping = stiff ? 50.0 : 0.1, .target = 1}};
      Simulation simulation(model, {.step = h}, effects);
      simulation.set_positions(std::vector<double>{0.9, 0.5});
      run(simulation, static_cast<int>(std::lround(0.1 / h)));
      const std::vector<double> before(simulation.positions().begin(), simulation.positions().end());
      run(simulation, 1);
      const std::vector<double> v = simulation.velocities();
      run(simulation, 1);
      error[halving] = 0;
      for (std::size_t k = 0; k < 2; ++k) {
        error[halving] = std::max(error[halving], std::abs(v[k] - (simulation.positions()[k] - before[k]) / (2 * h)));
      }
    }
    INFO((stiff ? "stiff" : "soft") << ": " << error[0] << ", " << error[1]);
    CHECK(error[0] < 1e-4);
    CHECK(error[1] < 0.6 * error[0] + 1e-9);
  }
}

}  // namespace linden::rest_test

// Orientations: no gimbal, no sign, no norm that slips.
#include <cmath>
#include <numbers>

#include "models/build/builder.hpp"
#include "models/build/generators.hpp"
#include "models/build/random.hpp"
#include "tests/gallery/models.hpp"
#include "tests/gallery/scenario.hpp"

namespace linden {
namespace {

using Quaternion = Eigen::Map<const Eigen::Vector4d>;

/// First row of the quaternion of body `slot`.
std::size_t quaternion_row(const Tree& tree, Index slot) {
  return static_cast<std::size_t>(tree.first_q(slot)) + (tree.kind(slot) == JointKind::free ? 3 : 0);
}

/// Angle between two orientations, signs left aside.
double angle_between(const double* a, const double* b) {
  const Eigen::Vector4d p = Quaternion(a), q = Quaternion(b);
  return 4 * std::asin(std::min(1.0, 0.5 * std::min((p - q).norm(), (p + q).norm())));
}

double worst_norm(const Simulation& simulation) {
  const Tree& tree = simulation.model().tree;
  double worst = 0;
  for (Index slot = 1; slot < tree.shape.slots; ++slot) {
    if (tree.kind(slot) == JointKind::screw) continue;
    worst = std::max(worst, std::abs(Quaternion(&simulation.positions()[quaternion_row(tree, slot)]).norm() - 1));
  }
  return worst;
}

/// A symmetric body on its joint, turned about one random axis after the other through several turns: its pose is known at every
/// step, and every chart of angles has its singular poses on the way.
void every_orientation(Report& report, JointType type) {
  const Model model = one_body(type, {1, Eigen::Vector3d::Zero(), moments(0.01, 0.01, 0.01)});
  Simulation simulation(model, {.step = 1e-3, .gravity = {0, 0, 0}, .tolerance = 1e-15});
  const std::size_t row = quaternion_row(model.tree, 1);
  Random random(1);
  const int axes = report.pick(10, 200, 5000), steps = 200;
  const double turn =
      2 * std::numbers::pi * 2.2 / steps;  // more than two whole turns about each axis, all signs of the quaternion
  double off = 0, jump = 0, norm = 0;
  for (int k = 0; k < axes; ++k) {
    // the first axes are those of the charts
    const Eigen::Vector3d axis =
        k < 3 ? Eigen::Vector3d(Eigen::Vector3d::Unit(k)) : Eigen::Vector3d(random.rotation() * Eigen::Vector3d::UnitZ());
    std::vector<double> v(static_cast<std::size_t>(model.tree.shape.velocities), 0.0);
    for (int i = 0; i < 3; ++i) v[static_cast<std::size_t>(i)] = axis[i] * turn / 1e-3;
    simulation.set_velocities(v);
    const Eigen::Quaterniond from(Eigen::Vector4d(Quaternion(&simulation.positions()[row])));
    std::vector<double> before(simulation.positions().begin(), simulation.positions().end());
    for (int step = 1; step <= steps; ++step) {
      if (!simulation.step().ok()) off = std::nan("");
      const Eigen::Quaterniond exact = from * Eigen::Quaterniond(Eigen::AngleAxisd(turn * step, axis));
      off = std::max(off, angle_between(&simulation.positions()[row], exact.coeffs().data()));
      jump = std::max(jump, std::abs(angle_between(&simulation.positions()[row], &before[row]) - turn));
      norm = std::max(norm, worst_norm(simulation));
      before.assign(simulation.positions().begin(), simulation.positions().end());
    }
  }
  report.at_most("orientation off [rad]", off, 8 * kEpsilon * steps, "eight epsilons a step; 200 steps about each axis");
  report.at_most("|turn of a step - what it must be| [rad]", jump, 16 * kEpsilon, "no jump: rounding of two orientations");
  report.at_most("|norm - 1|", norm, 4 * kEpsilon, "normalised each step");
}

/// q and -q are one orientation: whichever is given, the same motion.
void sign_flips(Report& report) {
  const Model model = random_tree({.bodies = 20, .seed = 5, .floating = true});
  const InitialState start = random_state(model, 1, 1.0);
  const int steps = report.pick(50, 500, 5000);
  const auto end = [&](bool flip) {
    Simulation simulation(model, {.step = 1e-3});
    InitialState given = start;
    for (Index slot = 1; flip && slot < model.tree.shape.slots; slot += 1) {
      if (model.tree.kind(slot) == JointKind::screw) continue;
      for (std::size_t k = 0; k < 4; ++k) given.positions[quaternion_row(model.tree, slot) + k] *= -1;
    }
    simulation.set_positions(given.positions);
    simulation.set_velocities(given.velocities);
    for (int k = 0; k < steps; ++k) {
      if (!simulation.step().ok()) return std::vector<double>{};
    }
    return std::vector<double>(simulation.positions().begin(), simulation.positions().end());
  };
  const std::vector<double> a = end(false), b = end(true);
  double worst = a.empty() || b.empty() ? std::nan("") : 0;
  for (std::size_t k = 0; k < a.size() && k < b.size(); ++k) worst = std::max(worst, std::abs(std::abs(a[k]) - std::abs(b[k])));
  report.at_most("difference of the motions", worst, 0, "products of two signs are exact: equal to the bit");
}

/// A thousand ball joints in a row, bent at random, fall, and its bends snap.
void spherical_chain(Report& report) {
  const auto steps = report.pick<std::int64_t>(20, 500, 15'000);
  Scenario swinging = scenario(ball_chain(1000), {.step = 2e-4}, steps);
  swinging.start = random_state(*swinging.model, 2, 0.5);
  swinging.every = report.pick(1, 5, 10);
  Simulation simulation = simulation_of(swinging);
  const RunRecord record = run(simulation, steps, swinging.every);
  promise_conservation(report, record, steps, false);
  report.at_most("|norm of a quaternion - 1|", worst_norm(simulation), 4 * kEpsilon, "normalised each step");
  run_beside(report, swinging, record.drift.scale());
}

/// A thousand bodies on hinges, slides, helices and ball joints, afloat without weight.
void floating_tree(Report& report) {
  const auto steps = report.pick<std::int64_t>(20, 500, 20'000);
  Scenario drifting = scenario(random_tree({.bodies = 1000, .seed = 3, .frees = false, .floating = true}),
                               {.step = 1e-3, .gravity = {0, 0, 0}}, steps);
  drifting.start = random_state(*drifting.model, 2, 0.5);
  drifting.every = report.pick(1, 5, 10);
  Simulation simulation = simulation_of(drifting);
  const RunRecord record = run(simulation, steps, drifting.every);
  promise_conservation(report, record, steps, false);
  const double walk = 100 * kEpsilon * std::sqrt(static_cast<double>(steps));
  report.at_most("drift of linear momentum", record.momentum->linear(), walk, "a hundred epsilons a step as a random walk");
  report.at_most("drift of angular momentum", record.momentum->angular(), walk, "the same");
  report.at_most("|norm of a quaternion - 1|", worst_norm(simulation), 4 * kEpsilon, "normalised each step");
}

}  // namespace

std::vector<Case> orientation_cases() {
  return {
      {"gimbal-ball", "a ball joint turned through every orientation, all signs of its quaternion",
       [](Report& report) { every_orientation(report, JointType::ball); }, ""},
      {"gimbal-free", "a free body turned through every orientation",
       [](Report& report) { every_orientation(report, JointType::free); }, ""},
      {"sign-flips", "quaternions given with the other sign", sign_flips, ""},
      {"spherical-chain", "1,000 ball joints in a row, bent at random, h = 0.2 ms", spherical_chain,
       "Nothing is wrong: its bends snap at 300 rad/s, which 1 ms does not resolve. From 1.5 s on steps were split there, and "
       "refused at 4.9 s."},
      {"floating-tree", "1,000 bodies afloat without weight", floating_tree, ""},
  };
}

}  // namespace linden

// Models that others published because their engine would not carry them.
#include <cmath>
#include <numbers>

#include "models/build/builder.hpp"
#include "tests/gallery/models.hpp"
#include "tests/gallery/scenario.hpp"

namespace linden {
namespace {

using Eigen::Vector3d;

Isometry at(double x, double y, double z) { return Isometry(Eigen::Translation3d(x, y, z)); }

/// Two boxes of 2 kg and 2 m, one on a hinge at (0, 0, 5) and the other across it on a ball joint, let go from horizontal.
///
/// source  google-deepmind/mujoco issue 2896: "Nan, Inf or huge value in QACC at DOF 1 ... Time = 37.9800" at h = 0.02 s
Model two_boxes() {
  LinkSpec first, second;
  first.name = "b1";
  first.joint = "ori";
  first.placement = at(0, 0, 5);
  first.axis = Vector3d::UnitY();
  first.inertia = box_inertia(2, {2, 0.2, 0.2}, {1, 0, 0});
  second.name = "b2";
  second.joint = "ball";
  second.parent = "b1";
  second.type = JointType::ball;
  // the body's centre lies at (1, 1, 0) from that of the first, its frame turned by 1.57; the joint at its (-1, 0, 0)
  second.placement = at(2, 1, 0) * Isometry(Eigen::AngleAxisd(1.57, Vector3d::UnitZ())) * at(-1, 0, 0);
  second.inertia = box_inertia(2, {2, 0.2, 0.2}, {1, 0, 0});
  return TreeBuilder("two boxes").add(first).add(second).build();
}

void double_pendulum(Report& report) {
  const double h = 0.02;
  const auto steps = report.pick<std::int64_t>(5000, 180'000, 180'000);  // an hour is 180,000
  const Scenario swinging = scenario(two_boxes(), {.step = h}, steps);
  const RunRecord record = run(swinging);
  promise_conservation(report, record, steps, report.form() != Form::quick);
  report.note(fmt::format("{:.0f} s, turns of up to {:.2g} rad a step", static_cast<double>(record.steps) * h, record.turn));
  run_beside(report, swinging, record.drift.scale());
}

constexpr double kDensity = 1000;  // [kg/m^3], MuJoCo's own where a shape gives no mass

/// A cylinder along z with half a ball at each end.
LinkInertia capsule(double radius, double length, const Vector3d& center) {
  const double r = radius, pi = std::numbers::pi;
  const double cylinder = kDensity * pi * r * r * length, ball = kDensity * 4 / 3 * pi * r * r * r;
  const double along = cylinder * r * r / 2 + ball * 2 * r * r / 5;
  const double across =
      cylinder * (3 * r * r + length * length) / 12 + ball * (2 * r * r / 5 + length * length / 4 + 3 * r * length / 8);
  return {cylinder + ball, center, Vector3d(across, across, along).asDiagonal()};
}

LinkInertia cylinder(double radius, double length, const Vector3d& center) {
  const double mass = kDensity * std::numbers::pi * radius * radius * length, r = radius * radius;
  const double across = mass * (3 * r + length * length) / 12;
  return {mass, center, Vector3d(across, across, mass * r / 2).asDiagonal()};
}

/// Axis z of a shape turned to `axis`.
LinkInertia turned(const LinkInertia& inertia, const Vector3d& axis) {
  const Eigen::Matrix3d R = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), axis).toRotationMatrix();
  return {inertia.mass, inertia.center, R * inertia.about_center * R.transpose()};
}

/// Both, of one body.
LinkInertia joined(const LinkInertia& a, const LinkInertia& b) {
  const double mass = a.mass + b.mass;
  const Vector3d center = (a.mass * a.center + b.mass * b.center) / mass;
  Eigen::Matrix3d about = a.about_center + b.about_center;
  for (const LinkInertia* one : {&a, &b}) {
    const Vector3d d = one->center - center;
    about += one->mass * (d.squaredNorm() * Eigen::Matrix3d::Identity() - d * d.transpose());
  }
  return {mass, center, about};
}

/// A hinge, a slide with a spring of 200 N/m, a ball joint, a hinge; the arms' shapes give the masses.
///
/// source  MuJoCo's documentation, Computation, Numerical integration: its "energy conserving pendulum"
Scenario sliding_pendulum(double h, std::int64_t steps) {
  const Vector3d x = Vector3d::UnitX(), y = Vector3d::UnitY();
  LinkSpec arm, slider, ball, last;
  arm.name = "arm";
  arm.joint = "hinge";
  arm.axis = y;
  arm.inertia = joined(turned(cylinder(0.02, 0.04, Vector3d::Zero()), y), turned(capsule(0.02, 0.1, {0.05, 0, 0}), x));
  slider.name = "slider";
  slider.joint = "slide";
  slider.parent = "arm";
  slider.type = JointType::prismatic;
  slider.axis = x;
  slider.placement = at(0.1, 0, 0);
  slider.inertia = turned(capsule(0.015, 0.2, Vector3d::Zero()), x);
  ball.name = "box";
  ball.joint = "ball";
  ball.parent = "slider";
  ball.type = JointType::ball;
  ball.placement = at(0.1, 0, 0);
  ball.inertia = box_inertia(kDensity * 0.04 * 0.04 * 0.1, {0.04, 0.1, 0.04}, {0, 0.05, 0});
  last.name = "end";
  last.joint = "last";
  last.parent = "box";
  last.axis = x;
  last.placement = at(0, 0.1, 0);
  last.inertia = turned(capsule(0.02, 0.1, {0, 0.05, 0}), y);
  Scenario swinging =
      scenario(TreeBuilder("sliding pendulum").add(arm).add(slider).add(ball).add(last).build(), {.step = h}, steps);
  swinging.effects.springs = {{.row = row_of(*swinging.model, "slide"), .stiffness = 200}};
  return swinging;
}

void energy_pendulum(Report& report) {
  // its page takes the default step of 2 ms; ten minutes of it
  const auto steps = report.pick<std::int64_t>(2000, 100'000, 300'000);
  const Scenario swinging = sliding_pendulum(2e-3, steps);
  const RunRecord record = run(swinging);
  promise_conservation(report, record, steps, report.form() != Form::quick);
  report.note(fmt::format("{:.0f} s, turns of up to {:.2g} rad a step", static_cast<double>(record.steps) * 2e-3, record.turn));
  run_beside(report, swinging, record.drift.scale());
}

/// Two rods on crossed hinges at 30 rad/s without weight. Their energy bounds how fast either can ever turn: no speed of a joint
/// beyond sqrt(2 E / least inertia that it can feel).
///
/// source  google-deepmind/mujoco_warp issue 1662 and the test of its repair: 1.45e12 rad/s, where the CPU engine has 22.7
void two_hinges(Report& report) {
  const auto rod = [] {
    return LinkInertia{1, {0, 0, 0.2}, moments((3 * 0.0025 + 0.16) / 12, (3 * 0.0025 + 0.16) / 12, 0.5 * 0.0025)};
  };
  LinkSpec first, second;
  first.name = "body1";
  first.joint = "joint1";
  first.axis = Vector3d::UnitY();
  second.name = "body2";
  second.joint = "joint2";
  second.parent = "body1";
  second.axis = Vector3d::UnitX();
  second.placement = at(0, 0, 0.4);
  first.inertia = second.inertia = rod();
  const auto steps = report.pick<std::int64_t>(5000, 100'000, 1'000'000);
  Scenario whirling =
      scenario(TreeBuilder("two hinges").add(first).add(second).build(), {.step = 1e-3, .gravity = {0, 0, 0}}, steps);
  whirling.start = {{0.5, 0.5}, {30, -30}};
  Simulation simulation = simulation_of(whirling);
  const double across = (3 * 0.0025 + 0.16) / 12 + 0.04;
  const double bound = std::sqrt(2 * simulation.energy().kinetic / (0.5 * across));
  const RunRecord record = run(simulation, steps);
  double fastest = 0;
  Simulation again = simulation_of(whirling);
  for (int k = 0; k < 5000 && again.step().ok(); ++k) {
    for (const double v : again.velocities()) fastest = std::max(fastest, std::abs(v));
  }
  report.at_most("fastest joint in 5 s [rad/s]", fastest, bound, "energy: sqrt(2 E / half the inertia of a rod about its end)");
  promise_conservation(report, record, steps, report.form() != Form::quick);
  run_beside(report, whirling, record.drift.scale());
}

}  // namespace

std::vector<Case> published_cases() {
  return {
      {"mujoco-2896",
       "a double pendulum of two boxes on a hinge and a ball joint, h = 0.02 s, an hour: MuJoCo 3.3.6 went NaN after 38 s",
       double_pendulum, ""},
      {"mujoco-pendulum",
       "hinge, slide on a spring, ball, hinge, h = 2 ms: on its page MuJoCo's Euler diverges and its implicit method loses "
       "energy",
       energy_pendulum, ""},
      {"mujoco-warp-1662", "two crossed hinges at 30 rad/s: reached 1.45e12 rad/s in mujoco_warp", two_hinges, ""},
  };
}

}  // namespace linden

// The project's models with closed loops: a gripper of two four-bars, a leg with its knee motor at the hip, a Stewart platform.
#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <string>
#include <vector>

#include "engine/mobility.hpp"
#include "engine/queries/kinematics.hpp"
#include "engine/queries/link_motion.hpp"
#include "engine/scene/scene_file.hpp"
#include "engine/simulation.hpp"
#include "models/urdf/urdf.hpp"
#include "tests/engine/linkage_humanoid.hpp"
#include "tests/engine/mechanisms.hpp"
#include "tests/engine/scenes.hpp"

namespace linden::loop_models_test {
namespace {

/// Steps that keep every coupling closed.
void run_closed(Simulation& simulation, int steps) {
  double widest = 0;
  for (int k = 0; k < steps; ++k) {
    const StepReport report = simulation.step();
    if (!report.ok()) FAIL(simulation.describe(report));
    widest = std::max(widest, worst_gap(simulation.couplings()));
  }
  CHECK(widest < 1e-12);
}

/// Released at rest: two seconds in which every loop stays closed and the energy stays in a band.
void check_swing(Simulation& simulation) {
  const double start = simulation.energy().total();
  double kinetic = 0, off = 0, widest = 0;
  for (int k = 0; k < 2000; ++k) {
    const StepReport report = simulation.step();
    if (!report.ok()) FAIL(simulation.describe(report));
    const Energy energy = simulation.energy();
    kinetic = std::max(kinetic, energy.kinetic);
    off = std::max(off, std::abs(energy.total() - start));
    widest = std::max(widest, worst_gap(simulation.couplings()));
  }
  CAPTURE(off, kinetic);
  CHECK(kinetic > 1e-3);
  CHECK(off < 1e-3 * kinetic);
  CHECK(widest < 1e-12);
}

struct Coordinate {
  const char* joint;
  double position;
};

/// A simulation of a model that stands there, closed.
Simulation placed(const char* file, const Options& options, std::initializer_list<Coordinate> start, const Effects& effects = {}) {
  Simulation simulation(load_urdf(model_file(file)), options, effects);
  std::vector<double> q(simulation.positions().begin(), simulation.positions().end());
  for (const Coordinate& one : start) {
    const Model& model = simulation.model();
    q[static_cast<std::size_t>(model.tree.first_q(model.names.slot_of_joint.at(one.joint)))] = one.position;
  }
  simulation.set_positions(q);
  CHECK(simulation.openness().gap < 1e-9);
  return simulation;
}

/// Position and quaternion.
std::array<double, 7> pose_of(Simulation& simulation, const std::string& link) {
  return position_and_quaternion(link_pose(Kinematics(simulation), place_of(simulation.model(), link)));
}

/// How far a link is turned from where it is at zero, as a quaternion's length beside the identity.
double turned(Simulation& simulation, const std::string& link) {
  const std::array<double, 7> pose = pose_of(simulation, link);
  return std::hypot(pose[3], pose[4], pose[5]);
}

TEST_CASE("the models with loops are read whole, closed at zero, and have the freedom that they should") {
  struct Case {
    const char *model, *scene;
    Index loops, freedom, of_scene;  // degrees
  };
  // in its scene the gripper's drivers are geared, and the leg's trunk slides on a rail
  const auto c = GENERATE(Case{"gripper.urdf", "scenes/gripper.yaml", 2, 2, 1}, Case{"leg.urdf", "scenes/leg.yaml", 1, 3, 4},
                          Case{"stewart.urdf", "scenes/stewart.yaml", 6, 6, 6});
  CAPTURE(c.model);
  const Model model = load_urdf(model_file(c.model), Base::fixed, Reading::strict);
  CHECK(static_cast<Index>(model.couplings.size()) == c.loops);
  const Mobility mobility = mobility_of(model, {});
  CHECK(mobility.freedom == c.freedom);
  CHECK(worst_gap(mobility.couplings) < 1e-9);
  const Scene scene = load_scene(model_file(c.scene));
  CHECK(scene.model.warnings.empty());
  CHECK(mobility_of(scene.model, scene.initial.positions).freedom == c.of_scene);
}

TEST_CASE("the gripper's fingers swing, closed") {
  Simulation simulation = placed("gripper.urdf", {.gravity = {0, 0, 9.81}},
                                 {{"right_driver", 0.5}, {"right_follower", 0.5}, {"right_fingertip", -0.5},
                                  {"left_driver", 0.2}, {"left_follower", 0.2}, {"left_fingertip", -0.2}});
  check_swing(simulation);
}

TEST_CASE("the leg swings, closed") {
  Simulation simulation = placed("leg.urdf", {}, {{"hip", 0.4}, {"thigh", 0.3}, {"knee", -0.9}, {"crank", -0.6}, {"rod", 0.9}});
  check_swing(simulation);
}

TEST_CASE("the platform swings on springs, closed") {
  const Model model = load_urdf(model_file("stewart.urdf"));
  Effects effects;
  for (int leg = 1; leg <= 6; ++leg) effects.springs.push_back({row_of(model, "leg_" + std::to_string(leg)), 5000.0 + 1000 * leg, 0.01});
  Simulation simulation(model, {}, effects);
  check_swing(simulation);
}

TEST_CASE("the scenes of the models with loops run to their ends, closed") {
  const char* file = GENERATE("scenes/gripper.yaml", "scenes/leg.yaml", "scenes/stewart.yaml", "scenes/hoist.yaml");
  CAPTURE(file);
  const Scene scene = load_scene(model_file(file));
  Simulation simulation(scene);
  run_closed(simulation, static_cast<int>(std::lround(scene.duration / scene.options.step)));
  CHECK(simulation.passive_gifts().empty());
}

TEST_CASE("the gripper's fingertips stay upright, and its drivers say how far it opens") {
  Simulation simulation(load_scene(model_file("scenes/gripper.yaml")));
  const auto row = [&](const char* joint) { return static_cast<std::size_t>(row_of(simulation.model(), joint)); };
  const std::size_t right = row("right_driver"), left = row("left_driver");
  double narrow = 1, wide = 0;
  for (int k = 0; k < 80; ++k) {
    run(simulation, 50);
    CHECK(turned(simulation, "right_fingertip") < 1e-10);
    CHECK(turned(simulation, "left_fingertip") < 1e-10);
    const std::span<const double> q = simulation.positions();
    CHECK(q[left] == Approx(q[right]).margin(1e-11));
    // pads are 35 mm beside the pins of their fingertips
    const double opening = pose_of(simulation, "right_fingertip")[0] - pose_of(simulation, "left_fingertip")[0] - 2 * 0.035;
    CHECK(opening == Approx(2 * 0.06 * std::sin(q[right])).margin(1e-12));
    narrow = std::min(narrow, opening);
    wide = std::max(wide, opening);
  }
  CHECK(narrow < 0.004);
  CHECK(wide > 0.074);
}

TEST_CASE("the leg's shank turns as its crank does, and it squats") {
  Simulation simulation(load_scene(model_file("scenes/leg.yaml")));
  const Model& model = simulation.model();
  const auto at = [&](const char* joint) {
    return simulation.positions()[static_cast<std::size_t>(model.tree.first_q(model.names.slot_of_joint.at(joint)))];
  };
  double lowest = 1;
  for (int k = 0; k < 100; ++k) {
    run(simulation, 50);
    CHECK(at("knee") == Approx(at("crank") - at("thigh")).margin(1e-10));
    CHECK(at("rod") == Approx(at("thigh") - at("crank")).margin(1e-10));
    lowest = std::min(lowest, pose_of(simulation, "trunk")[2]);
  }
  // thigh and shank of 0.2 m, each off the vertical by what its servo is asked, on a foot of 20 mm; the servos give way a little
  CHECK(lowest == Approx(0.4 * std::cos(0.9) + 0.02).margin(0.015));
  CHECK(pose_of(simulation, "trunk")[2] == Approx(0.4 * std::cos(0.4) + 0.02).margin(0.01));
}

TEST_CASE("equal legs raise the platform straight up") {
  const double s = GENERATE(-0.05, 0.02, 0.1);
  const Model model = load_urdf(model_file("stewart.urdf"));
  Effects effects;
  for (int leg = 1; leg <= 6; ++leg) effects.motions.push_back({row_of(model, "leg_" + std::to_string(leg)), {{0, 0.5}, {0, s}}});
  Simulation simulation(model, {}, effects);
  run_closed(simulation, 600);
  // feet 50 mm above the base's origin; each ball 0.265 m, the root of 0.07, beside its foot
  const std::array<double, 7> pose = pose_of(simulation, "platform");
  CHECK(std::hypot(pose[0], pose[1]) < 1e-9);
  CHECK(pose[2] == Approx(0.05 + std::sqrt((0.535 + s) * (0.535 + s) - 0.07)).margin(1e-9));
  CHECK(turned(simulation, "platform") < 1e-9);
}

TEST_CASE("the platform is where its six legs are as long as their motions say") {
  const Scene scene = load_scene(model_file("scenes/stewart.yaml"));
  Simulation simulation(scene);
  run(simulation, 2000);
  const std::array<double, 7> pose = pose_of(simulation, "platform");
  CHECK(turned(simulation, "platform") > 0.03);
  const Eigen::Quaterniond turn(pose[6], pose[3], pose[4], pose[5]);
  const Eigen::Vector3d shift(pose[0], pose[1], pose[2]);
  const double y = std::sqrt(3) / 20;
  const double feet[6][2] = {{0.45, y}, {-0.15, 5 * y}, {-0.3, 4 * y}, {-0.3, -4 * y}, {-0.15, -5 * y}, {0.45, -y}};
  const double balls[6][2] = {{0.2, 2 * y}, {0.05, 3 * y}, {-0.25, y}, {-0.25, -y}, {0.05, -3 * y}, {0.2, -2 * y}};
  const double longer[6] = {0.08, 0.06, -0.01, -0.01, 0.03, 0.08};
  for (int k = 0; k < 6; ++k) {
    CAPTURE(k);
    const Eigen::Vector3d foot(feet[k][0], feet[k][1], 0.05), ball = shift + turn * Eigen::Vector3d(balls[k][0], balls[k][1], 0);
    CHECK((ball - foot).norm() == Approx(0.535 + longer[k]).margin(1e-9));
  }
}

TEST_CASE("a humanoid with a four-bar at each elbow, knee and ankle is as free as without, and keeps them closed and its energy") {
  const Model model = linkage_humanoid(Base::floating), bare = load_urdf(model_file("humanoid.urdf"), Base::floating);
  CHECK(model.tree.bodies() == bare.tree.bodies() + 2 * kLinkages);
  REQUIRE(model.couplings.size() == kLinkages);
  Simulation simulation(model, {.gravity = {0, 0, 0}});
  CHECK(simulation.openness().gap < 1e-15);
  random_start(simulation, 2, 0.4);
  const std::vector<double> q(simulation.positions().begin(), simulation.positions().end());
  const Mobility mobility = mobility_of(model, q);
  CHECK(mobility.rows == 5 * kLinkages);
  CHECK(mobility.freedom == bare.degrees_of_freedom());
  check_swing(simulation);
}

TEST_CASE("the crank of a humanoid's linkage follows the knee as a four-bar's does") {
  Effects bend;
  const Model model = linkage_humanoid(Base::fixed);
  const Index knee = row_of(model, "left_knee_pitch");
  bend.motions.push_back({knee, {{0, 1}, {0, 1.2}}});
  Simulation simulation(model, {.gravity = {0, 0, 0}}, bend);
  for (int k = 0; k < 10; ++k) {
    REQUIRE(simulation.run(100).ok());
    const auto angle = [&](const char* joint) {
      return simulation.positions()[static_cast<std::size_t>(model.tree.first_q(model.names.slot_of_joint.at(joint)))];
    };
    CHECK(angle("left_knee_pitch") == Approx(0.12 * (k + 1)).margin(1e-9));
    // Freudenstein: the ends of lever and crank, both turned about y from -x, are as far apart as the rod is long
    const double lever = angle("left_knee_pitch"), crank = angle("left_knee_crank_joint");
    const double x = -0.06 * std::cos(crank) + 0.05 * std::cos(lever), z = 0.2 + 0.06 * std::sin(crank) - 0.05 * std::sin(lever);
    CHECK(std::hypot(x, z) == Approx(std::hypot(0.01, 0.2)).margin(1e-12));
    CHECK(crank > 0.5 * lever);
  }
}

}  // namespace
}  // namespace linden::loop_models_test

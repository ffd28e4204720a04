// The plain simulator of scenes that tests/everyday judges by, against closed forms.
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "engine/initial_state.hpp"
#include "layout/contacts.hpp"
#include "models/build/builder.hpp"
#include "models/build/coupled_model.hpp"
#include "models/build/generators.hpp"
#include "models/build/isometry.hpp"
#include "models/shapes/contacts_of.hpp"
#include "tests/reference/closed_forms.hpp"
#include "tests/reference/coriolis_plain.hpp"
#include "tests/reference/plain_scene.hpp"

namespace linden::plain_scene_test {
namespace {

using Eigen::VectorXd;
using reference::PlainScene;

constexpr double kG = 9.81;
constexpr std::array<double, 3> kDown{0, 0, -kG}, kNone{0, 0, 0};

LinkSpec link(const std::string& name, JointType type, double mass, double inertia) {
  LinkSpec spec;
  spec.name = name;
  spec.joint = name + "_joint";
  spec.type = type;
  spec.inertia = {mass, Eigen::Vector3d::Zero(), inertia * Eigen::Matrix3d::Identity()};
  return spec;
}

Model one(JointType type, double mass, double inertia) { return TreeBuilder("one").add(link("link", type, mass, inertia)).build(); }

VectorXd numbers(std::initializer_list<double> list) {
  VectorXd result(static_cast<Eigen::Index>(list.size()));
  Eigen::Index k = 0;
  for (const double x : list) result[k++] = x;
  return result;
}

/// A free sphere or box of 2 kg on a plane through the origin, gravity tilted about y by `slope`.
struct OnSlope {
  Model model;
  Effects effects;
  std::array<double, 3> gravity;

  OnSlope(const LinkShape& shape, double half, double inertia, double slope, double friction)
      : gravity{kG * std::sin(slope), 0, -kG * std::cos(slope)} {
    LinkSpec spec = link("thing", JointType::free, 2, inertia);
    spec.shapes = {shape};
    model = TreeBuilder("on a slope").add(spec).build();
    effects.ground = Ground{.stiffness = 1e4, .damping = 100, .friction = friction};
    std::vector<std::string> notes;
    effects.ground->contacts = contacts_of(model, notes);
    const double sag = 2 * kG * std::cos(slope) / (1e4 * static_cast<double>(resting(shape)));
    place = numbers({0, 0, half - sag, 0, 0, 0, 1});
  }
  /// Contacts that bear it.
  static int resting(const LinkShape& shape) {
    return shape.shape.kind == ShapeKind::box ? 4 : shape.shape.kind == ShapeKind::cylinder ? 2 : 1;
  }
  /// Way along the slope after a second from rest.
  double way(int steps) const {
    PlainScene scene(model, effects, gravity);
    scene.start(place, VectorXd::Zero(6));
    scene.advance(1, steps);
    return scene.q[0];
  }
  VectorXd place;
};

LinkShape sphere(double radius) {
  LinkShape shape;
  shape.shape.kind = ShapeKind::sphere;
  shape.shape.size = {radius, 0, 0};
  return shape;
}

}  // namespace

TEST_CASE("the plain simulator's mass matrix and bias are those of derivatives of the kinetic energy", "[plain]") {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const Model model = random_tree({.bodies = 6, .seed = seed, .floating = seed % 2 == 0});
    const InitialState state = random_state(model, seed, 1);
    const reference::PlainTree tree = reference::plain_tree(model);
    const VectorXd q = Eigen::Map<const VectorXd>(state.positions.data(), tree.positions);
    const VectorXd v = Eigen::Map<const VectorXd>(state.velocities.data(), tree.velocities);
    const auto motions = reference::body_motions(tree, q, v);
    const Eigen::MatrixXd M = reference::mass_matrix(tree, q);
    CHECK((reference::mass_matrix_of(tree, motions) - M).norm() < 1e-13 * M.norm());
    const VectorXd c = reference::coriolis_force(tree, q, v);
    CHECK((reference::bias_force(tree, motions) - c).norm() < 1e-12 * (1 + c.norm()));
  }
}

TEST_CASE("the plain simulator swings a pendulum as Jacobi's functions do, to fourth order", "[plain]") {
  const Pendulum pendulum(2.0);
  const Model model = Pendulum::model();
  double error[2];
  for (int halving = 0; halving < 2; ++halving) {
    PlainScene scene(model, {}, kDown);
    scene.start(numbers({pendulum.start()}), numbers({0}));
    scene.advance(3, 800 << halving);
    error[halving] = std::abs(scene.q[0] - static_cast<double>(pendulum.angle(3)));
  }
  CHECK(error[0] < 1e-7);
  CHECK(error[0] / error[1] == Approx(16).epsilon(0.2));
}

TEST_CASE("the plain simulator keeps the energy of random trees of all joints", "[plain]") {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const Model model = random_tree({.bodies = 5, .seed = seed, .floating = seed % 2 == 0});
    const InitialState state = random_state(model, seed, 1);
    Effects effects;
    for (Index i = 1; i < model.tree.shape.slots; ++i) {
      if (model.tree.kind(i) == JointKind::ball) effects.ball_springs.push_back({.slot = i, .stiffness = 2});
      if (model.tree.kind(i) == JointKind::screw) effects.springs.push_back({.row = model.tree.first_v(i), .stiffness = 3, .rest = 0.1});
      if (model.tree.kind(i) == JointKind::screw) effects.armature.push_back({.row = model.tree.first_v(i), .inertia = 0.01});
    }
    PlainScene scene(model, effects, kDown);
    scene.start(Eigen::Map<const VectorXd>(state.positions.data(), model.tree.shape.positions),
                Eigen::Map<const VectorXd>(state.velocities.data(), model.tree.shape.velocities));
    const double before = scene.energy();
    scene.advance(0.2, 800);
    CHECK(scene.energy() == Approx(before).margin(1e-8));
  }
}

TEST_CASE("the plain simulator damps an oscillator as its closed form does", "[plain]") {
  const double I = 0.02, k = 3, c = 0.1, decay = c / (2 * I), w = std::sqrt(k / I - decay * decay);
  Effects effects;
  effects.springs = {{.row = 0, .stiffness = k, .rest = 0.1}};
  effects.damping = {{.row = 0, .coefficient = c}};
  PlainScene scene(one(JointType::revolute, 1, I), effects, kNone);
  scene.start(numbers({0.5}), numbers({0}));
  scene.advance(0.7, 1400);
  const double expected = 0.1 + 0.4 * std::exp(-decay * 0.7) * (std::cos(w * 0.7) + decay / w * std::sin(w * 0.7));
  CHECK(scene.q[0] == Approx(expected).margin(1e-10));
}

TEST_CASE("the plain simulator's mass between two springs with play swings and flies as its closed form does, and stops short by friction's work", "[plain]") {
  const double m = 2, k = 500, w = 0.02, rest = 0.1, A = 0.03, rate = std::sqrt(k / m);
  Effects effects;
  effects.dead_zone_springs = {{.row = 0, .stiffness = k, .half_width = w, .rest = rest}};
  const Model model = one(JointType::prismatic, m, 0.01);
  const double swing = 0.5 * std::numbers::pi / rate, flight = 2 * w / (A * rate);
  PlainScene scene(model, effects, kNone);
  scene.start(numbers({rest + w + A}), numbers({0}));
  CHECK(scene.stiffest_rate() == Approx(rate));
  CHECK(scene.energy() == Approx(0.5 * k * A * A));
  scene.advance(swing + 0.25 * flight, 4000);
  CHECK(scene.q[0] == Approx(rest + 0.5 * w).margin(1e-8));
  CHECK(scene.v[0] == Approx(-A * rate).epsilon(1e-6));
  scene.advance(0.75 * flight + 0.5 * swing, 4000);
  CHECK(scene.q[0] == Approx(rest - w - A * std::sqrt(0.5)).margin(1e-8));
  CHECK(scene.energy() == Approx(0.5 * k * A * A).epsilon(1e-6));
  // k/2 (A^2 - B^2) = f (A + B + 2 w)
  const double f = 2, s = f / k, B = -s + std::sqrt((A - s) * (A - s) - 4 * s * w);
  effects.friction = {{.row = 0, .force = f}};
  PlainScene slowed(model, effects, kNone);
  slowed.start(numbers({rest + w + A}), numbers({0}));
  double lowest = slowed.q[0];
  for (int step = 0; step < 400; ++step) {
    slowed.advance(1e-3, 64);
    lowest = std::min(lowest, slowed.q[0]);
  }
  CHECK(lowest == Approx(rest - w - B).margin(2e-5));
}

TEST_CASE("the plain simulator's servo sags by the load over its stiffness, and gives way where its force is limited", "[plain]") {
  // a slider along z under its weight
  Effects effects;
  effects.servos = {{.row = 0, .stiffness = 400, .damping = 60, .target = 0.2}};
  const Model model = one(JointType::prismatic, 2, 0.01);
  PlainScene sags(model, effects, kDown);
  sags.advance(4, 8000);
  CHECK(sags.q[0] == Approx(0.2 - 2 * kG / 400).margin(1e-9));
  CHECK(std::abs(sags.v[0]) < 1e-9);
  effects.servos[0].max_force = kG;  // half the weight
  PlainScene falls(model, effects, kDown);
  falls.advance(1, 1000);
  CHECK(falls.v[0] == Approx(-0.5 * kG).epsilon(1e-6));
}

TEST_CASE("the plain simulator's joint friction holds what it can, and slows the rest by its force", "[plain]") {
  Effects effects;
  effects.friction = {{.row = 0, .force = 2 * kG * 1.01}};
  const Model model = one(JointType::prismatic, 2, 0.01);
  PlainScene holds(model, effects, kDown);
  holds.advance(1, 500);
  CHECK(std::abs(holds.q[0]) < 1e-12);
  effects.friction[0].force = kG;
  PlainScene slides(model, effects, kDown);
  slides.advance(1, 500);
  CHECK(slides.v[0] == Approx(-0.5 * kG).epsilon(1e-9));
  effects.friction[0].force = 4;
  PlainScene stops(model, effects, kNone);
  stops.start(numbers({0}), numbers({1}));  // stops after 0.5 s and 0.25 m
  stops.advance(1, 5000);
  CHECK(stops.v[0] == Approx(0).margin(1e-14));
  CHECK(stops.q[0] == Approx(0.25).margin(1e-3));
}

TEST_CASE("the plain simulator's limit gives back its share of the speed", "[plain]") {
  for (const double e : {0.0, 0.5, 1.0}) {
    Effects effects;
    effects.limits = {{.row = 0, .lower = -0.3, .restitution = e}};
    PlainScene scene(one(JointType::prismatic, 2, 0.01), effects, kNone);
    scene.start(numbers({0}), numbers({-1}));
    scene.advance(0.5, 5000);
    CHECK(scene.v[0] == Approx(e).margin(1e-12));
    CHECK(scene.q[0] == Approx(-0.3 + 0.2 * e).margin(1e-3));
  }
}

TEST_CASE("the plain simulator's joints go no faster than they may", "[plain]") {
  Effects effects;
  effects.limits = {{.row = 0, .velocity = 0.5}};
  PlainScene scene(one(JointType::prismatic, 2, 0.01), effects, kDown);
  scene.advance(1, 1000);  // falls for 0.5 / g, then at 0.5 m/s
  CHECK(scene.v[0] == Approx(-0.5));
  CHECK(scene.q[0] == Approx(-0.5 * (1 - 0.25 / kG)).epsilon(1e-3));
}

TEST_CASE("the plain simulator's servo follows a ramp behind by its damping's share, none where the ramp's speed is given", "[plain]") {
  // k (ramp - q) + c (given - v) = 0 once it follows
  Effects effects;
  effects.servos = {{.row = 0, .stiffness = 400, .damping = 60, .target_over_time = {{0, 10}, {0, 3}}, .feedforward = {{0}, {2 * kG}}}};
  const Model model = one(JointType::prismatic, 2, 0.01);
  PlainScene lags(model, effects, kDown);
  lags.advance(4, 8000);
  CHECK(lags.q[0] == Approx(0.3 * 4 - 60 * 0.3 / 400).margin(1e-9));
  effects.servos[0].target_velocity = {{0}, {0.3}};
  PlainScene follows(model, effects, kDown);
  follows.advance(4, 8000);
  CHECK(follows.q[0] == Approx(0.3 * 4).margin(1e-9));
}

TEST_CASE("in the plain simulator joints that are tied are one coordinate, at limits too", "[plain]") {
  LinkSpec a = link("a", JointType::revolute, 1, 0.02), b = link("b", JointType::revolute, 1, 0.005);
  b.mimic = "a_joint";
  b.multiplier = -2;
  const Model model = TreeBuilder("tied").add(a).add(b).build();
  Effects effects;
  const Index leader = row_of(model, "a_joint"), follower = row_of(model, "b_joint");
  effects.torques = {{.row = leader, .force = {{0}, {0.4}}}};
  PlainScene turns(model, effects, kNone);
  turns.advance(1, 10);
  CHECK(turns.v[leader] == Approx(0.4 / (0.02 + 4 * 0.005)));
  CHECK(turns.v[follower] == Approx(-2 * turns.v[leader]));
  effects = {};
  effects.limits = {{.row = leader, .lower = -0.3, .restitution = 1}};
  PlainScene bounces(model, effects, kNone);
  VectorXd v = VectorXd::Zero(2);
  v[leader] = -1;
  bounces.start(bounces.q, v);
  bounces.advance(0.5, 1000);
  CHECK(bounces.v[leader] == Approx(1));
  CHECK(bounces.v[follower] == Approx(-2));
}

TEST_CASE("the plain simulator leaves couplings alone that nothing opens but a joint whose motion is given", "[plain]") {
  LinkSpec swings = link("swings", JointType::ball, 1, 0.02), held = link("held", JointType::revolute, 1, 0.005);
  held.parent = "swings";
  held.axis = Eigen::Vector3d(1, 2, 3).normalized();
  held.placement.translation() = Eigen::Vector3d(0.3, 0.1, -0.2);
  CouplingSpec guide;
  guide.kind = CouplingKind::slider;
  guide.link_a = "swings";
  guide.link_b = "held";
  guide.frame_a = held.placement;
  guide.frame_a.rotate(Eigen::AngleAxisd(0.7, held.axis));
  const Model model = coupled(TreeBuilder("held").add(swings).add(held).build(), {guide});
  const Index row = row_of(model, "held_joint");
  Effects effects;
  effects.motions = {{row, {{0}, {0.7}}}};
  for (const double turned : {0.3, 0.9, 1.4, 2.2}) {
    PlainScene scene(model, effects, kNone);
    VectorXd start = scene.q;
    start.head<4>() = Eigen::Quaterniond(Eigen::AngleAxisd(turned, Eigen::Vector3d(2, -1, 1).normalized())).coeffs();
    start[4] = 0.7;
    scene.start(start, numbers({0.4, -0.3, 0.8, 0}));
    CHECK((scene.q - start).norm() < 1e-12);
    CHECK((scene.v - numbers({0.4, -0.3, 0.8, 0})).norm() < 1e-12);
  }
}

TEST_CASE("a push within a step of the plain simulator gives its whole impulse", "[plain]") {
  Effects effects;
  effects.wrenches = {{.slot = 1, .force = {1000, 0, 0}, .from = 0.0112, .to = 0.0162}};
  PlainScene scene(one(JointType::free, 1, 0.01), effects, kNone);
  scene.advance(0.03, 3);
  CHECK(scene.v[3] == Approx(5));
  CHECK(scene.q[0] == Approx(5 * (0.03 - 0.0137)).epsilon(1e-6));
}

TEST_CASE("a block on the plain simulator's ground slides by what friction leaves, or stays", "[plain]") {
  const double slope = 0.4;
  const Eigen::Vector3d size(0.3, 0.2, 0.1);
  const OnSlope slides(box_shape(size, Eigen::Vector3d::Zero()), 0.05, 0.02, slope, 0.2);
  CHECK(slides.way(2000) == Approx(0.5 * kG * (std::sin(slope) - 0.2 * std::cos(slope))).epsilon(0.01));
  const OnSlope stays(box_shape(size, Eigen::Vector3d::Zero()), 0.05, 0.02, slope, 0.6);
  CHECK(std::abs(stays.way(2000)) < 1e-3);  // it leans a little on its lower corners
}

TEST_CASE("a ball rolls down the plain simulator's ground as solid balls do", "[plain]") {
  const double slope = 0.3, r = 0.1, solid = 0.4 * 2 * r * r;
  const OnSlope rolls(sphere(r), r, solid, slope, 0.5);
  CHECK(rolls.way(2000) == Approx(0.5 * kG * std::sin(slope) / 1.4).epsilon(0.002));
}

TEST_CASE("a cylinder rolls down the plain simulator's ground as solid cylinders do", "[plain]") {
  const double slope = 0.3, r = 0.1;
  LinkShape cylinder;
  cylinder.pose = pose_of(Isometry(Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitX())));
  cylinder.shape.kind = ShapeKind::cylinder;
  cylinder.shape.size = {r, 0.2, 0};
  const OnSlope rolls(cylinder, r, 0.5 * 2 * r * r, slope, 0.5);
  CHECK(rolls.way(2000) == Approx(0.5 * kG * std::sin(slope) / 1.5).epsilon(0.002));
}

TEST_CASE("a ball dropped on the plain simulator's ground comes back as high", "[plain]") {
  LinkSpec spec = link("ball", JointType::free, 1, 0.01);
  spec.shapes = {sphere(0.1)};
  const Model model = TreeBuilder("ball").add(spec).build();
  Effects effects;
  effects.ground = Ground{.stiffness = 1e4, .friction = 0};
  std::vector<std::string> notes;
  effects.ground->contacts = contacts_of(model, notes);
  PlainScene scene(model, effects, kDown);
  scene.start(numbers({0, 0, 0.6, 0, 0, 0, 1}), VectorXd::Zero(6));
  double rise = 0;
  for (int k = 0; k < 70; ++k) {
    scene.advance(0.01, 400);
    if (k > 40) rise = std::max(rise, scene.q[2]);
  }
  CHECK(rise == Approx(0.6).epsilon(0.01));
}

TEST_CASE("drag slows a body in wind to the wind's speed", "[plain]") {
  Effects effects;
  effects.drag = {{.slot = 1, .linear = 2}};
  effects.wind = {3, 0, 0};
  PlainScene scene(one(JointType::free, 1, 0.01), effects, kNone);
  scene.advance(0.5, 200);
  CHECK(scene.v[3] == Approx(3 * (1 - std::exp(-1))).epsilon(1e-8));
}

}  // namespace linden::plain_scene_test

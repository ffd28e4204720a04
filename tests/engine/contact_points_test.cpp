// What the ground does to bodies in a step: where, along which normal and with which force, friction included.
#include <cmath>
#include <numbers>

#include "engine/queries/inverse_dynamics.hpp"
#include "engine/queries/link_motion.hpp"
#include "models/build/builder.hpp"
#include "models/shapes/contacts_of.hpp"
#include "tests/engine/scenes.hpp"

namespace linden::contact_points_test {
namespace {

using Eigen::Vector3d;
using Numbers = std::vector<double>;

Vector3d eigen(const std::array<double, 3>& a) { return {a[0], a[1], a[2]}; }

LinkSpec box(const std::string& name, double mass) {
  LinkSpec link;
  link.name = name;
  link.joint = name + "_joint";
  link.type = JointType::free;
  link.inertia = {mass, Vector3d::Zero(), 0.1 * Eigen::Matrix3d::Identity()};
  CollisionShape shape;
  shape.kind = ShapeKind::box;
  shape.size = {0.4, 0.4, 0.2};
  link.shapes = {{Pose{}, shape}};
  return link;
}

Ground ground(const Model& model) {
  std::vector<std::string> notes;
  return {.stiffness = 1e4, .damping = 200, .contacts = contacts_of(model, notes)};
}

Vector3d total_force(const std::vector<ContactPoint>& points) {
  Vector3d sum = Vector3d::Zero();
  for (const ContactPoint& point : points) sum += eigen(point.force);
  return sum;
}

}  // namespace

TEST_CASE("a box at rest is held at its corners by its weight", "[contact_points]") {
  const Model model = TreeBuilder("box").add(box("box", 5)).build();
  Effects effects;
  effects.ground = ground(model);
  Simulation simulation(model, {.step = 1e-3}, effects);
  CHECK_THROWS_WITH(simulation.contact_points(), Catch::Contains("keep_forces"));
  simulation.keep_forces();
  simulation.set_positions(Numbers{0.3, -0.2, 0.1001, 0, 0, 0, 1});
  CHECK(simulation.contact_points().empty());
  run(simulation, 2000);
  const std::vector<ContactPoint> points = simulation.contact_points();
  REQUIRE(points.size() == 4);
  for (const ContactPoint& point : points) {
    CHECK(point.slot == 1);
    CHECK((eigen(point.normal) - Vector3d(0, 0, 1)).norm() < 1e-9);
    CHECK((eigen(point.force) - Vector3d(0, 0, 5 * 9.81 / 4)).norm() < 1e-6);
    // the corners are 12 newtons deep
    CHECK(std::abs(std::abs(point.place[0] - 0.3) - 0.2) < 1e-4);
    CHECK(std::abs(std::abs(point.place[1] + 0.2) - 0.2) < 1e-4);
    CHECK(std::abs(point.place[2] + 5 * 9.81 / 4 / 1e4) < 1e-9);
  }
  double normal_force = 0;
  for (const BodyContact& contact : simulation.contacts()) normal_force += contact.normal_force;
  CHECK(std::abs(total_force(points).z() - normal_force) < 1e-9);
  // what acts on the body holds its weight about its centre, and so the root's joint has nothing to do
  const Numbers wrenches = simulation.body_wrenches();
  CHECK((Vector3d(wrenches[9], wrenches[10], wrenches[11]) - Vector3d(0, 0, 5 * 9.81)).norm() < 1e-6);
  CHECK(Vector3d(wrenches[6], wrenches[7], wrenches[8]).norm() < 1e-6);
  const std::vector<SpatialForce> reactions = joint_reactions(Kinematics(simulation), wrenches);
  CHECK(eigen(reactions[1].force).norm() < 1e-6);
  CHECK(eigen(reactions[1].moment).norm() < 1e-6);
}

TEST_CASE("on a slope friction holds what runs down it, and drags what slides by its coefficient", "[contact_points]") {
  const double angle = 0.3;
  const Model model = TreeBuilder("box").add(box("box", 5)).build();
  for (const double coefficient : {0.8, 0.1}) {
    Effects effects;
    effects.ground = ground(model);
    effects.ground->friction = coefficient;
    // the slope as gravity that leans
    Simulation simulation(model, {.step = 1e-3, .gravity = {9.81 * std::sin(angle), 0, -9.81 * std::cos(angle)}}, effects);
    simulation.keep_forces();
    simulation.set_positions(Numbers{0, 0, 0.1, 0, 0, 0, 1});
    run(simulation, 2000);
    const Vector3d force = total_force(simulation.contact_points());
    const double along = -5 * 9.81 * (coefficient > std::tan(angle) ? std::sin(angle) : coefficient * std::cos(angle));
    CHECK((force - Vector3d(along, 0, 5 * 9.81 * std::cos(angle))).norm() < 1e-4);
  }
}

TEST_CASE("contact points are those of the body and of the moment that they say", "[contact_points]") {
  // a box turned about z and set down on one that stands: two bodies, each with its own corners
  const Model model = TreeBuilder("boxes").add(box("left", 2)).add(box("right", 4)).build();
  Effects effects;
  effects.ground = ground(model);
  Simulation simulation(model, {.step = 1e-3}, effects);
  simulation.keep_forces();
  const Index left = place_of(model, "left").slot, right = place_of(model, "right").slot;
  Numbers q(14, 0.0);
  const auto put = [&](Index slot, double x, double turn) {
    const auto first = static_cast<std::size_t>(model.tree.first_q(slot));
    q[first] = x;
    q[first + 2] = 0.1;
    q[first + 5] = std::sin(turn / 2);
    q[first + 6] = std::cos(turn / 2);
  };
  put(left, -1, std::numbers::pi / 4);
  put(right, 1, 0);
  simulation.set_positions(q);
  run(simulation, 2000);
  double weight_left = 0, weight_right = 0;
  for (const ContactPoint& point : simulation.contact_points()) {
    (point.slot == left ? weight_left : weight_right) += point.force[2];
    // corners of the turned one lie on its axes, 0.2 sqrt 2 away
    const double x = point.place[0] - (point.slot == left ? -1 : 1), y = point.place[1];
    if (point.slot == left) CHECK(std::abs(std::max(std::abs(x), std::abs(y)) - 0.2 * std::numbers::sqrt2) < 1e-4);
    if (point.slot == right) CHECK((std::abs(std::abs(x) - 0.2) < 1e-4 && std::abs(std::abs(y) - 0.2) < 1e-4));
  }
  CHECK(std::abs(weight_left - 2 * 9.81) < 1e-5);
  CHECK(std::abs(weight_right - 4 * 9.81) < 1e-5);
}

TEST_CASE("a joint between two bodies that stand carries the upper one", "[contact_points]") {
  LinkSpec upper = box("upper", 3);
  upper.parent = "lower";
  upper.type = JointType::prismatic;
  upper.axis = Vector3d::UnitX();
  upper.placement.translation() = Vector3d(0, 0, 0.5);
  upper.shapes.clear();
  const Model model = TreeBuilder("stack").add(box("lower", 5)).add(upper).build();
  Effects effects;
  effects.ground = ground(model);
  effects.friction = friction_everywhere(model, 10);
  Simulation simulation(model, {.step = 1e-3}, effects);
  simulation.keep_forces();
  Numbers q = model.neutral();
  q[static_cast<std::size_t>(model.tree.first_q(1)) + 2] = 0.1;
  simulation.set_positions(q);
  run(simulation, 3000);
  const Kinematics now(simulation);
  const auto reactions = joint_reactions(now, simulation.body_wrenches());
  const LinkPlace& place = place_of(model, "upper");
  const Pose body = link_pose(now, LinkPlace{place.slot, Pose{}});
  const std::array<double, 3> force = reactions[static_cast<std::size_t>(place.slot)].force;
  Vector3d in_world;
  for (int row = 0; row < 3; ++row) {
    in_world[row] = 0;
    for (int column = 0; column < 3; ++column) {
      in_world[row] += body.rotation[static_cast<std::size_t>(3 * row + column)] * force[static_cast<std::size_t>(column)];
    }
  }
  CHECK((in_world - Vector3d(0, 0, 3 * 9.81)).norm() < 1e-5);
  CHECK(eigen(reactions[1].force).norm() < 1e-5);
}

}  // namespace linden::contact_points_test

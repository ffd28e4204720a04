// The plain simulator's contact of bodies, beside closed forms: where shapes touch, sliding and rolling.
#include <catch2/catch.hpp>
#include <cmath>

#include "models/build/builder.hpp"
#include "models/shapes/pair_contact.hpp"
#include "tests/reference/plain_scene.hpp"

namespace linden::plain_touch_test {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kGravity = 9.81, kFriction = 0.5, kHalf = 0.1;

LinkShape shape_of(ShapeKind kind, const std::array<double, 3>& size, const Vector3d& at) {
  LinkShape result;
  Isometry pose = Isometry::Identity();
  pose.translation() = at;
  result.pose = pose_of(pose);
  result.shape = {.kind = kind, .size = size, .mesh = {}};
  return result;
}

/// A block or a ball of 1 kg, on a slab whose top is at z = 0.
Model on_slab(ShapeKind kind) {
  TreeBuilder builder("a body on a slab");
  LinkSpec slab;
  slab.name = "slab";
  slab.joint = "fixed";
  slab.type = JointType::fixed;
  slab.shapes = {shape_of(ShapeKind::box, {20, 20, 1}, {0, 0, -0.5})};
  builder.add(slab);
  const bool ball = kind == ShapeKind::sphere;
  LinkSpec body;
  body.name = "body";
  body.joint = "free";
  body.type = JointType::free;
  body.inertia = ball ? sphere_inertia(1, kHalf, Vector3d::Zero()) : box_inertia(1, Vector3d::Constant(2 * kHalf), Vector3d::Zero());
  body.shapes = {ball ? shape_of(kind, {kHalf, 0, 0}, Vector3d::Zero()) : shape_of(kind, {2 * kHalf, 2 * kHalf, 2 * kHalf}, Vector3d::Zero())};
  builder.add(body);
  return builder.build();
}

reference::PlainScene scene_of(const Model& model, double slope) {
  std::vector<std::string> notes;
  Effects effects;
  effects.contact = pair_contact_of(model, notes);
  effects.contact->materials[0].friction = kFriction;
  effects.contact->materials[0].stiffness = 1e8;
  reference::PlainScene scene(model, effects, {kGravity * std::sin(slope), 0, -kGravity * std::cos(slope)});
  scene.ease_contact(1e-3);
  return scene;
}

/// On the slab, with that speed along x.
void stand(reference::PlainScene& scene, double speed) {
  VectorXd q = scene.q, v = scene.v;
  q[2] = kHalf;
  v[3] = speed;
  scene.start(q, v);
}

}  // namespace

TEST_CASE("a plain block that slides stops after v^2 / 2 mu g", "[plain_touch]") {
  reference::PlainScene scene = scene_of(on_slab(ShapeKind::box), 0);
  stand(scene, 0.5);
  scene.advance(0.15, 300);
  CHECK(scene.q[0] == Approx(0.25 / (2 * kFriction * kGravity)).epsilon(4e-3));
  CHECK(std::abs(scene.q[1]) < 1e-9);
  CHECK(scene.v.norm() < 1e-6);
}

TEST_CASE("a plain ball rolls down with five sevenths of the pull", "[plain_touch]") {
  const double slope = 0.2;
  reference::PlainScene scene = scene_of(on_slab(ShapeKind::sphere), slope);
  stand(scene, 0);
  scene.advance(0.2, 400);
  CHECK(scene.q[0] == Approx(5.0 / 14 * kGravity * std::sin(slope) * 0.04).epsilon(5e-3));
  CHECK(scene.q[2] == Approx(kHalf).margin(1e-6));
}

TEST_CASE("a plain ball with rolling friction slows by five sevenths of it, and one that spins with torsional friction stops", "[plain_touch]") {
  const Model model = on_slab(ShapeKind::sphere);
  std::vector<std::string> notes;
  Effects effects;
  effects.contact = pair_contact_of(model, notes);
  effects.contact->materials = {{.stiffness = 1e8, .friction = kFriction, .rolling_friction = 0.01, .torsional_friction = 0.02}};
  const auto made = [&](const Vector3d& spin, double speed) {
    reference::PlainScene scene(model, effects, {0, 0, -kGravity});
    scene.ease_contact(1e-3);
    VectorXd q = scene.q, v = scene.v;
    q[2] = kHalf;
    v.head<3>() = spin;
    v[3] = speed;
    scene.start(q, v);
    return scene;
  };
  reference::PlainScene rolls = made({0, 3, 0}, 0.3), spins = made({0, 0, 4}, 0);
  rolls.advance(0.2, 400);
  CHECK(rolls.q[0] == Approx(0.06 - 5.0 / 14 * kGravity * 0.01 / kHalf * 0.04).epsilon(5e-3));
  const double slows = 0.02 * kGravity / 0.004;
  spins.advance(0.05, 100);
  CHECK(spins.v[2] == Approx(4 - 0.05 * slows).epsilon(1e-2));
  spins.advance(0.05, 100);
  CHECK(std::abs(spins.v[2]) < 1e-6);
}

TEST_CASE("a plain block slides above the angle of friction as Coulomb has it", "[plain_touch]") {
  const double angle = std::atan(1.2 * kFriction);
  reference::PlainScene steep = scene_of(on_slab(ShapeKind::box), angle);
  stand(steep, 0);
  steep.advance(0.1, 100);
  CHECK(steep.q[0] == Approx(0.005 * kGravity * (std::sin(angle) - kFriction * std::cos(angle))).epsilon(0.02));
}

TEST_CASE("crossed bars touch where their edges cross, and a turned block at the corners of what both cover", "[plain_touch]") {
  std::vector<reference::BodyMotion> motions(3);
  const ConvexShape bar{.kind = ConvexKind::box, .half = {0.5, 0.1, 0.1}}, block{.kind = ConvexKind::box, .half = {0.1, 0.1, 0.1}};
  const auto places = [&](const ConvexShape& under, const ConvexShape& above, double turn) {
    PairContact contact;
    contact.shapes = {{.slot = 1, .link = "a", .pose = {}, .shape = under}, {.slot = 2, .link = "b", .pose = {}, .shape = above}};
    contact.pairs = {{0, 1}};
    motions[2].origin = Vector3d(0, 0, 0.199);
    motions[2].R = Eigen::AngleAxisd(turn, Vector3d::UnitZ()).toRotationMatrix();
    std::vector<Vector3d> directions;
    return reference::PlainTouching(contact).places(motions, 1e-3, directions);
  };
  const auto crossed = places(bar, bar, M_PI / 2);
  CHECK(crossed.size() == 4);
  for (const reference::PlainTouch& touch : crossed) {
    CHECK(std::abs(touch.place.x()) == Approx(0.1));
    CHECK(std::abs(touch.place.y()) == Approx(0.1));
    CHECK(touch.gap == Approx(-1e-3).margin(1e-8));
    CHECK((touch.normal - Vector3d::UnitZ()).norm() < 1e-7);
  }
  const auto eight = places(block, block, M_PI / 4);
  CHECK(eight.size() == 8);
  for (const reference::PlainTouch& touch : eight) CHECK(touch.place.head<2>().norm() == Approx(0.1 / std::cos(M_PI / 8)));
}

}  // namespace linden::plain_touch_test

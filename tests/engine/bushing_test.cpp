// Bushings: springs and dampers along and about three axes each, by roll, pitch and yaw.
#include <catch2/catch.hpp>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "engine/batch.hpp"
#include "engine/simulation.hpp"
#include "layout/support/input_error.hpp"
#include "models/build/builder.hpp"
#include "models/build/coupled_model.hpp"

namespace linden::bushing_test {
namespace {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Three = std::array<double, 3>;

constexpr double kDegree = std::numbers::pi / 180;

Options weightless(double h) {
  Options options{.step = h};
  options.gravity = {0, 0, 0};
  return options;
}

Matrix3d turned(const Vector3d& rpy) {
  return (AngleAxisd(rpy[2], Vector3d::UnitZ()) * AngleAxisd(rpy[1], Vector3d::UnitY()) * AngleAxisd(rpy[0], Vector3d::UnitX())).toRotationMatrix();
}

const Vector3d kMoments(0.1, 0.2, 0.25);  // of inertia of the body

LinkSpec body_of(const std::string& name, JointType type = JointType::free, const Vector3d& axis = Vector3d::UnitZ()) {
  LinkSpec link;
  link.name = name;
  link.joint = name + "_joint";
  link.type = type;
  link.axis = axis;
  link.inertia = {2, Vector3d::Zero(), kMoments.asDiagonal()};
  return link;
}

/// Frame A in the world, and C in the body.
Isometry placed(const Vector3d& at, const Vector3d& rpy) {
  Isometry pose = Isometry::Identity();
  pose.translation() = at;
  pose.linear() = turned(rpy);
  return pose;
}
const Isometry kA = placed({0.3, -0.2, 1}, {0.4, -0.7, 2.1}), kC = placed({0.1, 0.2, -0.1}, {-1.2, 0.3, 0.6});

/// A free body on a bushing.
Model mounted(const Springs& shift, const Springs& turn, CouplingKind kind = CouplingKind::bushing) {
  TreeBuilder builder("mounted");
  builder.add(body_of("body"));
  CouplingSpec spec{.name = "mount", .kind = kind, .link_a = "", .link_b = "body", .frame_a = kA, .frame_b = kC, .shift = shift, .turn = turn};
  return coupled(builder.build(), {spec});
}
/// Positions of the body where C is so in A.
std::vector<double> where(const Vector3d& shift, const Vector3d& rpy) {
  const Isometry body = kA * placed(shift, rpy) * kC.inverse();
  const Eigen::Quaterniond turn(body.linear());
  return {body.translation()[0], body.translation()[1], body.translation()[2], turn.x(), turn.y(), turn.z(), turn.w()};
}

/// What a bushing does to the body with C: a force at the origin of C and a moment, in the world.
struct Pull {
  Vector3d force, moment;
};

/// Drake's: the force acts at the point half-way from A to C, along a frame half-way; torque N^T (-K q), q' = N w.
Pull drake_pull(const Three& shift_stiffness, const Three& turn_stiffness, const Vector3d& shift, const Vector3d& rpy) {
  const AngleAxisd turn(turned(rpy));
  const Matrix3d half = AngleAxisd(turn.angle() / 2, turn.axis()).toRotationMatrix();
  const Vector3d force = -half * Eigen::Map<const Vector3d>(shift_stiffness.data()).cwiseProduct(half.transpose() * shift);
  const double pitch = rpy[1], yaw = rpy[2];
  Matrix3d N;
  N << std::cos(yaw) / std::cos(pitch), std::sin(yaw) / std::cos(pitch), 0, -std::sin(yaw), std::cos(yaw), 0, std::cos(yaw) * std::tan(pitch),
      std::sin(yaw) * std::tan(pitch), 1;
  const Vector3d gimbals = -Eigen::Map<const Vector3d>(turn_stiffness.data()).cwiseProduct(rpy);
  const Vector3d moment = N.transpose() * gimbals - 0.5 * shift.cross(force);
  return {kA.linear() * force, kA.linear() * moment};
}
/// What the gradient of its energy has beside Drake's: tan(theta/4)/2 l x (f x d), with the axis l and the angle theta from A to C.
Vector3d beside_drake(const Pull& drake, const Vector3d& shift, const Vector3d& rpy) {
  const AngleAxisd turn(turned(rpy));
  return 0.5 * std::tan(turn.angle() / 4) * (kA.linear() * turn.axis()).cross(drake.force.cross(kA.linear() * shift));
}

/// How fast a body on a bushing moves after some steps from rest, where all that pulls it is held against.
double moves(const Model& model, const std::vector<double>& q, const Pull& pull) {
  Effects effects;
  BodyWrench against{.slot = 1};
  for (std::size_t k = 0; k < 3; ++k) {
    against.point[k] = kC.translation()[static_cast<Eigen::Index>(k)];
    against.force[k] = -pull.force[static_cast<Eigen::Index>(k)];
    against.moment[k] = -pull.moment[static_cast<Eigen::Index>(k)];
  }
  effects.wrenches.push_back(against);
  Simulation simulation(model, weightless(1e-3), effects);
  simulation.set_positions(q);
  REQUIRE(simulation.run(5).ok());
  double fastest = 0;
  for (const double v : simulation.velocities()) fastest = std::max(fastest, std::abs(v));
  return fastest;
}

const Three kShiftStiffness{400, 90, 250}, kTurnStiffness{20, 35, 12};

}  // namespace

TEST_CASE("A bushing pulls as Drake's does: its force, and its torque where its stiffness is one") {
  const Vector3d shifts[] = {{0.1, -0.05, 0.2}, {0, 0, 0}, {-0.3, 0.1, 0.05}};
  const Vector3d angles[] = {{0, 0, 0}, {0.01, -0.02, 0.03}, {0.7, -0.9, 1.2}, {-2.5, 1.3, 0.4}, {0.2, 0.1, -2.8}};
  for (const Vector3d& shift : shifts) {
    for (const Vector3d& rpy : angles) {
      CAPTURE(shift.transpose(), rpy.transpose());
      const std::vector<double> q = where(shift, rpy);
      const Three one{150, 150, 150};
      CHECK(moves(mounted({one, {}}, {kTurnStiffness, {}}), q, drake_pull(one, kTurnStiffness, shift, rpy)) < 1e-11);
      const Model uneven = mounted({kShiftStiffness, {}}, {kTurnStiffness, {}});
      Pull pull = drake_pull(kShiftStiffness, kTurnStiffness, shift, rpy);
      const Vector3d beside = beside_drake(pull, shift, rpy);
      if (beside.norm() > 1e-3) CHECK(moves(uneven, q, pull) > 1e-6);
      pull.moment += beside;
      CHECK(moves(uneven, q, pull) < 1e-11);
    }
  }
}

TEST_CASE("A torque about one axis turns a bushing by torque over stiffness, and a weld that gives way as half the sine of twice its angle") {
  for (const double degrees : {1.0, 10.0, 30.0, 60.0}) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      CAPTURE(degrees, axis);
      const double angle = degrees * kDegree;
      for (const CouplingKind kind : {CouplingKind::bushing, CouplingKind::weld}) {
        if (kind == CouplingKind::weld && degrees > 45) continue;  // beyond it pulls less the farther it is turned
        const double torque = kTurnStiffness[axis] * (kind == CouplingKind::bushing ? angle : std::sin(2 * angle) / 2);
        Effects effects;
        BodyWrench push{.slot = 1};
        for (std::size_t k = 0; k < 3; ++k) push.moment[k] = torque * kA.linear()(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(axis));
        effects.wrenches.push_back(push);
        // damped by half of what keeps it from swinging
        const auto damped = [](const Three& stiffness, double inertia) {
          Three damping{};
          for (std::size_t k = 0; k < 3; ++k) damping[k] = std::sqrt(stiffness[k] * inertia);
          return damping;
        };
        const Model model = mounted({kShiftStiffness, damped(kShiftStiffness, 2)}, {kTurnStiffness, damped(kTurnStiffness, 0.2)}, kind);
        Simulation simulation(model, weightless(1e-2), effects);
        simulation.set_positions(where({0, 0, 0}, {0, 0, 0}));
        REQUIRE(simulation.run(3000).ok());
        Vector3d rpy = Vector3d::Zero();
        rpy[static_cast<Eigen::Index>(axis)] = angle;
        const std::vector<double> expected = where({0, 0, 0}, rpy);
        const double sign = expected[6] * simulation.positions()[6] < 0 ? -1 : 1;
        for (std::size_t k = 0; k < 7; ++k) CHECK((k < 3 ? 1 : sign) * simulation.positions()[k] == Approx(expected[k]).margin(1e-8));
      }
    }
  }
}

TEST_CASE("What is pushed along an axis gives way by its stiffness, of a weld too, and what has none is held by it and let go by a bushing") {
  for (const CouplingKind kind : {CouplingKind::bushing, CouplingKind::weld}) {
    CAPTURE(name_of(kind));
    Effects effects;
    BodyWrench push{.slot = 1};
    const Vector3d force = kA.linear() * Vector3d(8, 6, 4);
    for (std::size_t k = 0; k < 3; ++k) {
      push.force[k] = force[static_cast<Eigen::Index>(k)];
      push.point[k] = kC.translation()[static_cast<Eigen::Index>(k)];
    }
    effects.wrenches.push_back(push);
    // nothing along z, rigid or free
    const Model model = mounted({Three{4000, 1000, 0}, Three{120, 60, 0}}, {5e3, 100}, kind);
    CHECK(row_count(model.couplings) == (kind == CouplingKind::weld ? 6 : 5));
    CHECK(rigid_row_count(model.couplings) == (kind == CouplingKind::weld ? 1 : 0));
    Simulation simulation(model, weightless(1e-3), effects);
    simulation.set_positions(where({0, 0, 0}, {0, 0, 0}));
    REQUIRE(simulation.run(500).ok());
    const std::vector<CouplingState> states = simulation.couplings();
    CHECK(states[0].gaps[0] == Approx(8 / 4000.0).epsilon(2e-2));
    CHECK(states[0].gaps[1] == Approx(6 / 1000.0).epsilon(2e-2));
    CHECK(states[0].forces[0] == Approx(-8).epsilon(2e-2));
    const std::span<const double> q = simulation.positions();
    const Vector3d now = kA.inverse() * (Vector3d(q[0], q[1], q[2]) + Eigen::Quaterniond(q[6], q[3], q[4], q[5]) * kC.translation());
    if (kind == CouplingKind::weld) {
      CHECK(std::abs(now[2]) < 1e-12);
    } else {
      CHECK(now[2] == Approx(0.5 * 4 / 2.0 * 0.25).epsilon(2e-2));
    }
  }
}

TEST_CASE("What swings on a bushing about one axis does so at one frequency, however far") {
  const Vector3d axes[] = {Vector3d::UnitX(), Vector3d::UnitY(), Vector3d::UnitZ()};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (const double amplitude : {0.01, 1.3}) {
      CAPTURE(axis, amplitude);
      TreeBuilder builder("swing");
      builder.add(body_of("body", JointType::revolute, axes[axis]));
      CouplingSpec spec{.name = "mount", .kind = CouplingKind::bushing, .link_a = "", .link_b = "body", .turn = {kTurnStiffness, {}}};
      Simulation simulation(coupled(builder.build(), {spec}), weightless(1e-3));
      const double rate = std::sqrt(kTurnStiffness[axis] / kMoments[static_cast<Eigen::Index>(axis)]);
      simulation.set_velocities(std::vector{amplitude * rate});
      for (int k = 0; k < 2000; ++k) {
        REQUIRE(simulation.step().ok());
        REQUIRE(simulation.positions()[0] == Approx(amplitude * std::sin(rate * simulation.time())).margin(6e-4 * amplitude));
      }
      CHECK(simulation.couplings()[0].gaps.size() == 3);
      CHECK(simulation.couplings()[0].gaps[axis] == Approx(simulation.positions()[0]).margin(1e-14));
    }
  }
}

TEST_CASE("A damper about an axis is worked against at torque over damping, turn after turn") {
  TreeBuilder builder("stirrer");
  builder.add(body_of("body", JointType::revolute, Vector3d::UnitX()));
  CouplingSpec spec{.name = "oil", .kind = CouplingKind::bushing, .link_a = "", .link_b = "body", .turn = {Three{0, 0, 0}, Three{0.5, 0, 0}}};
  Effects effects;
  effects.torques.push_back({0, {{0}, {2}}});
  Simulation simulation(coupled(builder.build(), {spec}), weightless(1e-2), effects);
  REQUIRE(simulation.run(500).ok());
  for (int k = 0; k < 500; ++k) {
    REQUIRE(simulation.step().ok());
    REQUIRE(simulation.velocities()[0] == Approx(4).epsilon(1e-6));
  }
  CHECK(simulation.positions()[0] > 6 * std::numbers::pi);
}

TEST_CASE("A body that swings through the right angle of its bushing's pitch, where roll and yaw are one, gains nothing") {
  const Model model = mounted({}, Springs(2, 0));
  double most = 0;
  for (int start = 0; start < 20; ++start) {
    Simulation simulation(model, weightless(2.5e-3));
    simulation.set_positions(where(Vector3d::Zero(), {0.05 * start, 80 * kDegree, 0.3}));
    std::vector<double> v(6, 0.0);
    v[1] = 6;
    v[2] = 0.1 * start - 1;
    simulation.set_velocities(v);
    const double begin = simulation.energy().total();
    for (int k = 0; k < 2000; ++k) {
      REQUIRE(simulation.step().ok());
      most = std::max(most, simulation.energy().total() / begin);
    }
  }
  CHECK(most < 1.2);
}

TEST_CASE("Two bodies on an uneven bushing keep their momenta to rounding and their energy in a band of second order, far from its rest") {
  const auto run = [](double h) {
    TreeBuilder builder("two");
    builder.add(body_of("a"));
    builder.add(body_of("b"));
    CouplingSpec spec{.name = "mount", .kind = CouplingKind::bushing, .link_a = "a", .link_b = "b", .frame_a = kA, .frame_b = kC};
    spec.shift = {kShiftStiffness, {}};
    spec.turn = {kTurnStiffness, {}};
    Simulation simulation(coupled(builder.build(), {spec}), weightless(h));
    std::vector<double> q{0, 0, 0, 0, 0, 0, 1};
    const std::vector<double> other = where({0.1, -0.05, 0.08}, {0.5, -0.4, 0.8});
    q.insert(q.end(), other.begin(), other.end());
    simulation.set_positions(q);
    simulation.set_velocities(std::vector{0.3, -0.2, 0.5, 0.1, 0.4, 0.0, -0.4, 0.1, 0.2, 0.0, -0.3, 0.2});
    const Momentum before = simulation.momentum();
    const double start = simulation.energy().total();
    double widest = 0;
    for (int k = 0; k < 4 / h; ++k) {
      REQUIRE(simulation.step().ok());
      widest = std::max(widest, std::abs(simulation.energy().total() - start));
    }
    const Momentum after = simulation.momentum();
    for (std::size_t k = 0; k < 3; ++k) {
      CHECK(after.linear[k] == Approx(before.linear[k]).margin(1e-11));
      CHECK(after.angular[k] == Approx(before.angular[k]).margin(1e-11));
    }
    CHECK(simulation.effect_work().couplings == 0);
    return widest / start;
  };
  const double whole = run(4e-3), half = run(2e-3);
  CHECK(whole < 2e-2);
  CHECK(half == Approx(whole / 4).epsilon(0.15));
}

TEST_CASE("A damped bushing moves the same alone and in lanes, and what it takes is in the account") {
  const Model model = mounted({kShiftStiffness, Three{3, 0, 8}}, {kTurnStiffness, Three{0.3, 0.2, 0}});
  Simulation alone(model, weightless(2e-3));
  alone.set_positions(where({0.1, -0.05, 0.08}, {0.5, -0.7, 0.8}));
  const std::vector<double> start(alone.positions().begin(), alone.positions().end()), rest = alone.velocities();
  Batch batch(model, 9, weightless(2e-3));
  for (std::int64_t i = 0; i < 9; ++i) batch.reset(i, start, rest);
  const double before = alone.energy().total();
  batch.step(400);
  REQUIRE(alone.run(400).ok());
  CHECK(batch.summary().frozen == 0);
  for (Index row = 0; row < 7; ++row) CHECK(batch.positions()(7, row) == Approx(alone.positions()[static_cast<std::size_t>(row)]).margin(1e-9));
  CHECK(alone.effect_work().couplings > 0.5 * before);
  CHECK(alone.energy().total() + alone.effect_work().couplings == Approx(before).epsilon(1e-2));
}

TEST_CASE("A bushing that is none, and numbers of axes that hold nothing, are refused by name") {
  CHECK_THROWS_WITH(mounted({}, {}), Catch::Contains("\"mount\"") && Catch::Contains("neither pulls nor damps"));
  CHECK_THROWS_WITH(mounted({Three{1, -2, 0}, {}}, {}), Catch::Contains("\"mount\"") && Catch::Contains("-2"));
  CHECK_THROWS_WITH(mounted({Three{5, 0, 7}, {}}, {}, CouplingKind::point_on_plane), Catch::Contains("nothing that shifts along its axis x"));
  CHECK_THROWS_WITH(mounted({}, {Three{0, 0, 7}, {}}, CouplingKind::hinge), Catch::Contains("nothing that turns along its axis z"));
  CHECK_NOTHROW(mounted({5, 0}, {}, CouplingKind::point_on_plane));
}

}  // namespace linden::bushing_test

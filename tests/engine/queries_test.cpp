// Questions of a state: against the plain tree's Jacobians and derivatives, other questions, and closed forms.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/queries/centre_of_mass.hpp"
#include "engine/queries/energy_by_effect.hpp"
#include "engine/queries/imu.hpp"
#include "engine/queries/inverse_dynamics.hpp"
#include "engine/queries/jacobian.hpp"
#include "engine/queries/link_motion.hpp"
#include "engine/queries/mass_matrix.hpp"
#include "engine/queries/step_forces.hpp"
#include "models/build/builder.hpp"
#include "models/build/random.hpp"
#include "models/shapes/contacts_of.hpp"
#include "tests/engine/scenes.hpp"
#include "tests/reference/coriolis_plain.hpp"
#include "tests/reference/discrete_action_plain.hpp"

namespace linden::queries_test {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using reference::PlainTree;
using Numbers = std::vector<double>;

MatrixXd eigen(const Matrix& m) {
  return Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(m.numbers.data(), m.rows, m.columns);
}
VectorXd eigen(std::span<const double> v) { return Eigen::Map<const VectorXd>(v.data(), static_cast<Eigen::Index>(v.size())); }
Vector3d eigen(const std::array<double, 3>& a) { return {a[0], a[1], a[2]}; }
reference::Vector6<double> eigen(const SpatialMotion& V) {
  reference::Vector6<double> result;
  result << eigen(V.angular), eigen(V.linear);
  return result;
}
reference::Matrix4<double> eigen(const Pose& pose) {
  reference::Matrix4<double> T = reference::Matrix4<double>::Identity();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) T(row, column) = pose.rotation[static_cast<std::size_t>(3 * row + column)];
    T(row, 3) = pose.shift[static_cast<std::size_t>(row)];
  }
  return T;
}
Numbers numbers(const VectorXd& v) { return {v.begin(), v.end()}; }

double relative(const MatrixXd& found, const MatrixXd& expected) { return (found - expected).norm() / std::max(1e-12, expected.norm()); }

Contacts touching(const Model& model) {
  std::vector<std::string> notes;
  return contacts_of(model, notes);
}

/// Robots, and random trees of joints of all kinds.
std::vector<Model> asked_models() {
  std::vector<Model> models;
  for (const std::string& file : tree_robots()) {
    models.push_back(load_urdf(file, Base::fixed));
    if (file.find("hand") == std::string::npos) models.push_back(load_urdf(file, Base::floating));
  }
  for (std::uint64_t seed = 1; seed <= 4; ++seed) models.push_back(random_tree({.bodies = 12, .seed = seed, .floating = seed % 2 == 0}));
  return models;
}

struct Asked {
  Numbers q, v, a;
};

Asked random_of(const Model& model, std::uint64_t seed) {
  const InitialState start = random_state(model, seed, 1);
  Kinematics state(model, start.positions, start.velocities);
  Random random(seed);
  Numbers a;
  for (Index row = 0; row < model.tree.shape.velocities; ++row) a.push_back(random.uniform(-2, 2));
  state.set(start.positions, start.velocities, a);
  const auto copy = [](std::span<const double> rows) { return Numbers(rows.begin(), rows.end()); };
  return {copy(state.positions()), copy(state.velocities()), copy(state.accelerations())};
}

/// Where the state is t later, at constant acceleration.
Asked later(const Model& model, const Asked& state, double t) {
  const VectorXd v = eigen(std::span(state.v)), a = eigen(std::span(state.a));
  const VectorXd delta = t * v + 0.5 * t * t * a;
  return {numbers(reference::advanced(reference::plain_tree(model), eigen(std::span(state.q)), delta)), numbers(v + t * a), state.a};
}

/// Columns of followers added to their leaders', times their multipliers.
MatrixXd tied_columns(const Model& model, MatrixXd J) {
  for (const Mimic& mimic : model.mimics) {
    J.col(mimic.leader_v) += mimic.multiplier * J.col(mimic.follower_v);
    J.col(mimic.follower_v).setZero();
  }
  return J;
}

}  // namespace

TEST_CASE("every link is where the plain tree has it, moves by its Jacobian and by the derivative of its pose", "[queries]") {
  double worst = 0, worst_rate = 0;
  std::size_t merged = 0;
  for (const Model& model : asked_models()) {
    const Asked at = random_of(model, 3);
    const Kinematics state(model, at.q, at.v, at.a);
    const PlainTree tree = reference::plain_tree(model);
    const auto poses = reference::poses(tree, eigen(std::span(at.q)));
    constexpr double kTime = 1e-6;
    const Asked soon = later(model, at, kTime), before = later(model, at, -kTime);
    const Kinematics next(model, soon.q, soon.v), last(model, before.q, before.v);
    for (const auto& [name, link] : model.names.link) {
      const reference::Matrix4<double> expected = poses[static_cast<std::size_t>(link.slot)] * eigen(link.in_body),
                                       T = eigen(link_pose(state, link));
      worst = std::max(worst, relative(T, expected));
      merged += link.in_body == Pose{} ? 0 : 1;
      const auto J = reference::body_jacobian<double>(tree, poses, link.slot);
      const VectorXd V = reference::adjoint<double>(reference::inverse<double>(eigen(link.in_body))) * J * eigen(std::span(at.v));
      worst = std::max(worst, (eigen(link_twist(state, link, Frame::link)) - V).norm() / std::max(1.0, V.norm()));
      const SpatialMotion aligned = link_twist(state, link);
      worst = std::max(worst, (eigen(aligned.angular) - T.topLeftCorner<3, 3>() * V.head<3>()).norm() / std::max(1.0, V.norm()));
      const VectorXd W = reference::adjoint<double>(T) * V;
      worst = std::max(worst, (eigen(link_twist(state, link, Frame::world)) - W).norm() / std::max(1.0, W.norm()));
      const Vector3d moved = (eigen(link_pose(next, link)) - eigen(link_pose(last, link))).topRightCorner<3, 1>() / (2 * kTime);
      worst_rate = std::max(worst_rate, (eigen(aligned.linear) - moved).norm() / std::max(1.0, moved.norm()));
      for (const Frame frame : {Frame::aligned, Frame::link, Frame::world}) {
        const VectorXd by_jacobian = eigen(link_jacobian(state, link, frame)) * eigen(std::span(at.v));
        worst = std::max(worst, (by_jacobian - eigen(link_twist(state, link, frame))).norm() / std::max(1.0, by_jacobian.norm()));
      }
    }
  }
  CHECK(merged > 3);
  INFO("worst " << worst << ", of derivatives " << worst_rate);
  CHECK(worst < 1e-12);
  CHECK(worst_rate < 1e-7);
}

TEST_CASE("accelerations of links are the derivatives of their twists", "[queries]") {
  double worst = 0;
  for (const Model& model : asked_models()) {
    const Asked at = random_of(model, 5);
    const Kinematics state(model, at.q, at.v, at.a);
    constexpr double kTime = 1e-6;
    const Asked soon = later(model, at, kTime), before = later(model, at, -kTime);
    const Kinematics next(model, soon.q, soon.v), last(model, before.q, before.v);
    for (const auto& entry : model.names.link) {
      const LinkPlace& link = entry.second;  // clang 14 lets no lambda have a structured binding
      const auto rate = [&](Frame frame) {
        return reference::Vector6<double>((eigen(link_twist(next, link, frame)) - eigen(link_twist(last, link, frame))) / (2 * kTime));
      };
      const auto error = [&](const SpatialMotion& found, const reference::Vector6<double>& expected) {
        worst = std::max(worst, (eigen(found) - expected).norm() / std::max(1.0, expected.norm()));
      };
      error(link_acceleration(state, link), rate(Frame::aligned));
      error(link_spatial_acceleration(state, link, Frame::link), rate(Frame::link));
      error(link_spatial_acceleration(state, link, Frame::world), rate(Frame::world));
      const Vector3d in_link = eigen(link_pose(state, link)).topLeftCorner<3, 3>().transpose() * rate(Frame::aligned).tail<3>();
      error({link_acceleration(state, link, Frame::link).angular, {in_link[0], in_link[1], in_link[2]}},
            eigen(link_acceleration(state, link, Frame::link)));
    }
  }
  INFO("worst " << worst);
  CHECK(worst < 1e-7);
}

TEST_CASE("the Jacobian of a point moves it as the pose of its link does", "[queries]") {
  double worst = 0;
  for (const Model& model : asked_models()) {
    const Asked at = random_of(model, 7);
    const Kinematics state(model, at.q, at.v, at.a);
    constexpr double kTime = 1e-6;
    const Kinematics next(model, later(model, at, kTime).q), last(model, later(model, at, -kTime).q);
    const std::array<double, 3> point{0.1, -0.2, 0.3};
    const auto place = [&](const Kinematics& now, const LinkPlace& link) {
      const reference::Matrix4<double> T = eigen(link_pose(now, link));
      return Vector3d(T.topLeftCorner<3, 3>() * eigen(point) + T.topRightCorner<3, 1>());
    };
    for (const auto& [name, link] : model.names.link) {
      const Vector3d found = eigen(point_jacobian(state, link, point)) * eigen(std::span(at.v));
      const Vector3d moved = (place(next, link) - place(last, link)) / (2 * kTime);
      worst = std::max(worst, (found - moved).norm() / std::max(1.0, moved.norm()));
    }
  }
  INFO("worst " << worst);
  CHECK(worst < 1e-7);
}

TEST_CASE("the centre of mass is the mean place of the mass, and moves by the momentum that the mass matrix has", "[queries]") {
  double worst = 0, worst_rate = 0;
  for (const Model& model : asked_models()) {
    const Asked at = random_of(model, 9);
    const Kinematics state(model, at.q, at.v, at.a);
    const PlainTree tree = reference::plain_tree(model);
    const auto poses = reference::poses(tree, eigen(std::span(at.q)));
    Vector3d moment = Vector3d::Zero();
    reference::Vector6<double> momentum = reference::Vector6<double>::Zero();
    double mass = 0;
    for (Index i = 1; i < tree.slots(); ++i) {
      const reference::Matrix4<double>& T = poses[static_cast<std::size_t>(i)];
      mass += tree.body(i).mass();
      moment += T.topLeftCorner<3, 3>() * tree.body(i).moment() + tree.body(i).mass() * T.topRightCorner<3, 1>();
      const VectorXd own = tree.body(i).G * reference::body_jacobian<double>(tree, poses, i) * eigen(std::span(at.v));
      momentum += reference::adjoint<double>(reference::inverse<double>(T)).transpose() * own;
    }
    const CentreOfMass found = centre_of_mass(state);
    worst = std::max({worst, std::abs(found.mass - mass) / mass, relative(eigen(found.position), moment / mass)});
    const Momentum total = total_momentum(state), about = centroidal_momentum(state);
    worst = std::max({worst, relative(eigen(total.angular), momentum.head<3>()), relative(eigen(total.linear), momentum.tail<3>())});
    const Vector3d moved = momentum.head<3>() - Vector3d(moment / mass).cross(Vector3d(momentum.tail<3>()));
    worst = std::max(worst, (eigen(about.angular) - moved).norm() / momentum.norm());
    const VectorXd by_matrix = eigen(momentum_matrix(state)) * eigen(std::span(at.v));
    worst = std::max(worst, relative(by_matrix, momentum));
    const Vector3d velocity = eigen(centre_of_mass_jacobian(state)) * eigen(std::span(at.v));
    worst = std::max(worst, relative(velocity, eigen(found.velocity)));
    constexpr double kTime = 1e-6;
    const Kinematics next(model, later(model, at, kTime).q), last(model, later(model, at, -kTime).q);
    const Vector3d rate = (eigen(centre_of_mass(next).position) - eigen(centre_of_mass(last).position)) / (2 * kTime);
    worst_rate = std::max(worst_rate, (eigen(found.velocity) - rate).norm() / std::max(1.0, rate.norm()));
  }
  INFO("worst " << worst << ", of derivatives " << worst_rate);
  CHECK(worst < 1e-12);
  CHECK(worst_rate < 1e-7);
}

TEST_CASE("mass matrix and inverse, bias forces and inverse dynamics are those of the plain tree", "[queries]") {
  double worst = 0, worst_inverse = 0;
  for (const Model& model : asked_models()) {
    const Asked at = random_of(model, 11);
    Kinematics state(model, at.q, at.v, at.a);
    state.set_gravity({0.3, -2, -9});
    const PlainTree tree = reference::plain_tree(model);
    const VectorXd q = eigen(std::span(at.q)), v = eigen(std::span(at.v)), a = eigen(std::span(at.a));
    MatrixXd M = reference::mass_matrix(tree, q);
    const VectorXd gravity = reference::potential_force(tree, q, eigen(state.gravity()));
    const VectorXd tau = tied_columns(model, (M * a + reference::coriolis_force(tree, q, v) - gravity).transpose()).transpose();
    worst = std::max(worst, relative(eigen(std::span<const double>(inverse_dynamics(state))), tau));
    const VectorXd bias = tied_columns(model, (reference::coriolis_force(tree, q, v) - gravity).transpose()).transpose();
    worst = std::max(worst, relative(eigen(std::span<const double>(bias_forces(state))), bias));
    const VectorXd Q = tied_columns(model, gravity.transpose()).transpose();
    worst = std::max(worst, relative(eigen(std::span<const double>(gravity_forces(state))), Q));

    Numbers rotors;
    Random random(1);
    for (Index i = 1; i < tree.slots(); ++i) {
      for (Index k = 0; k < tree.body(i).dofs(); ++k) {
        rotors.push_back(tree.body(i).kind == JointKind::free ? 0.0 : random.uniform(0.01, 0.1));
      }
    }
    state.set_armature(rotors);
    M.diagonal() += eigen(std::span(rotors));
    M = tied_columns(model, tied_columns(model, M).transpose());
    worst = std::max(worst, relative(eigen(mass_matrix(state)), M));
    const Numbers forces = inverse_dynamics(state);
    worst_inverse = std::max(worst_inverse, relative(eigen(std::span<const double>(forward_dynamics(state, forces))), a));
    const Numbers moved = solve_mass_matrix(state, forces);
    const VectorXd back = M * eigen(std::span(moved));
    worst_inverse = std::max(worst_inverse, relative(back, eigen(std::span(forces))));
  }
  INFO("worst " << worst << ", of inverses " << worst_inverse);
  CHECK(worst < 1e-11);
  CHECK(worst_inverse < 1e-9);
}

TEST_CASE("forces of a step are those that a simulation was given", "[queries]") {
  constexpr double kStep = 1e-3;
  double worst = 0;
  for (const Model& model : asked_models()) {
    Simulation simulation(model, {.step = kStep, .tolerance = 1e-13});
    const Asked at = random_of(model, 13);
    simulation.set_positions(at.q);
    simulation.set_velocities(at.v);
    Random random(2);
    Numbers forces;
    for (Index row = 0; row < model.tree.shape.velocities; ++row) forces.push_back(random.uniform(-1, 1));
    for (const Mimic& mimic : model.mimics) forces[static_cast<std::size_t>(mimic.follower_v)] = 0;
    simulation.set_forces(forces);
    std::vector<Numbers> q;
    for (int k = 0; k < 3; ++k) {
      q.emplace_back(simulation.positions().begin(), simulation.positions().end());
      run(simulation, 1);
    }
    const StepForces found = step_forces(model, q[0], q[1], q[2], kStep);
    // positions are known to some 1e-16, and are divided by the square of the step
    const VectorXd scale = eigen(mass_matrix(Kinematics(model, q[1]))).diagonal();
    for (std::size_t row = 0; row < forces.size(); ++row) {
      worst = std::max(worst, std::abs(found.joints[row] - forces[row]) / std::max(1.0, scale[static_cast<Eigen::Index>(row)]));
    }
  }
  INFO("worst " << worst);
  CHECK(worst < 1e-6);
}

TEST_CASE("forces of a step are what the discrete action is short of", "[queries]") {
  constexpr double kStep = 0.05;
  const std::array<double, 3> gravity{0.5, -1, -9};
  double worst = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const Model model = random_tree({.bodies = 8, .seed = seed, .floating = seed % 2 == 0});
    const PlainTree tree = reference::plain_tree(model);
    const Asked at = random_of(model, seed);
    const VectorXd q1 = eigen(std::span(at.q)), v = eigen(std::span(at.v)), a = eigen(std::span(at.a));
    const VectorXd q0 = reference::advanced(tree, q1, -kStep * v), q2 = reference::advanced(tree, q1, kStep * v + kStep * kStep * a);
    const VectorXd short_of = reference::action_slope_at_end(tree, q0, q1, kStep, eigen(gravity)) +
                              reference::action_slope_at_begin(tree, q1, q2, kStep, eigen(gravity));
    const StepForces found = step_forces(model, numbers(q0), at.q, numbers(q2), kStep, gravity);
    worst = std::max(worst, relative(eigen(std::span(found.joints)), -short_of / kStep));
  }
  INFO("worst " << worst);
  CHECK(worst < 1e-11);
}

TEST_CASE("joint reactions carry what hangs below, and what swings pulls outward", "[queries]") {
  // two links one below the other on hinges about y, 1 m each, a mass at the end of each
  LinkSpec upper;
  upper.name = "upper";
  upper.joint = "shoulder";
  upper.type = JointType::revolute;
  upper.axis = Vector3d::UnitY();
  upper.inertia.mass = 2;
  upper.inertia.center = {0, 0, -1};
  LinkSpec lower = upper;
  lower.name = "lower";
  lower.joint = "elbow";
  lower.parent = "upper";
  lower.inertia.mass = 3;
  lower.placement.translation() = Vector3d(0, 0, -1);
  const Model model = TreeBuilder("pendulum").add(upper).add(lower).build();
  const auto world = [&](const Kinematics& state, const std::string& link, const std::array<double, 3>& force) {
    // the body's frame is turned so that the axis is z
    const LinkPlace& place = place_of(model, link);
    return Vector3d(eigen(link_pose(state, LinkPlace{place.slot, Pose{}})).topLeftCorner<3, 3>() * eigen(force));
  };
  const Index shoulder = place_of(model, "upper").slot, elbow = place_of(model, "lower").slot;
  Kinematics state(model);
  auto reactions = joint_reactions(state);
  CHECK((world(state, "upper", reactions[static_cast<std::size_t>(shoulder)].force) - Vector3d(0, 0, 5 * 9.81)).norm() < 1e-12);
  CHECK((world(state, "lower", reactions[static_cast<std::size_t>(elbow)].force) - Vector3d(0, 0, 3 * 9.81)).norm() < 1e-12);
  CHECK((eigen(reactions[0].force) - Vector3d(0, 0, -5 * 9.81)).norm() < 1e-12);
  // the shoulder turns at 2 rad/s: m w^2 r of both masses, 1 m and 2 m away
  state.set(Numbers{0, 0}, Numbers{2, 0});
  reactions = joint_reactions(state);
  CHECK(
      (world(state, "upper", reactions[static_cast<std::size_t>(shoulder)].force) - Vector3d(0, 0, 5 * 9.81 + 4 * (2 * 1 + 3 * 2))).norm() <
      1e-12);
  CHECK((world(state, "lower", reactions[static_cast<std::size_t>(elbow)].force) - Vector3d(0, 0, 3 * 9.81 + 4 * 3 * 2)).norm() < 1e-12);
  // the same from three configurations of a turn that goes on evenly: chords are shorter than arcs by a 24th of the square of the angle
  constexpr double kStep = 1e-3;
  const StepForces step = step_forces(model, Numbers{-2 * kStep, 0}, Numbers{0, 0}, Numbers{2 * kStep, 0}, kStep);
  CHECK((world(state, "upper", step.across[static_cast<std::size_t>(shoulder)].force) - Vector3d(0, 0, 5 * 9.81 + 4 * 8)).norm() < 1e-4);
  CHECK((eigen(step.across[0].force) - Vector3d(0, 0, -5 * 9.81 - 4 * 8)).norm() < 1e-4);
  // a wrench from outside that holds the lower mass up takes it off both joints
  Numbers outside(static_cast<std::size_t>(model.tree.shape.slots) * 6, 0.0);
  state.set(Numbers{0, 0});
  const Vector3d up = eigen(link_pose(state, LinkPlace{elbow, Pose{}})).topLeftCorner<3, 3>().transpose() * Vector3d(0, 0, 3 * 9.81);
  for (std::size_t k = 0; k < 3; ++k) outside[static_cast<std::size_t>(elbow) * 6 + 3 + k] = up[static_cast<Eigen::Index>(k)];
  reactions = joint_reactions(state, outside);
  CHECK(eigen(reactions[static_cast<std::size_t>(elbow)].force).norm() < 1e-12);
  CHECK((world(state, "upper", reactions[static_cast<std::size_t>(shoulder)].force) - Vector3d(0, 0, 2 * 9.81)).norm() < 1e-12);
}

TEST_CASE("an inertial measurement unit feels its weight at rest, nothing in free fall, and the pull of a turn", "[queries]") {
  LinkSpec body;
  body.name = "body";
  body.joint = "root";
  body.type = JointType::free;
  body.inertia = {2, Vector3d::Zero(), 0.1 * Eigen::Matrix3d::Identity()};
  LinkSpec head;
  head.name = "head";
  head.joint = "neck";
  head.parent = "body";
  head.type = JointType::fixed;
  head.placement.translation() = Vector3d(0.5, 0, 0);
  head.placement.linear() = Eigen::AngleAxisd(std::numbers::pi / 2, Vector3d::UnitY()).toRotationMatrix();
  const Model model = TreeBuilder("faller").add(body).add(head).build();
  const LinkPlace& at = place_of(model, "head");
  Simulation simulation(model, {.step = 1e-3});
  const ImuReading rest = imu(Kinematics(simulation), at);
  CHECK((eigen(rest.specific_force) - Vector3d(-9.81, 0, 0)).norm() < 1e-12);  // the head's x points down
  simulation.set_velocities(Numbers{0, 0, 0, 1, 2, 3});
  run(simulation, 3);
  CHECK(eigen(imu(Kinematics(simulation), at).specific_force).norm() < 1e-9);
  // a turn at 3 rad/s about z, 0.5 m away: 4.5 m/s^2 toward the middle, along the head's -z
  simulation.set_velocities(Numbers{0, 0, 3, 0, 0, 0});
  run(simulation, 3);
  const ImuReading turning = imu(Kinematics(simulation), at);
  CHECK((eigen(turning.specific_force) - Vector3d(0, 0, -4.5)).norm() < 1e-6);
  CHECK((eigen(turning.angular_velocity) - Vector3d(-3, 0, 0)).norm() < 1e-9);
}

TEST_CASE("energies by effect add up to what stays", "[queries]") {
  const Model model = load_urdf(model_file("humanoid.urdf"), Base::floating);
  Effects effects;
  effects.damping = damping_everywhere(model, 0.5);
  effects.servos = servo_everywhere(model, 50, 2);
  effects.ground = Ground{.height = -1.2, .contacts = touching(model)};
  Simulation simulation(model, {.step = 1e-3}, effects);
  const auto stays = [&] {
    double sum = 0;
    for (const EnergyShare& share : energy_by_effect(simulation)) {
      const bool given = share.name.ends_with("_given");
      sum += given ? -share.energy : share.energy;
    }
    return sum;
  };
  const double before = stays();
  std::vector<std::string> names;
  for (const EnergyShare& share : energy_by_effect(simulation)) names.push_back(share.name);
  CHECK(names == std::vector<std::string>{"kinetic", "gravity", "ground", "damping_taken", "servo_given", "ground_taken"});
  run(simulation, 300);
  const Energy energy = simulation.energy();
  CHECK(energy.kinetic > 1);
  CHECK(std::abs(stays() - before) < 1e-2 * energy.kinetic);
  CHECK(std::abs(stays() - (energy.total() + simulation.effect_work().taken() - simulation.effect_work().given())) < 1e-9);
}

TEST_CASE("questions that make no sense say what was found and what was expected", "[queries]") {
  const Model model = chain(3);
  Kinematics state(model);
  CHECK_THROWS_WITH(state.set(Numbers{1, 2}), Catch::Contains("positions: 2 numbers given") && Catch::Contains("expected 3"));
  CHECK_THROWS_WITH(state.set(Numbers{1, 2, NAN}), Catch::Contains("nan") && Catch::Contains("finite"));
  CHECK_THROWS_WITH(state.set(Numbers{1, 2, 3}, Numbers{1}), Catch::Contains("velocities: 1 numbers given"));
  CHECK_THROWS_WITH(solve_mass_matrix(state, Numbers{1}), Catch::Contains("1 numbers") && Catch::Contains("expected 3"));
  CHECK_THROWS_WITH(forward_dynamics(state, Numbers{1}), Catch::Contains("joint forces: 1 numbers") && Catch::Contains("expected 3"));
  CHECK_THROWS_WITH(inverse_dynamics(state, Numbers{1}), Catch::Contains("expected 24 (6 a slot)"));
  CHECK_THROWS_WITH(state.set_armature(Numbers{1}), Catch::Contains("armature: 1 numbers") && Catch::Contains("expected 3"));
  const Model floater = random_tree({.bodies = 2, .seed = 1, .floating = true});
  CHECK_THROWS_WITH(Kinematics(floater).set_armature(Numbers(static_cast<std::size_t>(floater.tree.shape.velocities), 0.1)),
                    Catch::Contains("armature of 0.1") && Catch::Contains("free joint"));
  CHECK_THROWS_WITH(place_of(model, "link_22"), Catch::Contains("has no link"));
  CHECK_THROWS_WITH(step_forces(model, Numbers{0, 0, 0}, Numbers{0, 0, 0}, Numbers{0, 0, 0}, 0), Catch::Contains("above zero"));
  CHECK_THROWS_WITH(step_forces(model, Numbers{0, 0, 0}, Numbers{4, 0, 0}, Numbers{0, 0, 0}, 1e-3), Catch::Contains("half a turn"));
  CHECK_THROWS_WITH(link_acceleration(state, model.names.link.begin()->second, Frame::world), Catch::Contains("link_spatial_acceleration"));
  Simulation other(chain(4));
  CHECK_THROWS_WITH(state.set(other), Catch::Contains("expected the same model"));
  const Simulation composed(model, {.order = 4});
  CHECK_THROWS_WITH(composed.accelerations(), Catch::Contains("order 4") && Catch::Contains("expected order 2"));
}

}  // namespace linden::queries_test

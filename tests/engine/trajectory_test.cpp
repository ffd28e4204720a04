// Recorded trajectories against the discrete action itself: the proof that the engine integrates what the paper writes.
#include "tests/engine/scenes.hpp"
#include "tests/reference/del_literal.hpp"
#include "tests/reference/discrete_action_plain.hpp"

namespace linden::trajectory_test {
namespace {

using Eigen::VectorXd;

constexpr double kStep = 1e-3;
const reference::Vector3<double> kGravity(0, 0, -9.81);

/// Followers of mimic joints move with their leaders: a variation of the leader is one of both.
VectorXd folded(const Model& model, VectorXd slope) {
  for (const Mimic& mimic : model.mimics) {
    slope[mimic.leader_v] += mimic.multiplier * slope[mimic.follower_v];
    slope[mimic.follower_v] = 0;
  }
  return slope;
}

VectorXd positions(const Simulation& simulation) {
  return Eigen::Map<const VectorXd>(simulation.positions().data(), static_cast<Eigen::Index>(simulation.positions().size()));
}

/// Steps a while and looks at the equation at a few places along the way, where three positions in a row are known.
void check_trajectory(Model model, double spread) {
  CAPTURE(model.names.model);
  const reference::PlainTree tree = reference::plain_tree(model);
  Simulation simulation(std::move(model), {.step = kStep});
  random_start(simulation, 7, spread);
  for (int look = 0; look < 3; ++look) {
    const VectorXd q0 = positions(simulation);
    run(simulation, 1);
    const VectorXd q1 = positions(simulation);
    const VectorXd p1 =
        Eigen::Map<const VectorXd>(simulation.momenta().data(), static_cast<Eigen::Index>(simulation.momenta().size()));
    run(simulation, 1);
    const VectorXd q2 = positions(simulation);

    const VectorXd end = folded(simulation.model(), reference::action_slope_at_end(tree, q0, q1, kStep, kGravity));
    const VectorXd begin = folded(simulation.model(), reference::action_slope_at_begin(tree, q1, q2, kStep, kGravity));
    REQUIRE(p1.norm() > 0);
    CHECK((end + begin).norm() < 1e-9 * p1.norm());
    CHECK((end - p1).norm() < 1e-9 * p1.norm());
    const VectorXd literal =
        reference::del_residual<double>(tree, q0, q1, q2, VectorXd::Zero(tree.velocities), kStep, kGravity);
    CHECK(folded(simulation.model(), literal).norm() < 1e-9 * p1.norm());
    run(simulation, 50);
  }
}

TEST_CASE("the discrete action is stationary along trajectories of random trees with all joint kinds") {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) check_trajectory(random_tree({.bodies = 15, .seed = seed}), 0.5);
  check_trajectory(ball_chain(10), 0.3);
  check_trajectory(chain(20), 0.3);
}

TEST_CASE("the discrete action is stationary along trajectories of every robot, fixed and floating") {
  for (const std::string& file : tree_robots()) {
    check_trajectory(load_urdf(file, Base::fixed), 0.3);
    check_trajectory(load_urdf(file, Base::floating), 0.3);
  }
}

}  // namespace
}  // namespace linden::trajectory_test

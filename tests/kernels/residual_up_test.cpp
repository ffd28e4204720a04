#include "kernels/tree/residual_up.hpp"

#include <catch2/catch.hpp>

#include "kernels/tree/gravity.hpp"
#include "tests/kernels/rig.hpp"
#include "tests/reference/del_literal.hpp"
#include "tests/reference/discrete_action_plain.hpp"

namespace linden::residual_up_test {
namespace {

const auto kernel = make_kernel(
    [](auto& rig) {
      find_residual(rig);
      find_momenta(rig);
    },
    [](auto& rig) {
      rig.result(0) = residual_up(rig.tree, rig.constants, rig.work.placement, rig.work.momentum_target,
                                  rig.work.impulse, rig.work.residual);
    },
    {"residual", "result"}, {"impulse"});

/// Three positions, the first two a step of `turn` apart, the last two another.
struct Path {
  VectorXd before, now, next, delta;

  Path(const PlainTree& tree, std::uint64_t seed, double turn) {
    const Instance first = random_instance(tree, seed, turn);
    before = first.q;
    now = reference::advanced(tree, before, first.delta);
    Random random(seed + 1000);
    delta = random_instance(tree, seed, turn).delta;
    // another direction, cut back until no body turns further than `turn`
    for (double& x : delta) x *= random.uniform(-1, 1);
    while (largest_turn(tree, now, delta) > turn) delta *= 0.9;
    next = reference::advanced(tree, now, delta);
  }
};

const Eigen::Vector3d kGravity(1.5, -2, -9.81);

TEST_CASE("h r without a target is the derivative of the discrete action by the step's begin, brute force") {
  double worst = 0;
  for (const Model& model : mixed_trees()) {
    const PlainTree tree = reference::plain_tree(model);
    for (const double turn : {1e-2, 0.5, 2.0, 2.8}) {
      const Instance instance = random_instance(tree, 3, turn);
      Rig<double> rig(model);
      rig.set(instance);
      fill(rig.state.p, VectorXd::Zero(tree.velocities));
      fill(rig.work.force, VectorXd::Zero(tree.velocities));
      find_residual(rig);
      const double h = rig.h;
      const VectorXd next = reference::advanced(tree, instance.q, instance.delta);
      const VectorXd slope = reference::action_slope_at_begin(tree, instance.q, next, h, Eigen::Vector3d::Zero());
      see(worst, relative_error(vector(rig.work.residual), -h * slope));
    }
  }
  INFO("worst relative error: " << worst);
  CHECK(worst < 1e-12);
}

TEST_CASE(
    "h r is that of the paper's two-step equation, brute force and by its Algorithm 2, for small and large steps") {
  double worst_action = 0, worst_literal = 0;
  for (const Model& model : mixed_trees()) {
    const PlainTree tree = reference::plain_tree(model);
    for (const double turn : {1e-2, 0.5, 2.0, 2.8}) {
      const Path path(tree, 17, turn);
      Rig<double> rig(model);
      const double h = rig.h;
      // p^k = D2 L_d of the step before, its half of the potential included
      const VectorXd p = reference::action_slope_at_end(tree, path.before, path.now, h, kGravity);
      fill(rig.state.q, path.now);
      fill(rig.state.p, p);
      fill(rig.work.delta, path.delta);
      place(rig);
      gravity_field_down(rig.tree, rig.work.placement, vec3(kGravity), rig.work.field);
      gravity_force_up(rig.tree, rig.constants, rig.work.placement, rig.work.field, rig.work.first_moment,
                       rig.work.force);
      find_residual(rig);
      const VectorXd residual = vector(rig.work.residual);
      const VectorXd sum = p + reference::action_slope_at_begin(tree, path.now, path.next, h, kGravity);
      const VectorXd literal = reference::del_residual<double>(tree, path.before, path.now, path.next,
                                                               VectorXd::Zero(tree.velocities), h, kGravity);
      see(worst_action, (residual + h * sum).norm() / (h * p.norm()));
      see(worst_literal, (residual - h * literal).norm() / (h * p.norm()));
    }
  }
  INFO("worst difference in units of h p: from the action " << worst_action << ", from Algorithm 2 " << worst_literal);
  CHECK(worst_action < 1e-12);
  CHECK(worst_literal < 1e-12);
}

TEST_CASE("a body that coasts at constant velocity leaves no residual") {
  // a free body that neither turns nor is forced: h p = m delta
  const Model model = random_tree({.bodies = 1, .seed = 5, .screws = false, .balls = false});
  const PlainTree tree = reference::plain_tree(model);
  Rig<double> rig(model);
  Instance instance = random_instance(tree, 1, 0.1);
  instance.delta << 0, 0, 0, 1, 2, 3;
  instance.p = tree.body(1).G * instance.delta / rig.h;
  instance.force.setZero();
  rig.set(instance);
  find_residual(rig);
  kernel.prepare(rig);
  kernel.run(rig);
  CHECK(vector(rig.work.residual).norm() < 8 * kEpsilon * rig.h * instance.p.norm());
}

TEST_CASE("residual_up returns the paper's norm squared") {
  for (const Model& model : mixed_trees()) {
    Rig<double> rig(model);
    rig.set(random_instance(reference::plain_tree(model), 3, 0.5));
    kernel.prepare(rig);
    kernel.run(rig);
    CHECK(rig.result(0) == Approx(vector(rig.work.residual).squaredNorm()).epsilon(1e-14));
  }
}

TEST_CASE("residual_up writes every residual and nothing else") { check_writes(kernel, {"impulse"}); }
TEST_CASE("residual_up allocates nothing") { check_allocates_nothing(kernel); }
TEST_CASE("residual_up gives equal bits in every lane") { check_lanes(kernel); }

}  // namespace
}  // namespace linden::residual_up_test

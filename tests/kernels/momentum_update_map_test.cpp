#include "kernels/tree/momentum_update_map.hpp"

#include <catch2/catch.hpp>

#include "kernels/tree/advance_map.hpp"
#include "tests/kernels/rig.hpp"
#include "tests/reference/discrete_action_plain.hpp"

namespace linden::momentum_update_map_test {
namespace {

const auto target = make_kernel(
    [](auto&) {},
    [](auto& rig) { momentum_target_map(rig.tree, rig.h, rig.state.p, rig.work.force, rig.work.momentum_target); },
    {"momentum_target"});

const auto update = make_kernel([](auto& rig) { find_residual(rig); },
                                [](auto& rig) {
                                  momentum_update_map(rig.tree, rig.constants, rig.h, rig.work.displacement,
                                                      rig.work.impulse, rig.work.residual, rig.work.force, rig.state.p);
                                },
                                {"p"});

/// From a displacement to the momentum at its end, without forces; leaves q at the end of the step.
void finish(Rig<double>& rig) {
  fill(rig.work.force, VectorXd::Zero(rig.tree.shape.velocities));
  find_residual(rig);
  advance_map(rig.tree, rig.work.motion, rig.work.delta, rig.state.q);
  placement_map(rig.tree, rig.constants, rig.state.q, rig.work.placement);
  momentum_update_map(rig.tree, rig.constants, rig.h, rig.work.displacement, rig.work.impulse, rig.work.residual,
                      rig.work.force, rig.state.p);
}

TEST_CASE("the target is h (p + h/2 Q), and the update (S^T Ad_dT^T F - C r) / h + h/2 Q") {
  double worst = 0;
  for (const Model& model : mixed_trees()) {
    const PlainTree tree = reference::plain_tree(model);
    const Instance instance = random_instance(tree, 5, 1.0);
    Rig<double> rig(model);
    rig.set(instance);
    const double h = rig.h;
    target.run(rig);
    const VectorXd expected = h * (instance.p + h / 2 * instance.force);
    see(worst, relative_error(vector(rig.work.momentum_target), expected));

    update.prepare(rig);
    update.run(rig);
    VectorXd p(tree.velocities);
    const VectorXd residual = vector(rig.work.residual);
    for (Index i = 1; i < tree.slots(); ++i) {
      const PlainBody& body = tree.body(i);
      const auto Ad = reference::adjoint<double>(row<Displacement>(rig.work.displacement, i));
      p.segment(body.v, body.dofs()) = body.S.transpose() * Ad.transpose() * row<Wrench>(rig.work.impulse, i);
      if (body.kind == JointKind::screw) {
        p[body.v] -= residual[body.v];
        continue;
      }
      // the rows of S^T Ad_dT^T S: all of it for a free joint, the turn alone for a ball
      p.segment(body.v, body.dofs()) -=
          body.S.transpose() * Ad.transpose() * body.S * residual.segment(body.v, body.dofs());
    }
    see(worst, relative_error(vector(rig.state.p), p / h + h / 2 * instance.force));
  }
  INFO("worst relative error: " << worst / kEpsilon << " epsilon");
  CHECK(worst < 64 * kEpsilon);
}

TEST_CASE("the update in two halves is the update") {
  for (const Model& model : mixed_trees()) {
    Rig<double> rig(model);
    rig.set(random_instance(reference::plain_tree(model), 5, 1.0));
    update.prepare(rig);
    update.run(rig);
    const VectorXd at_once = vector(rig.state.p);
    const Slots all = all_slots(rig.tree);
    momentum_at_end_map(rig.tree, rig.constants, rig.work.displacement, rig.work.impulse, rig.work.residual, all, rig.work.increment);
    momentum_end_map(rig.tree, rig.h, rig.work.increment, rig.work.force, all, rig.state.p);
    INFO(model.names.model);
    CHECK(relative_error(vector(rig.state.p), at_once) < 1e-13);
  }
}

TEST_CASE("the momentum at the end of a solved step is the derivative of the discrete action by its end") {
  double worst = 0;
  for (const Model& model : mixed_trees()) {
    const PlainTree tree = reference::plain_tree(model);
    for (const double turn : {1e-2, 0.5, 2.0, 2.8}) {
      Instance instance = random_instance(tree, 5, turn);
      const VectorXd next = reference::advanced(tree, instance.q, instance.delta);
      const Eigen::Vector3d none = Eigen::Vector3d::Zero();
      Rig<double> rig(model);
      // the momentum that makes this displacement the solution
      const double h = rig.h;
      instance.p = -reference::action_slope_at_begin(tree, instance.q, next, h, none);
      rig.set(instance);
      finish(rig);
      CHECK(vector(rig.work.residual).norm() < 1e-12 * h * instance.p.norm());
      see(worst, relative_error(vector(rig.state.p), reference::action_slope_at_end(tree, instance.q, next, h, none)));
    }
  }
  INFO("worst relative error: " << worst);
  CHECK(worst < 1e-12);
}

TEST_CASE("a free rigid body's momentum is carried on exactly by any displacement, solved for or not") {
  const Model model = random_tree({.bodies = 1, .seed = 3, .screws = false, .balls = false});
  const PlainTree tree = reference::plain_tree(model);
  double worst = 0;
  for (const double turn : {1e-3, 0.5, 2.0, 3.0}) {
    const Instance instance = random_instance(tree, 6, turn);
    Rig<double> rig(model);
    rig.set(instance);
    finish(rig);
    CHECK(vector(rig.work.residual).norm() > 1e-3);
    // p is given in the body's frame: at the end of the step it is seen from there
    const VectorXd expected =
        reference::adjoint<double>(row<Displacement>(rig.work.displacement, 1)).transpose() * instance.p;
    see(worst, relative_error(vector(rig.state.p), expected));
  }
  INFO("worst relative error: " << worst / kEpsilon << " epsilon");
  CHECK(worst < 64 * kEpsilon);
}

/// Momentum about the world's origin: a free root's p feels the whole of its tree.
reference::Vector6<double> root_momentum(const Rig<double>& rig) {
  const auto X = row<Placement>(rig.work.placement, 1);
  return reference::adjoint<double>(reference::inverse<double>(X)).transpose() * vector(rig.state.p).head<6>();
}

TEST_CASE("a free body's and a floating tree's momentum survive 1,000 steps that are barely solved") {
  for (const Index bodies : {1, 5}) {
    const Model model = random_tree({.bodies = bodies, .seed = 4, .frees = false, .floating = true});
    const PlainTree tree = reference::plain_tree(model);
    Rig<double> rig(model);
    Instance instance = random_instance(tree, 6, 0.05);
    const VectorXd next = reference::advanced(tree, instance.q, instance.delta);
    instance.p = -reference::action_slope_at_begin(tree, instance.q, next, rig.h, Eigen::Vector3d::Zero());
    instance.force.setZero();
    rig.set(instance);
    factor_mass(rig);
    const reference::Vector6<double> before = root_momentum(rig);
    double worst = 0, largest_residual = 0;
    for (int step = 0; step < 1000; ++step) {
      // one correction from a poor guess
      momentum_target_map(rig.tree, rig.h, rig.state.p, rig.work.force, rig.work.momentum_target);
      factor_mass(rig);
      pass_up(rig, rig.work.momentum_target);
      pass_down_mass(rig);
      for (Index row = 0; row < tree.velocities; ++row) rig.work.delta(row) = 0.98 * rig.work.increment(row);
      factor_newton(rig);
      find_residual(rig);
      pass_up(rig, rig.work.residual);
      pass_down_newton(rig);
      correct_motion_map(rig.tree, rig.constants, rig.work.increment, 1.0, rig.work.delta, rig.work.motion);
      displacement_map(rig.tree, rig.work.motion, rig.work.delta);
      finish(rig);
      see(largest_residual, vector(rig.work.residual).norm() / vector(rig.work.momentum_target).norm());
      see(worst, relative_error(root_momentum(rig), before));
    }
    INFO(bodies << " bodies: worst drift of momentum " << worst << ", largest relative residual " << largest_residual);
    CHECK(largest_residual > 1e-7);
    CHECK(worst < 1e-12);
  }
}

TEST_CASE("momenta that nothing changes stay within two epsilons over 80,000 steps, whatever the step") {
  const Model model = random_tree({.bodies = 12, .seed = 3});
  Rig<double> rig(model);
  rig.set(random_instance(reference::plain_tree(model), 5, 1.0));
  fill(rig.work.force, VectorXd::Zero(rig.tree.shape.velocities));
  fill(rig.work.residual, VectorXd::Zero(rig.tree.shape.velocities));
  // what is handed from one step to the next alone: bodies that do not turn, whose targets are their impulses
  for (Index i = 1; i < rig.tree.shape.slots; ++i) {
    for (int k = 0; k < 7; ++k) rig.work.displacement(i, k) = k == 3 ? 1 : 0;
    for (int k = 0; k < 6; ++k) rig.work.impulse(i, k) = 0;
  }
  for (const double h : {1e-3, 3e-3, 1e-4, 7e-7}) {
    const VectorXd start = vector(rig.state.p);
    for (int step = 0; step < 80'000; ++step) {
      momentum_target_map(rig.tree, h, rig.state.p, rig.work.force, rig.work.momentum_target);
      for (Index i = 1; i < rig.tree.shape.slots; ++i) {
        const Index row = rig.tree.first_v(i);
        const auto rows = [&](Index k) { return rig.work.momentum_target(row + k); };
        switch (rig.tree.kind(i)) {
          case JointKind::screw: {
            const double r = rig.constants.screw(i, 0), t = rig.constants.screw(i, 1);
            rig.work.impulse(i, r != 0 ? 2 : 5) = rows(0) / (r != 0 ? r : t);
            break;
          }
          case JointKind::ball:
            for (int k = 0; k < 3; ++k) rig.work.impulse(i, k) = rows(k);
            break;
          case JointKind::free:
            for (int k = 0; k < 6; ++k) rig.work.impulse(i, k) = rows(k);
        }
      }
      momentum_update_map(rig.tree, rig.constants, h, rig.work.displacement, rig.work.impulse, rig.work.residual, rig.work.force,
                          rig.state.p);
    }
    CAPTURE(h);
    for (Index row = 0; row < rig.tree.shape.velocities; ++row) {
      CHECK(std::abs(rig.state.p(row) - start[row]) <= 2 * std::numeric_limits<double>::epsilon() * std::abs(start[row]));
    }
  }
}

TEST_CASE("the momentum maps at the ends of a step write all they are to write and nothing else") {
  check_writes(target);
  check_writes(update);
}

TEST_CASE("the momentum maps at the ends of a step allocate nothing") {
  check_allocates_nothing(target);
  check_allocates_nothing(update);
}

TEST_CASE("the momentum maps at the ends of a step give equal bits in every lane") {
  check_lanes(target);
  check_lanes(update);
}

}  // namespace
}  // namespace linden::momentum_update_map_test

#include "kernels/tree/newton_factor_up.hpp"

#include <catch2/catch.hpp>

#include "models/build/builder.hpp"
#include "tests/kernels/rig.hpp"
#include "tests/reference/dense_jacobian.hpp"
#include "tests/reference/dense_jacobian_plain.hpp"
#include "tests/reference/elimination_plain.hpp"

namespace linden::newton_factor_up_test {
namespace {

const auto kernel =
    make_kernel([](auto& rig) { find_momenta(rig); },
                [](Rig<double>& rig) {
                  newton_factor_up(rig.tree, rig.constants, rig.work.placement, rig.work.motion, rig.work.displacement, rig.work.articulated, rig.gains());
                },
                {"gain_up", "gain_down", "joint_inverse"}, {}, {"articulated"});

TEST_CASE("the kernels' Jacobian by dual numbers is that of the paper's Algorithm 2 in plain matrices") {
  double worst = 0;
  for (const Model& model : mixed_trees()) {
    const PlainTree tree = reference::plain_tree(model);
    for (const double turn : {1e-3, 0.5, 2.0}) {
      const Instance instance = random_instance(tree, 3, turn);
      Rig<double> rig(model);
      rig.set(instance);
      place(rig);
      const MatrixXd kernels = reference::dense_jacobian(model, rig.work.placement, rig.work.motion);
      const MatrixXd plain =
          reference::dense_jacobian_plain(tree, instance.q, reference::advanced(tree, instance.q, instance.delta));
      see(worst, relative_error(kernels, plain));
    }
  }
  INFO("worst relative difference: " << worst);
  CHECK(worst < 1e-12);
}

TEST_CASE("the exact factor with its two passes solves with the dense Jacobian, in small steps and in large ones") {
  double worst = 0, worst_back = 0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    std::vector<Model> models = mixed_trees();
    models.push_back(random_tree({.bodies = 16, .seed = 40 + seed, .frees = seed % 2 == 0}));
    for (const Model& model : models) {
      const PlainTree tree = reference::plain_tree(model);
      for (const double turn : {1e-3, 0.5, 2.0}) {
        const Instance instance = random_instance(tree, seed, turn);
        Rig<double> rig(model);
        rig.set(instance);
        factor_newton(rig);
        pass_up(rig, rig.right_side);
        pass_down_newton(rig);
        const MatrixXd J = reference::dense_jacobian(model, rig.work.placement, rig.work.motion);
        const VectorXd found = vector(rig.work.increment), expected = dense_solve(J, instance.right_side);
        see(worst, relative_error(found, expected));
        see(worst_back, (J * found - instance.right_side).norm() / (J.norm() * found.norm()));
      }
    }
  }
  INFO("worst relative error of the solution: " << worst << ", of the equation: " << worst_back);
  CHECK(worst < 1e-10);
  CHECK(worst_back < 1e-13);
}

TEST_CASE("d of every joint is the pivot of the dense Jacobian's elimination, leaves first") {
  double worst = 0;
  for (const Model& model : mixed_trees()) {
    const PlainTree tree = reference::plain_tree(model);
    const Instance instance = random_instance(tree, 5, 1.0);
    Rig<double> rig(model);
    rig.set(instance);
    factor_newton(rig);
    const MatrixXd J = reference::dense_jacobian(model, rig.work.placement, rig.work.motion);
    const auto dense = reference::eliminate(tree, J, instance.right_side);
    for (Index i = 1; i < tree.slots(); ++i) {
      const Index n = tree.body(i).dofs(), block = model.tree.first_block(i);
      MatrixXd inverse(n, n);
      for (Index k = 0; k < n * n; ++k) inverse(k / n, k % n) = rig.work.joint_inverse(block + k);
      see(worst, (inverse * dense.pivot[static_cast<std::size_t>(i)] - MatrixXd::Identity(n, n)).norm());
    }
  }
  INFO("worst difference of d^-1 d from 1: " << worst);
  CHECK(worst < 1e-10);
}

TEST_CASE("Newton's method converges quadratically: a tenth of the error leaves a hundredth of it") {
  for (const Model& model : mixed_trees()) {
    const PlainTree tree = reference::plain_tree(model);
    const Instance solution = random_instance(tree, 6, 1.0);
    Rig<double> rig(model);
    rig.set(solution);
    find_residual(rig);
    // the target that makes this displacement the solution
    fill(rig.state.p, solution.p + vector(rig.work.residual) / rig.h);
    const auto residual_after_one = [&](double off) {
      fill(rig.work.delta, solution.delta);
      place(rig);
      Field<double> error = rig.right_side;
      for (double& x : error.flat()) x *= off;
      correct_motion_map(rig.tree, rig.constants, error, 1.0, rig.work.delta, rig.work.motion);
      double norm = 0;
      for (int pass = 0; pass < 2; ++pass) {
        displacement_down(rig.tree, rig.work.placement, rig.work.motion, rig.work.displacement);
        momentum_map(rig.tree, rig.constants, rig.work.displacement,
                     rig.work.impulse);
        momentum_target_map(rig.tree, rig.h, rig.state.p, rig.work.force, rig.work.momentum_target);
        norm = residual_up(rig.tree, rig.constants, rig.work.placement, rig.work.momentum_target, rig.work.impulse,
                           rig.work.residual);
        newton_factor_up(rig.tree, rig.constants, rig.work.placement, rig.work.motion, rig.work.displacement, rig.work.articulated, rig.gains());
        pass_up(rig, rig.work.residual);
        pass_down_newton(rig);
        correct_motion_map(rig.tree, rig.constants, rig.work.increment, 1.0, rig.work.delta, rig.work.motion);
      }
      return std::sqrt(norm);
    };
    const double coarse = residual_after_one(1e-3), fine = residual_after_one(1e-4);
    INFO(model.names.model << ": " << coarse << " after an error of 1e-3, " << fine << " after 1e-4");
    CHECK(fine < coarse / 50);
    CHECK(fine > coarse / 200);
  }
}

TEST_CASE("a hinge turns by its axis inertia alone however far it turns, a ball of equal inertias by dlog") {
  LinkSpec link;
  link.name = link.joint = "wheel";
  link.inertia.mass = 1;
  link.inertia.about_center = 3 * Eigen::Matrix3d::Identity();
  const auto factored = [&](JointType type, const VectorXd& q, const VectorXd& delta) {
    link.type = type;
    const Model model = TreeBuilder("wheel").add(link).build();
    Rig<double> rig(model);
    fill(rig.state.q, q);
    fill(rig.work.delta, delta);
    factor_newton(rig);
    return vector(rig.work.joint_inverse);
  };
  for (const double turn : {0.0, 1e-6, 1.0, 3.0}) {
    CHECK(factored(JointType::revolute, VectorXd::Zero(1), VectorXd::Constant(1, turn))[0] ==
          Approx(1.0 / 3).epsilon(1e-13));
  }
  // h mu = 3 w, w changes by dlog_-w eta: d = 3 dlog_-w
  const Eigen::Vector3d w(0.6, -1.2, 1);
  const VectorXd inverse = factored(JointType::ball, Eigen::Vector4d(0, 0, 0, 1), w);
  const Eigen::Matrix3d found = inverse.reshaped(3, 3).transpose();
  const Eigen::Matrix3d d = 3 * reference::bernoulli_series<double, 3>(-reference::hat<double>(w));
  CHECK((found * d - Eigen::Matrix3d::Identity()).norm() < 1e-13);
}

TEST_CASE("a tree gone through in parts is the tree gone through at once") {
  for (const Model& model : {random_tree({.bodies = 41, .seed = 9}), chain(40), balanced_tree(40)}) {
    Rig<double> rig(model);
    rig.set(random_instance(reference::plain_tree(model), 3, 0.1));
    place(rig);
    Rig<double> parts = rig;
    const Tree& tree = model.tree;
    const auto down = [&](Rig<double>& at, Slots slots) {
      displacement_down(tree, at.work.placement, at.work.motion, slots, at.work.displacement);
      momentum_map(tree, at.constants, at.work.displacement, slots, at.work.impulse);
    };
    const auto up = [&](Rig<double>& at, Slots slots) {
      newton_factor_up(tree, at.constants, at.work.placement, at.work.motion, at.work.displacement, slots, at.work.articulated,
                       at.gains());
      innovation_up(tree, at.constants, slots, at.work);
    };
    const auto solve = [&](Rig<double>& at, Slots slots) {
      increment_down(tree, at.constants, at.work.placement, at.work.motion, at.gains(), at.work.innovation, slots,
                     at.work.variation, at.work.increment);
      correct_motion_map(tree, at.constants, at.work.increment, 1e-3, slots, at.work.delta, at.work.motion);
    };
    for (Rig<double>* at : {&rig, &parts}) momentum_target_map(tree, at->h, at->state.p, at->work.force, at->work.momentum_target);
    down(rig, all_slots(tree));
    up(rig, all_slots(tree));
    solve(rig, all_slots(tree));
    // 11 bodies a part: neither a level nor a register
    constexpr Index kPart = 11;
    const Index end = tree.shape.slots;
    for (Index i = 1; i < end; i += kPart) down(parts, {i, std::min(i + kPart, end)});
    for (Index i = end; i > 1; i = std::max<Index>(1, i - kPart)) up(parts, {std::max<Index>(1, i - kPart), i});
    for (Index i = 1; i < end; i += kPart) solve(parts, {i, std::min(i + kPart, end)});
    INFO(model.names.model);
    const double scale = vector(rig.work.increment).norm();
    CHECK((vector(parts.work.innovation) - vector(rig.work.innovation)).norm() <= 1e-12 * vector(rig.work.innovation).norm());
    CHECK((vector(parts.work.increment) - vector(rig.work.increment)).norm() <= 1e-10 * scale);
    CHECK(relative_error(vector(parts.work.delta), vector(rig.work.delta)) < 1e-12);
  }
}

TEST_CASE("newton_factor_up writes all it is to write and nothing else") {
  check_writes(kernel);
}

TEST_CASE("newton_factor_up allocates nothing") { check_allocates_nothing_as<double>(kernel); }

}  // namespace
}  // namespace linden::newton_factor_up_test

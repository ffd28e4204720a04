#include "kernels/tree/articulated_inertia_up.hpp"

#include <catch2/catch.hpp>

#include "kernels/tree/velocity_down.hpp"
#include "models/build/builder.hpp"
#include "tests/kernels/rig.hpp"
#include "tests/reference/elimination_plain.hpp"
#include "tests/reference/mass_matrix_plain.hpp"

namespace linden::articulated_inertia_up_test {
namespace {

const auto kernel = make_kernel([](auto& rig) { place(rig); },
                                [](auto& rig) {
                                  articulated_inertia_up(rig.tree, rig.constants, rig.work.placement,
                                                         rig.work.articulated, rig.gains());
                                },
                                {"gain_up", "gain_down", "joint_inverse"}, {}, {"articulated"});

TEST_CASE("the factor of M with its two passes is the inverse of the mass matrix of body Jacobians") {
  double worst = 0;
  for_mixed_instances([&](const PlainTree& tree, const Instance& instance, Rig<double>& rig) {
    factor_mass(rig);
    pass_up(rig, rig.right_side);
    pass_down_mass(rig);
    const VectorXd expected = dense_solve(reference::mass_matrix(tree, instance.q), instance.right_side);
    see(worst, relative_error(vector(rig.work.increment), expected));
  });
  INFO("worst relative error: " << worst);
  CHECK(worst < 1e-11);
}

TEST_CASE("d of every joint is the pivot of dense elimination, leaves first") {
  double worst = 0;
  for (const Model& model : mixed_trees()) {
    const PlainTree tree = reference::plain_tree(model);
    const Instance instance = random_instance(tree, 5, 0.1);
    Rig<double> rig(model);
    rig.set(instance);
    factor_mass(rig);
    const auto dense = reference::eliminate(tree, reference::mass_matrix(tree, instance.q), instance.right_side);
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

TEST_CASE("an articulated inertia is symmetric, and that of a leaf is the body's own") {
  for (const Model& model : mixed_trees()) {
    const PlainTree tree = reference::plain_tree(model);
    Rig<double> rig(model);
    rig.set(random_instance(tree, 5, 0.1));
    factor_mass(rig);
    for (Index i = 1; i < tree.slots(); ++i) {
      const reference::Matrix6<double> A = eigen(Mat6<double>::from(rig.work.articulated.row(i)));
      CHECK((A - A.transpose()).norm() < 1e-13 * A.norm());
      bool leaf = true;
      for (Index c = i + 1; c < tree.slots(); ++c) leaf = leaf && tree.body(c).parent != i;
      if (leaf) CHECK(A == tree.body(i).G);
    }
  }
}

TEST_CASE("a cart that carries a pendulum feels the textbook's mass") {
  // slide along x, then a hinge about y; bob of mass 2 at distance 0.5 below, cart of mass 3
  LinkSpec cart;
  cart.name = cart.joint = "cart";
  cart.type = JointType::prismatic;
  cart.axis = Eigen::Vector3d::UnitX();
  cart.inertia = sphere_inertia(3, 0.1, Eigen::Vector3d::Zero());
  LinkSpec bob;
  bob.name = bob.joint = "bob";
  bob.parent = "cart";
  bob.axis = Eigen::Vector3d::UnitY();
  bob.inertia.mass = 2;
  bob.inertia.center = Eigen::Vector3d(0, 0, -0.5);
  const Model model = TreeBuilder("cart").add(cart).add(bob).build();
  for (const double angle : {0.0, 0.4, 1.5}) {
    Rig<double> rig(model);
    fill(rig.state.q, Eigen::Vector2d(0.3, angle));
    fill(rig.work.delta, Eigen::Vector2d::Zero());
    factor_mass(rig);
    const double coupling = 2 * 0.5 * std::cos(angle), turning = 2 * 0.25;
    CHECK(1 / rig.work.joint_inverse(1) == Approx(turning).epsilon(1e-14));
    CHECK(1 / rig.work.joint_inverse(0) == Approx(5 - coupling * coupling / turning).epsilon(1e-14));
  }
}

TEST_CASE("M applied by velocities and M^-1 by the factor cancel on chains of 300 links") {
  for (const Model& model : {chain(300), ball_chain(300), balanced_tree(300)}) {
    const PlainTree tree = reference::plain_tree(model);
    Rig<double> rig(model);
    rig.set(random_instance(tree, 2, 1e-4));
    factor_mass(rig);
    pass_up(rig, rig.right_side);
    pass_down_mass(rig);
    velocity_down(rig.tree, rig.constants, rig.work.placement, rig.work.increment, rig.work.twist);
    momentum_of_map(rig.tree, rig.constants, rig.work.twist, rig.work.impulse);
    impulse_up(rig.tree, rig.constants, rig.work.placement, rig.work.impulse, rig.work.residual);
    const double error = relative_error(vector(rig.work.residual), vector(rig.right_side));
    INFO(model.names.model << ": relative error of M M^-1 r: " << error);
    CHECK(error < 1e-8);  // rounding along 300 joints: 3e-10 to 3e-9, by compiler
  }
}

TEST_CASE("articulated_inertia_up writes all it is to write and nothing else") {
  check_writes(kernel);
}
TEST_CASE("articulated_inertia_up allocates nothing") { check_allocates_nothing(kernel); }
TEST_CASE("articulated_inertia_up gives equal bits in every lane") { check_lanes(kernel); }

}  // namespace
}  // namespace linden::articulated_inertia_up_test

#include "kernels/tree/velocity_down.hpp"

#include <catch2/catch.hpp>

#include "models/build/builder.hpp"
#include "tests/kernels/rig.hpp"
#include "tests/reference/coriolis_plain.hpp"

namespace linden::velocity_down_test {
namespace {

const auto velocities = make_kernel(
    [](auto& rig) { place(rig); },
    [](auto& rig) { velocity_down(rig.tree, rig.constants, rig.work.placement, rig.rate, rig.work.twist); }, {"twist"});

const auto momenta = make_kernel(
    [](auto& rig) {
      place(rig);
      velocities.run(rig);
    },
    [](auto& rig) { momentum_of_map(rig.tree, rig.constants, rig.work.twist, rig.work.impulse); }, {"impulse"});

const auto coriolis = make_kernel(
    [](auto& rig) {
      place(rig);
      velocities.run(rig);
    },
    [](auto& rig) {
      coriolis_down(rig.tree, rig.constants, rig.work.placement, rig.rate, rig.work.twist, rig.work.bias,
                    rig.work.impulse);
    },
    {"bias", "impulse"});

TEST_CASE("velocity_down is the Jacobian of every body times the rates") {
  double worst = 0;
  for (const Model& model : mixed_trees()) {
    const PlainTree tree = reference::plain_tree(model);
    const Instance instance = random_instance(tree, 2, 0.1);
    Rig<double> rig(model);
    rig.set(instance);
    velocities.prepare(rig);
    velocities.run(rig);
    const auto pose = reference::poses(tree, instance.q);
    CHECK(row<Twist>(rig.work.twist, 0).isZero(0));
    for (Index i = 1; i < tree.slots(); ++i) {
      const VectorXd V = reference::body_jacobian<double>(tree, pose, i) * instance.rate;
      see(worst, relative_error(row<Twist>(rig.work.twist, i), V));
    }
  }
  INFO("worst relative error: " << worst);
  CHECK(worst < 1e-14);
}

TEST_CASE("velocities, momenta and impulse_up make M v") {
  double worst = 0;
  for (const Model& model : mixed_trees()) {
    const PlainTree tree = reference::plain_tree(model);
    const Instance instance = random_instance(tree, 2, 0.1);
    Rig<double> rig(model);
    rig.set(instance);
    momenta.prepare(rig);
    momenta.run(rig);
    impulse_up(rig.tree, rig.constants, rig.work.placement, rig.work.impulse, rig.work.residual);
    see(worst, relative_error(vector(rig.work.residual), reference::mass_matrix(tree, instance.q) * instance.rate));
  }
  INFO("worst relative error: " << worst);
  CHECK(worst < 1e-13);
}

TEST_CASE("coriolis_down and impulse_up make the Coriolis force of the kinetic energy's derivatives") {
  double worst = 0;
  for (const Model& model : mixed_trees()) {
    const PlainTree tree = reference::plain_tree(model);
    const Instance instance = random_instance(tree, 2, 0.1);
    Rig<double> rig(model);
    rig.set(instance);
    coriolis.prepare(rig);
    coriolis.run(rig);
    impulse_up(rig.tree, rig.constants, rig.work.placement, rig.work.impulse, rig.work.residual);
    see(worst, relative_error(vector(rig.work.residual), reference::coriolis_force(tree, instance.q, instance.rate)));
  }
  INFO("worst relative error: " << worst);
  CHECK(worst < 1e-12);
}

TEST_CASE("accelerations are the derivatives of the bodies' twists when all rates stay as they are") {
  double worst = 0;
  for (const Model& model : mixed_trees()) {
    const PlainTree tree = reference::plain_tree(model);
    const Instance instance = random_instance(tree, 2, 0.1);
    Rig<double> rig(model);
    rig.set(instance);
    coriolis.prepare(rig);
    coriolis.run(rig);
    using Time = reference::Dual<1>;
    const reference::VectorX<Time> along = instance.rate.cast<Time>() * Time(0.0, 0);
    const auto pose = reference::poses<Time>(tree, instance.q, along);
    for (Index i = 1; i < tree.slots(); ++i) {
      const reference::Vector6<Time> V = reference::body_jacobian<Time>(tree, pose, i) * instance.rate.cast<Time>();
      reference::Vector6<double> a;
      for (int k = 0; k < 6; ++k) a[k] = V[k].slope[0];
      see(worst, (row<Twist>(rig.work.bias, i) - a).norm() / std::max(1.0, a.norm()));
    }
  }
  INFO("worst error: " << worst);
  CHECK(worst < 1e-13);
}

TEST_CASE("a spinning ball joint feels w x I w") {
  LinkSpec link;
  link.name = link.joint = "top";
  link.type = JointType::ball;
  link.inertia.mass = 1;
  link.inertia.about_center = Eigen::Vector3d(2, 3, 4).asDiagonal();
  const Model model = TreeBuilder("top").add(link).build();
  Rig<double> rig(model);
  Instance instance = random_instance(reference::plain_tree(model), 1, 0.1);
  instance.rate << 1, 2, 3;
  rig.set(instance);
  coriolis.prepare(rig);
  coriolis.run(rig);
  // (1 2 3) x (2 6 12)
  CHECK((rig.work.impulse(1, 0) == 6 && rig.work.impulse(1, 1) == -6 && rig.work.impulse(1, 2) == 2));
  momentum_of_map(rig.tree, rig.constants, rig.work.twist, rig.work.impulse);
  CHECK((rig.work.impulse(1, 0) == 2 && rig.work.impulse(1, 1) == 6 && rig.work.impulse(1, 2) == 12));
}

TEST_CASE("the velocity sweeps write all they are to write and nothing else") {
  check_writes(velocities, {"twist"});
  check_writes(momenta);
  check_writes(coriolis, {"bias"});
}

TEST_CASE("the velocity sweeps allocate nothing") {
  check_allocates_nothing(velocities);
  check_allocates_nothing(momenta);
  check_allocates_nothing(coriolis);
}

TEST_CASE("the velocity sweeps give equal bits in every lane") {
  check_lanes(velocities);
  check_lanes(momenta);
  check_lanes(coriolis);
}

}  // namespace
}  // namespace linden::velocity_down_test

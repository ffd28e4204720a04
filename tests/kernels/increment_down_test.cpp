#include "kernels/tree/increment_down.hpp"

#include <catch2/catch.hpp>

#include "models/build/builder.hpp"
#include "tests/kernels/rig.hpp"
#include "tests/reference/dense_jacobian.hpp"
#include "tests/reference/mass_matrix_plain.hpp"

namespace linden::increment_down_test {
namespace {

const auto newton = make_kernel(
    [](auto& rig) {
      factor_newton(rig);
      pass_up(rig, rig.right_side);
    },
    [](auto& rig) { pass_down_newton(rig); }, {"variation", "increment"});

const auto mass = make_kernel(
    [](auto& rig) {
      factor_mass(rig);
      pass_up(rig, rig.right_side);
    },
    [](auto& rig) { pass_down_mass(rig); }, {"variation", "increment"});

TEST_CASE("the increments of both passes solve the dense equations") {
  double worst_newton = 0, worst_mass = 0;
  for (const Model& model : mixed_trees()) {
    const PlainTree tree = reference::plain_tree(model);
    for (const double turn : {1e-3, 0.5, 2.0}) {
      const Instance instance = random_instance(tree, 8, turn);
      Rig<double> rig(model);
      rig.set(instance);
      newton.prepare(rig);
      newton.run(rig);
      const MatrixXd J = reference::dense_jacobian(model, rig.work.placement, rig.work.motion);
      see(worst_newton, relative_error(vector(rig.work.increment), dense_solve(J, instance.right_side)));
      mass.prepare(rig);
      mass.run(rig);
      const MatrixXd M = reference::mass_matrix(tree, instance.q);
      see(worst_mass, relative_error(vector(rig.work.increment), dense_solve(M, instance.right_side)));
    }
  }
  INFO("worst relative error with the Jacobian: " << worst_newton << ", with M: " << worst_mass);
  CHECK(worst_newton < 1e-10);
  CHECK(worst_mass < 1e-11);
}

TEST_CASE("the variations are how bodies move when joints do: at the end of the step for Newton, at its begin for M") {
  double worst = 0;
  for (const Model& model : mixed_trees()) {
    const PlainTree tree = reference::plain_tree(model);
    for (const double turn : {1e-3, 2.0}) {
      const Instance instance = random_instance(tree, 8, turn);
      Rig<double> rig(model);
      rig.set(instance);
      const auto compare = [&](const VectorXd& q) {
        const auto pose = reference::poses(tree, q);
        const VectorXd increment = vector(rig.work.increment);
        for (Index i = 1; i < tree.slots(); ++i) {
          const VectorXd eta = reference::body_jacobian<double>(tree, pose, i) * increment;
          see(worst, (row<Twist>(rig.work.variation, i) - eta).norm() / increment.norm());
        }
        CHECK(row<Twist>(rig.work.variation, 0).isZero(0));
      };
      newton.prepare(rig);
      newton.run(rig);
      compare(reference::advanced(tree, instance.q, instance.delta));
      mass.prepare(rig);
      mass.run(rig);
      compare(instance.q);
    }
  }
  INFO("worst difference in units of the increment: " << worst);
  CHECK(worst < 1e-13);
}

TEST_CASE("without a step the exact increment is the rate of the mass matrix") {
  for (const Model& model : mixed_trees()) {
    Instance instance = random_instance(reference::plain_tree(model), 9, 0.1);
    instance.delta.setZero();
    Rig<double> rig(model);
    rig.set(instance);
    newton.prepare(rig);
    newton.run(rig);
    const VectorXd exact = vector(rig.work.increment);
    mass.prepare(rig);
    mass.run(rig);
    CHECK(relative_error(exact, vector(rig.work.increment)) < 1e-13);
  }
}

TEST_CASE("a free body yields by its mass and its inertia") {
  LinkSpec link;
  link.name = link.joint = "base";
  link.type = JointType::free;
  link.inertia.mass = 2;
  link.inertia.about_center = Eigen::Vector3d(2, 4, 8).asDiagonal();
  const Model model = TreeBuilder("base").add(link).build();
  Rig<double> rig(model);
  Instance instance = random_instance(reference::plain_tree(model), 1, 0.1);
  instance.right_side << 2, 4, 8, 2, 4, 6;
  rig.set(instance);
  mass.prepare(rig);
  mass.run(rig);
  const VectorXd expected = (VectorXd(6) << 1, 1, 1, 1, 2, 3).finished();
  CHECK(relative_error(vector(rig.work.increment), expected) < 4 * kEpsilon);
}

TEST_CASE("the downward passes write all they are to write and nothing else") {
  check_writes(newton, {"variation"});
  check_writes(mass, {"variation"});
}

TEST_CASE("the downward passes allocate nothing") {
  check_allocates_nothing(newton);
  check_allocates_nothing(mass);
}

TEST_CASE("the downward passes give equal bits in every lane") {
  check_lanes(newton);
  check_lanes(mass);
}

}  // namespace
}  // namespace linden::increment_down_test

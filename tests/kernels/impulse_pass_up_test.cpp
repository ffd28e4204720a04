#include "kernels/tree/impulse_pass_up.hpp"

#include <catch2/catch.hpp>

#include "models/build/builder.hpp"
#include "tests/kernels/rig.hpp"
#include "tests/reference/dense_jacobian.hpp"
#include "tests/reference/elimination_plain.hpp"
#include "tests/reference/mass_matrix_plain.hpp"

namespace linden::impulse_pass_up_test {
namespace {

const auto kernel = make_kernel([](auto& rig) { factor_newton(rig); }, [](auto& rig) { pass_up(rig, rig.right_side); },
                                {"bias", "innovation", "result"});

TEST_CASE("the innovations are what dense elimination leaves of the right-hand side, for M and for the Jacobian") {
  double worst_mass = 0, worst_newton = 0;
  for (const Model& model : mixed_trees()) {
    const PlainTree tree = reference::plain_tree(model);
    for (const double turn : {1e-3, 0.5, 2.0}) {
      const Instance instance = random_instance(tree, 4, turn);
      Rig<double> rig(model);
      rig.set(instance);
      factor_mass(rig);
      pass_up(rig, rig.right_side);
      const auto mass = reference::eliminate(tree, reference::mass_matrix(tree, instance.q), instance.right_side);
      see(worst_mass, relative_error(vector(rig.work.innovation), mass.innovation));
      factor_newton(rig);
      pass_up(rig, rig.right_side);
      const MatrixXd J = reference::dense_jacobian(model, rig.work.placement, rig.work.motion);
      const auto newton = reference::eliminate(tree, J, instance.right_side);
      see(worst_newton, relative_error(vector(rig.work.innovation), newton.innovation));
    }
  }
  INFO("worst relative error with M: " << worst_mass << ", with the Jacobian: " << worst_newton);
  CHECK(worst_mass < 1e-11);
  CHECK(worst_newton < 1e-11);
}

TEST_CASE("impulse_pass_up returns the energy norm r.M^-1 r, and for the Jacobian the sum of u.d^-1 u") {
  for (const Model& model : mixed_trees()) {
    const PlainTree tree = reference::plain_tree(model);
    const Instance instance = random_instance(tree, 4, 0.5);
    Rig<double> rig(model);
    rig.set(instance);
    factor_mass(rig);
    pass_up(rig, rig.right_side);
    const MatrixXd M = reference::mass_matrix(tree, instance.q);
    CHECK(rig.result(0) == Approx(instance.right_side.dot(dense_solve(M, instance.right_side))).epsilon(1e-11));
    factor_newton(rig);
    pass_up(rig, rig.right_side);
    const MatrixXd J = reference::dense_jacobian(model, rig.work.placement, rig.work.motion);
    const auto dense = reference::eliminate(tree, J, instance.right_side);
    double sum = 0;
    for (Index i = 1; i < tree.slots(); ++i) {
      const VectorXd u = dense.innovation.segment(tree.body(i).v, tree.body(i).dofs());
      sum += u.dot(dense.pivot[static_cast<std::size_t>(i)].inverse() * u);
    }
    CHECK(rig.result(0) == Approx(sum).epsilon(1e-11));
  }
}

TEST_CASE("a push on the last of two equal sliders in a row is felt by the first in full") {
  // slide along x, then again along x: M = [2 1; 1 1]; r = (0, 3)
  LinkSpec first, second;
  first.name = first.joint = "first";
  second.name = second.joint = "second";
  second.parent = "first";
  first.type = second.type = JointType::prismatic;
  first.axis = second.axis = Eigen::Vector3d::UnitX();
  first.inertia = second.inertia = sphere_inertia(1, 0.1, Eigen::Vector3d::Zero());
  const Model model = TreeBuilder("sliders").add(first).add(second).build();
  Rig<double> rig(model);
  fill(rig.state.q, Eigen::Vector2d::Zero());
  fill(rig.work.delta, Eigen::Vector2d::Zero());
  factor_mass(rig);
  fill(rig.right_side, Eigen::Vector2d(0, 3));
  pass_up(rig, rig.right_side);
  CHECK(rig.work.innovation(1) == 3);
  CHECK(rig.work.innovation(0) == -3);  // 0 - 1 (1^-1) 3
  CHECK(rig.work.bias(1, 3) + rig.work.bias(1, 4) + rig.work.bias(1, 5) != 0);
  CHECK(rig.result(0) == 18);  // 3 (1) 3 + 3 (1) 3 = r.M^-1 r
}

TEST_CASE("impulse_pass_up writes all it is to write and nothing else") { check_writes(kernel, {"bias"}); }
TEST_CASE("impulse_pass_up allocates nothing") { check_allocates_nothing(kernel); }
TEST_CASE("impulse_pass_up gives equal bits in every lane") { check_lanes(kernel); }

}  // namespace
}  // namespace linden::impulse_pass_up_test

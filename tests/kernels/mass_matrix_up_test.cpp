#include "kernels/queries/mass_matrix_up.hpp"

#include <catch2/catch.hpp>

#include "tests/kernels/query_rig.hpp"
#include "tests/reference/mass_matrix_plain.hpp"

namespace linden::mass_matrix_up_test {
namespace {

const auto mass = [](auto& rig) { mass_matrix_up(rig.tree, rig.constants, rig.motions.placement, rig.composite, rig.mass_matrix.row(0)); };
const auto momentum = [](auto& rig) {
  momentum_matrix_map(rig.tree, rig.constants, rig.motions.pose, rig.composite, rig.momentum_matrix.row(0));
};
const auto prepare_momentum = [](auto& rig) {
  follow_bodies(rig);
  composite_inertia_up(rig.tree, rig.constants, rig.motions.placement, rig.composite);
};

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

TEST_CASE("an inertia seen from the parent's frame is Ad^T G Ad") {
  Random random(1);
  for (int sample = 0; sample < 100; ++sample) {
    const Inertia<double> G = random_inertia(random);
    const Placement<double> X = random_placement(random);
    const reference::Matrix6<double> Ad = reference::adjoint<double>(reference::inverse<double>(eigen(X)));
    CHECK(relative_error(eigen(to_parent(X, G)), Ad.transpose() * eigen(G) * Ad) < 1e-14);
  }
}

TEST_CASE("the mass matrix is that of all bodies' Jacobians, symmetric to the bit") {
  double worst = 0;
  for (const Model& model : mixed_trees()) {
    const PlainTree tree = reference::plain_tree(model);
    QueryRig<double> rig(model);
    rig.set(2);
    follow_bodies(rig);
    mass(rig);
    const RowMajor M = Eigen::Map<const RowMajor>(rig.mass_matrix.row(0), tree.velocities, tree.velocities);
    see(worst, relative_error(MatrixXd(M), reference::mass_matrix(tree, eigen(rig.q))));
    CHECK(M == M.transpose());
  }
  INFO("worst relative error: " << worst);
  CHECK(worst < 1e-13);
}

TEST_CASE("the momentum matrix times velocities is the momentum of all bodies") {
  double worst = 0;
  for (const Model& model : mixed_trees()) {
    QueryRig<double> rig(model);
    rig.set(2);
    prepare_momentum(rig);
    momentum(rig);
    const RowMajor A = Eigen::Map<const RowMajor>(rig.momentum_matrix.row(0), 6, model.tree.shape.velocities);
    const Wrench<double> expected = total_momentum_map<true>(rig.tree, rig.constants, rig.motions).momentum;
    see(worst, relative_error(VectorXd(A * eigen(rig.v)), VectorXd(eigen(expected))));
  }
  INFO("worst relative error: " << worst);
  CHECK(worst < 1e-13);
}

TEST_CASE("the sweeps of the mass matrix write all they are to write, allocate nothing and are the same in every lane") {
  check_query(follow_bodies, mass, {"mass_matrix", "composite"}, {"composite"});
  check_query(prepare_momentum, momentum, {"momentum_matrix"});
}

}  // namespace
}  // namespace linden::mass_matrix_up_test

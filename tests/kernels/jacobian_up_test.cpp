#include "kernels/queries/jacobian_up.hpp"

#include <catch2/catch.hpp>

#include "tests/kernels/query_rig.hpp"
#include "tests/reference/mass_matrix_plain.hpp"

namespace linden::jacobian_up_test {
namespace {

const auto last_body = [](auto& rig) {
  const Index slot = rig.tree.bodies();
  using S = typename std::remove_reference_t<decltype(rig.q)>::value_type;
  jacobian_up(rig.tree, rig.constants, rig.motions.pose, slot, load<Placement, S>(rig.motions.pose, slot), rig.jacobian.row(0));
};

TEST_CASE("Jacobians of bodies in any frame are the plain tree's, seen from there") {
  double worst = 0;
  Random random(1);
  for (const Model& model : mixed_trees()) {
    const PlainTree tree = reference::plain_tree(model);
    QueryRig<double> rig(model);
    rig.set(2);
    follow_bodies(rig);
    const auto poses = reference::poses(tree, eigen(rig.q));
    for (Index i = 1; i < tree.slots(); ++i) {
      const Placement<double> frame = random_placement(random);
      jacobian_up(rig.tree, rig.constants, rig.motions.pose, i, frame, rig.jacobian.row(0));
      using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
      const RowMajor J = Eigen::Map<const RowMajor>(rig.jacobian.row(0), 6, tree.velocities);
      const reference::Matrix4<double> relative = reference::inverse<double>(eigen(frame)) * poses[static_cast<std::size_t>(i)];
      see(worst,
          relative_error(MatrixXd(J), MatrixXd(reference::adjoint<double>(relative) * reference::body_jacobian<double>(tree, poses, i))));
    }
  }
  INFO("worst relative error: " << worst);
  CHECK(worst < 1e-13);
}

TEST_CASE("jacobian_up writes all it is to write, allocates nothing and is the same in every lane") {
  check_query(follow_bodies, last_body, {"jacobian"});
}

}  // namespace
}  // namespace linden::jacobian_up_test

#include "kernels/queries/total_momentum_map.hpp"

#include <catch2/catch.hpp>

#include "tests/kernels/query_rig.hpp"
#include "tests/reference/mass_matrix_plain.hpp"

namespace linden::total_momentum_map_test {
namespace {

const auto add_up = [](auto& rig) {
  const auto sum = total_momentum_map<true>(rig.tree, rig.constants, rig.motions);
  rig.sums(0) = sum.mass;
  sum.moment.to(rig.sums.row(1));
  sum.momentum.to(rig.sums.row(4));
};

TEST_CASE("mass, first moment and momentum are sums over bodies") {
  double worst = 0;
  for (const Model& model : mixed_trees()) {
    const PlainTree tree = reference::plain_tree(model);
    QueryRig<double> rig(model);
    rig.set(2);
    follow_bodies(rig);
    add_up(rig);
    VectorXd expected = VectorXd::Zero(10);
    const auto poses = reference::poses(tree, eigen(rig.q));
    for (Index i = 1; i < tree.slots(); ++i) {
      const reference::Matrix4<double>& T = poses[static_cast<std::size_t>(i)];
      expected[0] += tree.body(i).mass();
      expected.segment<3>(1) += T.topLeftCorner<3, 3>() * tree.body(i).moment() + tree.body(i).mass() * T.topRightCorner<3, 1>();
      const VectorXd own = tree.body(i).G * reference::body_jacobian<double>(tree, poses, i) * eigen(rig.v);
      expected.tail<6>() += reference::adjoint<double>(reference::inverse<double>(T)).transpose() * own;
    }
    see(worst, relative_error(eigen(rig.sums), expected));
  }
  INFO("worst relative error: " << worst);
  CHECK(worst < 1e-13);
}

TEST_CASE("total_momentum_map writes all it is to write, allocates nothing and is the same in every lane") {
  check_query(follow_bodies, add_up, {"sums"});
}

}  // namespace
}  // namespace linden::total_momentum_map_test

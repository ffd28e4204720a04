#include "kernels/queries/newton_euler_map.hpp"

#include <catch2/catch.hpp>

#include "kernels/tree/impulse_up.hpp"
#include "tests/kernels/query_rig.hpp"
#include "tests/reference/coriolis_plain.hpp"
#include "tests/reference/discrete_action_plain.hpp"

namespace linden::newton_euler_map_test {
namespace {

const auto wrenches = [](auto& rig) {
  using S = typename std::remove_reference_t<decltype(rig.q)>::value_type;
  newton_euler_map(rig.tree, rig.constants, rig.motions, Vec3<S>{S(0.5), S(-1.0), S(-9.0)}, rig.outside, rig.wrench);
};

TEST_CASE("wrenches that bodies need, summed up the tree, are M a + c - Q less what acts from outside") {
  double worst = 0;
  for (const Model& model : mixed_trees()) {
    const PlainTree tree = reference::plain_tree(model);
    QueryRig<double> rig(model);
    rig.set(2);
    follow_bodies(rig);
    wrenches(rig);
    Field<double> force;
    force.allocate(tree.velocities);
    impulse_up(rig.tree, rig.constants, rig.motions.placement, rig.wrench, force);
    const VectorXd q = eigen(rig.q), v = eigen(rig.v);
    const VectorXd slope = reference::gradient(tree.velocities, [&](const auto& eps) {
      using T = reference::Dual<8>;
      return reference::potential<T>(tree, reference::poses<T>(tree, q, eps), {0.5, -1.0, -9.0});
    });
    VectorXd expected = reference::mass_matrix(tree, q) * eigen(rig.a) + reference::coriolis_force(tree, q, v) + slope;
    const auto poses = reference::poses(tree, q);
    for (Index i = 1; i < tree.slots(); ++i) {
      expected -= reference::body_jacobian<double>(tree, poses, i).transpose() * row<Wrench>(rig.outside, i);
    }
    see(worst, relative_error(eigen(force), expected));
  }
  INFO("worst relative error: " << worst);
  CHECK(worst < 1e-12);
}

TEST_CASE("newton_euler_map writes all it is to write, allocates nothing and is the same in every lane") {
  check_query(follow_bodies, wrenches, {"wrench"});
}

}  // namespace
}  // namespace linden::newton_euler_map_test

#include "kernels/queries/motion_between_map.hpp"

#include <catch2/catch.hpp>

#include "tests/kernels/query_rig.hpp"

namespace linden::motion_between_map_test {
namespace {

const auto between = [](auto& rig) { motion_between_map(rig.tree, rig.constants, rig.q, rig.q_next, rig.motion); };

TEST_CASE("the motion of a joint from one place to another takes it there") {
  double worst = 0;
  for (const Model& model : mixed_trees()) {
    const PlainTree tree = reference::plain_tree(model);
    QueryRig<double> rig(model);
    rig.set(2);
    // the same turn by the other of its two quaternions
    for (Index i = 1; i < tree.slots(); ++i) {
      const PlainBody& body = tree.body(i);
      if (body.kind == JointKind::screw || i % 2 == 0) continue;
      for (Index k = 0; k < 4; ++k) rig.q_next(body.q + (body.kind == JointKind::free ? 3 : 0) + k) *= -1;
    }
    between(rig);
    const reference::VectorX<double> none = VectorXd::Zero(tree.velocities);
    for (Index i = 1; i < tree.slots(); ++i) {
      const reference::Matrix4<double> before = reference::joint_pose<double>(tree.body(i), eigen(rig.q), none);
      const reference::Matrix4<double> after = reference::joint_pose<double>(tree.body(i), eigen(rig.q_next), none);
      see(worst, relative_error(reference::Matrix4<double>(before * row<Displacement>(rig.motion, i)), after));
      CHECK(rig.motion(i, 3) >= 0);
    }
  }
  INFO("worst relative error: " << worst);
  CHECK(worst < 1e-14);
}

TEST_CASE("motion_between_map writes all it is to write, allocates nothing and is the same in every lane") {
  check_query(prepare_nothing, between, {"motion"}, {"motion"});
}

}  // namespace
}  // namespace linden::motion_between_map_test

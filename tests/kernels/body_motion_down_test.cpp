#include "kernels/queries/body_motion_down.hpp"

#include <catch2/catch.hpp>

#include "tests/kernels/query_rig.hpp"
#include "tests/reference/mass_matrix_plain.hpp"

namespace linden::body_motion_down_test {
namespace {

TEST_CASE("bodies are placed, move and accelerate as the plain tree's Jacobians and their derivatives say") {
  double worst = 0;
  for (const Model& model : mixed_trees()) {
    const PlainTree tree = reference::plain_tree(model);
    QueryRig<double> rig(model);
    rig.set(2);
    follow_bodies(rig);
    const VectorXd q = eigen(rig.q), v = eigen(rig.v), a = eigen(rig.a);
    using Time = reference::Dual<1>;
    const reference::VectorX<Time> along = v.cast<Time>() * Time(0.0, 0);
    const auto poses = reference::poses<Time>(tree, q, along);
    const auto still = reference::poses(tree, q);
    for (Index i = 1; i < tree.slots(); ++i) {
      see(worst, relative_error(row<Placement>(rig.motions.pose, i), still[static_cast<std::size_t>(i)]));
      const auto J = reference::body_jacobian<double>(tree, still, i);
      see(worst, relative_error(row<Twist>(rig.motions.twist, i), J * v));
      const reference::Vector6<Time> V = reference::body_jacobian<Time>(tree, poses, i) * v.cast<Time>();
      reference::Vector6<double> A = J * a;
      for (int k = 0; k < 6; ++k) A[k] += V[k].slope[0];
      see(worst, relative_error(row<Twist>(rig.motions.acceleration, i), A));
    }
  }
  INFO("worst relative error: " << worst);
  CHECK(worst < 1e-12);
}

TEST_CASE("bodies that nobody asks for are left alone, and those that are have the same bits") {
  const Model model = random_tree({.bodies = 12, .seed = 11});
  QueryRig<double> whole(model), part(model);
  whole.set(3);
  part.set(3);
  follow_bodies(whole);
  part.slots.clear();
  for (Index i = model.tree.bodies(); i != 0; i = model.tree.parent(i)) part.slots.insert(part.slots.begin(), i);
  REQUIRE(part.slots.size() < whole.slots.size());
  follow_bodies(part);
  for (Index i = 1; i < model.tree.shape.slots; ++i) {
    const bool asked = std::ranges::find(part.slots, i) != part.slots.end();
    for (int k = 0; k < 6; ++k) {
      CHECK(std::isnan(part.motions.acceleration(i, k)) == !asked);
      if (asked) CHECK(same_bits(part.motions.acceleration(i, k), whole.motions.acceleration(i, k)));
    }
  }
}

TEST_CASE("body_motion_down writes what its depth says, allocates nothing and is the same in every lane") {
  check_query(prepare_nothing, follow_bodies, {"placement", "pose", "twist", "acceleration"});
  const auto twists = [](auto& rig) {
    body_motion_down<MotionDepth::twists>(rig.tree, rig.constants, rig.slots.data(), rig.slots.size(), rig.q, rig.v, rig.a, rig.motions);
  };
  check_query(prepare_nothing, twists, {"placement", "pose", "twist"});
  const auto poses = [](auto& rig) {
    body_motion_down<MotionDepth::poses>(rig.tree, rig.constants, rig.slots.data(), rig.slots.size(), rig.q, rig.v, rig.a, rig.motions);
  };
  check_query(prepare_nothing, poses, {"placement", "pose"});
}

}  // namespace
}  // namespace linden::body_motion_down_test

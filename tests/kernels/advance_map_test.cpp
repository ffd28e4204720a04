#include "kernels/tree/advance_map.hpp"

#include <catch2/catch.hpp>

#include "models/build/builder.hpp"
#include "tests/kernels/rig.hpp"

namespace linden::advance_map_test {
namespace {

const auto kernel =
    make_kernel([](auto& rig) { place(rig); },
                [](auto& rig) { advance_map(rig.tree, rig.work.motion, rig.work.delta, rig.state.q); }, {}, {"q"});

TEST_CASE("advance_map moves every joint by its motion: T(q') = T(q) M") {
  double worst_pose = 0, worst_plain = 0;
  for (const Model& model : mixed_trees()) {
    const PlainTree tree = reference::plain_tree(model);
    for (const double turn : {1e-6, 0.5, 2.0, 3.0}) {
      const Instance instance = random_instance(tree, 3, turn);
      Rig<double> rig(model);
      rig.set(instance);
      kernel.prepare(rig);
      kernel.run(rig);
      const VectorXd q = vector(rig.state.q), none = VectorXd::Zero(tree.velocities);
      for (Index i = 1; i < tree.slots(); ++i) {
        const auto after = reference::joint_pose<double>(tree.body(i), q, none);
        const auto expected =
            (reference::joint_pose<double>(tree.body(i), instance.q, none) * row<Displacement>(rig.work.motion, i))
                .eval();
        see(worst_pose, (after - expected).cwiseAbs().maxCoeff());
      }
      see(worst_plain, (q - reference::advanced(tree, instance.q, instance.delta)).cwiseAbs().maxCoeff());
    }
  }
  INFO("worst difference of poses: " << worst_pose / kEpsilon << " epsilon, of positions: " << worst_plain / kEpsilon
                                     << " epsilon");
  CHECK(worst_pose < 16 * kEpsilon);
  CHECK(worst_plain < 16 * kEpsilon);
}

TEST_CASE("a screw adds its displacement exactly") {
  const Model model = chain(5);
  Rig<double> rig(model);
  const Instance instance = random_instance(reference::plain_tree(model), 3, 0.5);
  rig.set(instance);
  kernel.prepare(rig);
  kernel.run(rig);
  CHECK(vector(rig.state.q) == instance.q + instance.delta);
}

TEST_CASE("a free body moves along its own axes, not the world's") {
  LinkSpec link;
  link.name = link.joint = "base";
  link.type = JointType::free;
  link.inertia = box_inertia(1, Eigen::Vector3d(1, 1, 1), Eigen::Vector3d::Zero());
  const Model model = TreeBuilder("base").add(link).build();
  Rig<double> rig(model);
  // turned by a quarter about z; a metre along its x is a metre along the world's y
  const double s = std::sqrt(0.5);
  fill(rig.state.q, (VectorXd(7) << 5, 6, 7, 0, 0, s, s).finished());
  fill(rig.work.delta, (VectorXd(6) << 0, 0, std::numbers::pi / 2, std::numbers::pi / 2, 0, 0).finished());
  kernel.prepare(rig);
  kernel.run(rig);
  // on a quarter circle of radius 1 to the left: to (1, 1) in the body's frame before
  const VectorXd expected = (VectorXd(7) << 4, 7, 7, 0, 0, 1, 0).finished();
  CHECK((vector(rig.state.q) - expected).norm() < 16 * kEpsilon);
}

TEST_CASE("quaternions stay of unit length to rounding over 100,000 steps") {
  const Model model = random_tree({.bodies = 4, .seed = 2, .screws = false});
  const PlainTree tree = reference::plain_tree(model);
  Rig<double> rig(model);
  rig.set(random_instance(tree, 3, 0.5));
  double worst = 0;
  for (int step = 0; step < 100000; ++step) {
    // another motion now and then
    if (step % 100 == 0) {
      Random random(static_cast<std::uint64_t>(step));
      fill(rig.work.delta, random_vector(random, tree.velocities, 1.5));
      motion_map(rig.tree, rig.constants, rig.work.delta, rig.work.motion);
    }
    kernel.run(rig);
    for (Index i = 1; i < tree.slots(); ++i) {
      const Index turn = tree.body(i).q + (tree.body(i).kind == JointKind::free ? 3 : 0);
      double square = 0;
      for (Index k = turn; k < turn + 4; ++k) square += rig.state.q(k) * rig.state.q(k);
      see(worst, std::abs(square - 1));
    }
  }
  INFO("worst deviation of |q|^2 from 1: " << worst / kEpsilon << " epsilon");
  CHECK(worst < 4 * kEpsilon);
}

TEST_CASE("normalised halves the digits of the error in a quaternion's length") {
  for (const double error : {1e-2, 1e-4, 1e-6}) {
    const Quaternion<double> q{{(1 + error) * 0.5, (1 + error) * -0.5, (1 + error) * 0.5}, (1 + error) * 0.5};
    CHECK(eigen(normalised(q)).norm() - 1 == Approx(-1.5 * error * error).epsilon(0.02));
  }
}

TEST_CASE("advance_map changes every position and nothing else") { check_writes(kernel); }
TEST_CASE("advance_map allocates nothing") { check_allocates_nothing(kernel); }
TEST_CASE("advance_map gives equal bits in every lane") { check_lanes(kernel); }

}  // namespace
}  // namespace linden::advance_map_test

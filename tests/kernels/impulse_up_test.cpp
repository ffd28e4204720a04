#include "kernels/tree/impulse_up.hpp"

#include <catch2/catch.hpp>

#include "tests/kernels/rig.hpp"

namespace linden::impulse_up_test {
namespace {

const auto kernel = make_kernel(
    [](auto& rig) { find_momenta(rig); },
    [](auto& rig) { impulse_up(rig.tree, rig.constants, rig.work.placement, rig.work.impulse, rig.work.increment); },
    {"increment"}, {"impulse"});

TEST_CASE("impulse_up is the sum over all descendants, each brought up by the poses of the two bodies alone") {
  double worst = 0;
  for (const Model& model : mixed_trees()) {
    const PlainTree tree = reference::plain_tree(model);
    const Instance instance = random_instance(tree, 6, 0.1);
    Rig<double> rig(model);
    rig.set(instance);
    kernel.prepare(rig);
    Random random(8);
    std::vector<reference::Vector6<double>> own(tree.bodies.size(), reference::Vector6<double>::Zero());
    for (Index i = 1; i < tree.slots(); ++i) {
      const Wrench<double> m = random_wrench(random, 1);
      own[static_cast<std::size_t>(i)] = eigen(m);
      store(rig.work.impulse, i, m);
    }
    kernel.run(rig);
    const auto pose = reference::poses(tree, instance.q);
    std::vector<reference::Vector6<double>> F(tree.bodies.size(), reference::Vector6<double>::Zero());
    for (Index i = 1; i < tree.slots(); ++i) {
      // body i is felt by itself, by every ancestor and by the world
      for (Index a = i;; a = tree.body(a).parent) {
        const auto relative =
            (reference::inverse<double>(pose[static_cast<std::size_t>(i)]) * pose[static_cast<std::size_t>(a)]).eval();
        F[static_cast<std::size_t>(a)] +=
            reference::adjoint<double>(relative).transpose() * own[static_cast<std::size_t>(i)];
        if (a == 0) break;
      }
    }
    for (Index i = 0; i < tree.slots(); ++i) {
      see(worst, relative_error(row<Wrench>(rig.work.impulse, i), F[static_cast<std::size_t>(i)]));
      if (i == 0) continue;
      const PlainBody& body = tree.body(i);
      const VectorXd found = vector(rig.work.increment).segment(body.v, body.dofs());
      const VectorXd expected = body.S.transpose() * F[static_cast<std::size_t>(i)];
      see(worst, (found - expected).norm() / F[static_cast<std::size_t>(i)].norm());
    }
  }
  INFO("worst relative error: " << worst / kEpsilon << " epsilon");
  CHECK(worst < 64 * kEpsilon);
}

TEST_CASE("a unit force at the tip of a straight chain turns hinges by their distance to it") {
  // hinges about y at x = 0, 1.5, 3; the force along z at the last joint
  const Model model = paper_chain(3);
  Rig<double> rig(model);
  fill(rig.state.q, Eigen::Vector3d::Zero());
  fill(rig.work.delta, Eigen::Vector3d::Zero());
  kernel.prepare(rig);
  const PlainTree tree = reference::plain_tree(model);
  const auto pose = reference::poses(tree, Eigen::Vector3d::Zero());
  for (Index i = 1; i <= 3; ++i) {
    Wrench<double> m{{0, 0, 0}, {0, 0, 0}};
    if (i == 3) m.f = vec3(pose[3].topLeftCorner<3, 3>().transpose() * Eigen::Vector3d::UnitZ());
    store(rig.work.impulse, i, m);
  }
  kernel.run(rig);
  CHECK(rig.work.increment(0) == Approx(-3));
  CHECK(rig.work.increment(1) == Approx(-1.5));
  CHECK(rig.work.increment(2) == Approx(0).margin(1e-15));
  CHECK(rig.work.impulse(0, 1) == Approx(-3));
  CHECK(rig.work.impulse(0, 5) == Approx(1));
}

TEST_CASE("impulse_up writes every projection and nothing else") { check_writes(kernel, {"impulse"}); }
TEST_CASE("impulse_up allocates nothing") { check_allocates_nothing(kernel); }
TEST_CASE("impulse_up gives equal bits in every lane") { check_lanes(kernel); }

}  // namespace
}  // namespace linden::impulse_up_test

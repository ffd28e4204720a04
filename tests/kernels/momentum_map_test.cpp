#include "kernels/tree/momentum_map.hpp"

#include <catch2/catch.hpp>

#include "models/build/builder.hpp"
#include "tests/kernels/rig.hpp"
#include "tests/reference/discrete_action_plain.hpp"

namespace linden::momentum_map_test {
namespace {

const auto kernel = make_kernel([](auto& rig) { displace(rig); },
                                  [](auto& rig) {
                                    rig.result(0) =
                                        momentum_map(rig.tree, rig.constants, rig.work.displacement, rig.work.impulse);
                                  },
                                  {"impulse", "result"});

TEST_CASE("momentum_map is log, G hV and the series of dlog transposed") {
  double worst = 0;
  for (const Model& model : mixed_trees()) {
    const PlainTree tree = reference::plain_tree(model);
    for (const double turn : {1e-6, 0.3, 2.0, 3.0}) {
      Rig<double> rig(model);
      rig.set(random_instance(tree, 7, turn));
      kernel.prepare(rig);
      kernel.run(rig);
      double energy = 0;
      for (Index i = 1; i < tree.slots(); ++i) {
        const auto D = load<Displacement, double>(rig.work.displacement, i);
        reference::Vector6<double> u;
        const Eigen::Vector3d w = reference::rotation_vector<double>(eigen(D.r));
        u << w, reference::bernoulli_series<double, 3>(reference::hat<double>(w)) * eigen(D.p);
        const reference::Vector6<double> m = tree.body(i).G * u, mu = reference::dlog<double>(u).transpose() * m;
        energy += 0.5 * u.dot(m);
        see(worst, relative_error(row<Wrench>(rig.work.impulse, i), mu));
      }
      CHECK(rig.result(0) == Approx(energy).epsilon(1e-14));
    }
  }
  INFO("worst relative error: " << worst / kEpsilon << " epsilon");
  CHECK(worst < 64 * kEpsilon);
}

TEST_CASE("the momentum of a free body is the derivative of the discrete action by its beginning") {
  const Model model = random_tree({.bodies = 1, .seed = 3, .screws = false, .balls = false});
  const PlainTree tree = reference::plain_tree(model);
  const double h = 0.125;
  for (const double turn : {0.1, 2.0, 2.8}) {
    const Instance instance = random_instance(tree, 4, turn);
    Rig<double> rig(model);
    rig.set(instance);
    kernel.prepare(rig);
    kernel.run(rig);
    const VectorXd next = reference::advanced(tree, instance.q, instance.delta);
    const Eigen::Vector3d none = Eigen::Vector3d::Zero();
    const VectorXd p = -reference::action_slope_at_begin(tree, instance.q, next, h, none);
    CHECK(relative_error(row<Wrench>(rig.work.impulse, 1) / h, p) < 1e-12);
  }
}

TEST_CASE("a body turned by 1 rad about a principal axis has its inertia for h mu, and half of it for energy") {
  LinkSpec link;
  link.name = link.joint = "ball";
  link.type = JointType::ball;
  link.inertia.mass = 1;
  link.inertia.about_center = Eigen::Vector3d(2, 3, 4).asDiagonal();
  const Model model = TreeBuilder("ball").add(link).build();
  Rig<double> rig(model);
  fill(rig.state.q, Eigen::Vector4d(0, 0, 0, 1));
  fill(rig.work.delta, Eigen::Vector3d(0, 0, 1));
  kernel.prepare(rig);
  kernel.run(rig);
  CHECK(rig.work.impulse(1, 2) == Approx(4).epsilon(1e-15));
  CHECK(rig.work.impulse(1, 0) == 0);
  CHECK(rig.result(0) == Approx(2).epsilon(1e-15));
}

TEST_CASE("momentum_map writes all it is to write and nothing else") {
  check_writes(kernel);
}

TEST_CASE("momentum_map allocates nothing") {
  check_allocates_nothing(kernel);
}

TEST_CASE("momentum_map gives equal bits in every lane") {
  check_lanes(kernel);
}

}  // namespace
}  // namespace linden::momentum_map_test

#include "kernels/tree/gravity.hpp"

#include <catch2/catch.hpp>

#include "models/build/builder.hpp"
#include "tests/kernels/rig.hpp"
#include "tests/reference/discrete_action_plain.hpp"

namespace linden::gravity_test {
namespace {

const Eigen::Vector3d kGravity(1.5, -2, -9.81);

const auto field_down = make_kernel([](auto& rig) { place(rig); },
                                    [](auto& rig) {
                                      using S = std::decay_t<decltype(rig.h)>;
                                      const Vec3<S> g{S(kGravity[0]), S(kGravity[1]), S(kGravity[2])};
                                      gravity_field_down(rig.tree, rig.work.placement, g, rig.work.field);
                                    },
                                    {"field"});

const auto force_up = make_kernel(
    [](auto& rig) {
      place(rig);
      field_down.run(rig);
    },
    [](auto& rig) {
      rig.result(0) = gravity_force_up(rig.tree, rig.constants, rig.work.placement, rig.work.field,
                                       rig.work.first_moment, rig.work.force);
    },
    {"first_moment", "force", "result"});

TEST_CASE("gravity's force is minus the derivative of the potential, and its potential that of all masses") {
  double worst_force = 0, worst_potential = 0, worst_field = 0;
  for_mixed_instances([&](const PlainTree& tree, const Instance& instance, Rig<double>& rig) {
    force_up.prepare(rig);
    force_up.run(rig);
    const VectorXd Q = reference::potential_force(tree, instance.q, kGravity);
    const auto pose = reference::poses(tree, instance.q);
    const double P = reference::potential<double>(tree, pose, kGravity);
    see(worst_force, relative_error(vector(rig.work.force), Q));
    see(worst_potential, std::abs(rig.result(0) - P) / std::abs(P));
    for (Index i = 0; i < tree.slots(); ++i) {
      const Eigen::Vector3d g = pose[static_cast<std::size_t>(i)].topLeftCorner<3, 3>().transpose() * kGravity;
      see(worst_field, relative_error(row<Vec3>(rig.work.field, i), g));
    }
  });
  INFO("worst relative error of the force " << worst_force << ", of the potential " << worst_potential
                                            << ", of the field " << worst_field);
  CHECK(worst_force < 1e-13);
  CHECK(worst_potential < 1e-13);
  CHECK(worst_field < 1e-14);
}

TEST_CASE("a pendulum is pulled by m g l sin of its angle and a free body falls with its weight") {
  LinkSpec link;
  link.name = link.joint = "bob";
  link.axis = Eigen::Vector3d::UnitX();
  link.inertia.mass = 2;
  link.inertia.center = Eigen::Vector3d(0, 0, -0.5);
  const Model pendulum = TreeBuilder("pendulum").add(link).build();
  Rig<double> rig(pendulum);
  const Vec3<double> g{0, 0, -10};
  for (const double angle : {0.0, 0.3, 1.5, -2.0}) {
    rig.state.q(0) = angle;
    rig.work.delta(0) = 0;
    place(rig);
    gravity_field_down(rig.tree, rig.work.placement, g, rig.work.field);
    force_up.run(rig);
    CHECK(rig.work.force(0) == Approx(-10 * std::sin(angle)).margin(1e-14));
    CHECK(rig.result(0) == Approx(-10 * std::cos(angle)));
  }
  const Model floating = random_tree({.bodies = 8, .seed = 9, .frees = false, .floating = true});
  const PlainTree tree = reference::plain_tree(floating);
  Rig<double> whole(floating);
  whole.set(random_instance(tree, 1, 0.1));
  force_up.prepare(whole);
  force_up.run(whole);
  double mass = 0;
  for (Index i = 1; i < tree.slots(); ++i) mass += tree.body(i).mass();
  const Eigen::Matrix3d R = row<Placement>(whole.work.placement, 1).topLeftCorner<3, 3>();
  CHECK(relative_error(vector(whole.work.force).segment<3>(3), mass * R.transpose() * kGravity) < 1e-14);
}

TEST_CASE("the first moments add up to the centre of mass of everything") {
  const Model model = random_tree({.bodies = 12, .seed = 11});
  const PlainTree tree = reference::plain_tree(model);
  const Instance instance = random_instance(tree, 3, 0.1);
  Rig<double> rig(model);
  rig.set(instance);
  force_up.prepare(rig);
  force_up.run(rig);
  const auto pose = reference::poses(tree, instance.q);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (Index i = 1; i < tree.slots(); ++i) {
    const auto& X = pose[static_cast<std::size_t>(i)];
    sum += X.topLeftCorner<3, 3>() * tree.body(i).moment() + tree.body(i).mass() * X.topRightCorner<3, 1>();
  }
  CHECK(relative_error(row<Vec3>(rig.work.first_moment, 0), sum) < 1e-14);
}

TEST_CASE("the sweeps of gravity write all they are to write and nothing else") {
  check_writes(field_down, {"field"});
  check_writes(force_up, {"first_moment"});
}

TEST_CASE("the sweeps of gravity allocate nothing") {
  check_allocates_nothing(field_down);
  check_allocates_nothing(force_up);
}

TEST_CASE("the sweeps of gravity give equal bits in every lane") {
  check_lanes(field_down);
  check_lanes(force_up);
}

}  // namespace
}  // namespace linden::gravity_test

#include "kernels/tree/motion_map.hpp"

#include <catch2/catch.hpp>

#include "tests/kernels/rig.hpp"

namespace linden::motion_map_test {
namespace {

const auto motion = make_kernel(
    [](auto&) {}, [](auto& rig) { motion_map(rig.tree, rig.constants, rig.work.delta, rig.work.motion); }, {"motion"});

const auto correction =
    make_kernel([](auto& rig) { place(rig); },
                [](auto& rig) {
                  using S = std::decay_t<decltype(rig.h)>;
                  correct_motion_map(rig.tree, rig.constants, rig.rate, S(0.25), rig.work.delta, rig.work.motion);
                },
                {}, {"motion", "delta"});

const auto displacement =
    make_kernel([](auto& rig) { find_momenta(rig); },
                [](auto& rig) { displacement_map(rig.tree, rig.work.displacement, rig.work.delta); }, {}, {"delta"});

TEST_CASE("motion_map is exp of S delta for turns from 1e-12 to nearly pi") {
  double worst = 0;
  for (const Model& model : mixed_trees()) {
    const PlainTree tree = reference::plain_tree(model);
    for (const double size : {1e-12, 1e-3, 1.0, 1.8}) {
      Rig<double> rig(model);
      Random random(3);
      const VectorXd delta = random_vector(random, tree.velocities, size);
      fill(rig.work.delta, delta);
      motion.run(rig);
      for (Index i = 1; i < tree.slots(); ++i) {
        const PlainBody& body = tree.body(i);
        const reference::Vector6<double> u = body.S * delta.segment(body.v, body.dofs());
        const auto M = load<Displacement, double>(rig.work.motion, i);
        const Eigen::Vector4d turn = reference::rotation_quaternion<double>(u.head<3>());
        const Eigen::Vector3d shift = reference::exp<double>(u).topRightCorner<3, 1>();
        see(worst, relative_error(eigen(M.r).head<3>(), turn.head<3>()), std::abs(M.r.w - turn[3]),
            relative_error(eigen(M.p), shift));
      }
    }
  }
  INFO("worst relative error: " << worst / kEpsilon << " epsilon");
  CHECK(worst < 16 * kEpsilon);
}

TEST_CASE("correct_motion_map multiplies exp of the correction on from the right") {
  double worst = 0;
  for (const Model& model : mixed_trees()) {
    const PlainTree tree = reference::plain_tree(model);
    Rig<double> rig(model);
    const Instance instance = random_instance(tree, 2, 1.0);
    rig.set(instance);
    correction.prepare(rig);
    correction.run(rig);
    for (Index i = 1; i < tree.slots(); ++i) {
      const PlainBody& body = tree.body(i);
      const auto from = [&](const VectorXd& rows) {
        return reference::exp<double>(body.S * rows.segment(body.v, body.dofs()));
      };
      const auto expected = (from(instance.delta) * from(-0.25 * instance.rate)).eval();
      see(worst, (row<Displacement>(rig.work.motion, i) - expected).cwiseAbs().maxCoeff());
      if (body.kind == JointKind::screw) {
        CHECK(rig.work.delta(body.v) == Approx(instance.delta[body.v] - 0.25 * instance.rate[body.v]).epsilon(1e-15));
      } else {
        for (Index k = 0; k < body.dofs(); ++k) CHECK(rig.work.delta(body.v + k) == instance.delta[body.v + k]);
      }
    }
  }
  INFO("worst difference: " << worst / kEpsilon << " epsilon");
  CHECK(worst < 16 * kEpsilon);
}

TEST_CASE("a correction taken back leads to the same motion up to rounding") {
  for (const Model& model : mixed_trees()) {
    Rig<double> rig(model);
    rig.set(random_instance(reference::plain_tree(model), 2, 1.0));
    place(rig);
    const Field<double, 7> before = rig.work.motion;
    for (const double factor : {1.0, -0.5, -0.25, -0.25}) {
      correct_motion_map(rig.tree, rig.constants, rig.rate, factor, rig.work.delta, rig.work.motion);
    }
    for (Index i = 1; i < model.tree.shape.slots; ++i) {
      CHECK((row<Displacement>(rig.work.motion, i) - row<Displacement>(before, i)).norm() < 64 * kEpsilon);
    }
  }
}

TEST_CASE("displacement_map is log of the motion for ball and free joints and keeps what a screw had") {
  for (const Model& model : mixed_trees()) {
    const PlainTree tree = reference::plain_tree(model);
    Rig<double> rig(model);
    Random random(5);
    const VectorXd delta = random_vector(random, tree.velocities, 1.5);
    fill(rig.work.delta, delta);
    motion.run(rig);
    const VectorXd mark = random_vector(random, tree.velocities, 1);
    fill(rig.work.delta, mark);
    displacement_map(rig.tree, rig.work.motion, rig.work.delta);
    for (Index i = 1; i < tree.slots(); ++i) {
      const PlainBody& body = tree.body(i);
      for (Index k = body.v; k < body.v + body.dofs(); ++k) {
        const double expected = body.kind == JointKind::screw ? mark[k] : delta[k];
        CHECK(std::abs(rig.work.delta(k) - expected) <= (body.kind == JointKind::screw ? 0 : 16 * kEpsilon));
      }
    }
  }
}

TEST_CASE("a helix of pitch 1/2 that turns by a third of a turn shifts by half of it") {
  const Displacement<double> M = screw_motion(Screw<double>{1, 0.5}, 2 * std::numbers::pi / 3);
  CHECK(M.r.v.z == Approx(std::sqrt(0.75)).epsilon(1e-15));
  CHECK(M.r.w == Approx(0.5).epsilon(1e-15));
  CHECK(M.p.z == Approx(std::numbers::pi / 3).epsilon(1e-15));
  CHECK((M.r.v.x == 0 && M.r.v.y == 0 && M.p.x == 0 && M.p.y == 0));
}

TEST_CASE("the motion maps write all they are to write and nothing else") {
  check_writes(motion);
  check_writes(correction);
}

TEST_CASE("the motion maps allocate nothing") {
  check_allocates_nothing(motion);
  check_allocates_nothing(correction);
  check_allocates_nothing(displacement);
}

TEST_CASE("the motion maps give equal bits in every lane") {
  check_lanes(motion);
  check_lanes(correction);
  check_lanes(displacement);
}

}  // namespace
}  // namespace linden::motion_map_test

#include "kernels/values/joints.hpp"

#include <catch2/catch.hpp>

#include "models/build/builder.hpp"
#include "tests/kernels/rig.hpp"

namespace linden::joints_test {
namespace {

TEST_CASE("down meets every slot but the world once, in order, each with its kind") {
  for (const Model& model : mixed_trees()) {
    Index next = 1;
    down(model.tree, [&](auto joint, Index i) {
      CHECK(i == next++);
      CHECK(joint == model.tree.kind(i));
    });
    CHECK(next == model.tree.shape.slots);
  }
}

TEST_CASE("up meets every slot but the world once, in reverse, each with its kind") {
  for (const Model& model : mixed_trees()) {
    Index next = model.tree.bodies();
    up(model.tree, [&](auto joint, Index i) {
      CHECK(i == next--);
      CHECK(joint == model.tree.kind(i));
    });
    CHECK(next == 0);
  }
}

TEST_CASE("with_joint hands on the kind as a type") {
  for (const JointKind kind : {JointKind::screw, JointKind::ball, JointKind::free}) {
    int calls = 0;
    with_joint(kind, [&](auto joint) {
      constexpr JointKind known = joint;
      CHECK(known == kind);
      ++calls;
    });
    CHECK(calls == 1);
  }
}

TEST_CASE("a joint adds S a to a twist and takes S^T F of a wrench") {
  Random random(1);
  for (const Model& model : mixed_trees()) {
    const PlainTree tree = reference::plain_tree(model);
    Rig<double> rig(model);
    rig.set(random_instance(tree, 1, 0.1));
    down(model.tree, [&](auto joint, Index i) {
      const PlainBody& body = tree.body(i);
      const Index first = model.tree.first_v(i);
      const VectorXd a = vector(rig.rate).segment(first, body.dofs());
      const Twist<double> V = random_twist(random, 1);
      const Wrench<double> F = random_wrench(random, 1);
      const Twist<double> sum = add_motion(joint, model.constants, i, load_joint(joint, rig.rate, first), V);
      CHECK(relative_error(eigen(sum), eigen(V) + body.S * a) < 4 * kEpsilon);
      const VectorXd projected = VectorXd(eigen(project(joint, model.constants, i, F))).head(body.dofs());
      CHECK(relative_error(projected, body.S.transpose() * eigen(F)) < 4 * kEpsilon);
    });
  }
}

TEST_CASE("a joint's rows are read and written where they belong") {
  const Model model = random_tree({.bodies = 12, .seed = 11});
  Field<double> field;
  field.allocate(model.tree.shape.velocities);
  for (Index row = 0; row < field.rows(); ++row) field(row) = row;
  down(model.tree, [&](auto joint, Index i) {
    const Index first = model.tree.first_v(i), count = velocity_count(joint);
    const auto numbers = numbers_of<double>(load_joint(joint, field, first));
    for (Index k = 0; k < 6; ++k) CHECK(numbers[static_cast<std::size_t>(k)] == (k < count ? first + k : 0));
    Field<double> copy;
    copy.allocate(field.rows(), -1);
    store_joint(joint, copy, first, load_joint(joint, field, first));
    for (Index row = 0; row < field.rows(); ++row) {
      CHECK(copy(row) == (row >= first && row < first + count ? row : -1));
    }
  });
}

TEST_CASE("the two numbers of a screw are its turn and its shift") {
  LinkSpec link;
  link.name = link.joint = "drill";
  link.type = JointType::helical;
  link.pitch = 0.25;
  link.inertia = box_inertia(1, Eigen::Vector3d(1, 1, 1), Eigen::Vector3d::Zero());
  const Model model = TreeBuilder("drill").add(link).build();
  const auto screw = load_screw<double>(model.constants, 1);
  CHECK((screw.r == 1 && screw.t == 0.25));
  Field<double> rate;
  rate.allocate(1, 2.0);
  const Joint<JointKind::screw> joint;
  const Twist<double> V = add_motion(joint, model.constants, 1, load_joint(joint, rate, 0), Twist<double>{{1, 2, 3}, {4, 5, 6}});
  CHECK((V.w.x == 1 && V.w.y == 2 && V.w.z == 5 && V.v.x == 4 && V.v.y == 5 && V.v.z == 6.5));
  CHECK(project(joint, model.constants, 1, Wrench<double>{{1, 2, 3}, {4, 5, 6}}).n.x == 4.5);
}

TEST_CASE("what joints add and take has equal bits in every lane, and nothing allocates") {
  const auto kernel = make_kernel(
      [](auto&) {},
      [](auto& rig) {
        down(rig.tree, [&](auto joint, Index i) {
          using S = std::decay_t<decltype(rig.h)>;
          const Index first = rig.tree.first_v(i);
          const Vec3<S> zero{S(0.0), S(0.0), S(0.0)};
          const Twist<S> V = add_motion(joint, rig.constants, i, load_joint(joint, rig.rate, first), Twist<S>{zero, zero});
          store(rig.work.twist, i, V);
          store_joint(joint, rig.work.residual, first, project(joint, rig.constants, i, Wrench<S>{V.w, V.v}));
        });
      },
      {"twist", "residual"});
  check_writes(kernel);
  check_allocates_nothing(kernel);
  check_lanes(kernel);
}

}  // namespace
}  // namespace linden::joints_test

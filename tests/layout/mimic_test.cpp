// Which joints may be tied: what moves nothing is asked of the coordinate, not of each of its joints.
#include <fmt/format.h>

#include <catch2/catch.hpp>

#include "models/build/builder.hpp"
#include "models/build/dependent_joint.hpp"
#include "models/build/generators.hpp"
#include "models/build/random.hpp"
#include "models/urdf/urdf.hpp"
#include "tests/reference/mass_matrix_plain.hpp"

namespace linden::mimic_test {
using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using reference::PlainTree;

namespace {

constexpr double kNone = 0, kSome = 0.7;  // [kg]

struct Tie {
  std::string leader;
  double multiplier = 1;
};

/// A hinge about z at `at` of its parent, its link of so much mass 0.2 m from it.
LinkSpec hinge(const std::string& name, const std::string& parent, double mass, const Tie& tie = {},
               const Eigen::Vector3d& at = {0, 0, 0}) {
  LinkSpec link;
  link.name = name + "_link";
  link.joint = name;
  link.parent = parent.empty() ? "" : parent + "_link";
  link.placement = Isometry(Eigen::Translation3d(at));
  if (mass > 0) link.inertia = sphere_inertia(mass, 0.05, {0.2, 0, 0});
  link.mimic = tie.leader;
  link.multiplier = tie.multiplier;
  return link;
}

Model build(std::initializer_list<LinkSpec> links) {
  TreeBuilder builder("tied");
  builder.source("tied.urdf");
  for (const LinkSpec& link : links) builder.add(link);
  return builder.build();
}

std::string message_of(std::initializer_list<LinkSpec> links) {
  try {
    build(links);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

const Eigen::Vector3d kAside{0, 0.3, 0};

TEST_CASE("a coordinate of which one joint moves a mass is a coordinate, whichever joint it is", "[mimic]") {
  CHECK(build({hinge("j", "", kSome), hinge("k", "", kNone, {"j"})}).degrees_of_freedom() == 1);
  CHECK(build({hinge("j", "", kNone), hinge("k", "", kSome, {"j", -2})}).degrees_of_freedom() == 1);
  CHECK(build({hinge("j", "", kSome), hinge("k", "j", kNone, {"j"})}).degrees_of_freedom() == 1);
  CHECK(build({hinge("j", "", kNone), hinge("k", "", kNone, {"j", 0.5}), hinge("l", "", kSome, {"k", 3})}).degrees_of_freedom() == 1);
  // one after the other, the last alone with a mass, side by side or all about one axis
  CHECK_NOTHROW(build({hinge("j", "", kNone), hinge("k", "j", kNone, {"j"}, kAside), hinge("l", "k", kSome, {"j"}, kAside)}));
  CHECK_NOTHROW(build({hinge("j", "", kNone), hinge("k", "j", kNone, {"j", 2}), hinge("l", "k", kSome, {"j", -0.5})}));
  // a follower that stands still need not resist, nor need one below it
  CHECK_NOTHROW(build({hinge("j", "", kSome), hinge("k", "j", kNone, {"j", 0})}));
  CHECK_NOTHROW(build({hinge("j", "", kNone), hinge("k", "j", kSome, {"j", 0})}));
}

TEST_CASE("a coordinate that moves no mass is refused with leader and follower", "[mimic]") {
  const std::string message = message_of({hinge("j", "", kNone), hinge("k", "", kNone, {"j", -1}), hinge("l", "", kSome)});
  CHECK_THAT(message, StartsWith("tied.urdf: joint \"j\" moves nothing that resists, nor does \"k\" or any other joint that follows it; "
                                 "expected one that moves a link with an inertia in the direction the joint frees; give link "));
  CHECK_THAT(message, Contains("\"j_link\""));
  // the only mass hangs on a follower that stands still
  CHECK_THAT(message_of({hinge("j", "", kNone), hinge("k", "", kSome, {"j", 0})}), StartsWith("tied.urdf: joint \"j\" moves nothing"));
  // others are not excused by ties that are not theirs
  CHECK_THAT(message_of({hinge("j", "", kSome), hinge("k", "", kSome, {"j"}), hinge("l", "", kNone)}),
             StartsWith("tied.urdf: joint \"l\" moves nothing that resists: link \"l_link\" and all below it have a mass of 0 kg"));
}

TEST_CASE("a coordinate whose joints undo each other, or that others move alike, is refused", "[mimic]") {
  const std::string undone = "tied.urdf: joint \"j\" and those that follow it move nothing that resists, or nothing that other joints do";
  CHECK_THAT(message_of({hinge("j", "", kNone), hinge("k", "j", kSome, {"j", -1})}), StartsWith(undone));
  CHECK_NOTHROW(build({hinge("j", "", kNone), hinge("k", "j", kSome, {"j", -1}, kAside)}));
  // a free hinge on the axis of a coordinate, above it or below it
  const std::string above = "tied.urdf: joint \"i\" moves nothing that joints below it do not move in the same way";
  CHECK_THAT(message_of({hinge("i", "", kNone), hinge("j", "i", kNone), hinge("k", "j", kSome, {"j"})}), Contains("in the same way"));
  CHECK_NOTHROW(build({hinge("i", "", kSome), hinge("j", "i", kNone), hinge("k", "j", kSome, {"j"})}));
  CHECK_THAT(message_of({hinge("j", "", kNone), hinge("k", "j", kNone, {"j"}), hinge("i", "k", kSome)}), StartsWith(undone));
  CHECK_NOTHROW(build({hinge("j", "", kNone), hinge("k", "j", kNone, {"j"}), hinge("i", "k", kSome), hinge("l", "", kSome, {"j"})}));
  // hinges without ties, above a coordinate
  CHECK_THAT(message_of({hinge("i", "", kNone), hinge("h", "i", kNone), hinge("j", "h", kSome), hinge("k", "j", kSome, {"j"})}),
             StartsWith(above));
  // two coordinates that turn one link about one axis
  CHECK_THAT(message_of({hinge("j", "", kNone), hinge("l", "j", kNone), hinge("k", "l", kNone, {"j"}), hinge("m", "k", kSome, {"l"})}),
             Contains(" and those that follow it move nothing"));
}

TEST_CASE("a gripper that shows one of its fingers alone to gravity loads from its file", "[mimic]") {
  const Model model = parse_urdf(R"(<robot name="gripper">
<link name="palm"/><link name="right"/>
<link name="left"><inertial><mass value="0.02"/><inertia ixx="1e-5" iyy="1e-5" izz="1e-5" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="opens" type="prismatic"><parent link="palm"/><child link="left"/><axis xyz="0 1 0"/>
<limit lower="0" upper="0.04" effort="100" velocity="0.2"/></joint>
<joint name="ghost" type="prismatic"><parent link="palm"/><child link="right"/><axis xyz="0 -1 0"/>
<limit lower="0" upper="0.04" effort="100" velocity="0.2"/><mimic joint="opens"/></joint>
</robot>)",
                                 "gripper.urdf");
  CHECK(model.degrees_of_freedom() == 1);
  CHECK(model.tree.shape.velocities == 2);
}

TEST_CASE("joints depend on each other where the tied mass matrix is singular in a generic pose, and nowhere else", "[mimic]") {
  int singular = 0, regular = 0;
  for (std::uint64_t seed = 1; seed <= 400; ++seed) {
    Random random(seed);
    Model model = random_tree({.bodies = 4 + static_cast<Index>(random.below(9)), .seed = seed, .balls = seed % 3 == 0, .frees = false});
    const Tree& tree = model.tree;
    std::vector<Index> screws;
    for (Index i = 1; i < tree.shape.slots; ++i) {
      if (random.uniform(0, 1) < 0.5) std::fill_n(model.constants.inertia.row(i), 10, 0.0);
      if (tree.kind(i) == JointKind::screw) screws.push_back(i);
    }
    for (std::size_t k = screws.size(); k > 1; --k) std::swap(screws[k - 1], screws[random.below(k)]);
    const std::size_t leaders = 1 + random.below(2);
    MatrixXd Z = MatrixXd::Identity(tree.shape.velocities, tree.shape.velocities);
    for (std::size_t k = leaders; k < std::min(screws.size(), leaders + 1 + random.below(4)); ++k) {
      const Index f = screws[k], l = screws[k % leaders];
      const double multiplier = random.uniform(-2, 2);
      model.mimics.push_back({f, l, tree.first_v(f), tree.first_v(l), tree.first_q(f), tree.first_q(l), multiplier, 0.3});
      Z.col(tree.first_v(l)) += multiplier * Z.col(tree.first_v(f));
      Z.col(tree.first_v(f)).setZero();
    }
    const PlainTree plain = reference::plain_tree(model);
    VectorXd q = VectorXd::Zero(plain.positions);
    for (Index i = 1; i < tree.shape.slots; ++i) {
      if (tree.kind(i) == JointKind::screw) q[tree.first_q(i)] = random.uniform(-1.5, 1.5);
      if (tree.kind(i) == JointKind::ball) q.segment<4>(tree.first_q(i)) = Eigen::Vector4d(0.1, -0.5, 0.3, 0.7).normalized();
    }
    for (const Mimic& tie : model.mimics) q[tie.follower_q] = tie.multiplier * q[tie.leader_q] + tie.offset;
    MatrixXd M = Z.transpose() * reference::mass_matrix(plain, q) * Z;
    for (const Mimic& tie : model.mimics) M(tie.follower_v, tie.follower_v) = 1;  // no coordinate
    const VectorXd scale = M.diagonal().unaryExpr([](double m) { return m > 0 ? 1 / std::sqrt(m) : 1; });
    const double least = Eigen::SelfAdjointEigenSolver<MatrixXd>(scale.asDiagonal() * M * scale.asDiagonal()).eigenvalues()[0];
    CAPTURE(seed, least);
    if (least > 1e-10) {
      regular += 1;
      CHECK(dependent_joint(model) == 0);
    } else if (least < 1e-13) {
      singular += 1;
      CHECK(dependent_joint(model) != 0);
    }
  }
  CHECK(singular > 50);
  CHECK(regular > 50);
  CHECK(singular + regular > 390);
}

}  // namespace

}  // namespace linden::mimic_test

#include "models/build/merged_models.hpp"

#include <catch2/catch.hpp>
#include <numbers>

#include "models/build/builder.hpp"
#include "models/build/generators.hpp"
#include "models/build/isometry.hpp"
#include "models/urdf/urdf.hpp"

namespace linden::merged_models_test {
using Catch::Matchers::Contains;

namespace {

const std::string kArm = LINDEN_MODELS_DIR "/arm.urdf";
const std::string kHand = LINDEN_MODELS_DIR "/hand.urdf";
const std::string kHumanoid = LINDEN_MODELS_DIR "/humanoid.urdf";

Pose placed(double x, double y, double turn) {
  Isometry pose = Isometry::Identity();
  pose.translation() = Eigen::Vector3d(x, y, 0.3);
  pose.linear() = Eigen::AngleAxisd(turn, Eigen::Vector3d(1, 2, 2) / 3).toRotationMatrix();
  return pose_of(pose);
}

Isometry placement(const Model& model, Index slot) {
  Isometry pose = Isometry::Identity();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      pose.linear()(row, column) = model.constants.tree_placement(slot, 3 * row + column);
    }
    pose.translation()[row] = model.constants.tree_placement(slot, 9 + row);
  }
  return pose;
}

/// Everything of `part` is in `whole`, under its name and in its place.
void check_is_in(const PlacedModel& part, const Model& whole) {
  const Model& model = part.model;
  const std::string prefix = part.name.empty() ? "" : part.name + "/";
  std::vector<Index> slot_of(static_cast<std::size_t>(model.tree.shape.slots), 0);
  for (Index i = 1; i < model.tree.shape.slots; ++i) {
    const auto at = static_cast<std::size_t>(i);
    INFO(part.name << " " << model.names.joint[at]);
    const auto found = std::ranges::find(whole.names.joint, prefix + model.names.joint[at]);
    REQUIRE(found != whole.names.joint.end());
    const auto slot = static_cast<Index>(found - whole.names.joint.begin());
    slot_of[at] = slot;
    CHECK(whole.names.body[static_cast<std::size_t>(slot)] == prefix + model.names.body[at]);
    CHECK(whole.tree.kind(slot) == model.tree.kind(i));
    CHECK(whole.tree.parent(slot) == slot_of[static_cast<std::size_t>(model.tree.parent(i))]);
    for (int k = 0; k < 10; ++k) CHECK(whole.constants.inertia(slot, k) == model.constants.inertia(i, k));
    for (int k = 0; k < 2; ++k) CHECK(whole.constants.screw(slot, k) == model.constants.screw(i, k));
    CHECK(whole.constants.subtree_mass(slot) == Approx(model.constants.subtree_mass(i)));
    const Isometry expected = model.tree.parent(i) == 0 ? Isometry(isometry(part.pose) * placement(model, i)) : placement(model, i);
    CHECK(placement(whole, slot).matrix().isApprox(expected.matrix(), 1e-15));
    for (Index k = 0; k < velocity_count(model.tree.kind(i)); ++k) {
      const Index from = model.tree.first_v(i) + k, to = whole.tree.first_v(slot) + k;
      CHECK(whole.names.velocity[static_cast<std::size_t>(to)] == prefix + model.names.velocity[static_cast<std::size_t>(from)]);
      CHECK(whole.attributes.lower(to) == model.attributes.lower(from));
      CHECK(whole.attributes.upper(to) == model.attributes.upper(from));
      CHECK(whole.attributes.max_effort(to) == model.attributes.max_effort(from));
      CHECK(whole.attributes.max_velocity(to) == model.attributes.max_velocity(from));
      CHECK(whole.attributes.damping(to) == model.attributes.damping(from));
      CHECK(whole.attributes.friction(to) == model.attributes.friction(from));
    }
    for (Index k = 0; k < position_count(model.tree.kind(i)); ++k) {
      CHECK(whole.names.position[static_cast<std::size_t>(whole.tree.first_q(slot) + k)] ==
            prefix + model.names.position[static_cast<std::size_t>(model.tree.first_q(i) + k)]);
    }
  }
  for (const auto& [link, place] : model.names.link) {
    const LinkPlace& found = whole.names.link.at(prefix + link);
    CHECK(found.slot == slot_of[static_cast<std::size_t>(place.slot)]);
    const Isometry in_body = isometry(place.in_body), expected = place.slot == 0 ? Isometry(isometry(part.pose) * in_body) : in_body;
    CHECK(isometry(found.in_body).matrix().isApprox(expected.matrix(), 1e-15));
  }
  for (const auto& [joint, slot] : model.names.slot_of_joint) {
    CHECK(whole.names.slot_of_joint.at(prefix + joint) == slot_of[static_cast<std::size_t>(slot)]);
  }
  for (const BodyShape& shape : model.shapes) {
    const auto found = std::ranges::find_if(whole.shapes, [&](const BodyShape& other) {
      return other.link == prefix + shape.link && other.pose == shape.pose && other.shape.kind == shape.shape.kind &&
             other.shape.size == shape.shape.size;
    });
    REQUIRE(found != whole.shapes.end());
    CHECK(found->slot == slot_of[static_cast<std::size_t>(shape.slot)]);
  }
  for (const Mimic& mimic : model.mimics) {
    const Index follower = slot_of[static_cast<std::size_t>(mimic.follower_slot)],
                leader = slot_of[static_cast<std::size_t>(mimic.leader_slot)];
    const auto found = std::ranges::find(whole.mimics, follower, &Mimic::follower_slot);
    REQUIRE(found != whole.mimics.end());
    CHECK(found->leader_slot == leader);
    CHECK(found->follower_q == whole.tree.first_q(follower));
    CHECK(found->leader_q == whole.tree.first_q(leader));
    CHECK(found->follower_v == whole.tree.first_v(follower));
    CHECK(found->leader_v == whole.tree.first_v(leader));
    CHECK(found->multiplier == mimic.multiplier);
    CHECK(found->offset == mimic.offset);
  }
}

LinkSpec link_of(const std::string& name, const std::string& parent, JointType type, double mass, const Eigen::Vector3d& at) {
  LinkSpec link;
  link.name = name;
  link.joint = name + "_joint";
  link.parent = parent;
  link.type = type;
  link.axis = Eigen::Vector3d(0.6, 0, 0.8);
  link.placement.translation() = at;
  link.inertia = box_inertia(mass, Eigen::Vector3d(0.1, 0.2, 0.3), Eigen::Vector3d(0.02, 0.01, -0.05));
  link.shapes = {box_shape(Eigen::Vector3d(0.1, 0.2, 0.3), Eigen::Vector3d(0.02, 0.01, -0.05))};
  return link;
}

}  // namespace

TEST_CASE("merged models keep their bodies, names, attributes and mimic joints", "[merged models]") {
  const std::vector<PlacedModel> parts{{load_urdf(kHand), "hand", placed(1, 2, 0.4)},
                                       {load_urdf(kHumanoid, Base::floating), "walker", placed(-1, 0, 1)},
                                       {load_urdf(kArm), ""},
                                       {random_tree({.bodies = 40}), "random", placed(0, 5, -2)},
                                       {load_urdf(kHand), "other hand", placed(3, 0, 0)}};
  const Model whole = merged(parts, "crowd");
  CHECK(whole.names.model == "crowd");
  CHECK(std::ranges::is_sorted(whole.shapes, {}, &BodyShape::slot));
  Index bodies = 0, positions = 0;
  double mass = 0;
  std::size_t mimics = 0;
  for (const PlacedModel& part : parts) {
    check_is_in(part, whole);
    bodies += part.model.tree.bodies();
    positions += part.model.tree.shape.positions;
    mass += part.model.constants.subtree_mass(0);
    mimics += part.model.mimics.size();
  }
  CHECK(whole.tree.bodies() == bodies);
  CHECK(whole.tree.shape.positions == positions);
  CHECK(whole.mimics.size() == mimics);
  REQUIRE(mimics > 0);
  CHECK(whole.constants.subtree_mass(0) == Approx(mass));
  for (Index i = 2; i < whole.tree.shape.slots; ++i) {
    CHECK(whole.tree.parent(i) < i);
    CHECK(whole.tree.level(i) >= whole.tree.level(i - 1));
    if (whole.tree.level(i) == whole.tree.level(i - 1)) CHECK(whole.tree.kind(i) >= whole.tree.kind(i - 1));
  }
}

TEST_CASE("meshes of merged models are found where they were", "[merged models]") {
  Model one = chain(1), other = chain(1);
  one.source = LINDEN_MODELS_DIR "/arm.urdf";
  other.source = LINDEN_MODELS_DIR "/scenes/arm.urdf";
  one.shapes = {{1, "link1", Pose{}, {ShapeKind::mesh, {1, 1, 1}, "hand.urdf"}}};
  other.shapes = {{1, "link1", Pose{}, {ShapeKind::mesh, {1, 1, 1}, "../hand.urdf"}},
                  {1, "link1", Pose{}, {ShapeKind::mesh, {1, 1, 1}, "nowhere.stl"}}};
  const Model apart = merged({{one, "a"}, {other, "b"}}, "two");
  REQUIRE(apart.shapes.size() == 3);
  CHECK(apart.source.empty());
  CHECK(apart.shapes[0].shape.mesh == LINDEN_MODELS_DIR "/hand.urdf");
  CHECK(apart.shapes[1].shape.mesh == LINDEN_MODELS_DIR "/hand.urdf");
  CHECK(apart.shapes[2].shape.mesh == "nowhere.stl");
  const Model together = merged({{one, "a"}, {one, "b"}}, "two");
  CHECK(together.source == one.source);
  CHECK(together.shapes[1].shape.mesh == "hand.urdf");
}

TEST_CASE("one model merged with nothing is itself", "[merged models]") {
  for (const Model& model : {load_urdf(kHand), random_tree({.bodies = 30}), humanoids(2)}) {
    const Model same = merged({{model, ""}}, model.names.model);
    CHECK(same.hash() == model.hash());
    CHECK(same.names.position == model.names.position);
    CHECK(same.names.velocity == model.names.velocity);
  }
}

TEST_CASE("warnings of merged models say whose they are", "[merged models]") {
  TreeBuilder builder("w");
  LinkSpec link;
  link.name = "a";
  link.joint = "j";
  link.inertia = box_inertia(1, {1, 1, 1}, {0, 0, 0});
  builder.add(link).warn("a grain of salt");
  const Model whole = merged({{builder.build(), "left"}, {chain(2), "right"}}, "two");
  CHECK(whole.warnings == std::vector<std::string>{"left: a grain of salt"});
}

TEST_CASE("models whose names meet are not merged", "[merged models]") {
  const auto attempt = [](const std::string& a, const std::string& b) {
    return merged({{chain(2), a}, {chain(3), b}}, "two");
  };
  CHECK_THROWS_WITH(attempt("", ""), Contains("two coordinates are called \"joint1\"") && Contains("a name of its own"));
  CHECK_THROWS_AS(attempt("a", "a"), InputError);
  CHECK_NOTHROW(attempt("", "a"));
  CHECK_THROWS_AS(merged({}, "none"), InputError);
  Pose broken;
  broken.shift[0] = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(merged({{chain(2), "a", broken}}, "one"), Contains("not finite"));
}

TEST_CASE("a model that hangs from a link of another is as if it had been built there, base and all", "[merged models]") {
  TreeBuilder crane("crane"), rope("rope"), whole("whole");
  crane.add(link_of("mast", "", JointType::fixed, 50, {0, 0, 1}));
  crane.add(link_of("boom", "mast", JointType::revolute, 9, {0.1, 0, 2}));
  crane.add(link_of("hook", "boom", JointType::fixed, 1, {3, 0, 0.2}));  // part of the boom's body
  rope.add(link_of("clamp", "", JointType::fixed, 2, {0, 0, 0.1}));
  rope.add(link_of("first", "clamp", JointType::ball, 0.3, {0, 0, -0.1}));
  rope.add(link_of("second", "first", JointType::revolute, 0.2, {0, 0, -0.3}));
  const Pose pose = placed(0.2, -0.1, 0.7);
  for (LinkSpec link : {link_of("crane/mast", "", JointType::fixed, 50, {0, 0, 1}), link_of("crane/boom", "crane/mast", JointType::revolute, 9, {0.1, 0, 2}),
                        link_of("crane/hook", "crane/boom", JointType::fixed, 1, {3, 0, 0.2})}) {
    whole.add(link);
  }
  LinkSpec clamp = link_of("rope/clamp", "crane/hook", JointType::fixed, 2, {0, 0, 0.1});
  clamp.placement = isometry(pose) * clamp.placement;
  whole.add(clamp);
  whole.add(link_of("rope/first", "rope/clamp", JointType::ball, 0.3, {0, 0, -0.1}));
  whole.add(link_of("rope/second", "rope/first", JointType::revolute, 0.2, {0, 0, -0.3}));
  const Model expected = whole.build();
  // in either order of the list
  for (const bool rope_first : {false, true}) {
    std::vector<PlacedModel> parts{{crane.build(), "crane"}, {rope.build(), "rope", pose, "crane/hook"}};
    if (rope_first) std::swap(parts[0], parts[1]);
    const Model found = merged(parts, "whole");
    REQUIRE(found.tree.shape.slots == expected.tree.shape.slots);
    for (Index i = 1; i < expected.tree.shape.slots; ++i) {
      INFO(expected.names.body[static_cast<std::size_t>(i)]);
      CHECK(found.names.body[static_cast<std::size_t>(i)] == expected.names.body[static_cast<std::size_t>(i)]);
      CHECK(found.tree.parent(i) == expected.tree.parent(i));
      CHECK(found.constants.subtree_mass(i) == Approx(expected.constants.subtree_mass(i)));
      for (int k = 0; k < 10; ++k) CHECK(found.constants.inertia(i, k) == Approx(expected.constants.inertia(i, k)).margin(1e-13));
      CHECK(placement(found, i).matrix().isApprox(placement(expected, i).matrix(), 1e-14));
    }
    CHECK(found.welded.mass() == 50);
    for (const auto& [link, place] : expected.names.link) {
      INFO(link);
      REQUIRE(found.names.link.contains(link));
      CHECK(found.names.link.at(link).slot == place.slot);
      CHECK(isometry(found.names.link.at(link).in_body).matrix().isApprox(isometry(place.in_body).matrix(), 1e-14));
    }
    REQUIRE(found.shapes.size() == expected.shapes.size());
    for (const BodyShape& shape : expected.shapes) {
      const auto same = std::ranges::find(found.shapes, shape.link, &BodyShape::link);
      REQUIRE(same != found.shapes.end());
      CHECK(same->slot == shape.slot);
      CHECK(isometry(same->pose).matrix().isApprox(isometry(shape.pose).matrix(), 1e-14));
    }
  }
}

TEST_CASE("models hang from one another in a row, from what is fixed to the world too, and neither in a ring nor from nothing", "[merged models]") {
  const auto part = [](const std::string& name, const std::string& parent) {
    return PlacedModel{generate("chain:2"), name, placed(0.1, 0.2, 0.3), parent};
  };
  const Model row = merged({part("c", "b/link2"), part("a", ""), part("b", "a/link1")}, "row");
  CHECK(row.tree.roots().size() == 1);
  CHECK(row.tree.levels() - 1 == 5);  // a: 2, b below its first, c below that one's second
  TreeBuilder post("post");
  post.add(link_of("top", "", JointType::fixed, 5, {1, 2, 3})).add(link_of("arm", "top", JointType::revolute, 1, {0, 0, 0}));
  const Model stands = merged({{post.build(), "post", placed(0, 0, 0)}, {generate("chain:2"), "rope", Pose{}, "post/top"}}, "stands");
  const auto rope = static_cast<Index>(std::ranges::find(stands.names.body, "rope/link1") - stands.names.body.begin());
  CHECK(stands.tree.parent(rope) == 0);
  CHECK(placement(stands, rope).translation().isApprox(Eigen::Vector3d(1, 2, 3.3)));
  const auto message = [](const std::vector<PlacedModel>& parts) {
    try {
      merged(parts, "m");
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("nothing was thrown");
  };
  CHECK_THAT(message({part("a", "b/link1"), part("b", "a/link1")}), Contains("model \"a\" hangs from \"b/link1\": it hangs from itself"));
  CHECK_THAT(message({part("a", "a/link1")}), Contains("it hangs from itself"));
  CHECK_THAT(message({part("a", ""), part("b", "a/lnk1")}), Contains("there is no link \"a/lnk1\"") && Contains("did you mean \"a/link1\"?"));
  PlacedModel floating{load_urdf(kHumanoid, Base::floating), "h", Pose{}, "a/link1"};
  CHECK_THAT(message({part("a", ""), floating}), Contains("its base floats"));
}

}  // namespace linden::merged_models_test

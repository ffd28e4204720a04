// Shapes that stand in the world: as a scene's `world` has them, as C++ does, and as links that a URDF fixes to the world; bodies touch all of them.
#include <catch2/catch.hpp>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <fmt/format.h>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engine/queries/kinematics.hpp"
#include "engine/queries/link_motion.hpp"
#include "engine/scene/scene_bytes.hpp"
#include "engine/scene/scene_file.hpp"
#include "engine/simulation.hpp"
#include "engine/view/drawing.hpp"
#include "models/build/builder.hpp"
#include "models/build/world_shapes.hpp"
#include "models/shapes/pair_contact.hpp"
#include "tests/engine/folder.hpp"
#include "tests/engine/scenes.hpp"

namespace linden::scene_world_test {
namespace {

using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;

const std::string kEffects = "effects: {gravity: [0, 0, -9.81], contact: {stiffness: 1e8, friction: 0.5}}\n";

std::string link(const std::string& name, const std::string& shape, double mass) {
  return fmt::format(R"(<link name="{}"><inertial><mass value="{}"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>)"
                     R"(<collision><geometry>{}</geometry></collision></link>)",
                     name, mass, shape);
}

/// A ball and a block of 0.1 m and 1 kg, a table of one link without mass whose top is at 0.7 m, a hammer on a hinge about y at the world.
class Things : public Folder {
 public:
  Things() {
    write("block.urdf", "<robot name=\"block\">" + link("block", R"(<box size="0.1 0.1 0.1"/>)", 1) + "</robot>");
    write("ball.urdf", "<robot name=\"ball\">" + link("ball", R"(<sphere radius="0.05"/>)", 1) + "</robot>");
    write("table.urdf", R"(<robot name="table"><link name="leg"><collision><origin xyz="0 0 0.33"/><geometry><cylinder radius="0.05" length="0.66"/>)"
                        R"(</geometry></collision></link><link name="top"><collision><geometry><box size="1 0.6 0.04"/></geometry></collision></link>)"
                        R"(<joint name="nail" type="fixed"><parent link="leg"/><child link="top"/><origin xyz="0 0 0.68"/></joint></robot>)");
    write("hammer.urdf", R"(<robot name="hammer"><link name="mount"/>)" + link("head", R"(<sphere radius="0.05"/>)", 1) +
                             R"(<joint name="hinge" type="continuous"><parent link="mount"/><child link="head"/><axis xyz="0 1 0"/></joint></robot>)");
    write("wedge.obj", "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nv -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nf 1 2 3 4\nf 8 7 6 5\nf 1 5 6 2\nf 2 6 7 3\n"
                       "f 3 7 8 4\nf 4 8 5 1\n");
  }
  Scene scene(const std::string& text) const { return parse_scene(text, file("s.yaml")); }
  std::string refusal(const std::string& world) const {
    try {
      scene("model: block.urdf\nbase: floating\nworld:\n  - {type: sphere, name: knob, radius: 0.1}\n  - " + world + "\n" + kEffects);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
  /// A block or ball let go at a height, for a while: how high its middle is then.
  double height_of(const std::string& model, double height, const std::string& world, int steps = 1500) const {
    const Scene read = scene(fmt::format("model: {}.urdf\nbase: floating\ninitial: {{base: {{position: [0, 0, {}]}}}}\nworld:\n{}{}", model, height,
                                         world, kEffects));
    CHECK(read.model.warnings.size() == (world.find("mesh") == world.npos ? 0u : 1u));  // of a mesh that stands as its hull
    Simulation simulation(read);
    REQUIRE(simulation.run(steps).ok());
    return link_pose(Kinematics(simulation), place_of(simulation.model(), model)).shift[2];
  }
};

TEST_CASE("bodies come to rest on shapes of the world of every type, where they say they are") {
  const Things things;
  const Approx kRests = Approx(0.3 + 0.05).margin(1e-6);  // half of what falls above the top, less what it sinks
  // a face, a round top, a cylinder's flat end, a capsule's round end, a hull's face: each with its top at z = 0.3
  CHECK(things.height_of("block", 0.5, "  - {type: box, size: [1, 1, 0.2], position: [0, 0, 0.2]}\n") == kRests);
  CHECK(things.height_of("ball", 0.5, "  - {type: sphere, radius: 0.1, position: [0, 0, 0.2]}\n") == kRests);
  CHECK(things.height_of("block", 0.5, "  - {type: cylinder, radius: 0.3, length: 0.2, position: [0, 0, 0.2]}\n") == kRests);
  CHECK(things.height_of("ball", 0.5, "  - {type: capsule, radius: 0.1, length: 0.2, position: [0, 0, 0.1]}\n") == kRests);
  CHECK(things.height_of("block", 0.5, "  - {type: mesh, file: wedge.obj, scale: [0.5, 0.5, 0.2], position: [0, 0, 0.3]}\n") == kRests);
  // turned: a box that stands on end, by roll, pitch and yaw and by a quaternion
  CHECK(things.height_of("block", 0.5, "  - {type: box, size: [0.6, 1, 1], rotation: [0, 1.5707963267948966, 0]}\n") == kRests);
  CHECK(things.height_of("block", 0.5, "  - {type: box, size: [0.6, 1, 1], quaternion: [0, 0.7071067811865476, 0, 0.7071067811865476]}\n") ==
        kRests);
  // an ellipsoid's end, turned to stand up; a plane of every spelling, and one that is tilted under a ball in a groove of two
  CHECK(things.height_of("ball", 0.5, "  - {type: ellipsoid, radii: [0.1, 0.4, 0.4], position: [0, 0, 0.2], rotation: [0, 1.5707963267948966, 0]}\n") == kRests);
  CHECK(things.height_of("block", 0.5, "  - {type: plane, height: 0.3}\n") == kRests);
  CHECK(things.height_of("block", 0.5, "  - {type: plane, normal: [0, 0, 2], position: [7, 8, 0.3]}\n") == kRests);
  CHECK(things.height_of("block", 0.5, "  - {type: plane, rotation: [0, 0, 1], height: 0.3}\n") == kRests);
  CHECK(things.height_of("ball", 0.5, "  - {type: plane, normal: [1, 0, 1], position: [0, 0, 0.3]}\n  - {type: plane, normal: [-1, 0, 1], position: [0, 0, 0.3]}\n") ==
        Approx(0.3 + 0.05 * std::sqrt(2)).margin(1e-6));
  // beside it there is nothing
  CHECK(things.height_of("block", 0.5, "  - {type: box, size: [1, 1, 0.2], position: [0.7, 0, 0.2]}\n", 300) ==
        Approx(0.5 - 0.5 * 9.81 * 0.3 * 0.3).margin(1e-3));
}

TEST_CASE("shapes of the world are links of it, with names of their own or their types'") {
  const Things things;
  const Scene scene = things.scene("model: block.urdf\nbase: floating\nworld:\n  - {type: box, name: table, size: [1, 1, 0.1], position: [1, 2, 3]}\n"
                                   "  - {type: sphere, radius: 0.1}\n" + kEffects);
  const Model& model = scene.model;
  CHECK(place_of(model, "world/table").slot == 0);
  CHECK(place_of(model, "world/table").in_body.shift == std::array<double, 3>{1, 2, 3});
  CHECK(place_of(model, "world/sphere_2").slot == 0);
  REQUIRE(scene.effects.contact->shapes.size() == 3);
  CHECK(scene.effects.contact->shapes[0].link == "world/table");
  CHECK(scene.effects.contact->pairs.size() == 2);  // of the block with each, not of the two with each other
  // they change nothing of what moves, and go with the scene
  CHECK(model.hash() == load_urdf(things.file("block.urdf"), Base::floating).hash());
  const Scene again = scene_from_bytes(to_bytes(scene));
  CHECK(again.model.names.link.contains("world/table"));
  CHECK(again.model.welded.shapes.size() == 2);
}

TEST_CASE("pairs and except name shapes of the world as links") {
  const Things things;
  const auto read = [&](const std::string& which) {
    return things.scene("model: block.urdf\nbase: floating\nworld:\n  - {type: box, name: table, size: [1, 1, 0.1]}\n  - {type: sphere, name: knob, radius: 0.1}\n"
                        "effects: {contact: {" + which + "}}\n");
  };
  CHECK(read("pairs: [[block, world/knob]]").effects.contact->pairs == std::vector<std::pair<std::uint32_t, std::uint32_t>>{{1, 2}});
  CHECK(read("except: [[world/knob, block]]").effects.contact->pairs == std::vector<std::pair<std::uint32_t, std::uint32_t>>{{0, 2}});
  CHECK_THROWS_WITH(read("except: [[world/knop, block]]"), Contains("s.yaml:6: effects.contact: ") && Contains("has no link \"world/knop\"") &&
                                                               Contains("did you mean \"world/knob\"?"));
}

TEST_CASE("a body that hangs on the world touches shapes of the world, but not the link that it hangs on") {
  const Things things;
  things.write("anvil.urdf", R"(<robot name="anvil"><link name="mount"><collision><geometry><sphere radius="0.2"/></geometry></collision></link>)" +
                                 link("head", R"(<sphere radius="0.05"/>)", 1) +
                                 R"(<joint name="hinge" type="continuous"><parent link="mount"/><child link="head"/><axis xyz="0 1 0"/></joint></robot>)");
  std::vector<std::string> notes;
  const Model model = with_world(load_urdf(things.file("anvil.urdf")), {{"post", {ShapeKind::sphere, {0.1}, ""}, {.shift = {0.5, 0, 0}}}});
  const PairContact contact = pair_contact_of(model, notes);
  REQUIRE(contact.shapes.size() == 3);
  CHECK(notes.empty());
  REQUIRE(contact.pairs.size() == 1);
  CHECK(contact.shapes[contact.pairs[0].first].link == "world/post");
  CHECK(contact.shapes[contact.pairs[0].second].link == "head");
}

TEST_CASE("a scene without contact is told that nothing touches the shapes of its world") {
  const Things things;
  const std::string text = "model: block.urdf\nbase: floating\nworld: [{type: sphere, radius: 0.1}]\neffects: {gravity: [0, 0, -9.81]}\n";
  const std::vector<std::string> warnings = things.scene(text).model.warnings;
  REQUIRE(warnings.size() == 1);
  CHECK_THAT(warnings[0], StartsWith(things.file("s.yaml") + ":3: world: nothing touches these shapes"));
  CHECK(things.scene("model: block.urdf\nbase: floating\nworld: []\n").model.warnings.empty());
}

TEST_CASE("what is wrong with a shape of the world is said with its line") {
  const Things things;
  const auto check = [&](const std::string& shape, const std::vector<std::string>& parts) {
    CAPTURE(shape);
    const std::string found = things.refusal(shape);
    CHECK_THAT(found, StartsWith(things.file("s.yaml") + ":5: "));
    CHECK(found.find('\n') == found.npos);
    for (const std::string& part : parts) CHECK_THAT(found, Contains(part));
  };
  check("{size: [1, 1, 1]}", {"world[1] has no type", "box, sphere, ellipsoid, cylinder, capsule, mesh, plane or heights"});
  check("{type: bock, size: [1, 1, 1]}", {"world[1].type is \"bock\"", "did you mean box?"});
  check("{type: box}", {"world[1], a box, has no size"});
  check("{type: box, size: [1, 0, 1]}", {"world[1].size", "above zero"});
  check("{type: box, size: [1, 1]}", {"world[1].size", "[x, y, z]"});
  check("{type: sphere}", {"world[1], a sphere, has no radius"});
  check("{type: sphere, radius: 0}", {"world[1].radius"});
  check("{type: capsule, radius: 1}", {"world[1], a capsule, has no length"});
  check("{type: cylinder, radius: 1, size: 2}", {"the key \"size\" of world[1] is not known", "length"});
  check("{type: ellipsoid}", {"world[1], an ellipsoid, has no radii"});
  check("{type: ellipsoid, radii: [1, 2]}", {"world[1].radii", "[a, b, c]"});
  check("{type: ellipsoid, radii: [1, 0, 2]}", {"world[1].radii holds 1, 0 and 2", "above zero"});
  check("{type: ellipsoid, radii: [1, 1, 2], radius: 1}", {"the key \"radius\" of world[1] is not known", "radii"});
  check("{type: plane, size: [1, 1, 1]}", {"the key \"size\" of world[1] is not known"});
  check("{type: plane, normal: [0, 0, 0]}", {"world[1].normal", "not all zero"});
  check("{type: plane, normal: [0, 1]}", {"world[1].normal", "[x, y, z]"});
  check("{type: plane, height: high}", {"world[1].height"});
  check("{type: plane, height: 1, position: [0, 0, 1]}", {"world[1]: height and position are both given"});
  check("{type: plane, normal: [0, 0, 1], rotation: [0, 0, 1]}", {"world[1]: a normal and a turn are both given"});
  check("{type: plane, name: knob}", {"two links are called \"world/knob\""});
  check("{type: mesh}", {"world[1], a mesh, has no file"});
  check("{type: mesh, file: none.stl}", {"there is no file", "none.stl", "relative to the scene"});
  check("{type: mesh, file: wedge.obj, scale: [1, 0, 1]}", {"world[1].scale", "none of them zero"});
  check("{type: sphere, radius: 1, name: knob}", {"two links are called \"world/knob\""});
  check("{type: sphere, radius: 1, position: [1, 2]}", {"world[1].position"});
  check("{type: sphere, radius: 1, rotation: [0, 0, 0], quaternion: [0, 0, 0, 1]}", {"rotation and quaternion are both given"});
  check("7", {"world[1] is \"7\"", "a shape"});
  CHECK_THROWS_WITH(things.scene("model: block.urdf\nbase: floating\nworld: 3\n"), Contains("s.yaml:3: world is \"3\""));
  CHECK_THROWS_WITH(things.scene("models:\n  - {model: block.urdf, name: world, base: floating}\n"), Contains("s.yaml:2: a model is called world"));
}

TEST_CASE("what C++ puts into the world is checked") {
  const Things things;
  const Model block = load_urdf(things.file("block.urdf"), Base::floating);
  const CollisionShape ball{ShapeKind::sphere, {0.1}, ""};
  CHECK_THROWS_WITH(with_world(block, {{"", ball}}), Contains("it has no name"));
  CHECK_THROWS_WITH(with_world(block, {{"a", ball}, {"a", ball}}), Contains("two links are called \"world/a\""));
  CHECK_THROWS_WITH(with_world(block, {{"a", {ShapeKind::cylinder, {0.1, -1}, ""}}}), Contains("its size is -1"));
  CHECK_THROWS_WITH(with_world(block, {{"a", {ShapeKind::mesh, {1, 0, 1}, "a.stl"}}}), Contains("its scale is 0"));
  CHECK_THROWS_WITH(with_world(block, {{"a", ball, {.shift = {0, NAN, 0}}}}), Contains("its pose is not finite"));
  CHECK(with_world(block, {{"a", {ShapeKind::mesh, {1, -1, 1}, "a.stl"}}}).welded.shapes.size() == 1);  // mirrored
  CHECK_THROWS_WITH(with_world(block, {{"a", {ShapeKind::ellipsoid, {1, 0, 1}, ""}}}), Contains("its size is 0"));
  CHECK_THROWS_WITH(plane_pose({0, 0, 0}, 1), Contains("a plane of normal 0 0 0"));
  CHECK_THROWS_WITH(plane_pose({0, 0, 1}, NAN), Contains("finite numbers"));
  const Model floor = with_world(block, {{"floor", {ShapeKind::plane, {}, ""}, plane_pose({0, 0, 3}, 2)}});
  CHECK(floor.welded.shapes[0].pose.shift == std::array<double, 3>{0, 0, 2});
  // and they stand in the world alone
  LinkSpec moving;
  moving.name = "a";
  moving.joint = "free";
  moving.type = JointType::free;
  moving.inertia = {1, Eigen::Vector3d::Zero(), Eigen::Matrix3d::Identity()};
  moving.shapes = {{Pose{}, {ShapeKind::plane, {}, ""}}};
  CHECK_THROWS_WITH(TreeBuilder("robot").add(moving).build(), Contains("link \"a\": a collision shape is an ellipsoid, a plane or heights"));
  std::vector<std::string> notes;
  Effects effects;
  effects.contact = pair_contact_of(floor, notes);
  CHECK_NOTHROW(check(effects, floor));
  std::swap(effects.contact->shapes[0].slot, effects.contact->shapes[1].slot);
  CHECK_THROWS_WITH(check(effects, floor), Contains("a plane or heights are on a body that moves"));
  CollisionShape hills{ShapeKind::heights, {}, ""};
  CHECK_THROWS_WITH(with_world(block, {{"a", hills}}), Contains("its heights are no grid"));
  hills.heights = std::make_shared<const HeightField>(HeightField{2, 2, 1, 1, 0, 0, {0, 0, 0}});
  CHECK_THROWS_WITH(with_world(block, {{"a", hills}}), Contains("its heights are no grid"));
  hills.heights = std::make_shared<const HeightField>(HeightField{2, 2, 1, 1, 0, 0, {0, 0, 0, NAN}});
  CHECK_THROWS_WITH(with_world(block, {{"a", hills}}), Contains("finite numbers"));
  hills.heights = std::make_shared<const HeightField>(HeightField{2, 2, 1, 1, 0, 0, {0, 0, 0, 1}});
  const Model hilly = with_world(block, {{"hills", hills}});
  moving.shapes = {{Pose{}, hills}};
  CHECK_THROWS_WITH(TreeBuilder("robot").add(moving).build(), Contains("link \"a\": a collision shape is an ellipsoid, a plane or heights"));
  effects.contact = pair_contact_of(hilly, notes);
  CHECK_NOTHROW(check(effects, hilly));
  std::swap(effects.contact->shapes[0].slot, effects.contact->shapes[1].slot);
  CHECK_THROWS_WITH(check(effects, hilly), Contains("a plane or heights are on a body that moves"));
}

TEST_CASE("shapes of the world are drawn, beside a robot that shows visuals alone too") {
  const Things things;
  things.write("seen.urdf", R"(<robot name="seen"><link name="mount"><visual><geometry><box size="1 1 1"/></geometry></visual>)"
                            R"(<collision><geometry><box size="1 1 1"/></geometry></collision></link>)" +
                                link("head", R"(<sphere radius="0.05"/>)", 1) +
                                R"(<joint name="hinge" type="continuous"><parent link="mount"/><child link="head"/><axis xyz="0 1 0"/></joint></robot>)");
  const Scene scene = things.scene("model: seen.urdf\nworld: [{type: sphere, name: knob, radius: 0.1, position: [3, 0, 0]}]\n" + kEffects);
  int visuals = 0, collisions = 0;
  const Drawing drawing = drawing_of(scene.model, scene.effects);
  for (const DrawnPart& part : drawing.parts) {
    if (part.link != "world/knob") continue;
    CHECK(part.pose.shift == std::array<double, 3>{3, 0, 0});
    visuals += part.layer == Layer::visual ? 1 : 0;
    collisions += part.layer == Layer::collision ? 1 : 0;
  }
  CHECK(visuals == 1);
  CHECK(collisions == 1);
}

TEST_CASE("planes of the world are drawn as ground, ellipsoids as what they are") {
  const Things things;
  const Scene scene = things.scene("model: block.urdf\nbase: floating\nworld: [{type: plane, name: wall, normal: [1, 0, 0], height: 2}, "
                                   "{type: ellipsoid, name: egg, radii: [1, 2, 3]}]\n" + kEffects);
  const Drawing drawing = drawing_of(scene.model, scene.effects);
  int walls = 0, eggs = 0;
  for (const DrawnPart& part : drawing.parts) {
    if (part.link == "world/wall") {
      walls += 1;
      CHECK(part.layer == Layer::ground);
      CHECK(part.pose.shift == std::array<double, 3>{2, 0, 0});
      CHECK(part.pose.rotation[2] == 1);
    }
    if (part.link == "world/egg") {
      eggs += 1;
      CHECK(part.scale == std::array<double, 3>{1, 2, 3});
    }
  }
  CHECK(walls == 1);
  CHECK(eggs == 2);  // to be seen, and as what touches
  CHECK(drawing.warnings.empty());
}

TEST_CASE("a block falls on a table of a URDF that moves nothing, and tells whom it touches") {
  const Things things;
  const Scene scene = things.scene("models:\n  - {model: table.urdf, position: [1, 0, 0]}\n"
                                   "  - {model: block.urdf, base: floating, position: [1.2, 0, 0.8]}\n" + kEffects);
  CHECK(scene.model.tree.bodies() == 1);
  CHECK(scene.model.warnings.empty());
  Simulation simulation(scene);
  simulation.keep_forces();
  REQUIRE(simulation.run(1000).ok());
  CHECK(link_pose(Kinematics(simulation), place_of(simulation.model(), "block/block")).shift[2] == Approx(0.75).margin(1e-6));
  const PairContact& contact = *scene.effects.contact;
  double weight = 0;
  for (const ContactPoint& point : simulation.contact_points()) {
    weight += point.force[2];
    CHECK(point.link == "block/block");
    CHECK(point.other == 0);
    CHECK(point.other_link == "table/top");
  }
  CHECK(weight == Approx(9.81).epsilon(1e-6));
  CHECK(contact.shapes[0].link == "table/leg");
  CHECK(contact.shapes[1].link == "table/top");
  CHECK(contact.pairs.size() == 2);
}

TEST_CASE("the crate of table.yaml comes to lie on the table, and is stopped by the post") {
  const auto ends_at = [](Scene scene) {
    Simulation simulation(scene);
    REQUIRE(simulation.run(std::lround(scene.duration / scene.options.step)).ok());
    CHECK(simulation.energy().kinetic < 1e-6);
    return link_pose(Kinematics(simulation), place_of(simulation.model(), "crate")).shift;
  };
  const double post = -0.8 + 0.1 + 0.4;  // middle of a crate that touches it
  Scene scene = load_scene(model_file("scenes/table.yaml"));
  const std::array<double, 3> stopped = ends_at(scene);
  CHECK(stopped[2] == Approx(1 + 0.4).margin(1e-5));
  CHECK(stopped[1] > post - 1e-5);
  std::vector<std::string> notes;
  CHECK(act_from_outside(scene.effects));  // the table and the post take momentum
  PairContact crates = *scene.effects.contact;
  std::erase_if(crates.pairs, [&](const auto& pair) { return crates.shapes[pair.first].slot == 0; });
  Effects alone;
  alone.contact = std::move(crates);
  CHECK_FALSE(act_from_outside(alone));
  const std::vector<ContactMaterial> materials = scene.effects.contact->materials;
  scene.effects.contact = pair_contact_of(scene.model, notes, {{"crate", "world/post"}});
  scene.effects.contact->materials = materials;
  CHECK(ends_at(scene)[1] < post - 0.01);
}

TEST_CASE("models that all stand still are refused, alone and together") {
  const Things things;
  CHECK_THROWS_WITH(things.scene("model: table.urdf\n"), Contains("nothing moves") && Contains("base: floating"));
  CHECK_THROWS_WITH(things.scene("models:\n  - {model: table.urdf}\n  - {model: table.urdf, name: other}\n"),
                    Contains("s.yaml:1: nothing moves") && Contains("base: floating"));
  CHECK_THROWS_WITH(things.scene("models: [{model: block.urdf}]\n"), Contains("s.yaml:1: nothing moves"));
}

TEST_CASE("a table that hangs from a link goes with it") {
  const Things things;
  const Scene scene = things.scene("models:\n  - {model: hammer.urdf}\n  - {model: table.urdf, parent: hammer/head, position: [0, 0, 1]}\n" + kEffects);
  CHECK(scene.model.tree.bodies() == 1);
  CHECK(place_of(scene.model, "table/top").slot == 1);
  CHECK(scene.effects.contact->shapes.back().slot == 1);
}

}  // namespace
}  // namespace linden::scene_world_test

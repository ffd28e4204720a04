// Binary glTF files say where the engine has every body, what it looks like, and nothing that a validator objects to.
#include "engine/view/gltf.hpp"

#include <cmath>
#include <limits>
#include <numbers>
#include <set>

#include "tests/engine/animations.hpp"
#include "tests/engine/glb_reader.hpp"

namespace linden::gltf_test {
namespace {

using Eigen::Affine3d;
using Eigen::Vector3d;
using Json = Glb::Json;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

Affine3d affine(const Pose& pose) {
  Affine3d place = Affine3d::Identity();
  place.linear() = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(pose.rotation.data());
  place.translation() = Vector3d(pose.shift[0], pose.shift[1], pose.shift[2]);
  return place;
}

/// Of glTF, y up, in which x y z of linden are x z -y.
Affine3d y_up() {
  Affine3d turn = Affine3d::Identity();
  turn.linear() << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  return turn;
}

double distance_of(const Affine3d& a, const Affine3d& b) { return (a.matrix() - b.matrix()).cwiseAbs().maxCoeff(); }

/// Largest distance of a body's node from where the engine has the body, over all frames.
double largest_distance(const Glb& glb, const RealMotion& motion) {
  const Animation& animation = motion.animation;
  const auto instances = static_cast<std::size_t>(animation.instances);
  double largest = 0;
  for (std::size_t instance = 0; instance < instances; ++instance) {
    for (std::size_t body = 0; body < animation.bodies.size(); ++body) {
      const std::string prefix = instances > 1 ? std::to_string(instance) + " " : "";
      const std::size_t node = glb.node_named(prefix + animation.bodies[body]);
      for (std::size_t frame = 0; frame < animation.frames(); ++frame) {
        const Pose& pose = motion.poses[(frame * instances + instance) * animation.bodies.size() + body];
        largest = std::max(largest, distance_of(glb.world(node, frame), y_up() * affine(pose)));
      }
    }
  }
  return largest;
}

/// The material of a node's mesh.
const Json& material_of(const Glb& glb, const std::string& node) {
  const Json& primitive = glb.json["meshes"][glb.node(glb.node_named(node))["mesh"].get<std::size_t>()]["primitives"][0];
  return glb.json["materials"][primitive["material"].get<std::size_t>()];
}

std::size_t channels(const Glb& glb) { return glb.json.contains("animations") ? glb.json["animations"][0]["channels"].size() : 0; }

TEST_CASE("nodes of a glTF file are where the engine has the bodies, at every frame") {
  for (const std::int64_t instances : {1, 3}) {
    const RealMotion motion = motion_of(load_urdf(model_file("humanoid.urdf"), Base::floating), instances, 20);
    CHECK(largest_distance(Glb(glb_of(motion.animation)), motion) < 1e-6);
  }
  // links of a fixed base, of ball joints and of slides too
  for (const Model& model : {load_urdf(model_file("crane.urdf"), Base::fixed), ball_chain(20), random_tree({.bodies = 30, .seed = 7})}) {
    INFO(model.names.model);
    const RealMotion motion = motion_of(model, 1, 10);
    CHECK(largest_distance(Glb(glb_of(motion.animation)), motion) < 1e-6);
  }
}

TEST_CASE("bodies of a glTF file are no children of one another, however long the chain") {
  const RealMotion motion = motion_of(chain(10'000), 1, 2);
  const Glb glb(glb_of(motion.animation));
  REQUIRE(glb.json["nodes"].size() == 2 + 2 * 10'000);
  std::set<std::size_t> depths;
  for (std::size_t node = 0; node < glb.json["nodes"].size(); ++node) {
    std::size_t depth = 0;
    for (auto up = glb.parent_of(node); up; up = glb.parent_of(*up)) ++depth;
    depths.insert(depth);
  }
  CHECK(depths == std::set<std::size_t>{0, 1, 2, 3});
  CHECK(largest_distance(glb, motion) < 1e-4);  // floats, half a kilometre out
}

TEST_CASE("a glTF file has the form of its container: lengths, padding, chunks") {
  for (const char* title : {"", "a", "ab", "abc", "abcd"}) {  // all remainders of four
    Animation animation = still_body();
    animation.title = title;
    const Glb glb(glb_of(animation));
    CHECK(glb.json["asset"]["version"] == "2.0");
    CHECK(glb.json["scenes"][0]["name"] == title);
    const std::size_t end = glb.text.find_last_not_of(' ');
    CHECK(glb.text[end] == '}');
    CHECK(end + 4 >= glb.text.size());
  }
}

TEST_CASE("times of a glTF file begin at zero and rise") {
  Animation animation = still_body(5);
  animation.times = {1000, 1000.25, 1000.5, 1000.5 + 1e-9, 1001};  // two that a float takes for one
  for (std::size_t frame = 0; frame < 5; ++frame) set_pose(animation, frame, {0, 0, 0, 1}, {static_cast<float>(frame), 0, 0});
  const Glb glb(glb_of(animation));
  CHECK(glb.times() == std::vector<double>{0, 0.25, 0.5, 1});
  CHECK(glb.channel(glb.node_named("body"), "translation") == Glb::Rows{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {4, 0, 0}});
  const Json& times = glb.json["accessors"][glb.json["animations"][0]["samplers"][0]["input"].get<std::size_t>()];
  CHECK(times["min"] == Json{0.0});
  CHECK(times["max"] == Json{1.0});
}

TEST_CASE("what does not move in a glTF file has no channel") {
  Animation animation = still_body();
  for (std::size_t frame = 0; frame < 3; ++frame) set_pose(animation, frame, {0, 0, 2, 0}, {1, 2, 3});
  SECTION("nothing moves: there is no animation") {
    const Glb glb(glb_of(animation));
    CHECK_FALSE(glb.json.contains("animations"));
    CHECK(glb.node(glb.node_named("body"))["translation"] == Json{1.0, 2.0, 3.0});
    CHECK(glb.node(glb.node_named("body"))["rotation"] == Json{0.0, 0.0, 1.0, 0.0});
  }
  SECTION("the other quaternion of one rotation is no motion") {
    set_pose(animation, 1, {0, 0, -2, 0}, {1, 2, 3});
    CHECK(channels(Glb(glb_of(animation))) == 0);
  }
  SECTION("it shifts") {
    set_pose(animation, 2, {0, 0, 2, 0}, {1, 2, 4});
    const Glb glb(glb_of(animation));
    CHECK(channels(glb) == 1);
    CHECK(glb.channel(glb.node_named("body"), "translation") == Glb::Rows{{1, 2, 3}, {1, 2, 3}, {1, 2, 4}});
    CHECK(glb.node(glb.node_named("body"))["rotation"] == Json{0.0, 0.0, 1.0, 0.0});
  }
  SECTION("it turns") {
    set_pose(animation, 2, {0, 3, 0, 4}, {1, 2, 3});
    const Glb glb(glb_of(animation));
    CHECK(channels(glb) == 1);
    const Glb::Rows turned = glb.channel(glb.node_named("body"), "rotation").value();
    CHECK(turned[2] == std::vector<double>{0, static_cast<double>(0.6F), 0, static_cast<double>(0.8F)});
    CHECK(glb.node(glb.node_named("body"))["translation"] == Json{1.0, 2.0, 3.0});
  }
  SECTION("one frame") {
    animation.times.resize(1);
    animation.poses.resize(7);
    CHECK_FALSE(Glb(glb_of(animation)).json.contains("animations"));
  }
}

TEST_CASE("a body of a glTF file never turns the long way round") {
  // two turns about z, a frame each 10 degrees, with signs as the engine and others may give them
  constexpr std::size_t frames = 73;
  for (const int signs : {0, 1, 2}) {
    Animation animation = still_body(frames);
    for (std::size_t frame = 0; frame < frames; ++frame) {
      const double half = static_cast<double>(frame) * std::numbers::pi / 36;
      double sign = 1;
      if (signs == 1) sign = std::cos(half) < 0 ? -1 : 1;  // w is not negative
      if (signs == 2) sign = frame % 3 == 0 ? -1 : 1;
      set_pose(animation, frame, {0, 0, static_cast<float>(sign * std::sin(half)), static_cast<float>(sign * std::cos(half))});
    }
    const Glb glb(glb_of(animation));
    const Glb::Rows rotations = glb.channel(glb.node_named("body"), "rotation").value();
    REQUIRE(rotations.size() == frames);
    const Eigen::Map<const Eigen::Vector4d> first(rotations.front().data()), last(rotations.back().data());
    for (std::size_t frame = 1; frame < frames; ++frame) {
      const Eigen::Map<const Eigen::Vector4d> before(rotations[frame - 1].data()), now(rotations[frame].data());
      CHECK(before.dot(now) == Approx(std::cos(std::numbers::pi / 36)).margin(1e-6));
      CHECK(now.norm() == Approx(1).margin(1e-7));
    }
    CHECK((first - last).norm() < 1e-6);  // two turns are one way round all quaternions
  }
}

TEST_CASE("parts of a glTF file lie, scale and mirror as they are drawn") {
  Animation animation = still_body();
  set_pose(animation, 0, {0, 0, std::sqrt(0.5F), std::sqrt(0.5F)}, {10, 0, 0});  // x to y
  animation.drawing.meshes.push_back(triangle_mesh());
  // turned by x to z about -y, then shifted
  const Pose pose{.rotation = {0, 0, -1, 0, 1, 0, 1, 0, 0}, .shift = {0, 0, 5}};
  // not sorted by slot, as drawings are
  animation.drawing.parts = {{.link = "body", .slot = 1, .mesh = 1, .pose = pose, .scale = {2, -3, 4}},
                             {.link = "fixed", .slot = 0, .mesh = 1, .pose = pose, .scale = {2, -3, 4}},
                             {.link = "floor", .slot = 0, .mesh = 1, .layer = Layer::ground, .pose = {}}};
  const Glb glb(glb_of(animation));
  const auto corners = [&](const std::string& name) {
    const std::size_t node = glb.node_named(name);
    const Json& primitive = glb.json["meshes"][glb.node(node)["mesh"].get<std::size_t>()]["primitives"][0];
    const Glb::Rows points = glb.accessor(primitive["attributes"]["POSITION"]);
    std::vector<Vector3d> places;
    for (const auto& corner : glb.accessor(primitive["indices"])) {
      const std::vector<double>& point = points[static_cast<std::size_t>(corner[0])];
      places.push_back(y_up().inverse() * glb.world(node, 0) * Vector3d(point[0], point[1], point[2]));
    }
    return places;
  };
  const auto expect = [&](const std::string& name, const std::vector<Vector3d>& expected) {
    INFO(name);
    const std::vector<Vector3d> found = corners(name);
    REQUIRE(found.size() == expected.size());
    for (std::size_t k = 0; k < found.size(); ++k) CHECK((found[k] - expected[k]).norm() < 2e-6);
  };
  expect("fixed visual", {{0, 0, 5}, {0, 0, 7}, {0, -3, 5}});
  expect("body visual", {{10, 0, 5}, {10, 0, 7}, {13, 0, 5}});
  expect("floor ground", {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
  CHECK(glb.node(glb.node_named("body visual"))["scale"] == Json{2.0, -3.0, 4.0});
  CHECK(glb.parent_of(glb.node_named("fixed visual")) == glb.node_named("still"));
  CHECK(glb.parent_of(glb.node_named("floor ground")) == 0U);
}

TEST_CASE("layers of a glTF file are the visual ones and the ground, and others where they are asked for") {
  Animation animation = still_body();
  for (const Layer layer : {Layer::collision, Layer::inertia, Layer::visual}) {
    animation.drawing.parts.push_back({.link = "body", .slot = 1, .layer = layer, .pose = {}});
  }
  animation.drawing.parts.push_back({.link = "floor", .slot = 0, .layer = Layer::ground, .pose = {}});  // and not sorted by slot
  const auto names = [&](const GltfOptions& options) {
    const Glb glb(glb_of(animation, options));
    std::set<std::string> drawn;
    for (const Json& node : glb.json["nodes"]) {
      if (node.contains("mesh")) drawn.insert(node["name"]);
    }
    return drawn;
  };
  const std::set<std::string> always{"body visual 1", "body visual 2", "floor ground"};
  const auto with = [&](std::set<std::string> more) {
    more.insert(always.begin(), always.end());
    return more;
  };
  CHECK(names({}) == always);
  CHECK(names({.collision = true}) == with({"body collision"}));
  CHECK(names({.inertia = true}) == with({"body inertia"}));
  CHECK(names({.collision = true, .inertia = true}) == with({"body collision", "body inertia"}));
}

TEST_CASE("colours of a glTF file are linear, and blended where one sees through them") {
  Animation animation = still_body();
  animation.drawing.parts = {{.link = "grey", .slot = 1, .pose = {}, .colour = {0.5F, 0.04F, 1, 1}},
                             {.link = "glass", .slot = 1, .pose = {}, .colour = {0, 2, -1, 0.25F}}};
  const Glb glb(glb_of(animation));
  const Json &grey = material_of(glb, "grey visual"), &glass = material_of(glb, "glass visual");
  const std::vector<double> factor = grey["pbrMetallicRoughness"]["baseColorFactor"];
  CHECK(factor[0] == Approx(std::pow(1.11 / 2.11, 2.4)).epsilon(1e-6));  // IEC 61966-2-1: ((c + 0.055) / 1.055)^2.4
  CHECK(factor[1] == Approx(0.04 / 12.92).epsilon(1e-6));
  CHECK(factor[2] == 1);
  CHECK(factor[3] == 1);
  CHECK(grey["pbrMetallicRoughness"]["metallicFactor"] == 0);
  CHECK_FALSE(grey.contains("alphaMode"));
  CHECK(glass["pbrMetallicRoughness"]["baseColorFactor"] == Json{0.0, 1.0, 0.0, 0.25});
  CHECK(glass["alphaMode"] == "BLEND");
}

TEST_CASE("parts of a glTF file share meshes, numbers and materials") {
  RealMotion motion = motion_of(load_urdf(model_file("humanoid.urdf"), Base::floating), 5, 1);
  Drawing& drawing = motion.animation.drawing;
  drawing.meshes = {triangle_mesh(), cube_mesh(), triangle_mesh()};  // the first is not drawn
  for (DrawnPart& part : drawing.parts) {
    part.mesh = 1;
    if (part.slot % 2 == 0) part.colour = {1, 0, 0, 1};
  }
  drawing.parts.front().mesh = 2;
  const Glb glb(glb_of(motion.animation));
  std::set<std::string> names;
  for (const Json& node : glb.json["nodes"]) names.insert(node["name"]);
  CHECK(names.size() == glb.json["nodes"].size());
  CHECK(names.count("4 " + motion.animation.bodies[2] + " visual") == 1);
  CHECK(glb.json["materials"].size() == 2);
  CHECK(glb.json["meshes"].size() == 3);
  CHECK(glb.json["accessors"].size() == 6);
  CHECK(glb.binary.size() == (24 + 3) * 6 * 4 + (36 + 3) * 4);
  const Json &one = glb.json["meshes"][1]["primitives"][0], &other = glb.json["meshes"][2]["primitives"][0];
  CHECK(one["attributes"] == other["attributes"]);
  CHECK(one["indices"] == other["indices"]);
  CHECK(one["material"] != other["material"]);
  const Glb::Rows points = glb.accessor(one["attributes"]["POSITION"]);
  CHECK(std::ranges::any_of(points, [](const auto& point) { return point == std::vector<double>{0.5, -0.5, 0.5}; }));
  const Json& accessor = glb.json["accessors"][one["attributes"]["POSITION"].get<std::size_t>()];
  CHECK(accessor["min"] == Json{-0.5, -0.5, -0.5});
  CHECK(accessor["max"] == Json{0.5, 0.5, 0.5});
}

TEST_CASE("a glTF file of nothing to draw, of nothing that moves, of nobody, is one") {
  Animation animation = still_body();
  SECTION("no parts") { animation.drawing = {}; }
  SECTION("a mesh without triangles") { animation.drawing.meshes = {{}}; }
  SECTION("a part of another layer") { animation.drawing.parts[0].layer = Layer::collision; }
  SECTION("no instances") {
    animation.instances = 0;
    animation.poses.clear();
    animation.drawing = {};
  }
  SECTION("no bodies") {
    animation.bodies.clear();
    animation.poses.clear();
    animation.drawing = {};
  }
  const Glb glb(glb_of(animation));
  for (const char* key : {"meshes", "materials", "accessors", "bufferViews", "buffers", "animations"}) CHECK_FALSE(glb.json.contains(key));
}

TEST_CASE("a glTF file of motion without meshes has the motion") {
  Animation animation = still_body();
  animation.drawing = {};
  set_pose(animation, 1, {0, 0, 0, 1}, {1, 0, 0});
  const Glb glb(glb_of(animation));
  CHECK(glb.channel(glb.node_named("body"), "translation") == Glb::Rows{{0, 0, 0}, {1, 0, 0}, {0, 0, 0}});
}

TEST_CASE("names in a glTF file are text, whatever bytes they were") {
  const Glb glb(glb_of(hostile_names()));
  CHECK(glb.json["scenes"][0]["name"] == "</script><script>alert(1)</script>");
  const std::string no = "\xef\xbf\xbd", body = glb.node(2)["name"];
  CHECK_THAT(body, Catch::StartsWith("a" + no + "b" + no + no + "[31m" + no + no + "\"\\ " + no));
  CHECK(glb.node(3)["name"] == "gr\xc3\xbc\xc3\x9f \xe2\x9c\x93 \xf0\x9f\xa6\xbe '; -- visual");
  CHECK(std::ranges::none_of(glb.text, [](char byte) { return byte >= 0 && byte < ' '; }));
  CHECK(glb.json.dump() != "");  // throws where a name is no UTF-8
}

TEST_CASE("normals of a glTF file have unit length, whatever those of the mesh have") {
  Animation animation = still_body();
  animation.drawing.meshes = {triangle_mesh()};
  animation.drawing.meshes[0].normals = {0, 3, 4, 0, 0, 0, kNan, 0, 1};
  const Glb glb(glb_of(animation));
  const Json& attributes = glb.json["meshes"][0]["primitives"][0]["attributes"];
  const double y = static_cast<double>(0.6F), z = static_cast<double>(0.8F);
  CHECK(glb.accessor(attributes["NORMAL"]) == Glb::Rows{{0, y, z}, {0, 0, 1}, {0, 0, 1}});
}

}  // namespace
}  // namespace linden::gltf_test

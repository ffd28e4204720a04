// What cannot be written as glTF is refused with one message that says what is wrong of what.
#include <cmath>
#include <limits>

#include "engine/view/gltf.hpp"
#include "tests/engine/animations.hpp"

namespace linden::gltf_refusals_test {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

TEST_CASE("what cannot be written as glTF is refused with the body and the time") {
  RealMotion motion = motion_of(load_urdf(model_file("humanoid.urdf"), Base::floating), 2, 4);
  Animation& animation = motion.animation;
  const auto refused = [&](const std::string& text) { CHECK_THROWS_WITH(glb_of(animation), Catch::Contains(text)); };
  const std::size_t pose = animation.pose_at(3, 1, 5);
  const std::string name = "\"" + animation.bodies[5] + "\" of instance 1 at 0.05 s";
  SECTION("a place that is no number") { animation.poses[pose + 5] = kNan; }
  SECTION("a place without end") { animation.poses[pose + 6] = std::numeric_limits<float>::infinity(); }
  SECTION("a rotation that is no number") { animation.poses[pose + 3] = kNan; }
  SECTION("a rotation that is none") { std::fill_n(animation.poses.begin() + static_cast<std::ptrdiff_t>(pose), 4, 0.0F); }
  refused(name);
}

TEST_CASE("an animation that contradicts itself is refused, not written as glTF") {
  Animation animation = still_body();
  const auto refused = [&](const std::string& text) { CHECK_THROWS_WITH(glb_of(animation), Catch::Contains(text)); };
  SECTION("no frames") {
    animation.times.clear();
    animation.poses.clear();
    refused("without frames");
  }
  SECTION("times that fall") {
    animation.times = {0, 2, 1};
    refused("frame 2 of a motion is at 1 s and the one before at 2 s");
  }
  SECTION("a time that is none") {
    animation.times[0] = std::nan("");
    refused("frame 0 of a motion is at nan s");
  }
  SECTION("poses that are missing") {
    animation.poses.pop_back();
    refused("20 numbers for its poses");
  }
  SECTION("a part of a body that is not there") {
    animation.drawing.parts[0].slot = 2;
    refused("on body 2 of 1");
  }
  SECTION("a part of a mesh that is not there") {
    animation.drawing.parts[0].mesh = 1;
    refused("mesh 1 of 1");
  }
  SECTION("a scale that is none") {
    animation.drawing.parts[0].scale[1] = std::nan("");
    refused("scale 1 nan 1");
  }
  SECTION("a colour that is none") {
    animation.drawing.parts[0].colour[1] = kNan;
    refused("colour 0.7 nan 0.7 1");
  }
  SECTION("a corner that is not there") {
    animation.drawing.meshes[0].indices[7] = 24;
    refused("the mesh of link \"body\"");
  }
  SECTION("a corner that is nowhere") {
    animation.drawing.meshes[0].positions[7] = kNan;
    refused("the mesh of link \"body\"");
  }
}

TEST_CASE("a glTF file that would be too large is refused") {
  const RealMotion motion = motion_of(load_urdf(model_file("humanoid.urdf"), Base::floating), 2, 4);
  const std::size_t bytes = glb_of(motion.animation).size();
  CHECK(glb_of(motion.animation, {.most_bytes = bytes}).size() == bytes);
  const auto refused = Catch::Contains("4 frames of 2 instances with 35 bodies do not fit into one glTF file");
  for (const std::size_t most : {bytes - 1, bytes / 2, std::size_t{20}, std::size_t{0}}) {
    CHECK_THROWS_WITH(glb_of(motion.animation, {.most_bytes = most}), refused);
  }
}

}  // namespace
}  // namespace linden::gltf_refusals_test

// Files of all models and of hard cases are glTF to a reader. Where LINDEN_GLB_DIR names a folder they stay there, for
// tests/view/gltf.test.js.
#include <cstdlib>
#include <filesystem>

#include "engine/files/output_file.hpp"
#include "engine/view/gltf.hpp"
#include "tests/engine/animations.hpp"
#include "tests/engine/glb_reader.hpp"
#include "tests/scratch_folder.hpp"

namespace linden::glb_files_test {
namespace {

TEST_CASE("glTF files of all robots and of hard cases are read") {
  const ScratchFolder scratch;
  const char* chosen = std::getenv("LINDEN_GLB_DIR");
  const std::filesystem::path folder = chosen == nullptr ? scratch.path() : chosen;
  const auto write = [&](const std::string& name, const Animation& animation, const GltfOptions& options = {}) {
    const std::filesystem::path file = folder / (name + ".glb");
    write_file(file, glb_of(animation, options));
    INFO(file);
    const Glb glb(text_of(file));
    const auto nodes = static_cast<std::size_t>(animation.instances) * (1 + animation.bodies.size());
    CHECK(glb.json["nodes"].size() > nodes);
  };
  for (const std::string& robot : all_robots()) {
    const bool hand = robot.find("hand") != std::string::npos;
    const Model model = load_urdf(robot, hand ? Base::fixed : Base::floating);
    Animation animation = motion_of(model, 2, 30).animation;
    animation.drawing = drawing_of(model);
    write(std::filesystem::path(robot).stem(), animation);
  }
  const Model long_chain = chain(10'000);
  Animation links = motion_of(long_chain, 1, 3).animation;
  links.drawing = drawing_of(long_chain);
  write("chain", links);
  write("one_frame", motion_of(humanoids(1), 1, 1).animation);
  write("still", still_body());
  write("hostile_names", hostile_names());
  Animation nothing = still_body();
  nothing.drawing = {};
  write("nothing_drawn", nothing);
  nothing.bodies.clear();
  nothing.poses.clear();
  write("nobody", nothing);
  Animation many = motion_of(humanoids(1), 3, 10).animation;
  many.drawing.meshes.push_back(triangle_mesh());
  many.drawing.parts[3].scale = {-1, 2, 0.5};
  many.drawing.parts[4].colour[3] = 0.3F;
  many.drawing.parts.push_back({.link = "floor", .slot = 0, .mesh = 1, .layer = Layer::ground, .pose = {}, .scale = {5, 5, 1}});
  many.drawing.parts.push_back({.link = "box", .slot = 2, .layer = Layer::collision, .pose = {}});
  write("layers", many, {.collision = true});
}

}  // namespace
}  // namespace linden::glb_files_test

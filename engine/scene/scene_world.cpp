#include "engine/scene/scene_world.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <system_error>
#include <utility>
#include <vector>

#include "engine/scene/scene_start.hpp"
#include "layout/support/words.hpp"
#include "models/build/world_shapes.hpp"

namespace linden {
namespace {

using Keys = std::vector<std::string>;
const Keys kWorldTypes{"box", "sphere", "cylinder", "capsule", "mesh"};
const Keys kBoxKeys{"type", "name", "size", "position", "rotation", "quaternion"};
const Keys kSphereKeys{"type", "name", "radius", "position", "rotation", "quaternion"};
const Keys kRoundKeys{"type", "name", "radius", "length", "position", "rotation", "quaternion"};
const Keys kMeshKeys{"type", "name", "file", "scale", "position", "rotation", "quaternion"};
constexpr const char* kEdgesExpected = "[x, y, z] in m, edges above zero";
constexpr const char* kScaleExpected = "[x, y, z], none of them zero";

SceneValue required(const SceneValue& at, const std::string& type, std::string_view key, std::string_view expected) {
  if (const auto found = at.find(key)) return *found;
  at.fail(fmt::format("{}, a {}, has no {}", at.path(), type, key), expected, "add it");
}

CollisionShape box_of(const SceneValue& at) {
  at.entries_of(kBoxKeys);
  const SceneValue size = required(at, "box", "size", kEdgesExpected);
  const std::array<double, 3> edges = size.vector(kEdgesExpected);
  for (const double edge : edges) {
    if (!(edge > 0)) size.refuse(kEdgesExpected, "a plate is a thin box: write how thick it is");
  }
  return {ShapeKind::box, edges, ""};
}

CollisionShape sphere_of(const SceneValue& at) {
  at.entries_of(kSphereKeys);
  return {ShapeKind::sphere, {required(at, "sphere", "radius", "radius: in m").positive()}, ""};
}

CollisionShape round_of(const SceneValue& at, const std::string& type) {
  at.entries_of(kRoundKeys);
  const double radius = required(at, type, "radius", "radius: in m").positive();
  const double length = required(at, type, "length", "length: in m, along z").positive();
  return {type == "capsule" ? ShapeKind::capsule : ShapeKind::cylinder, {radius, length}, ""};
}

CollisionShape mesh_of(const SceneValue& at, const std::string& folder) {
  at.entries_of(kMeshKeys);
  const SceneValue file = required(at, "mesh", "file", "file: of the mesh, found relative to the scene");
  std::error_code ignored;
  const std::string path = std::filesystem::absolute(std::filesystem::path(folder) / file.text("a mesh file"), ignored).lexically_normal().string();
  CollisionShape shape{ShapeKind::mesh, {1, 1, 1}, path};
  if (!std::filesystem::is_regular_file(path, ignored)) {
    file.fail(fmt::format("{}: there is no file {}", file.path(), quoted(path)), "a mesh, STL, OBJ or Collada, found relative to the scene",
              "check the path");
  }
  if (const auto scale = at.find("scale")) {
    shape.size = scale->vector(kScaleExpected);
    for (const double factor : shape.size) {
      if (factor == 0) scale->refuse(kScaleExpected, "write 1 for what stays as it is");
    }
  }
  return shape;
}

CollisionShape shape_of(const SceneValue& at, const std::string& type, const std::string& folder) {
  if (type == "box") return box_of(at);
  if (type == "sphere") return sphere_of(at);
  if (type == "mesh") return mesh_of(at, folder);
  return round_of(at, type);
}

}  // namespace

Model read_world(const SceneValue& at, Model model, const std::string& folder) {
  const std::vector<SceneValue> items = at.list("shapes, {type: box, size: [x, y, z], position: [x, y, z]}");
  for (std::size_t k = 0; k < items.size(); ++k) {
    const SceneValue& item = items[k];
    item.entries("a shape, {type: box, size: [x, y, z], position: [x, y, z]}");
    const auto which = item.find("type"), name = item.find("name");
    if (!which) item.fail(fmt::format("{} has no type", item.path()), "type: box, sphere, cylinder, capsule or mesh", "add it");
    const std::string& type = which->choice(kWorldTypes);
    WorldShape shape{.name = name ? name->text("a name") : fmt::format("{}_{}", type, k + 1), .shape = shape_of(item, type, folder)};
    shape.pose = read_base(item).pose();
    model = item.located([&] { return with_world(std::move(model), {shape}); });
  }
  return model;
}

}  // namespace linden

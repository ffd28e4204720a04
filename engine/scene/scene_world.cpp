#include "engine/scene/scene_world.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <system_error>
#include <utility>
#include <vector>

#include "engine/scene/scene_heights.hpp"
#include "engine/scene/scene_start.hpp"
#include "layout/support/words.hpp"
#include "models/build/world_shapes.hpp"

namespace linden {
namespace {

using Keys = std::vector<std::string>;
const Keys kWorldTypes{"box", "sphere", "ellipsoid", "cylinder", "capsule", "mesh", "plane", "heights"};
const Keys kBoxKeys{"type", "name", "size", "position", "rotation", "quaternion"};
const Keys kEllipsoidKeys{"type", "name", "radii", "position", "rotation", "quaternion"};
const Keys kSphereKeys{"type", "name", "radius", "position", "rotation", "quaternion"};
const Keys kRoundKeys{"type", "name", "radius", "length", "position", "rotation", "quaternion"};
const Keys kPlaneKeys{"type", "name", "normal", "height", "position", "rotation", "quaternion"};
const Keys kHeightsKeys{"type", "name", "file", "spacing", "origin", "position", "rotation", "quaternion"};
const Keys kMeshKeys{"type", "name", "file", "scale", "position", "rotation", "quaternion"};
constexpr const char* kEdgesExpected = "[x, y, z] in m, edges above zero";
constexpr const char* kAxesExpected = "[a, b, c] in m, semi-axes along x, y, z, above zero";
constexpr const char* kScaleExpected = "[x, y, z], none of them zero";

SceneValue required(const SceneValue& at, const std::string& type, std::string_view key, std::string_view expected) {
  if (const auto found = at.find(key)) return *found;
  at.fail(fmt::format("{}, {} {}, has no {}", at.path(), type == "ellipsoid" ? "an" : "a", type, key), expected, "add it");
}

std::array<double, 3> lengths_of(const SceneValue& at, const std::string& type, const char* key, const char* expected, const char* advice) {
  const SceneValue size = required(at, type, key, expected);
  const std::array<double, 3> lengths = size.vector(expected);
  for (const double length : lengths) {
    if (!(length > 0)) size.fail(fmt::format("{} holds {:g}, {:g} and {:g}", size.path(), lengths[0], lengths[1], lengths[2]), expected, advice);
  }
  return lengths;
}

CollisionShape box_of(const SceneValue& at) {
  at.entries_of(kBoxKeys);
  return {ShapeKind::box, lengths_of(at, "box", "size", kEdgesExpected, "a plate is a thin box: write how thick it is"), ""};
}

CollisionShape ellipsoid_of(const SceneValue& at) {
  at.entries_of(kEllipsoidKeys);
  return {ShapeKind::ellipsoid, lengths_of(at, "ellipsoid", "radii", kAxesExpected, "what is flat is a thin ellipsoid or a box: write how thick it is"), ""};
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

CollisionShape heights_of(const SceneValue& at, const std::string& folder) {
  at.entries_of(kHeightsKeys);
  CollisionShape shape{ShapeKind::heights, {}, ""};
  shape.heights = std::make_shared<const HeightField>(read_heights(at, folder));
  return shape;
}

CollisionShape shape_of(const SceneValue& at, const std::string& type, const std::string& folder) {
  if (type == "box") return box_of(at);
  if (type == "ellipsoid") return ellipsoid_of(at);
  if (type == "plane") return {ShapeKind::plane, {}, ""};
  if (type == "sphere") return sphere_of(at);
  if (type == "heights") return heights_of(at, folder);
  if (type == "mesh") return mesh_of(at, folder);
  return round_of(at, type);
}

/// By a normal or a turn, z where neither is given; and how high it is along its normal, or through which point it goes.
Pose plane_pose_of(const SceneValue& at) {
  constexpr const char* kNormalExpected = "[x, y, z], not all zero";
  at.entries_of(kPlaneKeys);
  const auto normal = at.find("normal"), height = at.find("height"), position = at.find("position");
  const auto rotation = at.find("rotation"), quaternion = at.find("quaternion");
  if (normal && (rotation || quaternion)) {
    normal->fail(fmt::format("{}: a normal and a turn are both given", at.path()), "one of them", "leave one out");
  }
  if (height && position) height->fail(fmt::format("{}: height and position are both given", at.path()), "one of them", "leave one out");
  Pose pose = read_base(at).pose();
  std::array<double, 3> direction{pose.rotation[2], pose.rotation[5], pose.rotation[8]};
  if (normal) {
    direction = normal->vector(kNormalExpected);
    if (direction == std::array<double, 3>{}) normal->refuse(kNormalExpected, "write where it looks to, [0, 0, 1] for a floor");
  }
  if (!normal && !height) return pose;
  const Pose facing = plane_pose(direction, height ? height->number() : 0);
  return {normal ? facing.rotation : pose.rotation, position ? pose.shift : facing.shift};
}

}  // namespace

Model read_world(const SceneValue& at, Model model, const std::string& folder) {
  const std::vector<SceneValue> items = at.list("shapes, {type: box, size: [x, y, z], position: [x, y, z]}");
  for (std::size_t k = 0; k < items.size(); ++k) {
    const SceneValue& item = items[k];
    item.entries("a shape, {type: box, size: [x, y, z], position: [x, y, z]}");
    const auto which = item.find("type"), name = item.find("name");
    if (!which) item.fail(fmt::format("{} has no type", item.path()), "type: box, sphere, ellipsoid, cylinder, capsule, mesh, plane or heights", "add it");
    const std::string& type = which->choice(kWorldTypes);
    WorldShape shape{.name = name ? name->text("a name") : fmt::format("{}_{}", type, k + 1), .shape = shape_of(item, type, folder)};
    shape.pose = shape.shape.kind == ShapeKind::plane ? plane_pose_of(item) : read_base(item).pose();
    model = item.located([&] { return with_world(std::move(model), {shape}); });
  }
  return model;
}

}  // namespace linden

#include "engine/view/gltf_drawing.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <span>
#include <stdexcept>

#include "layout/support/words.hpp"

namespace linden {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kRoughness = 0.6;

float linear_of(float srgb) {
  const double value = std::clamp(srgb, 0.0F, 1.0F);
  return static_cast<float>(value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4));
}

const char* layer_name(Layer layer) {
  switch (layer) {
    case Layer::visual: return "visual";
    case Layer::collision: return "collision";
    case Layer::inertia: return "inertia";
    case Layer::ground: return "ground";
  }
  return "";
}

bool all_finite(const auto& numbers) {
  return std::ranges::all_of(numbers, [](auto number) { return std::isfinite(number); });
}

/// The mesh, if it is one: as many normals as positions, corners that there are.
void require_mesh(const DrawnPart& part, const TriangleMesh& mesh) {
  const std::size_t points = mesh.positions.size() / 3;
  const bool whole = mesh.positions.size() % 3 == 0 && mesh.normals.size() == mesh.positions.size() && mesh.indices.size() % 3 == 0;
  const bool there = std::ranges::all_of(mesh.indices, [&](std::uint32_t corner) { return corner < points; });
  if (whole && there && all_finite(mesh.positions)) return;
  throw std::runtime_error(
      fmt::format("the mesh of link {} has {} numbers of positions, {} of normals and {} corners: expected triangles, corners among its {} "
                  "points, and finite numbers",
                  quoted(part.link), mesh.positions.size(), mesh.normals.size(), mesh.indices.size(), points));
}

void require_part(const DrawnPart& part, const Animation& animation) {
  const bool placed = part.slot >= 0 && static_cast<std::size_t>(part.slot) <= animation.bodies.size();
  if (placed && part.mesh < animation.drawing.meshes.size() && all_finite(part.pose.rotation) && all_finite(part.pose.shift) &&
      all_finite(part.scale) && all_finite(part.colour)) {
    return;
  }
  throw std::runtime_error(
      fmt::format("link {} is drawn on body {} of {} with mesh {} of {} at {}, scale {}, colour {}: expected a body and a mesh that there "
                  "are, and finite numbers",
                  quoted(part.link), part.slot, animation.bodies.size(), part.mesh, animation.drawing.meshes.size(),
                  fmt::join(part.pose.shift, " "), fmt::join(part.scale, " "), fmt::join(part.colour, " ")));
}

/// Scaled to unit length; up where there is none.
void append_normals(std::string& file, std::span<const float> normals) {
  for (std::size_t k = 0; k < normals.size(); k += 3) {
    const double length = std::hypot(normals[k], normals[k + 1], normals[k + 2]);
    std::array<float, 3> unit{0, 0, 1};
    if (length > 0 && std::isfinite(length)) {
      for (std::size_t j = 0; j < 3; ++j) unit[j] = static_cast<float>(normals[k + j] / length);
    }
    append_as_it_is<float>(file, unit);
  }
}

}  // namespace

GltfDrawing::GltfDrawing(const Animation& animation, const GltfOptions& options, GlbNumbers& numbers, GlbRoom& room)
    : animation_(animation), numbers_(numbers), meshes_(room), materials_(room) {
  std::map<std::pair<std::string, Layer>, int> seen, total;
  const auto chosen = [&](const DrawnPart& part) {
    if (part.layer == Layer::collision) return options.collision;
    if (part.layer == Layer::inertia) return options.inertia;
    return true;
  };
  std::vector<const DrawnPart*> drawn;
  for (const DrawnPart& part : animation_.drawing.parts) {
    if (!chosen(part)) continue;
    require_part(part, animation_);
    if (animation_.drawing.meshes[part.mesh].indices.empty()) continue;
    drawn.push_back(&part);
    ++total[{part.link, part.layer}];
  }
  for (const DrawnPart* part : drawn) {
    const std::pair key{part->link, part->layer};
    std::string name = fmt::format("{} {}", part->link, layer_name(part->layer));
    if (total[key] > 1) name += fmt::format(" {}", ++seen[key]);
    (part->layer == Layer::ground ? ground_ : parts_).push_back({part, std::move(name), mesh_of(*part)});
  }
  std::ranges::stable_sort(parts_, {}, slot_of);
}

std::size_t GltfDrawing::mesh_of(const DrawnPart& part) {
  const std::size_t material = material_of(part.colour);
  const auto [place, added] = coloured_.try_emplace({part.mesh, material}, meshes_.size());
  if (!added) return place->second;
  const Accessors& accessors = accessors_of(part);
  Json mesh;
  mesh["primitives"][0] = {{"attributes", {{"POSITION", accessors.positions}, {"NORMAL", accessors.normals}}},
                           {"indices", accessors.corners},
                           {"material", material}};
  return meshes_.add(mesh);
}

std::size_t GltfDrawing::material_of(const Colour& colour) {
  const auto [place, added] = colours_.try_emplace(colour, materials_.size());
  if (!added) return place->second;
  const float opacity = std::clamp(colour[3], 0.0F, 1.0F);
  const std::array<float, 4> factor{linear_of(colour[0]), linear_of(colour[1]), linear_of(colour[2]), opacity};
  Json material;
  material["pbrMetallicRoughness"] = {{"baseColorFactor", factor}, {"metallicFactor", 0}, {"roughnessFactor", kRoughness}};
  material["doubleSided"] = true;  // meshes of robots are often open, or inside out
  if (opacity < 1) material["alphaMode"] = "BLEND";
  return materials_.add(material);
}

const GltfDrawing::Accessors& GltfDrawing::accessors_of(const DrawnPart& part) {
  const auto found = accessors_.find(part.mesh);
  if (found != accessors_.end()) return found->second;
  const TriangleMesh& mesh = animation_.drawing.meshes[part.mesh];
  require_mesh(part, mesh);
  std::array<float, 3> least, most;
  std::copy_n(mesh.positions.begin(), 3, least.begin());
  most = least;
  for (std::size_t k = 0; k < mesh.positions.size(); ++k) {
    least[k % 3] = std::min(least[k % 3], mesh.positions[k]);
    most[k % 3] = std::max(most[k % 3], mesh.positions[k]);
  }
  Accessors accessors{};
  constexpr auto real = GlbNumbers::Component::real;
  const std::size_t points = mesh.positions.size() / 3;
  accessors.positions = numbers_.add(GlbNumbers::vertices, real, "VEC3", points, {{"min", least}, {"max", most}});
  accessors.normals = numbers_.add(GlbNumbers::vertices, real, "VEC3", points, {});
  accessors.corners = numbers_.add(GlbNumbers::corners, GlbNumbers::Component::corner, "SCALAR", mesh.indices.size(), {});
  order_.push_back(&mesh);
  return accessors_.emplace(part.mesh, accessors).first->second;
}

void GltfDrawing::append_to(std::string& json) const {
  meshes_.append_to(json, "meshes");
  materials_.append_to(json, "materials");
}

void GltfDrawing::append_numbers(std::string& file) const {
  for (const TriangleMesh* mesh : order_) {
    append_as_it_is<float>(file, mesh->positions);
    append_normals(file, mesh->normals);
  }
  for (const TriangleMesh* mesh : order_) append_as_it_is<std::uint32_t>(file, mesh->indices);
}

}  // namespace linden

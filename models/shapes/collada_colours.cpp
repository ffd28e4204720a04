#include "models/shapes/collada_colours.hpp"

#include <algorithm>
#include <optional>
#include <vector>

#include "layout/support/words.hpp"

namespace linden {
namespace {

using tinyxml2::XMLElement;

/// The element at the end of a path of tags; null where one is missing.
const XMLElement* within(const XMLElement* element, std::initializer_list<const char*> tags) {
  for (const char* tag : tags) element = element ? element->FirstChildElement(tag) : nullptr;
  return element;
}

/// <color> holds three or four numbers.
std::optional<std::array<double, 4>> colour_in(const XMLElement& color) {
  std::string_view rest = color.GetText() ? color.GetText() : "";
  std::array<double, 4> rgba{0, 0, 0, 1};
  for (std::size_t k = 0; k < 3; ++k) {
    const std::optional<double> number = number_in(next_word(rest));
    if (!number) return std::nullopt;
    rgba[k] = std::clamp(*number, 0.0, 1.0);
  }
  return rgba;
}

}  // namespace

MeshColour ColladaColours::of(const XMLElement* instance, std::string_view symbol) {
  if (symbol.empty()) return {};
  const XMLElement* material = nullptr;
  if (instance) {
    const Bound& bound = bound_by(*instance);
    if (const auto found = bound.find(symbol); found != bound.end()) material = found->second;
  }
  if (!material) material = find_(symbol);
  if (!material || material->Name() != std::string_view("material")) return {};
  const auto [at, first_time] = colours_.try_emplace(material);
  if (first_time) at->second = colour_of(*material);
  return at->second;
}

const ColladaColours::Bound& ColladaColours::bound_by(const XMLElement& instance) {
  const auto [at, first_time] = bound_.try_emplace(&instance);
  if (!first_time) return at->second;
  const XMLElement* common = within(&instance, {"bind_material", "technique_common"});
  for (const XMLElement* bind = within(common, {"instance_material"}); bind; bind = bind->NextSiblingElement("instance_material")) {
    const char* symbol = bind->Attribute("symbol");
    const XMLElement* material = target(bind->Attribute("target"), "material");
    if (material && symbol) at->second.emplace(symbol, material);
  }
  return at->second;
}

const XMLElement* ColladaColours::target(const char* reference, std::string_view tag) const {
  const XMLElement* found = reference && reference[0] == '#' ? find_(reference + 1) : nullptr;
  return found && found->Name() == tag ? found : nullptr;
}

MeshColour ColladaColours::colour_of(const XMLElement& material) const {
  MeshColour colour;
  const XMLElement* instance = material.FirstChildElement("instance_effect");
  const XMLElement* effect = instance ? target(instance->Attribute("url"), "effect") : nullptr;
  const XMLElement* technique = within(effect, {"profile_COMMON", "technique"});
  for (const char* law : {"phong", "lambert", "blinn", "constant"}) {
    const XMLElement* source = within(technique, {law, law == std::string_view("constant") ? "emission" : "diffuse"});
    if (!source) continue;
    colour.textured = source->FirstChildElement("texture") != nullptr;
    if (const XMLElement* color = source->FirstChildElement("color")) colour.rgba = colour_in(*color);
    return colour;
  }
  return colour;
}

}  // namespace linden

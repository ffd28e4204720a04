#include "models/urdf/urdf_visuals.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string_view>
#include <utility>

#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"
#include "models/urdf/urdf_shapes.hpp"

namespace linden {
namespace {

using tinyxml2::XMLElement;

std::string text_in(const XMLElement& element, const char* attribute) {
  const char* text = element.Attribute(attribute);
  return text ? text : "";
}

/// Three or four finite numbers.
std::optional<std::array<double, 4>> colour_in(std::string_view text) {
  const std::vector<std::string_view> words = words_of(text);
  if (words.size() != 3 && words.size() != 4) return std::nullopt;
  std::array<double, 4> rgba{0, 0, 0, 1};
  for (std::size_t k = 0; k < words.size(); ++k) {
    const std::optional<double> number = number_in(words[k]);
    if (!number) return std::nullopt;
    rgba[k] = std::clamp(*number, 0.0, 1.0);
  }
  return rgba;
}

}  // namespace

UrdfVisuals::UrdfVisuals(const UrdfStructure& robot, UrdfReport& report) : report_(report) {
  define(*robot.links().front().element->Parent()->ToElement());
  for (const UrdfLink& link : robot.links()) {
    for (const XMLElement* visual = link.element->FirstChildElement("visual"); visual; visual = visual->NextSiblingElement("visual")) {
      define(*visual);
    }
  }
}

void UrdfVisuals::define(const XMLElement& holder) {
  for (const XMLElement* element = holder.FirstChildElement("material"); element; element = element->NextSiblingElement("material")) {
    Material material = read(*element);
    if (material.rgba || !material.texture.empty()) called_.try_emplace(material.name, std::move(material));
  }
}

Material UrdfVisuals::read(const XMLElement& element) {
  Material material{.name = text_in(element, "name")};
  if (const XMLElement* color = element.FirstChildElement("color")) material.rgba = colour_in(text_in(*color, "rgba"));
  if (const XMLElement* texture = element.FirstChildElement("texture")) material.texture = text_in(*texture, "filename");
  return material;
}

Material UrdfVisuals::material_of(const XMLElement& visual) {
  const XMLElement* element = visual.FirstChildElement("material");
  if (!element) return {};
  Material material = read(*element);
  const XMLElement* color = element->FirstChildElement("color");
  if (color && !material.rgba) {
    fault(fmt::format("{}:{}: <color> has rgba={}; expected four numbers from 0 to 1; it gives no colour", report_.source,
                      color->GetLineNum(), quoted(text_in(*color, "rgba"))));
  }
  if (material.rgba || !material.texture.empty() || material.name.empty()) return material;
  const auto found = called_.find(material.name);
  return found == called_.end() ? material : found->second;
}

std::vector<LinkVisual> UrdfVisuals::of(const UrdfLink& link, bool give_mass) {
  std::vector<LinkVisual> visuals;
  for (const XMLElement* visual = link.element->FirstChildElement("visual"); visual; visual = visual->NextSiblingElement("visual")) {
    UrdfReport own{report_.source, {}, {}};
    std::optional<LinkShape> shape;
    try {
      shape = shape_of(*visual, link, give_mass ? report_ : own);
    } catch (const InputError& error) {
      if (give_mass) throw;
      fault(fmt::format("{}; the <visual> is left out", error.what()));
    }
    for (const std::string& warning : own.warnings) fault(warning);
    if (shape) visuals.push_back({std::move(*shape), material_of(*visual)});
  }
  return visuals;
}

void UrdfVisuals::fault(const std::string& message) {
  if (faults_++ == 0) first_fault_ = message;
}

std::vector<std::string> UrdfVisuals::faults() const {
  if (faults_ == 0) return {};
  return {faults_ == 1 ? first_fault_ : fmt::format("{} (the first of {} faults in visuals)", first_fault_, faults_)};
}

}  // namespace linden

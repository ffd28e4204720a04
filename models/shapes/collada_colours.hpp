// models/shapes/collada_colours.hpp
// Colours of the surfaces in a COLLADA file.
//
//   <instance_geometry> -> <bind_material><technique_common><instance_material symbol target> -> <material><instance_effect url>
//     -> <effect><profile_COMMON><technique><phong|lambert|blinn|constant> -> <diffuse|emission><color> or <texture>
//
// A symbol that an instance does not bind, as where a geometry is shown without one, is taken for the name of a <material>.
//
// source  COLLADA 1.4.1, Digital Asset Schema Release, ch. 7
#pragma once

#include <tinyxml2.h>

#include <functional>
#include <string_view>
#include <unordered_map>

#include "models/shapes/mesh_file.hpp"

namespace linden {

class ColladaColours {
 public:
  /// find(id): the element of the document that has it, or null.
  using Find = std::function<const tinyxml2::XMLElement*(std::string_view id)>;
  explicit ColladaColours(Find find) : find_(std::move(find)) {}

  /// `instance`: may be null; `symbol`: what a surface calls its material. cost  one pass over what each instance binds, the first time
  MeshColour of(const tinyxml2::XMLElement* instance, std::string_view symbol);

 private:
  using Bound = std::unordered_map<std::string_view, const tinyxml2::XMLElement*>;

  const Bound& bound_by(const tinyxml2::XMLElement& instance);
  /// What "#id" stands for; null where it is no element of this tag.
  const tinyxml2::XMLElement* target(const char* reference, std::string_view tag) const;
  MeshColour colour_of(const tinyxml2::XMLElement& material) const;

  Find find_;
  std::unordered_map<const tinyxml2::XMLElement*, Bound> bound_;
  std::unordered_map<const tinyxml2::XMLElement*, MeshColour> colours_;  // of a <material>
};

}  // namespace linden

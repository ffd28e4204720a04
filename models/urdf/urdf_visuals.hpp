// models/urdf/urdf_visuals.hpp
// The <visual> elements of a link: a shape as <collision> has it (models/urdf/urdf_shapes.hpp) and a <material>.
//
//   <material><color rgba="..."/></material>   the colour that counts where there is one; three numbers are opaque, numbers beyond 0 and 1
//                                              are cut to these
//   <material name="..."/>                     the first of that name that gives a colour or a texture, of the robot's own and then of
//                                              those in visuals, wherever in the file
//   <texture filename="..."/>                  its name
//
// A visual moves nothing, so nothing in it is an error, nor worth a warning to those who only let the robot move: what is wrong is left
// out, and told where the model is looked at, once for all of a file. But where the mass of a link is to come from its visuals
// (models/shapes/shape_mass.hpp) their shapes have to be right.
#pragma once

#include <string>
#include <unordered_map>
#include <vector>

#include "layout/shapes.hpp"
#include "models/urdf/urdf_structure.hpp"

namespace linden {

class UrdfVisuals {
 public:
  /// Both must outlive it.
  UrdfVisuals(const UrdfStructure& robot, UrdfReport& report);

  /// `give_mass`: a shape that is wrong throws InputError, as a collision shape does.
  std::vector<LinkVisual> of(const UrdfLink& link, bool give_mass);

  /// One message, if anything was wrong: `file:line: what was found; ...`.
  std::vector<std::string> faults() const;

 private:
  void define(const tinyxml2::XMLElement& holder);
  Material material_of(const tinyxml2::XMLElement& visual);
  /// As it stands there.
  Material read(const tinyxml2::XMLElement& material);
  void fault(const std::string& message);

  UrdfReport& report_;
  std::unordered_map<std::string, Material> called_;
  std::string first_fault_;
  int faults_ = 0;
};

}  // namespace linden

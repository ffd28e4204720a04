// models/urdf/urdf_vocabulary.hpp
// The words of URDF: which elements there are, where each belongs, which attributes it has, and what linden does with them.
//
// A file is compared with one table of them, element by element. What is not taken up is told once, as a warning with its line:
//
//   <inertail>, pos="0 0 1"              not known; the nearest known word is named
//   <origin> within <child>              known, but elsewhere
//   a second <inertial>                  the first is used
//   <spring>, armature="0.1"             known, and not simulated
//   <gazebo>, <transmission>, <sensor>   the business of other programs; all of them in one warning
//   <loop_joint>, <joint> in <gazebo>    closed loops: what of them is not used is told by models/urdf/urdf_loops.hpp
//   text between the tags                not read
//
// Equal findings are one warning, with their number. Where a file gives none, all of it was used, or belongs to URDF and moves nothing:
// visuals, materials, names of shapes, limits of controllers. Macros of xacro throw InputError with the command that expands them.
//
// cost  one pass over the elements; a word that is not known is compared with all others
// source  http://wiki.ros.org/urdf/XML
#pragma once

#include <tinyxml2.h>

#include <cstdint>
#include <span>
#include <string_view>

#include "models/urdf/urdf_structure.hpp"

namespace linden {

/// What linden does with an element and all that is in it.
enum class UrdfUse : std::uint8_t {
  moves,     // read
  no_motion, // belongs to URDF and has no effect on motion
  lost,      // would have an effect, and is not simulated
  others,    // an extension that other programs read; not looked into
  loops,     // read, and what is in it looked at, by urdf_loops.hpp
  macro      // to be expanded by xacro before the file is URDF
};

/// How many elements of one name, or of one kind, their parent may hold.
enum class UrdfCount : std::uint8_t {
  one,
  many,
  one_of_all  // one of all elements that are counted so: the shapes of a geometry
};

struct UrdfElement {
  std::string_view name;     // "drake:*" stands for all words that begin with "drake:"
  std::string_view parents;  // "link joint"; "*" = anywhere
  UrdfUse use;
  UrdfCount count;
  std::string_view attributes;  // read, or without effect on motion
  std::string_view lost;        // attributes that would have an effect, and are not simulated
};

std::span<const UrdfElement> urdf_vocabulary();

/// Compares all that is in <robot> with the vocabulary.
void check_vocabulary(const tinyxml2::XMLElement& robot, UrdfReport& report);

}  // namespace linden

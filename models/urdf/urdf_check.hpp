// models/urdf/urdf_check.hpp
// Checks URDF text element by element and writes down again what a tree needs of it, for urdfdom to read.
//
// urdfdom 3 by itself names no lines, and
//   lets through  a link under two joints, loops, an <inertial> that it half read, an <axis> without xyz (= 0 0 0)
//   refuses       revolute and prismatic joints without <limit>, <limit> without effort or velocity, "1.0 ", tabs
//   falls over    deeply nested markup (it recurses), % in a bad number (its message is used as a printf format)
// The text written here has none of these: links with their <inertial>; joints with origin, parent, child, axis, limit,
// mimic and dynamics; every number in the shortest form that reads back to the same double. Collision shapes do not pass through
// urdfdom, which knows no capsules: they are read here (models/urdf/urdf_shapes.hpp), and so are visuals and materials
// (models/urdf/urdf_visuals.hpp) and closed loops (models/urdf/urdf_loops.hpp). Sensors, transmissions and unknown elements are left out, and
// what of them a reader should know is told (models/urdf/urdf_vocabulary.hpp).
//
//   what the file says                              what becomes of it
//   revolute or prismatic joint without limits      unlimited, with a warning
//   one of lower and upper                          the other is 0, as the URDF standard has it, with a warning
//   no effort or velocity limit, or a negative one  unlimited (negative: with a warning)
//   an infinite limit, lower above upper            unlimited, with a warning
//   no products of inertia ixy, ixz, iyz            0, with a warning
//   <mimic> of a fixed, floating or planar joint    left out, with a warning
//   limits of continuous, floating, planar joints   only the effort and velocity of continuous ones are kept; the rest is told
//
// Names and the tree come first (models/urdf/urdf_structure.hpp), then the numbers, as they are written down again.
// Everything else that is wrong throws InputError: `file:line: what was found; what was expected; what to do`.
#pragma once

#include <limits>
#include <string>
#include <unordered_map>
#include <vector>

#include "layout/shapes.hpp"
#include "models/urdf/urdf_loops.hpp"

namespace linden {

/// How "no limit" is written for urdfdom, which knows no infinity.
inline constexpr double kUnlimited = std::numeric_limits<double>::max();

struct CheckedUrdf {
  std::string xml;                    // for urdfdom; one root link, no loops, every name found
  std::vector<std::string> joints;    // names in the order of the file, which urdfdom forgets
  std::unordered_map<std::string, std::vector<LinkShape>> shapes;  // of the links that have any
  std::unordered_map<std::string, std::vector<LinkVisual>> visuals;  // the same
  std::vector<UrdfLoop> loops;        // that are understood
  std::vector<std::string> visual_faults;  // what is wrong about visuals, in the form of warnings
  std::vector<std::string> warnings;  // `file:line: what was found; how it is read`
  std::string suspect;                // of a slip in a word, which later errors may come from; may be empty
};

/// `mass_of_shapes`: links without <inertial> get their mass from collision shapes or visuals, so that these have to be right.
CheckedUrdf check_urdf(const std::string& xml, const std::string& source_name, bool mass_of_shapes = false);

}  // namespace linden

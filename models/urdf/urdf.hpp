// models/urdf/urdf.hpp
// From a URDF file to a model: the dialect that real robots are written in.
//
//   URDF                                    LinkSpec (models/build/builder.hpp)
//   revolute, continuous                    revolute; continuous joints have no position limits
//   prismatic, fixed, planar                the same; the normal of the plane is the axis
//   floating                                free
//   inertial at any origin, turned          turned into the link's axes
//   link without inertial                   massless; where a density is given, with the mass of its shapes (models/shapes/shape_mass.hpp)
//   limit, dynamics, mimic                  limits, damping and friction, mimic
//   collision shapes                        shapes; meshes by name only, their files are not opened
//   visuals with their materials            visuals and visual_faults (models/urdf/urdf_visuals.hpp); with a density also the mass of links
//                                           that have neither inertial nor collision shapes
//   loops: <loop_joint>, <loop>,            couplings (models/urdf/urdf_loops.hpp)
//   <drake:ball_constraint>, <drake:linear_spring_damper>, <gazebo><joint>
//   sensors, all else                       not read; what a reader should know of it is told (models/urdf/urdf_vocabulary.hpp)
//
// A tree has one root link. With Base::fixed it is fixed to the world. With Base::floating a free joint called "base"
// carries it, unless the file itself lets its robot float: where the root, with all that is fixed to it, has no mass
// and carries floating joints only, it is the world. A floating joint of the file is honoured with either base.
//
// Slots of one level and kind keep the order of the file's <joint> elements where their parents do. Files are checked
// before urdfdom sees them (models/urdf/urdf_check.hpp); what was read with a grain of salt is in Model::warnings.
//
// source  http://wiki.ros.org/urdf/XML; the reading itself is urdfdom's
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "layout/model.hpp"
#include "layout/support/input_error.hpp"

namespace linden {

enum class Base : std::uint8_t { fixed, floating };

/// Whether a robot of which nothing moves is refused. Furniture: a model without bodies, for merging with others
/// (models/build/merged_models.hpp).
enum class Still : std::uint8_t { refused, furniture };

/// What becomes of warnings: strict reading refuses a file that gives any.
enum class Reading : std::uint8_t { lenient, strict };

/// Reads a URDF file. Throws InputError: `file:line: what was found; what was expected; what to do`.
/// `density` [kg/m^3]: of links that have shapes and no <inertial>, which get mass and inertia by it; what became of them is in Model::notes.
Model load_urdf(const std::string& file, Base base = Base::fixed, Reading reading = Reading::lenient,
                std::optional<double> density = std::nullopt, Still still = Still::refused);

/// The same from memory; `source_name` stands for the file in messages. Threads may call both at once.
Model parse_urdf(const std::string& xml, const std::string& source_name, Base base = Base::fixed,
                 Reading reading = Reading::lenient, std::optional<double> density = std::nullopt, Still still = Still::refused);

}  // namespace linden

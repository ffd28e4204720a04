// engine/scene/scene_time_table.hpp
// Numbers over time as a scene gives them: a number, FILE.csv, or {times, values}. Files are found in the folder of the scene, time,value a
// line. Every function throws InputError with file and line.
#pragma once

#include <string>

#include "engine/scene/scene_yaml.hpp"
#include "layout/effects.hpp"

namespace linden {

/// The path that a scene in `folder` names.
std::string scene_path(const SceneValue& at, const std::string& folder);

TimeTable read_time_table(const SceneValue& at, const std::string& folder);
/// From a file alone.
TimeTable read_time_table_file(const SceneValue& at, const std::string& folder);

/// Positions of the joint at `row`: as above, with velocities beside them where there are any, in a third column or as {times, values, velocities}.
JointMotion read_motion(const SceneValue& at, Index row, const std::string& folder);

}  // namespace linden

// engine/scene/scene_servos.hpp
// The servos of a scene, `effects.servo`.
#pragma once

#include <string>
#include <vector>

#include "engine/scene/scene_joints.hpp"
#include "engine/scene/scene_yaml.hpp"
#include "layout/effects.hpp"

namespace linden {

/// `start`: positions [nq] that servos hold where no target is given; `folder`: of the scene. What was named and does nothing joins
/// `warnings`. Throws InputError with file and line.
std::vector<Servo> read_servos(const SceneValue& at, const SceneJoints& joints, const std::vector<double>& start, const std::string& folder,
                               std::vector<std::string>& warnings);

}  // namespace linden

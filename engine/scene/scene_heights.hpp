// engine/scene/scene_heights.hpp
// A height field as a scene names it, {file, spacing: [dx, dy], origin: [x, y]}: the terrain of a ground, and a shape that stands in the world. The file
// is a table of numbers, a row along x each, found relative to the scene.
#pragma once

#include <string>

#include "engine/scene/scene_yaml.hpp"
#include "layout/height_field.hpp"

namespace linden {

/// The keys that are its own; others of `at` are the caller's. Throws InputError with file and line.
HeightField read_heights(const SceneValue& at, const std::string& folder);

}  // namespace linden

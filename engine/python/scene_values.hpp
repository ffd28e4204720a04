// engine/python/scene_values.hpp
// What Python says of a scene, keys and values as in a scene's file, as the reader of scenes takes it (engine/scene/scene_yaml.hpp).
#pragma once

#include <nanobind/nanobind.h>

#include <memory>

#include "engine/scene/scene_yaml.hpp"

namespace linden::python {

/// None, text and paths, numbers, lists, tuples, arrays and dicts of these. Throws InputError for what is none of them, for keys that are
/// no text, and for more levels than a scene has.
std::shared_ptr<const YamlNode> scene_values(nanobind::handle value);

}  // namespace linden::python

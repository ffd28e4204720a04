// engine/scene/scene_bytes.hpp
// Models and scenes as bytes, to be taken to another process or machine without the files that they were read from: all of their members, the
// same to the bit, so that they move the same to the bit there.
//
//   const std::string bytes = to_bytes(scene);
//   Batch batch(scene_from_bytes(bytes), 4096);
//
// A line of text, what layout/archive.hpp writes, and a checksum; of a machine with little-endian numbers for others of that kind.
#pragma once

#include <string>
#include <string_view>

#include "engine/scene/scene.hpp"

namespace linden {

std::string to_bytes(const Model& model);
std::string to_bytes(const Scene& scene);

/// Throw InputError for bytes that to_bytes did not write, that another version of linden wrote or that are damaged, and for models,
/// options and effects that make no sense. name: of where the bytes come from, for messages.
Model model_from_bytes(std::string_view bytes, const std::string& name = "model");
Scene scene_from_bytes(std::string_view bytes, const std::string& name = "scene");

}  // namespace linden

// engine/scene/load_model.hpp
// From what a person writes on the command line to a model.
#pragma once

#include <optional>
#include <string>

#include "layout/support/input_error.hpp"
#include "models/urdf/urdf.hpp"

namespace linden {

/// A URDF file, or chain:N, ball-chain:N, paper-chain:N, tree:N, random:N, humanoids:N, ring:N, fourbars:N, ladder:N, roller-chain:N, net:AxB,
/// boxes:N, wall:N, pile:N, cards:N, dominoes:N.
/// `base` is for URDF files (fixed where it is not given); throws InputError where it is given for a generated model, for a scene, and for
/// whatever cannot be read. `density` [kg/m^3]: for URDF files too, of links without inertia (models/urdf/urdf.hpp).
Model load_model(const std::string& name, std::optional<Base> base, std::optional<double> density = std::nullopt);

/// More memory is asked for than there is.
class MemoryError : public InputError {
 public:
  using InputError::InputError;
};

/// Throws MemoryError where `what` needs more bytes than the machine has: asked for too much, Linux ends programs without a word.
void require_memory(const std::string& what, double bytes);

/// What a generated model takes to build and to simulate [bytes]; 0 where its name holds no number.
double memory_of(const std::string& name);

/// Throws MemoryError where the machine has less than that.
void check_memory(const std::string& name);

/// "fixed" or "floating"; throws InputError for anything else.
Base base_from(const std::string& text);

/// How the model hangs on to the world, in words: "fixed base", "floating base", "2 of 3 roots float".
std::string base_of(const Model& model);

/// The model's warnings on stderr, the first five of them, and its notes.
void print_warnings(const Model& model);

}  // namespace linden

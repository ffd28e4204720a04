// engine/required_model.hpp
// A model that is shared, and there.
#pragma once

#include <memory>
#include <utility>

#include "layout/model.hpp"
#include "layout/support/input_error.hpp"

namespace linden {

/// The same pointer. Throws InputError where it is null.
inline std::shared_ptr<const Model> required(std::shared_ptr<const Model> model) {
  if (!model) throw InputError("the pointer to the model is null; expected a model; give one that load_urdf or a generator made");
  return model;
}

}  // namespace linden

// engine/program/couplings_text.hpp
// What inspect says of couplings.
#pragma once

#include <nlohmann/json.hpp>

#include "engine/mobility.hpp"

namespace linden {

/// A table of the first `count`, and what is to be known of all of them.
void say_couplings(const Model& model, const Mobility& mobility, std::size_t count);
nlohmann::ordered_json couplings_json(const Model& model, const Mobility& mobility);

}  // namespace linden

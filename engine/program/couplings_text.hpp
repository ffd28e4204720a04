// engine/program/couplings_text.hpp
// What inspect says of couplings.
#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "engine/mobility.hpp"
#include "engine/sweeps/closure_work.hpp"

namespace linden {

/// A table of the first `count`, and what is to be known of all of them.
void say_couplings(const Model& model, const Mobility& mobility, std::size_t count);
nlohmann::ordered_json couplings_json(const Model& model, const Mobility& mobility);
/// What a factor takes where loops close: a table of the first `count`, and a note where several that close together take far more than the tree
/// itself.
void say_closures(const Model& model, const std::vector<ClosureWork>& closures, std::size_t count);
nlohmann::ordered_json closures_json(const Model& model, const std::vector<ClosureWork>& closures);

}  // namespace linden

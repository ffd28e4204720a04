// engine/view/curves.hpp
// Curves of the rows of q, of v, and of forces on these, of one instance: with their units and the bodies whose joints they belong to, and
// no numbers yet.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/view/animation.hpp"
#include "layout/model.hpp"

namespace linden {

std::vector<Curve> position_curves(const Model& model, std::int64_t instance);
std::vector<Curve> velocity_curves(const Model& model, std::int64_t instance);
std::vector<Curve> force_curves(const Model& model, std::int64_t instance);

}  // namespace linden

// engine/program/recording_view.hpp
// A recording as a motion to be looked at.
#pragma once

#include <string>

#include "engine/files/recorded_arrays.hpp"
#include "engine/program/views.hpp"
#include "layout/effects.hpp"
#include "layout/model.hpp"

namespace linden {

/// `file`: that the arrays were read from, for messages. The first `shown` instances; frames as --fps asks for. Curves: positions,
/// velocities, energy, and every array [frames, instances, rows] whose rows have names. Throws InputError where the arrays are not of this
/// model, and for numbers of a position or a time that are not finite.
Animation animation_of(const RecordedArrays& arrays, const std::string& file, const Model& model, const Effects& effects,
                       const ViewArguments& arguments, std::int64_t shown);

}  // namespace linden

// engine/solve/diagnosis.hpp
// Which body a step that failed is reported for: the slot that whoever reads the report should look at first.
#pragma once

#include "layout/model.hpp"
#include "layout/workspace.hpp"

namespace linden {

/// Whose joint or pose turned most in the displacement evaluated last, or is not finite.
Index worst_displacement(const Model& model, const Workspace<double>& work);
/// Which has most kinetic energy in it.
Index fastest_body(const Model& model, const BodyConstants<double>& constants, const Workspace<double>& work);
/// Whose joint has the largest share of the residual's energy norm. joint_inverse: see TreeSweeps.
Index largest_residual(const Model& model, const Workspace<double>& work, const Field<double>& joint_inverse);

}  // namespace linden

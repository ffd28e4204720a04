// layout/merged_models.hpp
// Several models as one: one system with the roots of all of them, that move as each would alone.
//
//   slots      sorted anew (layout/tree.hpp); within level and kind, models in their order, bodies in theirs
//   names      of links, joints and coordinates begin with the model's name and a slash, "left/elbow"; an empty name adds nothing
//   pose       moves the roots: what a free root's position counts from as well as where a fixed one sits
//   shapes     meshes are called by the whole path of their files where the models come from several files
//   the rest   constants, attributes, mimic joints and warnings come along unchanged
#pragma once

#include <string>
#include <vector>

#include "layout/model.hpp"

namespace linden {

struct PlacedModel {
  Model model;
  std::string name;              // before the names of its links and joints; empty: they stay as they are
  Pose pose = Pose::Identity();  // of what the model takes for the world
};

/// Throws InputError where there is no model, a pose is not finite, or two links, joints or coordinates end up with one name.
Model merged(const std::vector<PlacedModel>& parts, const std::string& name);

}  // namespace linden

// models/build/merged_models.hpp
// Several models as one: one system with the roots of all of them. Those that stand in the world move as each would alone; one that is hung
// from a link of another is fixed to that with what is its world, and carried along.
//
//   slots      sorted anew (layout/tree.hpp); within level and kind, models in their order, bodies in theirs
//   names      of links, joints and coordinates begin with the model's name and a slash, "left/elbow"; an empty name adds nothing
//   pose       moves the roots: what a free root's position counts from as well as where a fixed one sits; of a hung model in the frame of
//              its parent link
//   welded     what a hung model has fixed to its world becomes part of the body it hangs from, mass, shapes and all
//   shapes     meshes are called by the whole path of their files where the models come from several files
//   the rest   constants, attributes, mimic joints and warnings come along unchanged
#pragma once

#include <string>
#include <vector>

#include "layout/model.hpp"

namespace linden {

struct PlacedModel {
  Model model;
  std::string name;      // before the names of its links and joints; empty: they stay as they are
  Pose pose{};           // of what the model takes for the world
  std::string parent{};  // link that it hangs from, as the whole calls it, "crane/hook"; empty: the world
};

/// Throws InputError where there is no model, a pose is not finite, two links, joints or coordinates end up with one name, or a model hangs
/// from a link that there is not, from itself by way of others, or by a free joint.
Model merged(const std::vector<PlacedModel>& parts, const std::string& name);

}  // namespace linden

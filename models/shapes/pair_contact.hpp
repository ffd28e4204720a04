// Which shapes of a model can touch each other: all of its collision shapes, meshes as their convex hulls, in the pairs of collision_pairs.hpp.
#pragma once

#include <string>
#include <vector>

#include "layout/effects/contact.hpp"
#include "layout/model.hpp"
#include "models/shapes/collision_pairs.hpp"

namespace linden {

/// disabled: pairs of links that do not touch; only: where it is not empty, the pairs that do, neighbours too. Notes say which meshes were not found
/// or not read, and so touch nothing, and how many stand as their hulls. Throws InputError, with the nearest name, where a pair names a link that
/// the model does not have.
PairContact pair_contact_of(const Model& model, std::vector<std::string>& notes, const LinkPairs& disabled = {}, const LinkPairs& only = {});

}  // namespace linden

// models/shapes/contacts_of.hpp
// Where the bodies of a model may touch the ground, from the collision shapes of its file (layout/contacts.hpp). Files of meshes are read for
// this, for masses from a density and where a model is looked at, and for nothing else: mesh_path.hpp finds them, mesh_box.hpp reads them.
#pragma once

#include <string>
#include <vector>

#include "layout/contacts.hpp"
#include "layout/model.hpp"

namespace linden {

/// Contact points of all shapes of a model. Notes say which meshes were not found or not read, and so touch nothing, and how many
/// stand as boxes.
Contacts contacts_of(const Model& model, std::vector<std::string>& notes);

}  // namespace linden

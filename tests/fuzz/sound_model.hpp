// tests/fuzz/sound_model.hpp
// What holds of every model, whatever it was read from.
#pragma once

#include <algorithm>
#include <cmath>

#include "layout/model.hpp"
#include "tests/fuzz/input.hpp"

namespace linden {

inline bool finite(const Pose& pose) {
  const auto is_finite = [](double value) { return std::isfinite(value); };
  return std::ranges::all_of(pose.rotation, is_finite) && std::ranges::all_of(pose.shift, is_finite);
}

inline void require_sound(const Model& model) {
  const Tree& tree = model.tree;
  const auto slots = static_cast<std::size_t>(tree.shape.slots);
  require(tree.bodies() > 0, "no body moves");
  require(model.names.body.size() == slots && model.names.joint.size() == slots, "names of bodies and joints");
  require(model.names.position.size() == static_cast<std::size_t>(tree.shape.positions), "names of positions");
  require(model.names.velocity.size() == static_cast<std::size_t>(tree.shape.velocities), "names of velocities");
  for (Index i = 1; i < tree.shape.slots; ++i) {
    require(tree.parent(i) >= 0 && tree.parent(i) < i, "a parent comes after its child");
  }
  model.constants.each(model.constants, [](const char* name, const auto& field, Rows, const char*) {
    require(std::ranges::all_of(field.flat(), [](double value) { return std::isfinite(value); }), name);
  });
  model.attributes.each(model.attributes, [](const char* name, const auto& field, Rows, const char*) {
    require(std::ranges::none_of(field.flat(), [](double value) { return std::isnan(value); }), name);
  });
  for (const Mimic& mimic : model.mimics) {
    require(std::isfinite(mimic.multiplier) && std::isfinite(mimic.offset), "a mimic's numbers");
    require(mimic.leader_slot > 0 && mimic.leader_slot != mimic.follower_slot, "a mimic's leader");
  }
  for (const Coupling& coupling : model.couplings) {
    require(finite(coupling.frame_a) && finite(coupling.frame_b), "the frames of a coupling");
    require(!coupling.terms.empty() || coupling.slot_a != coupling.slot_b, "a coupling of a body with itself");
  }
  for (const auto& [link, place] : model.names.link) {
    require(place.slot >= 0 && place.slot < tree.shape.slots && finite(place.in_body), "the place of a link");
  }
  for (const BodyShape& shape : model.shapes) {
    require(shape.slot > 0 && shape.slot < tree.shape.slots && finite(shape.pose), "the place of a shape");
  }
  for (const BodyVisual& visual : model.visuals) {
    require(visual.shape.slot > 0 && visual.shape.slot < tree.shape.slots && finite(visual.shape.pose), "the place of a visual");
  }
}

}  // namespace linden

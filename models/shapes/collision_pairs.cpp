#include "models/shapes/collision_pairs.hpp"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>

#include "layout/effects.hpp"
#include "layout/support/input_error.hpp"
#include "models/build/world_shapes.hpp"

namespace linden {

LinkPairs srdf_disabled_pairs(const std::string& file) {
  tinyxml2::XMLDocument document;
  const tinyxml2::XMLError error = document.LoadFile(file.c_str());
  if (error == tinyxml2::XML_ERROR_FILE_NOT_FOUND) throw InputError(fmt::format("{}: there is no such file; expected an SRDF file; check the path", file));
  if (error != tinyxml2::XML_SUCCESS) {
    throw InputError(fmt::format("{}: it cannot be read as XML ({}); expected an SRDF file", file, document.ErrorStr()));
  }
  const tinyxml2::XMLElement* robot = document.RootElement();
  if (robot == nullptr || std::string(robot->Name()) != "robot") {
    throw InputError(fmt::format("{}: its root is <{}>; expected <robot>", file, robot == nullptr ? "" : robot->Name()));
  }
  LinkPairs pairs;
  for (const auto* entry = robot->FirstChildElement("disable_collisions"); entry != nullptr;
       entry = entry->NextSiblingElement("disable_collisions")) {
    const char *one = entry->Attribute("link1"), *other = entry->Attribute("link2");
    if (one == nullptr || other == nullptr) {
      throw InputError(fmt::format("{}:{}: <disable_collisions> without link1 and link2; expected the names of two links", file,
                                   entry->GetLineNum()));
    }
    pairs.emplace_back(one, other);
  }
  return pairs;
}

CollisionPairs::CollisionPairs(const Model& model, const LinkPairs& disabled) {
  for (Index i = 0; i < model.tree.shape.slots; ++i) parent_.push_back(model.tree.kind(i) == JointKind::free ? -1 : model.tree.parent(i));
  for (const Coupling& coupling : model.couplings) {
    if (coupling.kind == CouplingKind::gear || coupling.kind == CouplingKind::cable || coupling.kind == CouplingKind::rod) continue;
    tied_.emplace(std::min(coupling.slot_a, coupling.slot_b), std::max(coupling.slot_a, coupling.slot_b));
  }
  for (const auto& [one, other] : disabled) {
    place_of(model, one);
    place_of(model, other);
    disabled_.emplace(std::min(one, other), std::max(one, other));
  }
}

bool CollisionPairs::may_touch(Index slot_a, const std::string& link_a, Index slot_b, const std::string& link_b) const {
  if (slot_a == slot_b) return false;
  const bool apart = (slot_a == 0 && stands_in_world(link_a)) || (slot_b == 0 && stands_in_world(link_b));
  if (!apart) {
    if (parent_[static_cast<std::size_t>(slot_a)] == slot_b || parent_[static_cast<std::size_t>(slot_b)] == slot_a) return false;
    if (tied_.contains({std::min(slot_a, slot_b), std::max(slot_a, slot_b)})) return false;
  }
  return disabled_.empty() || !disabled_.contains({std::min(link_a, link_b), std::max(link_a, link_b)});
}

}  // namespace linden

#include "engine/scene/scene_joints.hpp"

#include <fmt/format.h>

#include "layout/effects.hpp"
#include "layout/support/words.hpp"

namespace linden {

SceneJoints::SceneJoints(const Model& model) : model_(model), slot_of_row_(static_cast<std::size_t>(model.tree.shape.velocities)) {
  for (const Run& run : model.tree.runs) {
    for (Index i = run.begin; i < run.end; ++i) {
      for (Index k = 0; k < velocity_count(run.kind); ++k) {
        slot_of_row_[static_cast<std::size_t>(model.tree.first_v(i) + k)] = {i, run.kind};
      }
    }
  }
  for (const Mimic& mimic : model.mimics) leader_of_[mimic.follower_slot] = mimic.leader_slot;
}

NamedJoint SceneJoints::joint(const SceneValue& at, const std::string& name) const {
  const Index row = at.located([&] { return row_of(model_, name); });
  const auto [slot, kind] = slot_of_row_[static_cast<std::size_t>(row)];
  if (kind == JointKind::free)
    at.fail(fmt::format("joint {} is a free joint", quoted(name)), "a joint that turns or slides", "leave it out");
  return {slot, row, model_.tree.first_q(slot), kind};
}

NamedJoint SceneJoints::screw(const SceneValue& at, const std::string& name) const {
  const NamedJoint found = joint(at, name);
  if (found.kind != JointKind::screw) {
    at.fail(fmt::format("joint {} is a ball joint", quoted(name)), "a joint that turns or slides about one axis",
            "leave it out; ball joints have damping and spring");
  }
  return found;
}

void SceneJoints::refuse_follower(const SceneValue& at, const NamedJoint& joint) const {
  const auto found = leader_of_.find(joint.slot);
  if (found == leader_of_.end()) return;
  at.fail(fmt::format("joint {} follows another", quoted(this->name(joint.slot))), "a joint that follows none",
          fmt::format("name its leader {}", quoted(this->name(found->second))));
}

LinkPlace SceneJoints::body(const SceneValue& at, const std::string& link) const {
  const LinkPlace place = at.located([&] { return place_of(model_, link); });
  if (place.slot == 0)
    at.fail(fmt::format("link {} is fixed to the world", quoted(link)), "a link that moves", "leave it out");
  return place;
}

}  // namespace linden

// engine/scene/scene_joints.hpp
// Joints and links as a scene names them: found in the model, or refused with file, line and what to write instead.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "engine/scene/scene_yaml.hpp"
#include "layout/model.hpp"

namespace linden {

/// A joint of the model that a scene names.
struct NamedJoint {
  Index slot, row, position;  // first velocity and position row
  JointKind kind;
};

class SceneJoints {
 public:
  /// The model must outlive it.
  explicit SceneJoints(const Model& model);

  const Model& model() const { return model_; }
  /// Throw InputError for a joint that there is not, a free one, and the second also for a ball joint.
  NamedJoint joint(const SceneValue& at, const std::string& name) const;
  NamedJoint screw(const SceneValue& at, const std::string& name) const;
  NamedJoint joint(const SceneValue::Entry& entry) const { return joint(entry.value, entry.key); }
  NamedJoint screw(const SceneValue::Entry& entry) const { return screw(entry.value, entry.key); }
  void refuse_follower(const SceneValue& at, const NamedJoint& joint) const;
  /// Where a link that moves is.
  LinkPlace body(const SceneValue& at, const std::string& link) const;

 private:
  const std::string& name(Index slot) const { return model_.names.joint[static_cast<std::size_t>(slot)]; }

  const Model& model_;
  std::vector<std::pair<Index, JointKind>> slot_of_row_;
  std::map<Index, Index> leader_of_;
};

}  // namespace linden

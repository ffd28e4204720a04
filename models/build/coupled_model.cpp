#include "models/build/coupled_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <unordered_set>

#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"

namespace linden {
namespace {

[[noreturn]] void refuse_coupling(const std::string& name, const std::string& what) { throw InputError(fmt::format("coupling {}: {}", quoted(name), what)); }

std::string default_name(const CouplingSpec& spec, const Coupling& coupling) {
  if (spec.kind == CouplingKind::gear) {
    std::vector<std::string> joints;
    for (const GearJoint& one : spec.joints) joints.push_back(one.joint);
    return fmt::format("gear of {}", fmt::join(joints, ", "));
  }
  if (spec.kind == CouplingKind::cable) {
    if (spec.joint) return spec.joint->name;
    std::vector<std::string> links;
    for (const CablePlace& place : spec.through) links.push_back(place.link.empty() ? "world" : place.link);
    return fmt::format("cable of {}", fmt::join(links, ", "));
  }
  const auto link = [](const std::string& name) { return name.empty() ? std::string("world") : name; };
  return fmt::format("{} of {} and {}", kind_text(coupling), link(spec.link_a), link(spec.link_b));
}

/// A frame at the point whose z axis is `axis`, and y axis as near to `side` as can be where that is not zero.
Isometry frame_at(const Eigen::Vector3d& point, const Eigen::Vector3d& axis, const Eigen::Vector3d& side) {
  Isometry frame = Isometry::Identity();
  const Eigen::Vector3d z = axis.normalized();
  Eigen::Vector3d y = side - side.dot(z) * z;
  if (y.norm() < 1e-9 * std::max(1e-300, side.norm()) || side.isZero()) y = z.unitOrthogonal();
  y.normalize();
  frame.linear().col(0) = y.cross(z);
  frame.linear().col(1) = y;
  frame.linear().col(2) = z;
  frame.translation() = point;
  return frame;
}

class Coupler {
 public:
  explicit Coupler(Model model) : model_(std::move(model)), poses_(neutral_poses(model_)) {
    for (const Coupling& coupling : model_.couplings) names_.insert(coupling.name);
  }

  void add(const CouplingSpec& spec) {
    if (spec.joint) check_joint(spec);
    Coupling coupling;
    coupling.kind = spec.kind;
    coupling.shift = spec.shift.along;
    coupling.turn = spec.turn.along;
    coupling.name = spec.name.empty() ? default_name(spec, coupling) : spec.name;
    if (!names_.insert(coupling.name).second) refuse_coupling(coupling.name, "there is another one of this name; expected each once; give it a name");
    check_compliance(coupling);
    if (spec.kind == CouplingKind::gear) {
      add_terms(spec, coupling);
    } else if (spec.kind == CouplingKind::cable) {
      add_cable(spec, coupling);
    } else {
      add_frames(spec, coupling);
    }
    if (spec.joint && spec.kind != CouplingKind::cable) {
      model_ = with_closing_joint(std::move(model_), coupling, *spec.joint);
      poses_ = neutral_poses(model_);
    }
    model_.couplings.push_back(std::move(coupling));
  }

  Model take() { return std::move(model_); }

 private:
  void check_joint(const CouplingSpec& spec) const {
    const std::string& name = spec.name.empty() ? spec.joint->name : spec.name;
    if (spec.kind != CouplingKind::hinge && spec.kind != CouplingKind::slider && spec.kind != CouplingKind::cable) {
      refuse_coupling(name, fmt::format("a {} has no coordinate of its own; expected a hinge, a slider or a cable; leave joint {} out", name_of(spec.kind), quoted(spec.joint->name)));
    }
    check_name(name, spec.joint->name);
    if (spec.shift.gives_way() || spec.turn.gives_way()) {
      refuse_coupling(name, "it gives way, and is to have a coordinate of its own; expected a rigid one; leave its stiffness and damping out, or the joint");
    }
  }
  void check_name(const std::string& coupling, const std::string& joint) const {
    if (model_.names.slot_of_joint.contains(joint)) {
      refuse_coupling(coupling, fmt::format("there is a joint {} already; expected a name of its own; choose another", quoted(joint)));
    }
  }
  static void check_compliance(const Coupling& coupling) {
    for (const Compliances* laws : {&coupling.shift, &coupling.turn}) {
      const char* const does = laws == &coupling.turn ? "turns" : "shifts";
      const bool is_one = (*laws)[0] == (*laws)[1] && (*laws)[0] == (*laws)[2];
      bool used = false;
      for (std::size_t axis = 0; axis < laws->size(); ++axis) {
        const Compliance& law = (*laws)[axis];
        for (const double number : {law.stiffness, law.damping}) {
          if (!(number >= 0) || !std::isfinite(number)) {
            refuse_coupling(coupling.name, fmt::format("a stiffness or damping of it is {}; expected a finite number, zero or more", number));
          }
        }
        const auto uses = [&](const GapRow& row) { return &compliance_of(coupling, row) == &law; };
        const bool has_row = std::ranges::any_of(rows_of(coupling.kind), uses);
        used = used || has_row;
        if (!is_one && !has_row && law.gives_way()) {
          refuse_coupling(coupling.name,
                          fmt::format("a {} has nothing that {} along its axis {}; expected zero there", name_of(coupling.kind), does, "xyz"[axis]));
        }
      }
      if (any_gives_way(*laws) && !used) {
        refuse_coupling(coupling.name, fmt::format("a {} has nothing that {}; expected no stiffness or damping of that", name_of(coupling.kind), does));
      }
    }
    if (rows_of(coupling).empty()) refuse_coupling(coupling.name, "it neither pulls nor damps; expected a stiffness or damping above zero");
  }
  LinkPlace place_of(const std::string& coupling, const std::string& link) const {
    if (link.empty() || link == "world") return {};
    const auto found = model_.names.link.find(link);
    if (found != model_.names.link.end()) return found->second;
    std::vector<std::string> names;
    for (const auto& [name, place] : model_.names.link) names.push_back(name);
    std::ranges::sort(names);
    const std::string near = nearest(link, names);
    refuse_coupling(coupling, fmt::format("model {} has no link {}{}", quoted(model_.names.model), quoted(link),
                                          near.empty() ? "; expected one of its links, or world" : fmt::format("; did you mean {}?", quoted(near))));
  }

  void add_frames(const CouplingSpec& spec, Coupling& coupling) const {
    const LinkPlace a = place_of(coupling.name, spec.link_a), b = place_of(coupling.name, spec.link_b);
    if (a.slot == b.slot) {
      refuse_coupling(coupling.name, a.slot == 0 ? "both of its links are fixed to the world; expected one that moves"
                                                 : fmt::format("both of its links are parts of body {}; expected two that move against each other",
                                                               quoted(model_.names.body[static_cast<std::size_t>(a.slot)])));
    }
    coupling.slot_a = a.slot;
    coupling.slot_b = b.slot;
    Isometry frame_a = isometry(a.in_body) * spec.frame_a, frame_b = isometry(b.in_body) * spec.frame_b;
    if (spec.at) {
      const PointAndAxis& at = *spec.at;
      if (!at.point.allFinite() || !at.axis.allFinite() || !at.second_axis.allFinite()) refuse_coupling(coupling.name, "its point or axis is not finite");
      if (at.axis.norm() < 1e-12) refuse_coupling(coupling.name, "its axis has no length; expected a direction");
      Eigen::Vector3d side = at.second_axis;
      if (spec.kind == CouplingKind::bushing && side.isZero()) side = Eigen::Vector3d::UnitY();
      Isometry in_world_a = frame_at(at.point, at.axis, side), in_world_b = in_world_a;
      if (spec.kind == CouplingKind::universal) {
        const Eigen::Vector3d second = at.second_axis.isZero() ? in_world_a.linear().col(1) : at.second_axis;
        if (std::abs(at.axis.normalized().dot(second.normalized())) > 1e-9) refuse_coupling(coupling.name, "its two axes are not at right angles");
        in_world_a = frame_at(at.point, at.axis.cross(second), second);  // x is the axis
        in_world_b = in_world_a;
      }
      frame_a = poses_[static_cast<std::size_t>(a.slot)].inverse() * in_world_a;
      frame_b = poses_[static_cast<std::size_t>(b.slot)].inverse() * in_world_b;
    }
    coupling.frame_a = pose_of(frame_a);
    coupling.frame_b = pose_of(frame_b);
    if (spec.kind != CouplingKind::rod) return;
    const Eigen::Vector3d apart = poses_[static_cast<std::size_t>(b.slot)] * Eigen::Vector3d(frame_b.translation()) -
                                  poses_[static_cast<std::size_t>(a.slot)] * Eigen::Vector3d(frame_a.translation());
    coupling.length = spec.length != 0 ? spec.length : apart.norm();
    if (!(coupling.length > 0) || !std::isfinite(coupling.length)) {
      refuse_coupling(coupling.name, fmt::format("its length is {} m; expected more than zero; two points that are one are a ball joint", coupling.length));
    }
  }

  void add_cable(const CouplingSpec& spec, Coupling& coupling) {
    if (any_gives_way(coupling.shift)) refuse_coupling(coupling.name, "a cable stretches by a spring on its length; expected no stiffness or damping of its row");
    for (const CablePlace& place : spec.through) place_of(coupling.name, place.link);
    const ClosingJoint length = spec.joint.value_or(ClosingJoint{.name = coupling.name});
    if (!spec.joint) check_name(coupling.name, length.name);
    model_ = with_cable_length(std::move(model_), coupling, spec.through, length);
    poses_ = neutral_poses(model_);
  }

  void add_terms(const CouplingSpec& spec, Coupling& coupling) const {
    if (spec.joints.empty()) refuse_coupling(coupling.name, "it names no joints; expected two or more, with their ratios");
    if (!std::isfinite(spec.offset)) refuse_coupling(coupling.name, fmt::format("its offset is {}", spec.offset));
    coupling.offset = spec.offset;
    std::unordered_set<Index> rows;
    for (const GearJoint& one : spec.joints) {
      const auto found = model_.names.slot_of_joint.find(one.joint);
      if (found == model_.names.slot_of_joint.end()) {
        refuse_coupling(coupling.name, fmt::format("model {} has no moving joint {}", quoted(model_.names.model), quoted(one.joint)));
      }
      const Index slot = found->second;
      if (model_.tree.kind(slot) != JointKind::screw) {
        refuse_coupling(coupling.name, fmt::format("joint {} has more than one coordinate; expected joints that turn or slide", quoted(one.joint)));
      }
      if (!std::isfinite(one.ratio) || one.ratio == 0) {
        refuse_coupling(coupling.name, fmt::format("the ratio of joint {} is {}; expected a finite number other than zero", quoted(one.joint), one.ratio));
      }
      if (!rows.insert(model_.tree.first_v(slot)).second) refuse_coupling(coupling.name, fmt::format("joint {} is named twice", quoted(one.joint)));
      coupling.terms.push_back({model_.tree.first_q(slot), model_.tree.first_v(slot), one.ratio});
    }
  }

  Model model_;
  std::vector<Isometry> poses_;
  std::unordered_set<std::string> names_;
};

}  // namespace

std::vector<Isometry> neutral_poses(const Model& model) {
  std::vector<Isometry> poses(static_cast<std::size_t>(model.tree.shape.slots), Isometry::Identity());
  std::unordered_map<Index, double> offsets;
  for (const Mimic& mimic : model.mimics) offsets[mimic.follower_slot] = mimic.offset;
  for (Index i = 1; i < model.tree.shape.slots; ++i) {
    Pose placed;
    for (std::size_t k = 0; k < 9; ++k) placed.rotation[k] = model.constants.tree_placement(i, static_cast<int>(k));
    for (std::size_t k = 0; k < 3; ++k) placed.shift[k] = model.constants.tree_placement(i, static_cast<int>(9 + k));
    Isometry pose = poses[static_cast<std::size_t>(model.tree.parent(i))] * isometry(placed);
    if (const auto found = offsets.find(i); found != offsets.end()) {
      pose.rotate(Eigen::AngleAxisd(model.constants.screw(i, 0) * found->second, Eigen::Vector3d::UnitZ()));
      pose.translate(Eigen::Vector3d(0, 0, model.constants.screw(i, 1) * found->second));
    }
    poses[static_cast<std::size_t>(i)] = pose;
  }
  return poses;
}

Model coupled(Model model, const std::vector<CouplingSpec>& couplings) {
  Coupler coupler(std::move(model));
  for (const CouplingSpec& spec : couplings) coupler.add(spec);
  return coupler.take();
}

}  // namespace linden

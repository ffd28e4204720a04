#include "models/urdf/urdf.hpp"

#include <console_bridge/console.h>
#include <fmt/format.h>
#include <urdf_parser/urdf_parser.h>

#include <cmath>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "layout/support/text_file.hpp"
#include "layout/support/words.hpp"
#include "models/build/builder.hpp"
#include "models/shapes/shape_mass.hpp"
#include "models/urdf/urdf_check.hpp"

namespace linden {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Keeps urdfdom's messages off stderr while it lives. The handler is global to the process, hence the lock.
class QuietConsole : public console_bridge::OutputHandler {
 public:
  QuietConsole() : lock_(mutex()), before_(console_bridge::getOutputHandler()) {
    console_bridge::useOutputHandler(this);
  }
  ~QuietConsole() override { console_bridge::useOutputHandler(before_); }
  QuietConsole(const QuietConsole&) = delete;
  QuietConsole& operator=(const QuietConsole&) = delete;

  void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override {
    if (level == console_bridge::CONSOLE_BRIDGE_LOG_ERROR && first_error_.empty()) first_error_ = text;
  }
  const std::string& first_error() const { return first_error_; }

 private:
  static std::mutex& mutex() {
    static std::mutex instance;
    return instance;
  }
  std::lock_guard<std::mutex> lock_;
  console_bridge::OutputHandler* before_;
  std::string first_error_;
};

/// A robot as urdfdom holds it. Its links own their children, so that destroying them recurses as deep as the tree is
/// (some 80 bytes of stack a link): they are cut apart first.
class Robot {
 public:
  Robot(const std::string& xml, const std::string& source_name) {
    const QuietConsole console;
    model_ = urdf::parseURDF(xml);
    if (!model_) {
      throw InputError(fmt::format("{}: urdfdom refuses it: {}; expected plain URDF; run check_urdf on the file",
                                   source_name, console.first_error()));
    }
  }
  ~Robot() {
    for (const auto& [name, link] : model_->links_) {
      link->child_links.clear();
      link->child_joints.clear();
      link->parent_joint.reset();
    }
  }
  Robot(const Robot&) = delete;
  Robot& operator=(const Robot&) = delete;

  const urdf::ModelInterface* operator->() const { return model_.get(); }

  /// The name, lengthened until no joint of the robot has it.
  std::string free_joint_name(std::string name) const {
    while (model_->joints_.count(name) > 0) name += '_';
    return name;
  }

 private:
  urdf::ModelInterfaceSharedPtr model_;
};

Vector3d vector_of(const urdf::Vector3& v) { return {v.x, v.y, v.z}; }

Isometry3d isometry_of(const urdf::Pose& pose) {
  const urdf::Rotation& r = pose.rotation;
  Isometry3d result = Isometry3d::Identity();
  result.linear() = Eigen::Quaterniond(r.w, r.x, r.y, r.z).toRotationMatrix();
  result.translation() = vector_of(pose.position);
  return result;
}

LinkInertia inertia_of(const urdf::Link& link) {
  LinkInertia result;
  if (!link.inertial) return result;
  const urdf::Inertial& i = *link.inertial;
  const Isometry3d frame = isometry_of(i.origin);
  Matrix3d about_center;
  about_center << i.ixx, i.ixy, i.ixz,  //
      i.ixy, i.iyy, i.iyz,              //
      i.ixz, i.iyz, i.izz;
  result.mass = i.mass;
  result.center = frame.translation();
  result.about_center = frame.linear() * about_center * frame.linear().transpose();
  return result;
}

JointType type_of(const urdf::Joint& joint) {
  switch (joint.type) {
    case urdf::Joint::REVOLUTE:
    case urdf::Joint::CONTINUOUS: return JointType::revolute;
    case urdf::Joint::PRISMATIC: return JointType::prismatic;
    case urdf::Joint::FLOATING: return JointType::free;
    case urdf::Joint::PLANAR: return JointType::planar;
    default: return JointType::fixed;
  }
}

JointLimits limits_of(const urdf::Joint& joint) {
  JointLimits result;
  if (!joint.limits) return result;
  const auto unlimited = [](double value) { return std::abs(value) == kUnlimited; };
  const urdf::JointLimits& limits = *joint.limits;
  if (!unlimited(limits.lower)) result.lower = limits.lower;
  if (!unlimited(limits.upper)) result.upper = limits.upper;
  if (!unlimited(limits.velocity)) result.velocity = limits.velocity;
  if (!unlimited(limits.effort)) result.effort = limits.effort;
  return result;
}

LinkSpec spec_of(const urdf::Joint& joint, const urdf::Link& link) {
  LinkSpec spec;
  spec.name = link.name;
  spec.parent = joint.parent_link_name;
  spec.joint = joint.name;
  spec.type = type_of(joint);
  spec.placement = isometry_of(joint.parent_to_joint_origin_transform);
  if (spec.type != JointType::fixed && spec.type != JointType::free)
    spec.axis = vector_of(joint.axis).stableNormalized();
  spec.inertia = inertia_of(link);
  spec.limits = limits_of(joint);
  if (joint.dynamics) {
    spec.damping = joint.dynamics->damping;
    spec.friction = joint.dynamics->friction;
  }
  if (joint.mimic) {
    spec.mimic = joint.mimic->joint_name;
    spec.multiplier = joint.mimic->multiplier;
    spec.offset = joint.mimic->offset;
  }
  return spec;
}

/// True where the root and all that is fixed to it have no mass and carry floating joints only.
bool root_is_world(const urdf::Link& root) {
  bool floats = false;
  std::vector<const urdf::Link*> welded{&root};
  for (std::size_t next = 0; next < welded.size(); ++next) {
    const urdf::Link& link = *welded[next];
    if (link.inertial && link.inertial->mass > 0) return false;
    for (std::size_t child = 0; child < link.child_joints.size(); ++child) {
      const auto type = link.child_joints[child]->type;
      if (type == urdf::Joint::FIXED) {
        welded.push_back(link.child_links[child].get());
      } else if (type == urdf::Joint::FLOATING) {
        floats = true;
      } else {
        return false;
      }
    }
  }
  return floats;
}

LinkSpec root_spec(const Robot& robot, Base base) {
  const urdf::Link& root = *robot->root_link_;
  const bool floating = base == Base::floating && !root_is_world(root);
  LinkSpec spec;
  spec.name = root.name;
  spec.joint = robot.free_joint_name(floating ? "base" : "world_to_" + root.name);
  spec.type = floating ? JointType::free : JointType::fixed;
  spec.inertia = inertia_of(root);
  return spec;
}

/// The model; what the builder refuses may come of a slip in a word.
Model built(const TreeBuilder& builder, const std::string& suspect) {
  try {
    return builder.build();
  } catch (const InputError& error) {
    if (suspect.empty()) throw;
    throw InputError(fmt::format("{} (and see {})", error.what(), suspect));
  }
}

}  // namespace

Model load_urdf(const std::string& file, Base base, Reading reading, std::optional<double> density, Still still) {
  return parse_urdf(read_text(file, "a URDF file"), file, base, reading, density, still);
}

Model parse_urdf(const std::string& xml, const std::string& source_name, Base base, Reading reading,
                 std::optional<double> density, Still still) {
  std::optional<ShapeMass> mass;
  if (density) mass.emplace(*density, source_name);
  CheckedUrdf checked = check_urdf(xml, source_name, density.has_value());
  const Robot robot(checked.xml, source_name);
  TreeBuilder builder(robot->getName());
  builder.source(source_name);
  for (const std::string& warning : checked.warnings) builder.warn(warning);
  for (const std::string& fault : checked.visual_faults) builder.visual_fault(fault);
  const auto add = [&](LinkSpec spec, const urdf::Link& link) {
    if (const auto found = checked.shapes.find(spec.name); found != checked.shapes.end()) spec.shapes = std::move(found->second);
    if (const auto found = checked.visuals.find(spec.name); found != checked.visuals.end()) spec.visuals = std::move(found->second);
    if (mass && !link.inertial) spec.inertia = mass->of(spec.name, spec.shapes, spec.visuals);
    builder.add(std::move(spec));
  };
  add(root_spec(robot, base), *robot->root_link_);
  bool moves = base == Base::floating;
  for (const std::string& name : checked.joints) {
    const urdf::JointConstSharedPtr joint = robot->getJoint(name);
    const urdf::LinkConstSharedPtr link = joint ? robot->getLink(joint->child_link_name) : nullptr;
    if (!link)
      throw InputError(
          fmt::format("{}: urdfdom lost joint {}; expected plain text in names; rename it", source_name, quoted(name)));
    moves = moves || joint->type != urdf::Joint::FIXED;
    add(spec_of(*joint, *link), *link);
  }
  if (!moves && still == Still::refused) {
    throw InputError(fmt::format("{}: nothing moves: the robot is one rigid body, fixed to the world; expected a joint that moves; let its "
                                 "base float by --base floating, in a scene by base: floating",
                                 source_name));
  }
  if (still == Still::furniture) builder.may_stand_still();
  if (mass) {
    for (const std::string& trouble : mass->troubles()) builder.warn(trouble);
    builder.note(mass->note());
  }
  const bool mesh_missing = mass && !mass->troubles().empty();
  Model model = with_loops(built(builder, mesh_missing ? mass->troubles().front() : checked.suspect), checked.loops, source_name);
  if (reading == Reading::strict) refuse_warnings(model);
  return model;
}

}  // namespace linden

// Of urdf_loops.hpp: what loops become.
#include <fmt/format.h>

#include <utility>

#include "models/urdf/urdf_loops.hpp"

namespace linden {
namespace {

using Eigen::Vector3d;

/// Both ends of a loop while all coordinates are zero, as a coupling.
CouplingSpec coupling_of(const UrdfLoop& loop, const Model& model, const std::vector<Isometry>& bodies) {
  const auto pose_of_link = [&](const std::string& link) -> Isometry {
    if (link.empty()) return Isometry::Identity();
    const LinkPlace place = model.names.link.at(link);
    return bodies[static_cast<std::size_t>(place.slot)] * isometry(place.in_body);
  };
  const Isometry link_a = pose_of_link(loop.link_a), link_b = pose_of_link(loop.link_b);
  Isometry end_a = link_a * loop.in_a, end_b = link_b * loop.in_b;
  if (loop.meeting) end_a = end_b = pose_of_link(loop.meeting->link) * loop.meeting->pose;
  if (loop.turned_as_at_zero) end_b.linear() = end_a.linear();
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  if (has_axis(loop.kind)) {
    Vector3d axis = loop.axis, second = (loop.second_axis - loop.axis.dot(loop.second_axis) * loop.axis).normalized();
    if (loop.axis_in) {
      const Eigen::Matrix3d into = end_a.linear().transpose() * pose_of_link(*loop.axis_in).linear();
      axis = into * axis;
      second = into * second;
    }
    if (loop.kind == CouplingKind::universal) {
      turn << axis, second, axis.cross(second);
    } else {
      turn << second.cross(axis), second, axis;
    }
  }
  CouplingSpec spec{.name = loop.name, .kind = loop.kind, .link_a = loop.link_a, .link_b = loop.link_b};
  spec.frame_a = link_a.inverse() * end_a;
  spec.frame_b = link_b.inverse() * end_b;
  spec.frame_a.linear() *= turn;
  spec.frame_b.linear() *= turn;
  spec.length = loop.length;
  spec.shift = loop.shift;
  spec.turn = loop.turn;
  return spec;
}

}  // namespace

Model with_loops(Model model, const std::vector<UrdfLoop>& loops, const std::string& source_name) {
  if (loops.empty()) return model;
  const std::vector<Isometry> bodies = neutral_poses(model);
  std::vector<std::pair<const UrdfLoop*, CouplingSpec>> couplings;
  const auto leave_out = [&](const UrdfLoop& loop, const std::string& why) {
    model.warnings.push_back(fmt::format("{}:{}: {}: {}; the robot moves as if it were not there", source_name, loop.line, loop.owner, why));
  };
  const auto slot = [&](const std::string& link) { return link.empty() ? 0 : model.names.link.at(link).slot; };
  for (const UrdfLoop& loop : loops) {
    if (slot(loop.link_a) == slot(loop.link_b)) {
      leave_out(loop, slot(loop.link_a) == 0 ? "both of its links are fixed to the world" : "both of its links are parts of one body");
      continue;
    }
    CouplingSpec spec = coupling_of(loop, model, bodies);
    if (!spec.frame_a.matrix().allFinite() || !spec.frame_b.matrix().allFinite()) {
      leave_out(loop, "its numbers are too large together");
      continue;
    }
    spec.joint = loop.joint;
    couplings.emplace_back(&loop, std::move(spec));
  }
  for (auto& [loop, spec] : couplings) {
    if (spec.joint) {
      try {
        model = coupled(model, {spec});
        continue;
      } catch (const InputError& error) {
        model.warnings.push_back(fmt::format("{}:{}: {}: {}; its limits, damping and friction are not used", source_name, loop->line, loop->owner, error.what()));
        spec.joint.reset();
      }
    }
    model = coupled(std::move(model), {spec});
  }
  return model;
}

}  // namespace linden

#include "models/build/cable.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>
#include <utility>

#include "layout/support/words.hpp"
#include "models/build/coupled_model.hpp"
#include "models/build/isometry.hpp"
#include "models/build/merged_models.hpp"
#include "models/build/vectors.hpp"

namespace linden {
namespace {

LinkPlace place_or_world(const Model& model, const std::string& link) { return link.empty() || link == "world" ? LinkPlace{} : model.names.link.at(link); }

Index common_ancestor(const Tree& tree, Index a, Index b) {
  while (a != b) {
    Index& lower = tree.level(a) > tree.level(b) ? a : b;
    lower = tree.parent(lower);
  }
  return a;
}

/// Of the lightest of these bodies, or of what hangs on one that has none [kg].
double least_mass(const Model& model, const std::vector<CablePoint>& points) {
  double least = 0;
  for (const CablePoint& point : points) {
    if (point.slot == 0) continue;
    const double own = model.constants.inertia(point.slot, 0), mass = own > 0 ? own : model.constants.subtree_mass(point.slot);
    if (mass > 0 && (least == 0 || mass < least)) least = mass;
  }
  return least > 0 ? least : 1;
}

std::vector<CablePoint> points_on_bodies(const Model& model, const std::vector<CablePlace>& places) {
  std::vector<CablePoint> points;
  for (const CablePlace& place : places) {
    const LinkPlace of_link = place_or_world(model, place.link);
    points.push_back({of_link.slot, array_of(isometry(of_link.in_body) * place.point)});
  }
  return points;
}

}  // namespace

Model with_cable_length(Model model, Coupling& cable, const std::vector<CablePlace>& places, const ClosingJoint& joint) {
  const auto refuse = [&](const std::string& what) { throw InputError(fmt::format("coupling {}: {}", quoted(cable.name), what)); };
  if (places.size() < 2) refuse(fmt::format("it goes through {} points; expected two or more", places.size()));
  for (const CablePlace& place : places) {
    if (!place.point.allFinite()) refuse("one of its points is not finite");
  }
  cable.points = points_on_bodies(model, places);
  Index host = cable.points.front().slot;
  const bool on_one_body = std::ranges::all_of(cable.points, [&](const CablePoint& point) { return point.slot == host; });
  if (on_one_body) refuse("all of its points are on one body; expected points that move against each other");
  for (const CablePoint& point : cable.points) host = common_ancestor(model.tree, host, point.slot);

  const std::vector<Isometry> poses = neutral_poses(model);
  cable.length = 0;
  for (std::size_t k = 1; k < cable.points.size(); ++k) {
    const auto at = [&](const CablePoint& point) { return Eigen::Vector3d(poses[static_cast<std::size_t>(point.slot)] * vector_of(point.at)); };
    cable.length += (at(cable.points[k]) - at(cable.points[k - 1])).norm();
  }

  LinkSpec slide;
  slide.name = fmt::format("length of {}", joint.name);
  slide.joint = joint.name;
  slide.type = JointType::prismatic;
  slide.inertia.mass = kCableMass * least_mass(model, cable.points);
  slide.limits = joint.limits;
  slide.damping = joint.damping;
  slide.friction = joint.friction;
  const std::string of_host = host == 0 ? "" : model.names.body[static_cast<std::size_t>(host)], name = model.names.model;
  const Isometry in_host = host == 0 ? Isometry(Isometry::Identity()) : isometry(model.names.link.at(of_host).in_body);
  PlacedModel hung{TreeBuilder(joint.name).add(std::move(slide)).build(), ""};
  Isometry along_x = Isometry::Identity();  // of the world, in the zero configuration
  along_x.linear() = Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitY()).toRotationMatrix();
  Isometry turned = Isometry::Identity();
  turned.linear() = (poses[static_cast<std::size_t>(host)] * in_host).linear().transpose() * along_x.linear();
  hung.pose = pose_of(turned);
  hung.parent = of_host;
  model = merged({PlacedModel{std::move(model), ""}, std::move(hung)}, name);

  cable.points = points_on_bodies(model, places);
  const Index slot = model.names.slot_of_joint.at(joint.name);
  cable.terms = {{model.tree.first_q(slot), model.tree.first_v(slot), -1}};
  return model;
}

}  // namespace linden

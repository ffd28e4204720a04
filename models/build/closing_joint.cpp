#include "models/build/closing_joint.hpp"

#include <fmt/format.h>

#include <numbers>
#include <utility>

#include "layout/support/words.hpp"
#include "models/build/isometry.hpp"
#include "models/build/merged_models.hpp"
#include "models/build/origin_inertia.hpp"

namespace linden {
namespace {

std::array<double, 10> inertia_numbers(const Model& model, Index slot) {
  std::array<double, 10> numbers;
  for (int k = 0; k < 10; ++k) numbers[static_cast<std::size_t>(k)] = model.constants.inertia(slot, k);
  return numbers;
}

/// Of a body, seen from a frame in it.
OriginInertia inertia_at(const Model& model, Index slot, const Isometry& frame) {
  const std::array<double, 10> numbers = inertia_numbers(model, slot);
  return OriginInertia(std::span<const double, 10>(numbers)).seen_from(Eigen::Isometry3d(frame.inverse().matrix()));
}

/// Whether the joint has something to move in this body: about its axis, or along it.
bool can_be_shared(const Model& model, Index slot, const Isometry& frame, CouplingKind kind) {
  constexpr double kNothing = 1e-12;
  if (slot == 0) return false;
  const OriginInertia inertia = inertia_at(model, slot, frame);
  if (!(inertia.mass > 0)) return false;
  return kind == CouplingKind::slider || inertia.about_origin(2, 2) > kNothing * std::max(1e-300, inertia.about_origin.trace());
}

/// About the centre of mass.
LinkInertia half_of(const OriginInertia& whole) {
  LinkInertia half;
  half.mass = 0.5 * whole.mass;
  half.center = whole.moment / whole.mass;
  half.about_center = 0.5 * (whole.about_origin - OriginInertia::parallel_axis(whole.mass, half.center));
  return half;
}

}  // namespace

Model with_closing_joint(Model model, Coupling& coupling, const ClosingJoint& joint) {
  const auto body = [&](Index slot) { return slot == 0 ? std::string("world") : model.names.body[static_cast<std::size_t>(slot)]; };
  Index host = coupling.slot_a, shared = coupling.slot_b;
  Isometry at_host = isometry(coupling.frame_a), at_shared = isometry(coupling.frame_b);
  if (!can_be_shared(model, shared, at_shared, coupling.kind)) {
    std::swap(host, shared);
    std::swap(at_host, at_shared);
    // what a does against b is the same about the axis the other way round
    const Eigen::AngleAxisd over(std::numbers::pi, Eigen::Vector3d::UnitX());
    at_host.rotate(over);
    at_shared.rotate(over);
    if (!can_be_shared(model, shared, at_shared, coupling.kind)) {
      throw InputError(fmt::format("joint {} that closes a loop: neither {} nor {} has an inertia that it could move; expected a link with mass and, where it "
                                   "turns, inertia about its axis; give one of them some, or leave the joint without a coordinate",
                                   quoted(joint.name), quoted(body(coupling.slot_a)), quoted(body(coupling.slot_b))));
    }
  }
  const std::string of_host = host == 0 ? "" : body(host), of_shared = body(shared), of_half = fmt::format("{} at {}", of_shared, joint.name);
  LinkSpec half;
  half.name = of_half;
  half.joint = joint.name;
  half.type = coupling.kind == CouplingKind::slider ? JointType::prismatic : JointType::revolute;
  half.inertia = half_of(inertia_at(model, shared, at_shared));
  half.limits = joint.limits;
  half.damping = joint.damping;
  half.friction = joint.friction;
  for (int k = 0; k < 10; ++k) model.constants.inertia(shared, k) = 0.5 * model.constants.inertia(shared, k);

  const std::string name = model.names.model;
  PlacedModel hung{TreeBuilder(joint.name).add(std::move(half)).build(), ""};
  hung.pose = pose_of(host == 0 ? at_host : Isometry(isometry(model.names.link.at(of_host).in_body).inverse() * at_host));
  hung.parent = of_host;
  model = merged({PlacedModel{std::move(model), ""}, std::move(hung)}, name);

  const LinkPlace place = model.names.link.at(of_half);
  coupling.kind = CouplingKind::weld;
  coupling.slot_a = place.slot;
  coupling.frame_a = place.in_body;
  coupling.slot_b = model.names.link.at(of_shared).slot;
  coupling.frame_b = pose_of(at_shared);
  return model;
}

}  // namespace linden

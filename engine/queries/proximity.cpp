#include "engine/queries/proximity.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <unordered_map>
#include <utility>

#include "engine/queries/link_frames.hpp"
#include "kernels/collision/broad_phase.hpp"
#include "kernels/collision/convex_pair.hpp"
#include "kernels/collision/height_contacts.hpp"
#include "layout/effects.hpp"
#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"
#include "models/shapes/convex_of.hpp"

namespace linden {

struct Proximity::Shapes {
  Shapes(const Model& model, const LinkPairs& disabled) : shapes(convex_of(model, notes)), pairs(model, disabled) {
    for (std::size_t k = 0; k < shapes.size(); ++k) of_link[shapes[k].link].push_back(k);
  }

  /// In the world.
  Pose pose(const Kinematics& state, std::size_t k) const {
    const Placement<double> T = frame_of(state, {shapes[k].slot, shapes[k].pose});
    Pose pose;
    T.R.to(pose.rotation.data());
    T.p.to(pose.shift.data());
    return pose;
  }

  const std::vector<std::size_t>& having(const Model& model, const std::string& link) const {
    place_of(model, link);
    const auto found = of_link.find(link);
    if (found == of_link.end()) {
      throw InputError(fmt::format("link {} has no collision shape that could be near another; expected one of the {} links that have", quoted(link),
                                   of_link.size()));
    }
    return found->second;
  }

  std::vector<std::string> notes;
  std::vector<ConvexBody> shapes;
  CollisionPairs pairs;
  std::unordered_map<std::string, std::vector<std::size_t>> of_link;
};

Proximity::Proximity(const Model& model, const LinkPairs& disabled) : shapes_(std::make_unique<Shapes>(model, disabled)) {}
Proximity::~Proximity() = default;
Proximity::Proximity(Proximity&&) noexcept = default;
Proximity& Proximity::operator=(Proximity&&) noexcept = default;

const std::vector<std::string>& Proximity::notes() const { return shapes_->notes; }

LinkDistance Proximity::distance(const Kinematics& state, const std::string& link_a, const std::string& link_b) const {
  const auto& of_a = shapes_->having(state.model(), link_a);
  const auto& of_b = shapes_->having(state.model(), link_b);
  if (link_a == link_b) throw InputError(fmt::format("the distance of link {} from itself was asked for; expected two links", quoted(link_a)));
  for (const auto* of_link : {&of_a, &of_b}) {
    for (const std::size_t k : *of_link) {
      if (!shapes_->shapes[k].shape.heights) continue;
      throw InputError(fmt::format("the distance of {} and {} was asked for, and {} are heights; expected links of other shapes; ask for all that is near",
                                   quoted(link_a), quoted(link_b), quoted(of_link == &of_a ? link_a : link_b)));
    }
  }
  LinkDistance nearest{.distance = std::numeric_limits<double>::infinity(), .normal = {}, .on_a = {}, .on_b = {}};
  for (const std::size_t a : of_a) {
    const Pose pose_a = shapes_->pose(state, a);
    for (const std::size_t b : of_b) {
      if (shapes_->shapes[a].shape.kind == ConvexKind::plane && shapes_->shapes[b].shape.kind == ConvexKind::plane) {
        throw InputError(fmt::format("the distance of {} and {} was asked for, which are planes without end both; expected one shape that has an end",
                                     quoted(link_a), quoted(link_b)));
      }
      // what is farther than the nearest so far need not be known
      const ContactPatch patch = contact_patch(shapes_->shapes[a].shape, pose_a, shapes_->shapes[b].shape, shapes_->pose(state, b), nearest.distance);
      if (patch.count == 0 || !(patch.distance < nearest.distance)) continue;
      const Vec3<double> place = patch.nearest().place, half = (0.5 * patch.distance) * patch.normal;
      nearest = {patch.distance, array_of(patch.normal), array_of(place - half), array_of(place + half)};
    }
  }
  return nearest;
}

std::vector<NearPair> Proximity::near(const Kinematics& state, double margin) const {
  if (!(margin >= 0) || !std::isfinite(margin)) throw InputError(fmt::format("margin: {} m; expected zero or more", margin));
  const std::vector<ConvexBody>& shapes = shapes_->shapes;
  std::vector<Pose> poses;
  std::vector<Bounds> bounds;
  for (std::size_t k = 0; k < shapes.size(); ++k) {
    poses.push_back(shapes_->pose(state, k));
    bounds.push_back(bounds_of(shapes[k].shape, poses.back()));
  }
  BroadPhase phase;
  std::vector<NearPair> found;
  HeightContacts met;
  for (const auto& [a, b] : phase.pairs(bounds, margin)) {
    const ConvexBody &one = shapes[a], &other = shapes[b];
    if (!shapes_->pairs.may_touch(one.slot, one.link, other.slot, other.link)) continue;
    if (one.shape.heights) {
      height_contacts(*one.shape.heights, poses[a], other.shape, poses[b], margin, met);
      const std::size_t first = found.size();
      for (const HeightContact& at : std::span(met.at).first(met.count)) {
        const std::array<double, 3> normal = array_of(at.normal);
        auto same = std::find_if(found.begin() + static_cast<std::ptrdiff_t>(first), found.end(), [&](const NearPair& pair) { return pair.normal == normal; });
        if (same == found.end()) same = found.insert(same, {one.link, other.link, one.slot, other.slot, a, b, at.point.gap, normal, {}});
        same->distance = std::min(same->distance, at.point.gap);
        same->points.push_back({array_of(at.point.place), at.point.gap, at.point.feature});
      }
      continue;
    }
    const ContactPatch patch = contact_patch(one.shape, poses[a], other.shape, poses[b], margin);
    if (patch.count == 0) continue;
    NearPair pair{one.link, other.link, one.slot, other.slot, a, b, patch.distance, array_of(patch.normal), {}};
    for (int k = 0; k < patch.count; ++k) {
      const PatchPoint& point = patch.points[static_cast<std::size_t>(k)];
      pair.points.push_back({array_of(point.place), point.gap, point.feature});
    }
    found.push_back(std::move(pair));
  }
  return found;
}

}  // namespace linden

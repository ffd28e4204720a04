#include "engine/scene/scene_couplings.hpp"

#include <fmt/format.h>

#include <optional>
#include <utility>

#include "engine/scene/scene_start.hpp"
#include "models/build/coupled_model.hpp"
#include "models/build/vectors.hpp"

namespace linden {
namespace {

using Keys = std::vector<std::string>;
const Keys kBodyKeys{"type",   "name",      "between", "point",             "axis",           "second_axis",
                     "frames", "joint", "stiffness", "damping", "turning_stiffness", "turning_damping"};
const Keys kRodKeys{"type", "name", "between", "points", "length"};
const Keys kSpringKeys{"type", "name", "between", "points", "stiffness", "damping", "rest"};
const Keys kCableKeys{"type", "name", "between", "points", "joint", "length", "stiffness", "damping"};
const Keys kBushingKeys{"type", "name", "between", "point", "frames", "stiffness", "damping", "turning_stiffness", "turning_damping"};
const Keys kGearKeys{"type", "name", "joints", "offset", "turning_stiffness", "turning_damping"};
const Keys kAllKeys{"type",   "name",   "between", "point",     "axis",    "second_axis", "frames",            "points",
                    "length", "joint", "joints", "offset",  "stiffness", "damping", "rest",        "turning_stiffness", "turning_damping"};
/// A rod that gives way, by the name that people know.
constexpr const char* kSpring = "spring";
const std::vector<std::string> kFrameKeys{"position", "rotation", "quaternion"};

const std::vector<std::string> kTypeNames = [] {
  std::vector<std::string> names;
  for (int kind = 0; kind < kCouplingKinds; ++kind) names.emplace_back(name_of(static_cast<CouplingKind>(kind)));
  names.emplace_back(kSpring);
  return names;
}();

CouplingKind kind_of(const SceneValue& at) {
  const std::string& type = at.choice(kTypeNames);
  if (type == kSpring) return CouplingKind::rod;
  int kind = 0;
  while (kTypeNames[static_cast<std::size_t>(kind)] != type) ++kind;
  return static_cast<CouplingKind>(kind);
}

SceneValue required(const SceneValue& at, std::string_view key, std::string_view expected) {
  if (const auto found = at.find(key)) return *found;
  at.fail(fmt::format("{} has no {}", at.path(), key), expected, "add it");
}

std::vector<SceneValue> pair_of(const SceneValue& at, std::string_view expected) {
  std::vector<SceneValue> items = at.list(expected);
  if (items.size() != 2) at.refuse(expected, "write one for each of both links");
  return items;
}

void read_cable(const SceneValue& at, CouplingSpec& spec) {
  constexpr const char* kLinks = "between: [link, link, ...], from end to end; world is one too";
  constexpr const char* kPoints = "points: one of each link, [[x, y, z], [x, y, z], ...]";
  const SceneValue between = required(at, "between", kLinks), points = required(at, "points", kPoints);
  const std::vector<SceneValue> links = between.list(kLinks), places = points.list(kPoints);
  if (links.size() < 2) between.refuse(kLinks, "write two links or more; a link that is gone through twice stands there twice");
  if (places.size() != links.size()) {
    points.fail(fmt::format("{} has {} points and {} links", at.path(), places.size(), links.size()), kPoints, "write one for each link of between");
  }
  for (std::size_t k = 0; k < links.size(); ++k) {
    spec.through.push_back({links[k].text("the name of a link, or world"), vector_of(places[k].vector("[x, y, z] in m, in the link's frame"))});
  }
}

/// How long a cable may become, or from where on it pulls.
struct CableEnd {
  std::string joint;
  std::optional<double> length;  // none: as long as it is while all coordinates are zero
  double stiffness;              // [N/m]; zero: it does not stretch
  double damping;                // of what is stretched [N s/m]
};

std::optional<CableEnd> end_of(const SceneValue& at, const CouplingSpec& spec) {
  const auto length = at.find("length"), stiffness = at.find("stiffness"), damping = at.find("damping");
  if (damping && !stiffness) {
    damping->fail(fmt::format("{} has a damping and no stiffness", at.path()), "stiffness: in N/m beside it; what does not stretch has nothing to damp",
                  "add it, or name the cable in effects.damping, which acts while it is slack too");
  }
  if (spec.joint && !length && !stiffness) return std::nullopt;  // what acts on the joint is all there is
  CableEnd end{spec.joint ? spec.joint->name : spec.name, std::nullopt, stiffness ? stiffness->positive() : 0,
               damping ? damping->not_negative("a damping, zero or more") : 0};
  if (length) end.length = length->positive();
  return end;
}

void read_bodies(const SceneValue& at, CouplingSpec& spec) {
  const std::vector<SceneValue> links = pair_of(required(at, "between", "between: [link, link]; world is one too"), "two links, [link, link]");
  spec.link_a = links[0].text("the name of a link, or world");
  spec.link_b = links[1].text("the name of a link, or world");
  if (spec.kind == CouplingKind::rod) {
    const std::vector<SceneValue> points = pair_of(required(at, "points", "points: a point of each link, [[x, y, z], [x, y, z]]"), "two points, [[x, y, z], [x, y, z]]");
    spec.frame_a.translation() = vector_of(points[0].vector("[x, y, z] in m, in the link's frame"));
    spec.frame_b.translation() = vector_of(points[1].vector("[x, y, z] in m, in the link's frame"));
    if (const auto length = at.find("length")) spec.length = length->positive();
    if (const auto rest = at.find("rest")) {
      spec.length = rest->not_negative("a length in m");
      if (spec.length == 0) spec.kind = CouplingKind::ball;  // which has a direction where both points meet
    }
    return;
  }
  const auto point = at.find("point"), frames = at.find("frames");
  if (point && frames) frames->fail("point and frames are both given", "one of them", "leave one out");
  if (!point && !frames) {
    at.fail(fmt::format("{} says not where", at.path()), "point: [x, y, z] in the world while all coordinates are zero, or frames: of both links", "add one");
  }
  if (frames) {
    const std::vector<SceneValue> both = pair_of(*frames, "two frames, [{position, rotation or quaternion}, {...}]");
    for (const SceneValue& frame : both) frame.entries_of(kFrameKeys);
    spec.frame_a = isometry(read_base(both[0]).pose());
    spec.frame_b = isometry(read_base(both[1]).pose());
    for (const char* key : {"axis", "second_axis"}) {
      if (const auto there = at.find(key)) there->fail(fmt::format("{} stands beside frames", key), "frames alone, whose z is the axis", "leave it out");
    }
    return;
  }
  PointAndAxis where;
  where.point = vector_of(point->vector("[x, y, z] in m"));
  const auto axis = at.find("axis"), second = at.find("second_axis");
  const bool turns = spec.kind != CouplingKind::ball && spec.kind != CouplingKind::weld && spec.kind != CouplingKind::bushing;
  if (turns && !axis) at.fail(fmt::format("{} has no axis", at.path()), "axis: [x, y, z], in the world while all coordinates are zero", "add it");
  if (!turns && axis) axis->fail(fmt::format("a {} has no axis", name_of(spec.kind)), "none", "leave it out");
  if (axis) where.axis = vector_of(axis->vector("[x, y, z], of any length"));
  if (second && spec.kind != CouplingKind::universal) second->fail(fmt::format("a {} has no second axis", name_of(spec.kind)), "none", "leave it out");
  if (second) where.second_axis = vector_of(second->vector("[x, y, z], at right angles to the axis"));
  spec.at = where;
}

/// Of all axes alike, or of each, where there are such.
Springs read_springs(const SceneValue& at, std::string_view stiffness, std::string_view damping, bool has_axes) {
  const auto numbers_of = [&](std::string_view key, std::string_view what) -> std::array<double, 3> {
    const auto value = at.find(key);
    if (!value) return {0, 0, 0};
    if (!has_axes || !value->is(SceneValue::Kind::list)) {
      const double number = value->not_negative(fmt::format("a {}, zero or more{}", what, has_axes ? ", or three, [x, y, z]" : ""));
      return {number, number, number};
    }
    const std::array<double, 3> numbers = value->vector(fmt::format("a {}, or three, [x, y, z], along or about the axes of the first link's frame", what));
    if (std::ranges::min(numbers) < 0) value->refuse(fmt::format("three numbers, each a {}, zero or more", what), "correct them");
    return numbers;
  };
  return {numbers_of(stiffness, "stiffness"), numbers_of(damping, "damping")};
}

CouplingSpec read_coupling(const SceneValue& at) {
  at.entries_of(kAllKeys);
  CouplingSpec spec;
  const SceneValue type = required(at, "type", "type: hinge, ball, weld, rod, spring, bushing, gear or another one");
  spec.kind = kind_of(type);
  const bool spring = type.choice(kTypeNames) == kSpring;
  at.entries_of(spec.kind == CouplingKind::gear      ? kGearKeys
                : spec.kind == CouplingKind::cable   ? kCableKeys
                : spec.kind == CouplingKind::bushing ? kBushingKeys
                : spring                             ? kSpringKeys
                : spec.kind == CouplingKind::rod     ? kRodKeys
                                                     : kBodyKeys);
  const bool has_axes = spec.kind != CouplingKind::gear && spec.kind != CouplingKind::rod;
  if (spec.kind != CouplingKind::cable) spec.shift = read_springs(at, "stiffness", "damping", has_axes);
  spec.turn = read_springs(at, "turning_stiffness", "turning_damping", has_axes);
  if (spring && !spec.shift.gives_way()) {
    at.fail(fmt::format("{} neither pulls nor damps", at.path()), "stiffness: in N/m, damping: in N s/m, or both; a rod is rigid", "add one");
  }
  if (spec.kind == CouplingKind::bushing && !spec.shift.gives_way() && !spec.turn.gives_way()) {
    at.fail(fmt::format("{} neither pulls nor damps", at.path()),
            "stiffness, damping, turning_stiffness or turning_damping, a number or [x, y, z]; a weld is rigid", "add one");
  }
  if (const auto name = at.find("name")) spec.name = name->text("a name");
  if (const auto joint = at.find("joint")) spec.joint = ClosingJoint{.name = joint->text("a name for the coordinate of this joint")};
  if (spec.kind == CouplingKind::cable) {
    if (spec.name.empty()) at.fail(fmt::format("{} has no name", at.path()), "name: of the cable, which its length is called by", "add it");
    read_cable(at, spec);
    return spec;
  }
  if (spec.kind != CouplingKind::gear) {
    read_bodies(at, spec);
    return spec;
  }
  for (const SceneValue::Entry& entry : required(at, "joints", "joints: {joint: ratio, joint: ratio}").entries("joints with their ratios")) {
    spec.joints.push_back({entry.key, entry.value.number()});
  }
  if (const auto offset = at.find("offset")) spec.offset = offset->number();
  return spec;
}

}  // namespace

SceneCouplings read_couplings(const SceneValue& at, Model model) {
  std::vector<CableEnd> ends;
  for (const SceneValue& item : at.list("couplings, {type: hinge, between: [link, link], point: [x, y, z], axis: [x, y, z]}")) {
    const CouplingSpec spec = read_coupling(item);
    model = item.located([&] { return coupled(std::move(model), {spec}); });
    if (spec.kind != CouplingKind::cable) continue;
    if (auto end = end_of(item, spec)) ends.push_back(*std::move(end));
  }
  SceneCouplings read{std::move(model), {}};
  const std::vector<double> neutral = read.model.neutral();
  for (const CableEnd& end : ends) {
    const Index slot = read.model.names.slot_of_joint.at(end.joint), row = read.model.tree.first_v(slot);
    const double length = end.length.value_or(neutral[static_cast<std::size_t>(read.model.tree.first_q(slot))]);
    if (end.stiffness > 0) {
      read.ends.dead_zone_springs.push_back({.row = row, .stiffness = end.stiffness, .half_width = length / 2, .rest = length / 2, .damping = end.damping});
    } else {
      read.ends.limits.push_back({.row = row, .upper = length});
    }
  }
  return read;
}

}  // namespace linden

#include "engine/scene/scene_effects.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <span>
#include <utility>

#include "engine/scene/number_table.hpp"
#include "engine/scene/scene_time_table.hpp"
#include "engine/scene/scene_joints.hpp"
#include "engine/scene/scene_heights.hpp"
#include "engine/scene/scene_numbers.hpp"
#include "engine/scene/scene_servos.hpp"
#include "engine/text.hpp"
#include "layout/smooth_curve.hpp"
#include "layout/support/words.hpp"
#include "models/build/isometry.hpp"
#include "models/build/vectors.hpp"
#include "models/shapes/contacts_of.hpp"
#include "models/shapes/pair_contact.hpp"

namespace linden {
namespace {

using Eigen::Vector3d;
using Kind = SceneValue::Kind;
using Entry = SceneValue::Entry;

/// gravity, and the names of all effects.
const std::vector<std::string> kEffects = [] {
  std::vector<std::string> names{"gravity"};
  for (const EffectFacts* facts : kEffectFacts) {
    if (std::ranges::find(names, facts->name) == names.end()) names.emplace_back(facts->name);
  }
  return names;
}();

/// Says which effect a reader is for: EffectsReader has one for each that is not read by its table of numbers.
template <class Entry>
struct Of {};

const std::vector<std::string> kLimit{"lower", "upper", "restitution", "velocity"};
const std::vector<std::string> kWrench{"force", "moment", "point", "frame", "from", "to", "file"};
const std::vector<std::string> kFrames{"world", "body"};
const std::vector<std::string> kDrag{"linear", "quadratic", "wind", "bodies"};
const std::vector<std::string> kBodyDrag{"linear", "quadratic"};
const std::vector<std::string> kTerrain{"file", "spacing", "origin"};
const std::vector<std::string> kGround{"normal", "height", "stiffness", "damping", "friction", "terrain"};
const std::vector<std::string> kContact{"stiffness",          "damping", "friction", "restitution", "rolling_friction",
                                        "torsional_friction", "between", "pairs",    "except",      "srdf"};
const std::vector<std::string> kBetweenKeys{"links", "stiffness", "damping", "friction", "restitution", "rolling_friction", "torsional_friction"};

/// By which a curve may round beyond a limit that one of its points lies on [rad, m].
constexpr double kCurveRounding = 1e-9;

constexpr std::string_view kVelocityLimit = "urdf or a number";

class EffectsReader {
 public:
  EffectsReader(const Model& model, const std::vector<double>& start, std::string folder)
      : model_(model), start_(start), folder_(std::move(folder)), joints_(model) {}

  std::vector<JointLimit> read_limits(const SceneValue& at) {
    if (const auto value = at.find("limits")) read(*value, Of<JointLimit>());
    return std::move(result_.effects.limits);
  }

  SceneEffects read(const SceneValue& at) {
    if (at.is(Kind::nothing)) return {};
    for (const auto& [key, value] : at.entries_of(kEffects)) {
      const std::vector<std::string>::size_type before = result_.warnings.size();
      if (key == "gravity") result_.gravity = value.vector("[x, y, z] in m/s^2");
      // captured by name: a structured binding cannot be
      const std::string& name = key;
      const SceneValue& here = value;
      Effects::each(result_.effects, [&]<class Effect>(std::span<const Effect>, std::string_view) {
        if (Effect::facts.name == name) read(here, Of<Effect>());
      });
      for (std::size_t k = before; k < result_.warnings.size(); ++k) {
        result_.warnings[k] = fmt::format("{}: {}", value.place(), result_.warnings[k]);
      }
    }
    leave_to_motions(at);
    at.located([&] { check(result_.effects, model_); });
    return std::move(result_);
  }

 private:
  void warn(std::string message) { result_.warnings.push_back(std::move(message)); }

  static double restitution_of(const SceneValue& at) {
    const double value = at.number();
    if (value < 0 || value > 1) at.refuse("a number from 0 to 1", "0 stops, 1 bounces back at the same speed");
    return value;
  }

  /// An effect that is nothing but numbers.
  template <HasFields Effect>
  void read(const SceneValue& at, Of<Effect>) {
    auto& list = result_.effects.list<Effect>();
    list = read_list<Effect>(at, joints_);
    if (list.empty()) warn("no joint has any");
  }

  void read(const SceneValue& at, Of<JointSpring>) {
    for (const Entry& entry : at.entries(grammar_of<JointSpring>())) {
      const NamedJoint found = joints_.joint(entry);
      joints_.refuse_follower(entry.value, found);
      if (found.kind == JointKind::screw) {
        result_.effects.springs.push_back(read_entry<JointSpring>(entry.value, found.row));
        continue;
      }
      entry.value.entries_of(field_names<JointSpring>());
      const auto stiffness = entry.value.find("stiffness"), rest = entry.value.find("rest");
      if (!stiffness) entry.value.fail(entry.value.path() + " has no stiffness", "stiffness", "add stiffness");
      BallSpring ball{found.slot, stiffness->not_negative()};
      if (rest) ball.rest = rest->quaternion();
      result_.effects.ball_springs.push_back(ball);
    }
    if (result_.effects.springs.empty() && result_.effects.ball_springs.empty()) warn("no joint has any");
  }
  /// Read among the other springs.
  void read(const SceneValue&, Of<BallSpring>) {}

  void read(const SceneValue& at, Of<Servo>) {
    result_.effects.servos = read_servos(at, joints_, start_, folder_, result_.warnings);
  }

  void read(const SceneValue& at, Of<JointLimit>) {
    std::vector<JointLimit>& list = result_.effects.limits;
    SharedLimits shared;
    bool named = false;
    if (!at.says("urdf")) {
      const std::vector<Entry> entries =
          at.entries("urdf, {restitution: number, velocity: urdf or number} or {joint: {lower, upper, restitution, velocity}}");
      if (const auto value = at.find("restitution")) shared.restitution = restitution_of(*value);
      if (const auto value = at.find("velocity")) {
        shared.velocity_of_file = value->says("urdf");
        if (!shared.velocity_of_file) shared.velocity = value->not_negative(kVelocityLimit);
      }
      for (const Entry& entry : entries) {
        if (entry.key == "restitution" || entry.key == "velocity") continue;
        named = true;
        list.push_back(limit(entry, shared));
      }
    }
    at.located([&] { list = named ? on_leaders(model_, list) : limits_everywhere(shared); });
    if (list.empty()) warn("no joint has any");
    const auto locked = std::ranges::find(list, 0.0, &JointLimit::velocity);
    if (locked == list.end()) return;
    warn(fmt::format("{} of {} joints cannot move ({}): their limit of velocity is 0", std::ranges::count(list, 0.0, &JointLimit::velocity),
                     list.size(), quoted(model_.names.velocity[static_cast<std::size_t>(locked->row)])));
  }

  /// What stands beside the joints, for those that have no values of their own.
  struct SharedLimits {
    double restitution = 0;
    bool velocity_of_file = false;
    double velocity = std::numeric_limits<double>::infinity();
  };

  /// The file's, and a number for a velocity on every joint.
  std::vector<JointLimit> limits_everywhere(const SharedLimits& shared) const {
    std::vector<JointLimit> list = urdf_limits(model_, shared.restitution, shared.velocity_of_file);
    if (!std::isfinite(shared.velocity)) return list;
    for (JointLimit limit : velocity_limit_everywhere(model_, shared.velocity)) {
      limit.restitution = shared.restitution;
      list.push_back(limit);
    }
    return on_leaders(model_, list);
  }

  JointLimit limit(const Entry& entry, const SharedLimits& shared) const {
    const SceneValue& at = entry.value;
    const Index row = joints_.screw(entry).row;
    JointLimit result{row, model_.attributes.lower(row), model_.attributes.upper(row), shared.restitution};
    result.velocity = shared.velocity_of_file ? model_.attributes.max_velocity(row) : shared.velocity;
    if (!at.says("urdf")) {
      at.entries_of(kLimit);
      if (const auto value = at.find("lower")) result.lower = value->number();
      if (const auto value = at.find("upper")) result.upper = value->number();
      if (const auto value = at.find("restitution")) result.restitution = restitution_of(*value);
      if (const auto value = at.find("velocity")) {
        result.velocity = value->says("urdf") ? model_.attributes.max_velocity(row) : value->not_negative(kVelocityLimit);
        if (!std::isfinite(result.velocity))
          value->fail(fmt::format("the model's file limits no velocity of {}", quoted(entry.key)), "a number", "write one");
      }
    }
    if (!std::isfinite(result.lower) && !std::isfinite(result.upper) && !std::isfinite(result.velocity)) {
      at.fail(fmt::format("{} has no limit and the model's file gives none", at.path()), "lower, upper, velocity or several of them",
              "add them, or leave the joint out");
    }
    if (result.lower > result.upper) {
      at.fail(fmt::format("{} goes from {} to {}", at.path(), result.lower, result.upper), "lower at or below upper",
              "exchange them");
    }
    return result;
  }

  void read(const SceneValue& at, Of<JointTorque>) {
    for (const Entry& entry : at.entries("{joint: number, FILE.csv or {times, values}}")) {
      const NamedJoint named = joints_.screw(entry);
      joints_.refuse_follower(entry.value, named);
      result_.effects.torques.push_back({named.row, read_time_table(entry.value, folder_)});
    }
    if (result_.effects.torques.empty()) warn("no joint has any");
  }

  void read(const SceneValue& at, Of<JointMotion>) {
    for (const Entry& entry : at.entries("{joint: number, FILE.csv or {times, values, velocities}}")) {
      const NamedJoint named = joints_.screw(entry);
      joints_.refuse_follower(entry.value, named);
      result_.effects.motions.push_back(read_motion(entry.value, named.row, folder_));
    }
    if (result_.effects.motions.empty()) warn("no joint has any");
  }

  /// A joint whose motion is given feels neither friction nor limits; it is not to be led beyond them.
  void leave_to_motions(const SceneValue& at) {
    const auto moved = [&](const auto& entry) {
      return std::ranges::find(result_.effects.motions, entry.row, &JointMotion::row) != result_.effects.motions.end();
    };
    for (const JointLimit& limit : result_.effects.limits) {
      const auto found = std::ranges::find(result_.effects.motions, limit.row, &JointMotion::row);
      if (found == result_.effects.motions.end()) continue;
      for (const auto& [time, value] : SmoothCurve(found->position, found->velocities).extremes()) {
        if (value >= limit.lower - kCurveRounding && value <= limit.upper + kCurveRounding) continue;
        at.find("motion")->fail(fmt::format("effects.motion leads {} to {:.6g} at {:.6g} s, beyond its limits of {} to {}",
                                            quoted(model_.names.velocity[static_cast<std::size_t>(limit.row)]), value, time, limit.lower,
                                            limit.upper),
                                "positions within them", "change the table, or leave the joint out of limits");
      }
    }
    std::erase_if(result_.effects.limits, moved);
    if (const auto left_out = std::erase_if(result_.effects.friction, moved); left_out > 0) {
      warn(fmt::format("{}: left out where the motion is given ({}): what drives a joint overcomes it", at.find("friction")->place(),
                       counted(static_cast<std::int64_t>(left_out), "joint")));
    }
  }

  void read(const SceneValue& at, Of<BodyWrench>) {
    for (const Entry& entry : at.entries("{link: {force, moment, point, frame, from, to, file}}")) {
      const LinkPlace place = joints_.body(entry.value, entry.key);
      if (!entry.value.is(Kind::list)) {
        result_.effects.wrenches.push_back(wrench_on(place, entry.value));
        continue;
      }
      for (const SceneValue& item : entry.value.list("wrenches")) result_.effects.wrenches.push_back(wrench_on(place, item));
    }
    if (result_.effects.wrenches.empty()) warn("no body has any");
  }

  BodyWrench wrench_on(const LinkPlace& place, const SceneValue& at) const {
    at.entries_of(kWrench);
    const auto vector_at = [&](const char* key, const char* expected) {
      const auto value = at.find(key);
      return value ? vector_of(value->vector(expected)) : Vector3d(Vector3d::Zero());
    };
    if (!at.find("force") && !at.find("moment"))
      at.fail(at.path() + " has neither force nor moment", "one of them or both", "add force: [x, y, z]");
    BodyWrench result{.slot = place.slot};
    const Vector3d force = vector_at("force", "[x, y, z] in N"), moment = vector_at("moment", "[x, y, z] in N m");
    const Isometry in_body = isometry(place.in_body);
    const Vector3d point = in_body * vector_at("point", "[x, y, z] in m");
    result.point = array_of(point);
    if (const auto frame = at.find("frame")) result.in_world = frame->choice(kFrames) == "world";
    result.force = array_of(result.in_world ? force : Vector3d(in_body.linear() * force));
    result.moment = array_of(result.in_world ? moment : Vector3d(in_body.linear() * moment));
    if (const auto value = at.find("from")) result.from = value->number();
    if (const auto value = at.find("to")) result.to = value->number();
    if (result.from > result.to)
      at.fail(fmt::format("{} goes from {} to {} s", at.path(), result.from, result.to), "from at or before to", "exchange them");
    if (const auto file = at.find("file")) result.scale = read_time_table_file(*file, folder_);
    return result;
  }

  void read(const SceneValue& at, Of<Drag>) {
    at.entries_of(kDrag);
    const auto coefficients = [](const SceneValue& place, Drag drag) {
      if (const auto value = place.find("linear")) drag.linear = value->not_negative();
      if (const auto value = place.find("quadratic")) drag.quadratic = value->not_negative();
      return drag;
    };
    const auto has_mass = [&](Index slot) { return model_.constants.inertia(slot, 0) > 0; };
    std::map<Index, Drag> drags;
    if (at.find("linear") || at.find("quadratic")) {
      for (Index slot = 1; slot < model_.tree.shape.slots; ++slot) {
        if (has_mass(slot)) drags.emplace(slot, coefficients(at, Drag{slot}));
      }
    }
    if (const auto bodies = at.find("bodies")) {
      std::map<Index, std::string> named;
      for (const Entry& entry : bodies->entries("{link: {linear, quadratic}}")) {
        const Index slot = joints_.body(entry.value, entry.key).slot;
        entry.value.entries_of(kBodyDrag);
        if (!has_mass(slot))
          entry.value.fail(fmt::format("the body of link {} has no mass", quoted(entry.key)), "one that drag can act on",
                           "leave it out");
        const auto [before, fresh] = named.emplace(slot, entry.key);
        if (!fresh) {
          entry.value.fail(fmt::format("links {} and {} are one body", quoted(before->second), quoted(entry.key)),
                           "every body once", "leave one out");
        }
        drags[slot] = coefficients(entry.value, Drag{slot});
      }
    }
    if (const auto wind = at.find("wind")) result_.effects.wind = wind->vector("[x, y, z] in m/s");
    for (const auto& [slot, drag] : drags) {
      if (drag.linear > 0 || drag.quadratic > 0) result_.effects.drag.push_back(drag);
    }
    if (result_.effects.drag.empty()) warn("no body has any: linear and quadratic are zero or not given");
  }

  void read(const SceneValue& at, Of<Ground>) {
    Ground ground;
    if (!at.is(Kind::nothing)) {
      at.entries_of(kGround);
      if (const auto normal = at.find("normal")) {
        const Vector3d direction = vector_of(normal->vector("[x, y, z], which way is up"));
        const double length = direction.stableNorm();
        if (!(length > 0) || !std::isfinite(length))
          normal->fail("effects.ground.normal has no direction", "[x, y, z], which way is up", "write [0, 0, 1]");
        ground.normal = array_of(direction / length);
      }
      if (const auto value = at.find("height")) ground.height = value->number();
      if (const auto value = at.find("stiffness")) ground.stiffness = value->positive();
      if (const auto value = at.find("damping")) ground.damping = value->not_negative();
      if (const auto value = at.find("friction")) ground.friction = value->not_negative();
      if (const auto value = at.find("terrain")) {
        value->entries_of(kTerrain);
        ground.terrain = read_heights(*value, folder_);
      }
    }
    std::vector<std::string> notes;
    ground.contacts = contacts_of(model_, notes);
    if (ground.contacts.empty()) notes.push_back("no link that moves has a collision shape: nothing touches it");
    for (std::string& note : notes) warn(std::move(note));
    result_.effects.ground = std::move(ground);
  }

  void read(const SceneValue& at, Of<PairContact>) {
    ContactMaterial material;
    LinkPairs only, disabled;
    std::vector<SceneValue> between;
    if (!at.is(Kind::nothing)) {
      at.entries_of(kContact);
      read_material(at, material);
      if (const auto value = at.find("between")) between = value->list("[{links: [link, link], ...}, ...]");
      if (const auto value = at.find("srdf")) disabled = value->located([&] { return srdf_disabled_pairs(scene_path(*value, folder_)); });
      if (const auto value = at.find("except")) disabled = joined(std::move(disabled), link_pairs(*value));
      if (const auto value = at.find("pairs")) {
        only = link_pairs(*value);
        if (!disabled.empty()) value->fail(value->path() + " stands beside pairs that are left out", "one of both", "leave out what does not touch from pairs");
      }
    }
    std::vector<std::string> notes;
    PairContact contact;
    at.located([&] { contact = pair_contact_of(model_, notes, disabled, only); });
    contact.materials = {material};
    for (const SceneValue& one : between) read_between(one, contact);
    if (contact.pairs.empty()) notes.push_back("no two links that may touch have collision shapes: nothing touches");
    for (std::string& note : notes) warn(std::move(note));
    result_.effects.contact = std::move(contact);
  }

  static void read_material(const SceneValue& at, ContactMaterial& material) {
    if (const auto value = at.find("stiffness")) {
      const bool rigid = value->is(Kind::text) && value->text("rigid") == "rigid";
      material.stiffness = rigid ? std::numeric_limits<double>::infinity() : value->positive();
    }
    if (const auto value = at.find("damping")) material.damping = value->not_negative();
    if (const auto value = at.find("friction")) material.friction = value->not_negative();
    if (const auto value = at.find("restitution")) material.restitution = restitution_of(*value);
    if (const auto value = at.find("rolling_friction")) material.rolling_friction = value->not_negative();
    if (const auto value = at.find("torsional_friction")) material.torsional_friction = value->not_negative();
  }

  /// Values of what touches between two links, or of all that touches one, over those of entries before.
  void read_between(const SceneValue& at, PairContact& contact) const {
    at.entries_of(kBetweenKeys);
    const auto links = at.find("links");
    if (!links) at.fail(at.path() + " names no links", "links: [link, link], or [link] for all that touches it", "add it");
    std::vector<std::string> names;
    for (const SceneValue& item : links->list("[link, link]")) {
      names.push_back(item.text("a link"));
      item.located([&] { place_of(model_, names.back()); });
    }
    if (names.empty() || names.size() > 2) {
      links->fail(fmt::format("{} names {} links", links->path(), names.size()), "one or two", "write [link, link], or [link] for all that touches it");
    }
    contact.of_pair.resize(contact.pairs.size(), 0);
    std::size_t found = 0;
    for (std::size_t pair = 0; pair < contact.pairs.size(); ++pair) {
      const std::string &a = contact.shapes[contact.pairs[pair].first].link, &b = contact.shapes[contact.pairs[pair].second].link;
      const bool meant = a == names[0] ? names.size() == 1 || b == names[1] : b == names[0] && (names.size() == 1 || a == names[1]);
      if (!meant) continue;
      found += 1;
      ContactMaterial material = contact.material(pair);
      read_material(at, material);
      auto known = std::ranges::find(contact.materials, material);
      if (known == contact.materials.end()) known = contact.materials.insert(known, material);
      contact.of_pair[pair] = static_cast<std::uint32_t>(known - contact.materials.begin());
    }
    if (found == 0) {
      links->fail(fmt::format("{}: nothing that touches is between {}", links->path(), fmt::join(names, " and ")),
                  "links with collision shapes that may touch", "look at pairs, except and the links' shapes, or leave it out");
    }
  }

  /// [[link, link], ...]
  static LinkPairs link_pairs(const SceneValue& at) {
    LinkPairs pairs;
    for (const SceneValue& item : at.list("[[link, link], ...]")) {
      const std::vector<SceneValue> both = item.list("[link, link]");
      if (both.size() != 2) item.fail(fmt::format("{} names {} links", item.path(), both.size()), "two", "write [link, link]");
      pairs.emplace_back(both[0].text("a link"), both[1].text("a link"));
    }
    return pairs;
  }
  static LinkPairs joined(LinkPairs pairs, const LinkPairs& more) {
    pairs.insert(pairs.end(), more.begin(), more.end());
    return pairs;
  }

  const Model& model_;
  const std::vector<double>& start_;
  std::string folder_;
  SceneJoints joints_;
  SceneEffects result_;
};

}  // namespace

const std::vector<std::string>& effect_keys() { return kEffects; }

std::vector<JointLimit> read_limits(const SceneValue& at, const Model& model) { return EffectsReader(model, {}, "").read_limits(at); }

SceneEffects read_effects(const SceneValue& at, const Model& model, const std::vector<double>& start, const std::string& folder) {
  return EffectsReader(model, start, folder).read(at);
}

}  // namespace linden

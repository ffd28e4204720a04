// layout/effects.hpp
// What acts on the bodies and joints of a scene beside gravity, as plain values: one list an effect, an empty list where the scene has
// none of it. Rows are velocity rows of screw joints, slots bodies; model.names says which is which. Each kind of entry stands with its facts
// in a file of its own, layout/effects/, and its equation, energy and cost in the file of that name in kernels/effects/.
//
//   Effects effects;
//   effects.damping = urdf_damping(model);
//   effects.servos.push_back({.row = elbow, .stiffness = 200, .damping = 20, .target = 0.4});
//   Simulation simulation(model, options, effects);
#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "layout/effects/armature.hpp"
#include "layout/effects/ball_spring.hpp"
#include "layout/effects/contact.hpp"
#include "layout/effects/damping.hpp"
#include "layout/effects/dead_zone_spring.hpp"
#include "layout/effects/drag.hpp"
#include "layout/effects/friction.hpp"
#include "layout/effects/ground.hpp"
#include "layout/effects/limits.hpp"
#include "layout/effects/motion.hpp"
#include "layout/effects/on_rows.hpp"
#include "layout/effects/servo.hpp"
#include "layout/effects/spring.hpp"
#include "layout/effects/torque.hpp"
#include "layout/effects/wrench.hpp"
#include "layout/names.hpp"

namespace linden {

struct Model;

/// Every effect, in the order in which checks, reports and accounts have them.
#define LINDEN_EFFECT_LISTS(LIST)                      \
  LIST(std::vector<Armature>, armature)                \
  LIST(std::vector<JointSpring>, springs)              \
  LIST(std::vector<BallSpring>, ball_springs)          \
  LIST(std::vector<DeadZoneSpring>, dead_zone_springs) \
  LIST(std::vector<JointDamping>, damping)             \
  LIST(std::vector<JointFriction>, friction)           \
  LIST(std::vector<JointLimit>, limits)                \
  LIST(std::vector<Servo>, servos)                     \
  LIST(std::vector<JointTorque>, torques)              \
  LIST(std::vector<JointMotion>, motions)              \
  LIST(std::vector<BodyWrench>, wrenches)              \
  LIST(std::vector<Drag>, drag)                        \
  LIST(std::optional<Ground>, ground)                  \
  LIST(std::optional<PairContact>, contact)

/// Entries of a list, none or one of what there is once.
template <class Entry>
std::span<const Entry> entries_in(const std::vector<Entry>& list) {
  return list;
}
template <class Entry>
std::span<const Entry> entries_in(const std::optional<Entry>& list) {
  return list ? std::span<const Entry>(&*list, 1) : std::span<const Entry>();
}

struct Effects {
#define LINDEN_LIST(type, name) type name;
  LINDEN_EFFECT_LISTS(LINDEN_LIST)
#undef LINDEN_LIST
  std::array<double, 3> wind{0, 0, 0};  // of drag [m/s], world frame

  /// The list whose entries are of this kind.
  template <class Entry>
  const auto& list() const {
#define LINDEN_LIST(type, name) \
  if constexpr (std::is_same_v<type::value_type, Entry>) return name;
    LINDEN_EFFECT_LISTS(LINDEN_LIST)
#undef LINDEN_LIST
  }
  template <class Entry>
  auto& list() {
#define LINDEN_LIST(type, name) \
  if constexpr (std::is_same_v<type::value_type, Entry>) return name;
    LINDEN_EFFECT_LISTS(LINDEN_LIST)
#undef LINDEN_LIST
  }
  /// visit(entries, name of their list) of every effect.
  template <class Visit>
  static void each(const Effects& effects, const Visit& visit) {
#define LINDEN_LIST(type, name) visit(entries_in(effects.name), #name);
    LINDEN_EFFECT_LISTS(LINDEN_LIST)
#undef LINDEN_LIST
  }
};

/// Facts of every effect, list by list.
inline constexpr std::array kEffectFacts{
#define LINDEN_LIST(type, name) &type::value_type::facts,
    LINDEN_EFFECT_LISTS(LINDEN_LIST)
#undef LINDEN_LIST
};
inline constexpr std::size_t kEffectLists = kEffectFacts.size();
inline constexpr std::size_t kBodyEffects = static_cast<std::size_t>(
    std::ranges::count(kEffectFacts, Site::body, [](const EffectFacts* facts) { return facts->site; }));

/// Place of an entry's list among them.
template <class Entry>
inline constexpr std::size_t kListOf = [] {
  std::size_t place = 0;
  while (kEffectFacts[place] != &Entry::facts) ++place;
  return place;
}();

/// First velocity row of a joint. Throws InputError, with the nearest name, where no such joint moves.
Index row_of(const Model& model, const std::string& joint);

/// Body of a link and the link's frame in it. Throws InputError, with the nearest name, where there is no such link.
const LinkPlace& place_of(const Model& model, const std::string& link);

/// What the robot's file says of its joints. A mimic joint's share is carried to the joint that leads it.
std::vector<JointDamping> urdf_damping(const Model& model);
std::vector<JointFriction> urdf_friction(const Model& model);
/// Limits of position, with those of velocity or without: joints that the file limits neither way have no entry.
std::vector<JointLimit> urdf_limits(const Model& model, double restitution = 0, bool velocities = false);

/// The same on every joint: screws, for damping the rows of ball joints too. Mimic joints' shares are carried to their leaders.
std::vector<Armature> armature_everywhere(const Model& model, double inertia);
std::vector<JointDamping> damping_everywhere(const Model& model, double coefficient);
std::vector<JointFriction> friction_everywhere(const Model& model, double force);
std::vector<JointLimit> velocity_limit_everywhere(const Model& model, double velocity);

/// On every screw joint that follows no other, no stronger than the file's effort limits, with `positions` [nq] for targets; empty:
/// the zero configuration.
std::vector<Servo> servo_everywhere(const Model& model, double stiffness, double damping,
                                    const std::vector<double>& positions = {});

/// Carries what stands on followers' rows to their leaders' (layout/effects/on_rows.hpp has it for armature, damping and friction): limits through
/// the map, velocities by |m|, the tighter ones and the smaller restitution where several meet. One entry a row is left, sorted by row.
/// Throws InputError where limits leave no room.
std::vector<JointLimit> on_leaders(const Model& model, const std::vector<JointLimit>& list);

/// Whether one takes momentum out of the system or brings it in: wrenches, drag, ground, contact with what is fixed to the world.
bool act_from_outside(const Effects& effects);

/// Throws InputError where an effect names what is not there or cannot have it (a row out of range, a screw's effect on a ball or
/// free joint or on a mimic joint's follower), holds a number that makes no sense, or meets another of its kind where there can be
/// only one: friction, limits and servos; or, where a joint's motion is given, none of the first two.
void check(const Effects& effects, const Model& model);

}  // namespace linden

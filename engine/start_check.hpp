// engine/start_check.hpp
// Whether a motion may begin where it is told to: joints within the limits that are in effect, followers of ties where their leaders put
// them, nothing deep in the ground. A start that breaks one of these moves off with a blow that nobody asked for, or stands still for ever.
//
//   joint   outside [lower, upper] of its JointLimit
//           by no more than kWrittenDigits of the limit: moved onto it, and told. Numbers that people write, or cut off, after five digits
//           are as far off: 1.5708 above a limit of 1.5707963, 3.1416 above one of 3.1415.
//   tie     q_follower differs from multiplier q_leader + offset by more than rounding
//   ground  a contact of a body lies deeper than kShallow, and deeper than M g / k: what the ground, of stiffness k at one point, gives way
//           at rest under the whole tree of M that the body belongs to. No load at rest sinks deeper. Over a terrain what counts is the depth
//           straight down from a centre, as people place things by the height of what lies below: what lies deeper across a slope is told.
//   contact shapes that touch each other lie deeper than kShallow: told, they are pushed apart slowly (engine/sweeps/body_contacts.hpp)
//
// Speeds are not looked at. What each fault says: joint or link, value, limit, what to do.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engine/options.hpp"
#include "layout/effects.hpp"
#include "layout/model.hpp"

namespace linden {

struct EffectPlan;
struct Scene;

inline constexpr double kWrittenDigits = 1e-4;
inline constexpr double kShallow = 1e-3;  // [m]

/// What was found of one start.
struct StartFindings {
  std::vector<double> positions;    // [nq] to start from: as given, but for joints moved onto a limit and what follows them
  std::vector<std::string> moved;   // a sentence for each of these
  std::vector<std::string> told;    // what is no fault, but pushes at the start
  std::vector<std::string> faults;  // joint or link, value, limit
  std::vector<std::string> advice;  // what to do about them

  bool sound() const { return faults.empty(); }
  /// All faults in one sentence, with what to do; empty where there are none.
  std::string text() const;
};

class StartCheck {
 public:
  /// Throws InputError for effects that make no sense for the model.
  StartCheck(const Model& model, const Options& options, const Effects& effects);
  ~StartCheck();

  /// positions [nq]; empty: the zero configuration.
  StartFindings look(std::span<const double> positions) const;
  /// The ground alone, of positions [nq] that keep limits and ties.
  StartFindings look_under(std::span<const double> positions) const;

 private:
  void look_at_ties(StartFindings& found) const;
  void look_at_limits(StartFindings& found) const;
  void look_at_ground(StartFindings& found) const;
  void look_at_contact(StartFindings& found) const;
  /// Poses of bodies in the world.
  Field<double, 12> poses(const std::vector<double>& positions) const;
  /// Depth in the ground that a body may start with [m].
  double allowed(Index slot) const;
  void follow(std::vector<double>& positions) const;

  const Model& model_;
  std::unique_ptr<const EffectPlan> plan_;
  std::vector<double> sag_;  // of the tree that hangs on each root, by root's slot [m]
  std::vector<Index> root_;  // [slots]
};

/// Positions [nq] that a scene starts from, empty for the zero configuration. Throws InputError where that start is none (StartFindings::text),
/// unless the scene takes it as given.
std::vector<double> checked_start(const Scene& scene);

/// "joint "knee" (0 rad, limits 0.1 to 2 rad)", for each whose zero its file's limits exclude: what follows goes with its leader.
std::vector<std::string> zeros_outside_limits(const Model& model);

}  // namespace linden

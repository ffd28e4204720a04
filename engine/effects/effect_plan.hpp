// engine/effects/effect_plan.hpp
// The effects of a scene made ready for its steps: sorted by the bodies they touch, with the numbers that do not change. Shared by
// all steppers; what changes within a step is in engine/effects/effect_sweeps.hpp.
//
// An effect that the scene does not name has no entry here, no memory in the sweeps and no call in a step.
#pragma once

#include <array>
#include <span>
#include <type_traits>
#include <vector>

#include "engine/options.hpp"
#include "kernels/effects/ground_plan.hpp"
#include "kernels/effects/law_setup.hpp"
#include "layout/effects.hpp"
#include "layout/model.hpp"
#include "layout/smooth_curve.hpp"

namespace linden {

/// Of a velocity that is read: how far it may be from the mean one of the last step where nothing is known of how the motion bends [rad/s, m/s].
inline constexpr double kAnyBend = 1e36;

/// What the laws of bodies (kernels/effects/laws.hpp) have on one body.
struct LoadedBody {
  struct Range {
    std::size_t first = 0, last = 0;  // [first, last) of what the law touches
  };
  Index slot = 0;
  std::array<Range, kBodyEffects> ranges{};  // law by law
};

struct EffectPlan {
  /// Throws InputError for effects that make no sense for the model.
  EffectPlan(const Model& model, const Options& options, const Effects& effects);

  Effects effects;       // of bodies sorted by their slots
  bool joints = false;   // some effect acts on joints
  bool bodies = false;   // on bodies
  bool pairs = false;    // between bodies
  bool balls = false;    // some acts on ball joints, whose displacement is then needed at every evaluation
  bool bounces = false;  // some limit has a restitution
  bool has_states = false;  // what acts is settled within the solve: some effect has states
  bool bends = false;    // velocities are held to how the motion bends (engine/VELOCITY.md): something has states, or acts more at
                         // the beginning of a step
  bool any() const { return joints || bodies || pairs; }
  /// Likewise, or bodies may touch each other.
  bool settles() const { return has_states || pairs; }

  Field<Index> q_row;               // position row of a screw's velocity row
  std::vector<SmoothCurve> curves;  // of every given motion
  std::vector<double> inertia;      // that a force on each row moves, all others free [kg m^2, kg]; empty where no law asks
  std::vector<double> zone_yields;  // of each spring with a dead zone: how far its row moves by a unit of impulse (engine/sweeps/coupling_yields.hpp)
  std::vector<double> mass;         // that a force on each body is taken to move [kg]
  Field<double> fastest;            // limit of every row's velocity, infinite without; no rows where none has one
  Field<double> rotor;              // armature of every row; no rows without armature
  std::vector<double> row_yields;   // of couplings (engine/sweeps/coupling_yields.hpp); empty where none gives way
  GroundPlan ground;                // no points without ground
  std::vector<LoadedBody> loaded_bodies;  // sorted by slot

  /// What laws are built from.
  LawSetup setup(const Tree& tree) const { return {effects, tree, q_row, inertia, zone_yields, mass, curves, ground, step_}; }
  /// Joints whose motion is given are where it is at a time [s], whatever stands in q [nq], and as fast as it goes on from there.
  void put_positions(double time, std::span<double> q) const;
  void put_velocities(double time, std::span<double> v) const;
  /// Numbers beside those of rows that are kept from step to step (EffectSweeps::kept).
  Index kept() const { return kept_; }
  /// N_least of the ground (kernels/effects/ground_contact.hpp) where gravity [m/s^2] is another than that of the options [N].
  double least_load(const std::array<double, 3>& gravity) const;

 private:
  void place_joints(const Model& model);
  void place_ground(const Model& model, const Options& options);
  void sort_bodies(const LawSetup& setup);
  void follow_laws(const LawSetup& setup);

  double step_;
  double least_load_mass_ = 0;  // [kg]
  Index kept_ = 0;
};

/// action(std::true_type) where there is any effect, else action(std::false_type). What steps is compiled for each apart, so that a step
/// without effects is the same to the last instruction whether there are any elsewhere or not; bench/pay_as_you_go counts them beside those
/// of a linden that has none.
template <class Action>
auto with_or_without([[maybe_unused]] const EffectPlan& plan, const Action& action) {
#ifndef LINDEN_WITHOUT_EFFECTS
  if (plan.any()) return action(std::true_type{});
#endif
  return action(std::false_type{});
}

}  // namespace linden

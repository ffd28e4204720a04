// kernels/effects/law.hpp
// What an effect is to a step: a law. It is built once from a scene and then asked for its parts, in this order within a step:
//
//   place       where its bodies are now; potential
//   begin       means of tables over the step; states (sticks? at its limit?) as the first guess suggests
//   guess       of bodies: states as their displacement in the first evaluation suggests
//   add         rows: impulses affine in the displacement (joint_impulses.hpp)     joints: when a step begins and when a state changed
//               or forces at points of bodies (body_impulses.hpp)                  bodies: once an evaluation
//   evaluate    of a joint: what is not affine in the displacement                 once an evaluation
//   update_states      states that belong to the solution so far: did one change?         once an evaluation
//   account     energy that it took or gave
//   end         of a joint: what p gets at the end beside its rows
//   keep        what is kept for the next step
//
// Laws derive from JointLaw or BodyLaw, where every part stands with what it has to do, and write those parts anew that they have; the others
// do nothing. Parts that the facts of their entries announce (layout/effects/facts.hpp) have to be there: require_parts. All laws stand in
// the two lists of kernels/effects/laws.hpp.
//
// S is double, or a pack of W instances.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <type_traits>
#include <utility>

#include "kernels/effects/joint_impulses.hpp"
#include "kernels/effects/lane_times.hpp"
#include "kernels/effects/law_setup.hpp"
#include "layout/body_constants.hpp"

namespace linden {

/// What a comparison of two S is.
template <class S>
using MaskOf = decltype(std::declval<S>() > std::declval<S>());

/// The joints at the beginning of a step.
template <class S>
struct JointsView {
  const Field<S>& q;
  const Field<Index>& q_row;  // position row of a screw's velocity row
  const Tree& tree;
};

/// The step that is being solved.
template <class S>
struct StepView : JointsView<S> {
  S h;           // [s]
  double stiction_speed;  // above zero: friction is smooth up to this speed [rad/s, m/s]
};

/// What is known when a step begins.
template <class S>
struct StepStart {
  const LaneTimes<S>& times;  // when it begins [s]
  double step;                // its length [s]
  const Field<S>& before;     // displacement of the step before
  MaskOf<S> known;            // where there is one
  bool passable;              // limits that joints bounce off: limits.hpp
};

/// How far a solve is when states are updated: its residual is small; it is solved; it has been updated so often that of what sticks too
/// hard one alone begins to slide; and so often that of limits too one alone changes.
template <class Mask>
struct StateUpdate {
  Mask near, solved, late, last;
};

/// A step that is solved and not yet ended.
template <class S>
struct SolvedStep {
  const Field<S>& residual;  // of held joints h times the impulse that holds them
  const Field<S>& delta;
  const Field<S>& before;    // displacement of the step before
  bool known;                // that one was as long as this
};

/// A joint at one instant, for schemes that know forces and no steps (engine/baseline/baseline.hpp).
struct Instant {
  double time;  // [s]
  const Field<double>&q, &v;
  const Field<Index>& q_row;
  const Tree& tree;
};

/// Bodies at one instant, likewise.
struct BodiesInstant {
  double time;                      // [s]
  const Field<double, 12>& pose;    // body -> world
  const Field<double, 6>& twist;    // angular [rad/s], linear [m/s], body frame
  const BodyConstants<double>& constants;
  const Effects& effects;           // of which some have a number that is no entry's, as the wind
};

/// Which part of a law a sweep is.
enum class Part : std::uint8_t { place, begin, guess, add, evaluate, update_states, keep };

/// A part as the schedule of a step has it (engine/sweeps/schedule.hpp): its kernel's name, and arrays by their names. Every part that a law
/// has written anew is named among its `sweeps`, but for `end` and a joint's `keep`, which are parts of joint_impulses_end_map. `residual` is
/// that of the joints as their solve left it.
struct PartSweep {
  Part part;
  std::string_view name, reads, writes;
};

/// Entries of an effect's list.
template <class Entry>
std::span<const Entry> entries_of(const Effects& effects) {
  return entries_in(effects.list<Entry>());
}

/// Numbers that a law keeps from step to step, for as many entries as it has.
template <class S, std::size_t N>
using KeptNumbers = std::array<std::span<S>, N>;

/// Laws whose share of the beginning of a step goes by how much they do in it.
template <class Law>
concept HasRatio = requires(const typename Law::Entry& entry) { Law::ratio(entry, 0.0, 0.0); };

template <class S, class E>
class LawOf {
 public:
  using Entry = E;
  static constexpr const EffectFacts& facts = E::facts;

  std::span<const E> entries() const { return entries_; }
  bool any() const { return !entries_.empty(); }

  // states
  /// Of what holds, the most that any has to bear as a share of what it can; only of what can be updated one by one.
  S overload(const StepView<S>&, const Field<S>&) const { return S(0.0); }

  // what is kept from one step to the next
  /// All of it, for a step that is taken back.
  KeptNumbers<S, 0> memory() { return {}; }
  /// So many numbers of it as a step of another stepper needs, one by one.
  static Index kept_numbers(const LawSetup&) { return 0; }
  S kept(Index) const { return S(0.0); }
  void set_kept(Index, const S&) {}
  /// The state is another's from now on.
  void forget() {}

 protected:
  explicit LawOf(std::span<const E> entries) : entries_(entries) {}

 private:
  std::span<const E> entries_;
};

/// A law of joints. Besides what stands here it has
///   static constexpr std::array sweeps{PartSweep{...}, ...};
///   void add(const StepView<S>&, JointImpulses<S>&) const;
/// and, as its facts demand,
///   static S potential(const Entry&, const JointsView<S>&);                                           .stores
///   MaskOf<S> update_states(const StepView<S>&, const StateUpdate<MaskOf<S>>&, const S& least,
///                    const Field<S>& residual, Field<S>& delta);                                       .has_states
///   void account(const StepView<S>&, const SolvedStep<S>&, const auto& book) const;  book(row, joules) .account
///   static void push(const Entry&, const Instant&, Field<double>& force);                              unless all of it is .sudden
/// and where it takes energy, so that it has to be implicit at long steps (begin_share),
///   static double ratio(const Entry&, double step, double inertia);   impulse of a step as a multiple of what stops a joint of this inertia
template <class S, class E>
class JointLaw : public LawOf<S, E> {
 public:
  explicit JointLaw(const LawSetup& setup) : LawOf<S, E>(entries_of<E>(setup.effects)) {}
  /// Whether anything acts on a ball joint, whose displacement is then needed at every evaluation.
  static bool on_ball(const E&, const LawSetup&) { return false; }
  /// delta: the first guess, which may be moved.
  void begin(const StepView<S>&, const StepStart<S>&, Field<S>&) {}
  /// At each evaluation, once the target of the residual has the rows.
  void evaluate(const StepView<S>&, const Field<S, 7>& /*motion*/, Field<S>& /*target*/) const {}
  /// The same of the impulses of the end of the step.
  void end(const StepView<S>&, const Field<S, 7>& /*motion*/, Field<S>& /*end*/) const {}
  /// After that, for the next step.
  void keep(const Field<S>& /*residual*/) {}
  /// Where states go by delta alone as long as friction is smooth, it is `follow` that sets them; `update_states` is not asked then.
  static constexpr bool kFollows = false;
  void follow(const StepView<S>&, const Field<S>& /*delta*/) {}
  /// Friction is now smooth up to a speed that is smaller by this factor.
  void regularize(double /*factor*/, Field<S>& /*delta*/) const {}
};

/// A law of bodies. Besides what stands here it has
///   static constexpr std::array sweeps{PartSweep{...}, ...};
///   static std::span<const ...> touching(const LawSetup&);      what it has on bodies, sorted by their slots
///   void add(const StepView<S>&, const BodyConstants<...>&, std::size_t first, std::size_t last, const Field<S, 7>& displacement,
///            BodyImpulses<S>&, Field<S, 6>& impulse);           of [first, last) of these, all on one body
/// and what its facts demand: S place(const Field<S, 12>& pose) where it .stores, update_states and account as a law of joints;
/// book(slot, joules); and
///   static void push(const Entry&, const BodiesInstant&, Field<double, 6>& impulse);                   unless all of it is .sudden
/// which, like `add`, takes what acts on a body, moment about its origin and force in its frame, from what is there (take_wrench). It may have a
/// ratio, of a body's mass.
template <class S, class E>
class BodyLaw : public LawOf<S, E> {
 public:
  explicit BodyLaw(const LawSetup& setup) : LawOf<S, E>(entries_of<E>(setup.effects)) {}
  void begin(const StepStart<S>&) {}
  void keep() {}
};

}  // namespace linden

// engine/simulation.hpp
// One instance of a model in time: state, step, energy, momentum, checkpoint.
//
//   Simulation simulation(load_urdf("models/humanoid.urdf", Base::floating), {.step = 1e-3});
//   simulation.set_positions(q);  simulation.set_velocities(v);
//   const StepReport report = simulation.step();
//   if (!report.ok()) ... simulation.describe(report) ...
//   simulation.run(1000);
//
// Positions are [nq], velocities and momenta [nv]; which row is which joint says model().names. Quaternions are x y z w. The
// velocity of a ball joint is its angular velocity in the body's frame; of a free joint angular then linear, in the body's frame.
//
// A tree of some 4,000 bodies or more that branches is stepped by all threads of the task arena (oneTBB) that the call is made in, with the
// same bits however many there are: an arena of one thread keeps it to one.
#pragma once

#include <array>
#include <functional>
#include <iosfwd>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/effects/effect_work.hpp"
#include "engine/effects/passive_watch.hpp"
#include "engine/effects/step_impulses.hpp"
#include "engine/assembly.hpp"
#include "engine/coupling_state.hpp"
#include "engine/energy.hpp"
#include "engine/guess/stage_guess.hpp"
#include "engine/options.hpp"
#include "engine/step_report.hpp"
#include "layout/effects.hpp"
#include "layout/model.hpp"
#include "layout/state.hpp"

namespace linden {

class CheckpointBytes;
struct EffectPlan;
struct Scene;
class Stepper;
enum class Then : std::uint8_t;  // engine/solve/stepper.hpp

/// How the ground holds a body, in the step taken last.
struct BodyContact {
  Index slot;
  int closed = 0;           // contact points that it pushes at the end of the step
  double normal_force = 0;  // of all of them, mean over the step [N]
};

/// Where the ground pushes a body, or another body does, in the step taken last.
struct ContactPoint {
  Index slot;                        // body that is pushed
  std::array<double, 3> place{};     // where they touch, world frame [m]
  std::array<double, 3> normal{};    // of the ground there, or of what pushes, towards the body; unit length, world frame
  std::array<double, 3> force{};     // on the body, friction with it, mean over the step; world frame [N]
  std::array<double, 3> moment{};    // likewise, against rolling and spinning, beside that of the force at its place [N m]
  Index other = 0;                   // body that pushes; 0: the ground, or what is fixed to the world
  std::string link{}, other_link{};  // whose shapes touch, where two do; what stands in the world has a name too
};

class Simulation {
 public:
  /// At rest in the model's zero configuration, but for joints whose motion is given. Throws InputError for options and effects that make no sense, and for a null pointer.
  explicit Simulation(Model model, const Options& options = {}, const Effects& effects = {});
  explicit Simulation(std::shared_ptr<const Model> model, const Options& options = {}, const Effects& effects = {});
  /// At the start of the scene (engine/scene/scene.hpp), with what its seed draws of what is randomised. Throws InputError too where that lies outside limits, contradicts ties or is in the
  /// ground, unless the scene takes it as given (engine/start_check.hpp). Positions that are set later are not looked at.
  explicit Simulation(const Scene& scene);
  ~Simulation();
  Simulation(Simulation&&) noexcept;

  const Model& model() const { return *model_; }
  const Options& options() const { return options_; }
  /// As they act: what stood on followers of mimic joints is on their leaders.
  const Effects& effects() const;
  double time() const { return clock_ ? *clock_ : static_cast<double>(steps_) * options_.step; }
  std::int64_t steps() const { return steps_; }
  /// Length of the step taken last, or of the first to come [s].
  double last_step() const { return clock_ && last_step_ > 0 ? last_step_ : options_.step; }
  /// How long variable steps were, and what became of the accuracy asked for: nothing where steps do not vary.
  std::optional<StepLengths> step_lengths() const;

  std::span<const double> positions() const { return state_.q.flat(); }
  std::span<const double> momenta() const { return state_.p.flat(); }
  /// Velocities of the motion: one O(n) solve (engine/VELOCITY.md).
  std::vector<double> velocities();
  /// Accelerations of the motion [nv]: what the mean velocities of the last two steps differ by, over the step, which is how fast they
  /// change at the node between the two. Zero where less than two steps are known: after a start, a change of the state, a blow at a limit or a
  /// step that was split. Throws InputError for an order above 2, whose sub-steps differ in length.
  std::vector<double> accelerations() const;

  /// Throw InputError for a wrong count or a number that is not finite. Quaternions are normalised; mimic joints follow their
  /// leaders, and joints whose motion is given are where it is, whatever is given for them. set_positions keeps the velocities, not the momenta.
  void set_positions(std::span<const double> q);
  void set_velocities(std::span<const double> v);

  /// Generalized forces [nv; N m, N], on top of gravity and the same over every step until they are set anew; empty: none (the default).
  /// Conjugate to the velocities: of a ball or free joint moment, then force, in the body's frame.
  void set_forces(std::span<const double> force);
  /// As they were set: [nv], or empty.
  std::span<const double> forces() const { return applied_; }

  /// Targets of the servos [rad, m], in the order of Effects::servos, the same over every step until they are set anew. Where the effects
  /// have a table the number goes over it from now on, and NaN gives the servo back to its table; target velocity and feed-forward go on
  /// as the effects say. Throws InputError for a wrong count or another number that is not finite.
  void set_servo_targets(std::span<const double> targets);
  /// Joints of the servos, as model().names.velocity has them; of the entries of joint friction.
  std::vector<std::string> servo_names() const;
  std::vector<std::string> friction_names() const;
  /// As they are now: those that were set, else those of the effects at this time.
  std::vector<double> servo_targets();
  /// Factors of the servos' stiffness and damping as the effects have them, in the order of Effects::servos, likewise; none negative.
  void set_gains(std::span<const double> factors);
  /// Forces of joint friction [N m, N] in the order of Effects::friction, likewise; none negative.
  void set_friction(std::span<const double> forces);
  /// Coulomb's coefficient of the ground, likewise. Throws InputError too where there is no ground.
  void set_ground_friction(double coefficient);

  /// Forces [N m, N] of the motions that the effects give, in the order of Effects::motions: those that made the last step, at its beginning.
  std::vector<double> motion_forces() const;

  /// The first wrench that the effects name on a body, from now on: force [N] and moment [N m] in the directions and at the point that it
  /// was given with. Throws InputError where the effects name none on that body (one of zero will do) or a number is not finite.
  void set_wrench(Index slot, const std::array<double, 3>& force, const std::array<double, 3>& moment);

  /// One step. A report that is not ok() leaves the state as it was before.
  StepReport step();
  /// So many steps, or fewer where one fails: the same motion to the last bit. A large tree is gone over once less a step so.
  StepsReport run(std::int64_t steps);
  /// Steps to the first node at or past t [s]; none where the simulation is there already. With variable steps too the motion has the same bits wherever
  /// it is stopped: t ends no step.
  StepsReport advance_to(double t);
  /// Positions [nq] at a time within the last step of advance_to: between its ends those of the cubic through positions and velocities there, joint
  /// by joint, of ball and free joints in their displacements. Throws InputError for other times.
  std::vector<double> positions_at(double t);
  /// describe(const StepsReport&) tells of steps that were split.
  std::string describe(const StepReport& report) const { return linden::describe(report, *model_, last_step()); }

  /// From the next step on it is kept what effects applied, at the cost of a pass up the tree a step where something acts on bodies. What
  /// follows is zero before that, and throws InputError where this was not called.
  void keep_forces();
  bool keeps_forces() const { return impulses_.has_value(); }
  /// Mean over the step taken last: generalized forces of all effects together [nv; N m, N], conjugate to the velocities. Gravity, armature
  /// and set_forces are not among them, nor blows at limits, which have no duration.
  std::vector<double> joint_forces() const;
  /// Likewise of each servo [N m, N], in the order of Effects::servos.
  std::vector<double> servo_torques() const;
  /// Of every body that may touch the ground, sorted by slot.
  std::vector<BodyContact> contacts() const;
  /// Every place where the ground pushes at the end of the step, sorted by slot; then every place where bodies push each other, once, in the order of
  /// their pairs. The forces of one that was pushed before, and is not any more, are not among them.
  std::vector<ContactPoint> contact_points() const;
  /// What contacts of bodies with each other keep from step to step (engine/sweeps/body_contacts.hpp), for observations; empty without.
  std::span<const double> contact_memory();
  /// Wrench of all effects on each body [slots x 6]: moment about its origin [N m], force [N]; in the frame that the body had when the step
  /// began.
  std::vector<double> body_wrenches() const;

  /// Moves the positions to where all couplings are closed, as near as the mass matrix measures, or to where they are least open; velocities stay.
  /// set_positions does so by itself where kOpenStart of the mechanism's size are enough. Steps from a start that is open throw InputError.
  Assembly assemble();
  /// What there was to close, and is left open, of the positions set last.
  const Assembly& openness() const { return assembly_; }
  /// How far open the couplings of the model are, and what held them in the step taken last; of an order above 2 in its last sub-step.
  std::vector<CouplingState> couplings() const;

  Energy energy();
  /// What effects gave and took since the start, runs that were continued included [J]. Total energy plus what was taken less what was given
  /// stays.
  const EffectWork& effect_work() const { return effect_work_; }
  /// Effects that gave energy although they can only take it, since then: none where all is well (engine/effects/passive_watch.hpp).
  const std::vector<PassiveGift>& passive_gifts() const { return watch_->gifts(); }
  Momentum momentum();

  /// All that a run depends on, so that one continued from it is bit-identical: the state, forces, servo targets, gains, friction and wrenches
  /// that were set, what effects gave and took, and the forces that are kept (keep_forces). What was not set is as the effects of the
  /// simulation have it that loads. load throws InputError for another model's checkpoint, another step, accuracy, order or gravity, effects on other
  /// joints or bodies (their numbers may be others), a file that is cut short or is no checkpoint; the simulation is then unchanged.
  void save(const std::string& file);
  void load(const std::string& file);
  /// Whether the steps of the run that a file was saved of vary; if not, their length [s]. Throws InputError where it cannot be read.
  struct SavedSteps {
    bool vary;
    double step;
  };
  static SavedSteps saved_steps(const std::string& file);
  /// The same in memory. name: of where the bytes come from, for messages.
  std::string checkpoint();
  void restore(std::string_view bytes, const std::string& name = "checkpoint");

 private:
  /// Of the instance that is meant, where something is randomised.
  explicit Simulation(const std::shared_ptr<const Scene>& instance);
  struct Continued;
  Continued continued();
  void check_continued(const Continued& from, const std::function<void(const std::string&)>& impossible);
  void check_accuracy_of(const Continued& from, const std::string& name) const;
  void go_on(const Continued& from);
  void restore(CheckpointBytes& bytes);
  static std::array<double, 6> numbers_of(const BodyWrench& wrench);
  std::vector<double> mean_forces(const std::vector<double>& impulses) const;
  void check_row_count(const char* what, std::size_t found, Index expected) const;
  void changed();
  void forget_past();
  void close_nearly_closed();
  StepReport take_step(Then then);
  StepReport step_of(double h, Then then);
  StepReport step_in_stages(double h);
  StepReport variable_step();
  StepReport step_halved_until_taken(double h);
  double next_landing() const;
  double next_length() const;
  void measure(double h);
  void look_at_energy(const Energy& now);

  std::shared_ptr<const Model> model_;
  Options options_;
  std::unique_ptr<EffectPlan> plan_;
  State<double> state_;
  std::unique_ptr<Stepper> stepper_;
  Field<double> rate_;
  Assembly assembly_;                                 // of the start
  std::vector<double> applied_;                       // forces that were set; empty: none
  std::vector<std::array<double, 6>> own_wrenches_;   // force and moment of each wrench as the effects have it
  EffectWork effect_work_;
  std::optional<StepImpulses> impulses_;  // of the step taken last, where they are kept
  std::optional<PassiveWatch> watch_;
  std::int64_t steps_ = 0;
  int history_ = 0;
  struct Varying;
  std::unique_ptr<Varying> varying_;    // where steps vary
  std::optional<double> clock_;         // likewise: time [s]
  double last_step_ = 0;                // likewise
  struct LastStep;
  std::unique_ptr<LastStep> step_from_;  // where the step began that positions_at is asked about
  std::optional<StageGuess> stage_guess_;  // where a step has several sub-steps; none of them then looks at the state's history
  Field<double> good_q_, good_p_;  // at the beginning of a step of several sub-steps
};

}  // namespace linden

// engine/batch.hpp
// N instances of one model in time: rollouts over lanes and threads.
//
//   Batch batch(load_scene("models/scenes/humanoid_drop.yaml"), 4096);                       every instance as its scene says
//   Batch batch(load_urdf("models/humanoid.urdf", Base::floating), 4096, {.step = 1e-3});
//   for (std::int64_t i = 0; i < batch.size(); ++i) batch.reset(i, q, v);
//   batch.step(100);
//   batch.positions().instance(7)     Eigen vector of instance 7, no copy
//   batch.record(7).status            an instance whose step failed is frozen at its last good state
//
// Memory is [block][row][lane]: a block of W instances, W the lanes of the processor's registers, lies together, so that a thread takes it
// through many steps without leaving its cache. Of an instance are kept positions, momenta, one number more a degree of freedom for each
// sub-step (one at order 2, engine/compose/composition.hpp), with effects two more, and one a contact point. At order 2, where no effect
// sticks, stops or saturates, the factor of a step is kept too, 52 bytes a screw: most steps do without making one
// (engine/sweeps/lane_factor.hpp). Where bodies may touch each other, what their shapes remember is kept in double precision.
//
// Results are equal to the bit for any number of threads, any number and order of instances, any neighbours and any splitting of steps
// into calls; with other registers (other Instructions, another kind of processor) they differ by rounding.
//
// Effects act as in a Simulation, on lanes and threads alike, but for contact of bodies with each other: an instance in which two are near each other
// is stepped alone, and takes as long as a Simulation. Gravity, masses, forces, servo targets and gains, friction of joints and of the
// ground may differ from instance to instance.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "engine/batch_rows.hpp"
#include "engine/instance_record.hpp"
#include "engine/options.hpp"
#include "engine/solve/instructions.hpp"
#include "layout/effects.hpp"
#include "layout/model.hpp"

namespace linden {

class CheckpointBytes;
struct Scene;

/// What a batch is computed with. No result depends on the threads; with other instructions results differ by rounding.
struct BatchOptions {
  int threads = 0;                             // 0: all that the machine has
  std::optional<Instructions> instructions{};  // none: the best that the processor has
  /// Whether the factor of a step is kept for those that follow, where effects allow it: half of the time of a free step, and 52 bytes a screw
  /// of an instance. With and without, results differ by what the tolerance of a step leaves.
  bool hold_factors = true;
};

/// Throws InputError where `found` is none of first..last, which are called `what`.
void require_one_of(const char* what, std::int64_t found, std::int64_t first, std::int64_t last);

/// All instances' rows of one quantity where they lie: [block][row][lane]. Asked for an instance or a row that there is not, it throws
/// InputError.
template <class Number>
class BatchView {
 public:
  using Real = std::remove_const_t<Number>;
  using Vector = std::conditional_t<std::is_const_v<Number>, const Eigen::VectorX<Real>, Eigen::VectorX<Real>>;

  BatchView(std::span<Number> flat, Index rows, int lanes, std::int64_t size) : flat_(flat), rows_(rows), lanes_(lanes), size_(size) {}

  Index rows() const { return rows_; }
  int lanes() const { return lanes_; }
  Number& operator()(std::int64_t instance, Index row) const {
    if (row < 0 || row >= rows_) require_one_of("row", row, 0, rows_ - 1);
    return flat_[offset(instance) + static_cast<std::size_t>(row * lanes_)];
  }
  /// One instance's rows, a strided Eigen vector.
  Eigen::Map<Vector, 0, Eigen::InnerStride<>> instance(std::int64_t instance) const {
    return {flat_.data() + offset(instance), rows_, Eigen::InnerStride<>(lanes_)};
  }
  /// Everything, lanes of the last block that hold no instance included.
  std::span<Number> flat() const { return flat_; }

 private:
  std::size_t offset(std::int64_t instance) const {
    if (instance < 0 || instance >= size_) require_one_of("instance", instance, 0, size_ - 1);
    const auto block = static_cast<std::size_t>(instance / lanes_), lane = static_cast<std::size_t>(instance % lanes_);
    return block * static_cast<std::size_t>(rows_) * static_cast<std::size_t>(lanes_) + lane;
  }
  std::span<Number> flat_;
  Index rows_;
  int lanes_;
  std::int64_t size_;  // instances
};

/// Sums over all instances since the start.
struct BatchSummary {
  std::int64_t frozen = 0;
  std::int64_t steps = 0;
  std::int64_t evaluations = 0;  // of the residual
  std::int64_t factors = 0;      // of the Jacobian, but for those of steps taken alone
  std::int64_t rescued = 0;      // steps taken alone
};

template <class Real>
class BatchOf {
 public:
  /// Every instance at rest in the model's zero configuration. Throws InputError for options that make no sense or that a batch does not
  /// have: it solves by Newton's method, starts from extrapolation and stops by energy; and, above order 2, for effects that cannot be taken back
  /// in time. Here and below an instance or a body that there is
  /// not, and a null pointer, are InputErrors too.
  BatchOf(Model model, std::int64_t size, const Options& options = {}, const Effects& effects = {}, const BatchOptions& computed = {});
  BatchOf(std::shared_ptr<const Model> model, std::int64_t size, const Options& options = {}, const Effects& effects = {},
          const BatchOptions& computed = {});
  /// Every instance at the start of the scene (engine/scene/scene.hpp), which is looked at as that of a Simulation is; of what the scene
  /// randomises, instance i has what the seed scene.seed + i draws, the first instance that of Simulation(scene). A reset keeps it.
  explicit BatchOf(const Scene& scene, std::int64_t size, const BatchOptions& computed = {});
  ~BatchOf();
  BatchOf(BatchOf&&) noexcept;
  BatchOf& operator=(BatchOf&&) noexcept;

  const Model& model() const;
  const Options& options() const;
  std::int64_t size() const;
  int lanes() const;
  int threads() const;
  Instructions instructions() const;

  /// Starts instance i anew at time 0, its record cleared: positions [nq], velocities [nv], conventions and errors as Simulation's. Others are not
  /// touched; several threads may reset different instances at once. Whether the positions lie within limits or in the ground is not looked
  /// at, resets being many: StartCheck (engine/start_check.hpp) does that where it is wanted.
  void reset(std::int64_t i, std::span<const double> positions, std::span<const double> velocities);
  /// reset of the instances `which`, each named once, on all threads: positions [which x nq], velocities [which x nv], instance by
  /// instance. Where one is wrong InputError names it, and none is reset.
  void reset(std::span<const std::int64_t> which, std::span<const double> positions, std::span<const double> velocities);
  /// reset of every instance on all threads; start(i, positions, velocities) fills both, given as the neutral state at rest.
  void reset_all(const std::function<void(std::int64_t i, std::span<double> positions, std::span<double> velocities)>& start);

  /// Generalized forces on top of gravity, the same over every step until they are changed: rows [nv] to be written at will. The first
  /// call makes room for them, all zero.
  BatchView<Real> forces();

  /// Gravity [m/s^2], world frame, likewise: three rows, at first those of the options. An instance moves as if it were that of the options.
  BatchView<Real> gravity();

  /// Targets of the servos [rad, m] in the order of Effects::servos, likewise: rows to be written at will, at first those of the effects.
  /// Of a servo whose target is a table the row holds NaN until a number is written, which then goes over the table; NaN gives the servo
  /// back to it.
  BatchView<Real> servo_targets();
  /// Factors of the servos' stiffness and damping, in the order of Effects::servos, likewise, at first 1; none may be negative. What a servo
  /// feeds forward and its limit of force stay.
  BatchView<Real> gains();
  /// Forces of joint friction [N m, N] in the order of Effects::friction, likewise; none may be negative.
  BatchView<Real> friction();
  /// Coulomb's coefficient of the ground, likewise: one row, none without ground; it may not be negative.
  BatchView<Real> ground_friction();
  /// Joints of the rows of servo_targets and gains, and of friction, as model().names.velocity has them.
  std::vector<std::string> servo_names() const;
  std::vector<std::string> friction_names() const;

  /// Mass m [kg], first moment m c [kg m] and inertia xx xy xz yy yz zz [kg m^2] about the body frame's origin, of one body of one
  /// instance; the first call gives every instance masses of its own, after it several threads may set those of different instances at once.
  /// Keeps positions and momenta, so set it before reset. Effects that a step does not resolve are taken as implicitly as the model's masses
  /// call for. Throws InputError for an inertia that is not positive definite.
  void set_inertia(std::int64_t i, Index slot, const std::array<double, 10>& inertia);
  std::array<double, 10> inertia(std::int64_t i, Index slot) const;
  /// The same of a mass [kg] alone: first moment and inertia go with it, the centre of mass stays. Throws InputError too for a mass
  /// that is not above zero, and where the body has none so far.
  void set_mass(std::int64_t i, Index slot, double mass);

  /// All that the batch depends on (positions and momenta, what was set of each instance, records), so that what goes on from it is the same
  /// to the bit: by the same instructions, on any number of threads; by others it differs by rounding. What was never asked for (forces(),
  /// gravity(), ...) is as options and effects of the batch have it that loads; views stay what they are. load throws InputError for a
  /// checkpoint of another model, number of instances, precision, step or gravity, of effects on other joints or bodies (their numbers may
  /// be others), and for what is damaged or no checkpoint of a batch; the batch is then unchanged.
  void save(const std::string& file) const;
  void load(const std::string& file);
  /// The same in memory. name: of where the bytes come from, for messages.
  std::string checkpoint() const;
  void restore(std::string_view bytes, const std::string& name = "checkpoint");

  /// n steps of every instance that is not frozen.
  void step(std::int64_t n = 1);
  /// The same, with rows of the caller taken in before and observations given out after. Throws InputError, before anything is changed, for
  /// spans of another length, for rows of what there is not, for what observe refuses, and, naming instance and joint, for numbers that are
  /// not finite (but targets of servos that have a table) and negative gains and friction.
  void step(std::int64_t n, const BatchRows<Real>& rows);

  BatchView<const Real> positions() const;
  BatchView<const Real> momenta() const;
  /// Velocities of the motion (engine/VELOCITY.md) and energy (kinetic, potential [J]) of all instances, computed at every call.
  struct Observation {
    std::vector<Real> velocity_numbers, energy_numbers;
    Index nv;
    int lanes;
    std::int64_t size;
    BatchView<const Real> velocities() const { return {velocity_numbers, nv, lanes, size}; }
    BatchView<const Real> energies() const { return {energy_numbers, 2, lanes, size}; }
  };
  Observation observe() const;

  /// What was asked for (engine/queries/observations.hpp) of every instance, on all threads: [size x width], instance by instance. Frozen
  /// instances are seen in their last good state. Throws InputError for another length, for observations of another model, and for
  /// accelerations where a batch does not know them: in single precision and above order 2.
  void observe(const Observations& observations, std::span<double> to) const;
  void observe(const Observations& observations, std::span<float> to) const;

  const InstanceRecord& record(std::int64_t i) const;
  BatchSummary summary() const;
  /// What froze instance i: one sentence; empty where it runs.
  std::string describe(std::int64_t i) const;

  /// Bytes of all that is kept of the instances.
  std::size_t bytes() const;

 private:
  void restore(CheckpointBytes& bytes);

  struct Data;
  std::unique_ptr<Data> data_;
};

using Batch = BatchOf<double>;
using FloatBatch = BatchOf<float>;  // half the memory, twice the speed; what it costs: bench/precision.cpp

}  // namespace linden

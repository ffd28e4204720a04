#include "engine/batch.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "engine/batch_data.hpp"
#include "engine/queries/observations.hpp"
#include "engine/randomization.hpp"
#include "engine/required_model.hpp"
#include "engine/scene/scene.hpp"
#include "engine/start_check.hpp"
#include "layout/support/input_error.hpp"

namespace linden {
namespace {

void check_batch(std::int64_t size, const Options& options, const BatchOptions& computed) {
  check(options);
  constexpr std::int64_t most = 1'000'000'000;
  if (size < 1 || size > most) throw InputError(fmt::format("{} instances; expected 1 to {}", size, most));
  if (computed.threads < 0 || computed.threads > 4096) {
    throw InputError(fmt::format("{} threads; expected 1 to 4096, or 0 for all there are", computed.threads));
  }
  const auto refuse = [](const char* what, std::string_view found, std::string_view only) {
    throw InputError(fmt::format("a batch has no {} \"{}\"; it knows \"{}\" (a Simulation has them all)", what, found, only));
  };
  if (options.order != 2) refuse("order", fmt::format("{}", options.order), "2");
  if (options.reduction != 0) refuse("reduction", fmt::format("{:g}", options.reduction), "0");
  if (options.solver != Solver::newton) refuse("solver", name(options.solver), name(Solver::newton));
  if (options.guess != FirstGuess::extrapolation) refuse("first guess", name(options.guess), name(FirstGuess::extrapolation));
  if (options.stop != StopTest::energy) refuse("stop test", name(options.stop), name(StopTest::energy));
  if (computed.instructions && !available(*computed.instructions)) {
    throw InputError(fmt::format("this processor or this build of linden has no {} instructions; the best there is: {}",
                                 name(*computed.instructions), name(best_instructions())));
  }
}

}  // namespace

void require_one_of(const char* what, std::int64_t found, std::int64_t first, std::int64_t last) {
  if (found >= first && found <= last) return;
  throw InputError(fmt::format("there is no {} {}: {}", what, found,
                               last < first ? "there are none" : fmt::format("they go from {} to {}", first, last)));
}

template <class Real>
BatchOf<Real>::BatchOf(Model model, std::int64_t size, const Options& options, const Effects& effects, const BatchOptions& computed)
    : BatchOf(std::make_shared<const Model>(std::move(model)), size, options, effects, computed) {}

template <class Real>
BatchOf<Real>::BatchOf(std::shared_ptr<const Model> model, std::int64_t size, const Options& options, const Effects& effects,
                       const BatchOptions& computed) {
  check_batch(size, options, computed);
  data_ = std::make_unique<Data>(required(std::move(model)), size, options, effects, computed);
  if (!effects.motions.empty()) reset_all([](std::int64_t, std::span<double>, std::span<double>) {});
}

template <class Real>
BatchOf<Real>::BatchOf(const Scene& scene, std::int64_t size, const BatchOptions& computed)
    : BatchOf(scene.model, size, scene.options, scene.effects, computed) {
  const std::vector<double> start = checked_start(scene);
  if (!start.empty()) data_->check_count("positions", start.size(), data_->shape().positions);
  const std::vector<double>& rates = scene.initial.velocities;
  if (!rates.empty()) data_->check_count("velocities", rates.size(), data_->shape().velocities);
  const auto randomize = [&](std::int64_t i) {
    apply(draw(scene.randomization, scene.model, scene.effects, scene.seed + static_cast<std::uint64_t>(i)), scene.effects, *this, i);
  };
  if (scene.randomization.any()) randomize(0);  // makes room, before there are several threads
  reset_all([&](std::int64_t i, std::span<double> positions, std::span<double> velocities) {
    if (scene.randomization.any()) randomize(i);
    std::ranges::copy(start, positions.begin());
    std::ranges::copy(rates, velocities.begin());
  });
}

template <class Real>
BatchOf<Real>::~BatchOf() = default;
template <class Real>
BatchOf<Real>::BatchOf(BatchOf&&) noexcept = default;
template <class Real>
BatchOf<Real>& BatchOf<Real>::operator=(BatchOf&&) noexcept = default;

template <class Real>
const Model& BatchOf<Real>::model() const {
  return *data_->model;
}
template <class Real>
const Options& BatchOf<Real>::options() const {
  return data_->options;
}
template <class Real>
std::int64_t BatchOf<Real>::size() const {
  return data_->size;
}
template <class Real>
int BatchOf<Real>::lanes() const {
  return data_->lanes;
}
template <class Real>
int BatchOf<Real>::threads() const {
  return data_->threads;
}
template <class Real>
Instructions BatchOf<Real>::instructions() const {
  return data_->instructions;
}

template <class Real>
void BatchOf<Real>::reset(std::int64_t i, std::span<const double> positions, std::span<const double> velocities) {
  data_->check_instance(i);
  data_->check_count("positions", positions.size(), data_->shape().positions);
  data_->check_count("velocities", velocities.size(), data_->shape().velocities);
  data_->start(i, positions, velocities, *data_->worker().instance);
}

template <class Real>
void BatchOf<Real>::reset_all(
    const std::function<void(std::int64_t i, std::span<double> positions, std::span<double> velocities)>& start) {
  const std::vector<double> neutral = model().neutral();
  data_->for_blocks([&](std::int64_t b, typename Data::Worker& worker) {
    std::vector<double> positions, velocities;
    for (std::int64_t i = b * lanes(); i < std::min((b + 1) * lanes(), size()); ++i) {
      positions = neutral;
      velocities.assign(static_cast<std::size_t>(data_->shape().velocities), 0.0);
      start(i, positions, velocities);
      data_->start(i, positions, velocities, *worker.instance);
    }
  });
}

template <class Real>
BatchView<Real> BatchOf<Real>::forces() {
  return data_->asked(data_->applied);
}
template <class Real>
BatchView<Real> BatchOf<Real>::gravity() {
  return data_->asked(data_->gravity);
}
template <class Real>
BatchView<Real> BatchOf<Real>::servo_targets() {
  return data_->asked(data_->targets);
}
template <class Real>
BatchView<Real> BatchOf<Real>::gains() {
  return data_->asked(data_->gains);
}
template <class Real>
BatchView<Real> BatchOf<Real>::friction() {
  return data_->asked(data_->frictions);
}
template <class Real>
BatchView<Real> BatchOf<Real>::ground_friction() {
  return data_->asked(data_->ground_friction);
}

template <class Real>
std::vector<std::string> BatchOf<Real>::servo_names() const {
  return joints_of(model(), data_->plan.effects.servos);
}
template <class Real>
std::vector<std::string> BatchOf<Real>::friction_names() const {
  return joints_of(model(), data_->plan.effects.friction);
}

template <class Real>
void BatchOf<Real>::set_inertia(std::int64_t i, Index slot, const std::array<double, 10>& inertia) {
  data_->check_instance(i);
  const Tree& tree = model().tree;
  data_->check_body(slot);
  // a body's 6 x 6 inertia is positive semidefinite where its inertia about the centre of mass is
  const double m = inertia[0];
  const Eigen::Vector3d mc(inertia[1], inertia[2], inertia[3]);
  Eigen::Matrix3d I;
  I << inertia[4], inertia[5], inertia[6], inertia[5], inertia[7], inertia[8], inertia[6], inertia[8], inertia[9];
  const double scale = I.norm();  // of a mass far from the origin, of which nothing but rounding may be left below
  const bool finite = std::ranges::all_of(inertia, [](double value) { return std::isfinite(value); });
  if (finite && m > 0) I -= (mc.squaredNorm() * Eigen::Matrix3d::Identity() - mc * mc.transpose()) / m;
  if (!finite || m < 0 || (m == 0 && !(mc.isZero(0))) ||
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(I).eigenvalues()[0] < -1e-9 * (scale + 1e-300)) {
    throw InputError(fmt::format("instance {}, body \"{}\": mass {} and its moments are no body's: expected finite numbers, a mass that is "
                                 "not negative and an inertia about the centre of mass that is positive definite",
                                 i, model().names.body[static_cast<std::size_t>(slot)], m));
  }
  data_->asked(data_->mass);
  const double more = m - static_cast<double>(data_->mass_row(i, slot)[0]);
  for (std::size_t k = 0; k < 10; ++k) data_->mass_row(i, slot)[k * static_cast<std::size_t>(lanes())] = static_cast<Real>(inertia[k]);
  for (Index body = slot;; body = tree.parent(body)) {
    Real& sum = data_->mass_row(i, body)[10 * lanes()];
    sum = static_cast<Real>(static_cast<double>(sum) + more);
    if (body == 0) break;
  }
}

template <class Real>
void BatchOf<Real>::set_mass(std::int64_t i, Index slot, double mass) {
  std::array<double, 10> numbers = inertia(i, slot);
  if (!(numbers[0] > 0)) {
    throw InputError(fmt::format("instance {}, body \"{}\" has no mass, of which its inertia would follow; expected set_inertia", i,
                                 model().names.body[static_cast<std::size_t>(slot)]));
  }
  const double factor = mass / numbers[0];
  for (double& number : numbers) number *= factor;
  numbers[0] = mass;
  set_inertia(i, slot, numbers);
}

template <class Real>
std::array<double, 10> BatchOf<Real>::inertia(std::int64_t i, Index slot) const {
  data_->check_instance(i);
  data_->check_body(slot);
  std::array<double, 10> result;
  for (std::size_t k = 0; k < 10; ++k) {
    result[k] = data_->mass.empty() ? model().constants.inertia(slot, static_cast<int>(k))
                                    : static_cast<double>(data_->mass_row(i, slot)[k * static_cast<std::size_t>(lanes())]);
  }
  return result;
}

template <class Real>
void BatchOf<Real>::step(std::int64_t n) {
  data_->for_blocks([&](std::int64_t b, typename Data::Worker& worker) { worker.block->step(data_->block(b), n); });
}

template <class Real>
BatchView<const Real> BatchOf<Real>::positions() const {
  return {data_->q, data_->shape().positions, lanes(), size()};
}
template <class Real>
BatchView<const Real> BatchOf<Real>::momenta() const {
  return {data_->p, data_->shape().velocities, lanes(), size()};
}

template <class Real>
typename BatchOf<Real>::Observation BatchOf<Real>::observe() const {
  const Index nv = data_->shape().velocities;
  Observation seen{std::vector<Real>(data_->p.size()), std::vector<Real>(data_->at(data_->blocks, 2)), nv, lanes(), size()};
  data_->for_blocks([&](std::int64_t b, typename Data::Worker& worker) {
    worker.block->observe(data_->block(b), seen.velocity_numbers.data() + data_->at(b, nv), seen.energy_numbers.data() + data_->at(b, 2));
  });
  return seen;
}

template <class Real>
void BatchOf<Real>::Data::check_observations(const Observations& observations, std::size_t room) const {
  const ObservationSchedule& schedule = *observations.schedule();
  require_same_model(schedule, *model);
  if (schedule.targets) require_same_servos(schedule, plan.effects.servos.size());
  const std::size_t expected = static_cast<std::size_t>(size) * static_cast<std::size_t>(observations.width());
  if (room != expected) {
    throw InputError(fmt::format("observations of {} instances: room for {} numbers given, expected {} x {} = {}", size, room, size,
                                 observations.width(), expected));
  }
  if (!schedule.accelerations) return;
  const char* const why = std::is_same_v<Real, float> ? "in single precision it keeps too little of its last steps"
                          : !model->mimics.empty()    ? "with mimic joints it keeps one step alone"
                                                      : nullptr;
  if (why != nullptr) throw InputError(fmt::format("accelerations were asked of a batch: {}; leave them out, or ask a Simulation", why));
}

template <class Real>
template <class Number>
void BatchOf<Real>::Data::observe(const Observations& observations, std::span<Number> to) {
  check_observations(observations, to.size());
  const auto width = static_cast<std::size_t>(observations.width());
  for_blocks([&](std::int64_t b, Worker& mine) {
    if (!mine.observer || mine.observer->schedule() != observations.schedule().get()) {
      const BlockSetup<Real> setup{*model, constants, options, plan};
      mine.observer = std::make_unique<BatchObserver<Real>>(observations.schedule(), setup, instructions);
    }
    const Block<Real> here = block(b);
    const std::span<const Real> rows = mine.observer->observe(here, *mine.block);
    const auto stride = static_cast<std::size_t>(lanes);
    for (int l = 0; l < here.count; ++l) {
      Number* const row = to.data() + static_cast<std::size_t>(b * lanes + l) * width;
      for (std::size_t k = 0; k < width; ++k) row[k] = static_cast<Number>(rows[k * stride + static_cast<std::size_t>(l)]);
    }
  });
}

template <class Real>
void BatchOf<Real>::observe(const Observations& observations, std::span<double> to) const {
  data_->observe(observations, to);
}
template <class Real>
void BatchOf<Real>::observe(const Observations& observations, std::span<float> to) const {
  data_->observe(observations, to);
}

template <class Real>
const InstanceRecord& BatchOf<Real>::record(std::int64_t i) const {
  data_->check_instance(i);
  return data_->records[static_cast<std::size_t>(i)];
}

template <class Real>
BatchSummary BatchOf<Real>::summary() const {
  BatchSummary sum;
  for (const InstanceRecord& record : data_->records) {
    sum.frozen += record.status != StepStatus::converged ? 1 : 0;
    sum.steps += record.steps;
    sum.evaluations += record.evaluations;
    sum.rescued += record.rescued;
  }
  return sum;
}

template <class Real>
std::string BatchOf<Real>::describe(std::int64_t i) const {
  const InstanceRecord& instance = record(i);
  StepReport report;
  report.status = instance.status;
  report.slot = instance.slot;
  report.residual = instance.residual;
  return linden::describe(report, model(), options().step);
}

template <class Real>
std::size_t BatchOf<Real>::bytes() const {
  std::size_t bytes = data_->records.size() * sizeof(InstanceRecord);
  Data::each(*data_, [&](const auto& numbers, Index) { bytes += numbers.size() * sizeof(numbers[0]); });
  return bytes;
}

template class BatchOf<double>;
template class BatchOf<float>;

}  // namespace linden

#include "engine/batch.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "engine/batch_data.hpp"
#include "engine/randomization.hpp"
#include "engine/required_model.hpp"
#include "engine/scene/scene.hpp"
#include "engine/start_check.hpp"
#include "layout/support/input_error.hpp"

namespace linden {
namespace {

void check_batch(std::int64_t size, const Options& options, const BatchOptions& computed) {
  check(options);
  if (options.accuracy) {
    throw InputError(fmt::format("an accuracy of {:g} is asked for, and a batch takes steps of one length and order; leave the accuracy out and give step "
                                 "and order (a Simulation chooses them)", *options.accuracy));
  }
  constexpr std::int64_t most = 1'000'000'000;
  if (size < 1 || size > most) throw InputError(fmt::format("{} instances; expected 1 to {}", size, most));
  if (computed.threads < 0 || computed.threads > 4096) {
    throw InputError(fmt::format("{} threads; expected 1 to 4096, or 0 for all there are", computed.threads));
  }
  const auto refuse = [](const char* what, std::string_view found, std::string_view only) {
    throw InputError(fmt::format("a batch has no {} \"{}\"; it knows \"{}\" (a Simulation has them all)", what, found, only));
  };
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
  const bool pushed = !data_->plan.row_yields.empty();  // at rest momenta are what stretched springs leave in them
  if ((pushed || !effects.motions.empty()) && data_->has_start.empty()) reset_all([](std::int64_t, std::span<double>, std::span<double>) {});
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
void BatchOf<Real>::reset(std::span<const std::int64_t> which, std::span<const double> positions, std::span<const double> velocities) {
  const auto nq = static_cast<std::size_t>(data_->shape().positions), nv = static_cast<std::size_t>(data_->shape().velocities);
  const auto require_count = [&](const char* what, std::size_t found, std::size_t each) {
    if (found == which.size() * each) return;
    throw InputError(fmt::format("{} of {} instances: {} numbers given, expected {} x {} = {}", what, which.size(), found, which.size(),
                                 each, which.size() * each));
  };
  require_count("positions", positions.size(), nq);
  require_count("velocities", velocities.size(), nv);
  std::vector<bool> named(static_cast<std::size_t>(size()));
  for (const std::int64_t i : which) {
    data_->check_instance(i);
    if (named[static_cast<std::size_t>(i)]) throw InputError(fmt::format("instance {} is to be reset twice; expected it once", i));
    named[static_cast<std::size_t>(i)] = true;
  }
  const auto each = [&](const auto& work) {
    data_->for_each(std::ssize(which), [&](std::int64_t k, typename Data::Worker& worker) {
      const auto at = static_cast<std::size_t>(k);
      work(k, positions.subspan(at * nq, nq), velocities.subspan(at * nv, nv), *worker.instance);
    });
  };
  std::vector<std::string> wrong(which.size());
  each([&](std::int64_t k, std::span<const double> q, std::span<const double> v, InstanceStepper& alone) {
    try {
      data_->place(q, v, alone);
    } catch (const InputError& error) {
      wrong[static_cast<std::size_t>(k)] = error.what();
    }
  });
  const auto first = std::ranges::find_if(wrong, [](const std::string& message) { return !message.empty(); });
  if (first != wrong.end()) {
    throw InputError(fmt::format("instance {}: {}; none was reset", which[static_cast<std::size_t>(first - wrong.begin())], *first));
  }
  each([&](std::int64_t k, std::span<const double> q, std::span<const double> v, InstanceStepper& alone) {
    data_->start(which[static_cast<std::size_t>(k)], q, v, alone);
  });
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
  data_->forget_factor(i);
  for (std::size_t k = 0; k < 10; ++k) data_->mass_row(i, slot)[k * static_cast<std::size_t>(lanes())] = static_cast<Real>(inertia[k]);
  // each sum anew, so that it does not depend on the masses there were before
  for (Index body = slot;; body = tree.parent(body)) {
    double sum = static_cast<double>(data_->mass_row(i, body)[0]);
    for (const Index child : data_->children(body)) sum += static_cast<double>(data_->mass_row(i, child)[10 * lanes()]);
    data_->mass_row(i, body)[10 * lanes()] = static_cast<Real>(sum);
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
  if (!(mass > 0) || !std::isfinite(mass)) {
    throw InputError(fmt::format("instance {}, body \"{}\": a mass of {} kg is given; expected one above zero", i,
                                 model().names.body[static_cast<std::size_t>(slot)], mass));
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
BatchView<const Real> BatchOf<Real>::positions() const {
  return {data_->q, data_->shape().positions, lanes(), size()};
}
template <class Real>
BatchView<const Real> BatchOf<Real>::momenta() const {
  return {data_->p, data_->shape().velocities, lanes(), size()};
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
    sum.factors += record.factors;
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
  report.coupling = instance.coupling;
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

#include "engine/batch_rows.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <limits>
#include <string_view>

#include "engine/batch_data.hpp"
#include "engine/queries/observations.hpp"
#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"

namespace linden {
namespace {

/// Rows of the caller, [size x width].
template <class Real>
struct GivenRows {
  std::string_view what;                           // "targets"
  std::string_view of_one;                         // what a number is, before the name of its joint
  std::string_view needs;                          // what there must be for them
  std::span<const Real> numbers;
  Index width;
  bool not_negative;
  std::function<std::string(Index)> name;          // of a column: its joint
  std::function<bool(Index)> may_be_nan;           // of a column
  std::function<BatchView<Real>()> view;           // where they go; makes room

  std::span<const Real> row(std::int64_t i) const {
    return numbers.subspan(static_cast<std::size_t>(i) * static_cast<std::size_t>(width), static_cast<std::size_t>(width));
  }
  Real least() const { return not_negative ? Real(0) : std::numeric_limits<Real>::lowest(); }
  bool sensible(std::int64_t i, Index column) const {
    const Real number = row(i)[static_cast<std::size_t>(column)];
    if (std::isnan(number)) return may_be_nan && may_be_nan(column);
    return number >= least() && number <= std::numeric_limits<Real>::max();
  }
  /// The first column of instance i whose number makes no sense; else width. Nearly always all are finite, which is quickly seen.
  Index first_wrong(std::int64_t i) const {
    const Real low = least(), high = std::numeric_limits<Real>::max();
    int fine = 1;
    for (const Real number : row(i)) fine &= static_cast<int>(number >= low) & static_cast<int>(number <= high);
    Index column = fine != 0 ? width : 0;
    while (column < width && sensible(i, column)) ++column;
    return column;
  }
};

template <class Real>
void require_count(const GivenRows<Real>& given, std::int64_t size) {
  const std::size_t expected = static_cast<std::size_t>(size) * static_cast<std::size_t>(given.width);
  if (given.numbers.size() == expected) return;
  if (expected == 0) {
    throw InputError(
        fmt::format("{} were given and there is no {}; expected one among the effects; leave them out", given.what, given.needs));
  }
  throw InputError(fmt::format("{} of {} instances: {} numbers given, expected {} x {} = {}", given.what, size, given.numbers.size(), size,
                               given.width, expected));
}

/// Throws InputError for the first instance with a number that makes no sense.
template <class Data, class Real>
void require_sensible(const Data& data, const GivenRows<Real>& given) {
  std::atomic<std::int64_t> first = data.size;
  data.for_blocks([&](std::int64_t b, const auto&) {
    for (std::int64_t i = b * data.lanes; i < std::min((b + 1) * data.lanes, data.size); ++i) {
      if (given.first_wrong(i) == given.width) continue;
      for (std::int64_t before = first; i < before && !first.compare_exchange_weak(before, i);) {}
      return;
    }
  });
  if (first == data.size) return;
  const Index column = given.first_wrong(first);
  throw InputError(fmt::format("instance {}: the {}{} is {}; expected a finite number{}; nothing was stepped", first.load(), given.of_one,
                               given.name(column), given.row(first)[static_cast<std::size_t>(column)],
                               given.not_negative ? ", zero or more" : ""));
}

/// Row by row into lanes.
template <class Real>
void spread(const GivenRows<Real>& given, const BatchView<Real>& to, std::int64_t block, int count) {
  const auto lanes = static_cast<std::size_t>(to.lanes()), width = static_cast<std::size_t>(given.width);
  Real* const rows = to.flat().data() + static_cast<std::size_t>(block) * width * lanes;
  for (std::size_t l = 0; l < static_cast<std::size_t>(count); ++l) {
    const Real* const from = given.row(block * to.lanes() + static_cast<std::int64_t>(l)).data();
    for (std::size_t k = 0; k < width; ++k) rows[k * lanes + l] = from[k];
  }
}

}  // namespace

template <class Real>
void BatchOf<Real>::Data::check_observations(const Observations& observations, std::size_t room) const {
  const ObservationSchedule& schedule = *observations.schedule();
  require_same_model(schedule, *model, model_hash);
  if (schedule.targets) require_same_servos(schedule, plan.effects.servos.size());
  const std::size_t expected = static_cast<std::size_t>(size) * static_cast<std::size_t>(observations.width());
  if (room != expected) {
    throw InputError(fmt::format("observations of {} instances: room for {} numbers given, expected {} x {} = {}", size, room, size,
                                 observations.width(), expected));
  }
  if (!schedule.accelerations) return;
  const char* const why = std::is_same_v<Real, float> ? "in single precision it keeps too little of its last steps"
                          : options.order != 2        ? "above order 2 its sub-steps differ in length"
                                                      : nullptr;
  if (why != nullptr) throw InputError(fmt::format("accelerations were asked of a batch: {}; leave them out, or ask a Simulation", why));
}

template <class Real>
template <class Number>
void BatchOf<Real>::Data::observe(const Observations& observations, std::span<Number> to, std::int64_t b, Worker& mine, bool stepped) {
  if (!mine.observer || mine.observer->schedule() != observations.schedule().get()) {
    const BlockSetup<Real> setup{*model, constants, options, plan, holds_factor()};
    mine.observer = std::make_unique<BatchObserver<Real>>(observations.schedule(), setup, instructions);
  }
  const Block<Real> here = block(b);
  const std::span<const Real> rows = mine.observer->observe(here, *mine.block, stepped);
  const auto width = static_cast<std::size_t>(observations.width()), stride = static_cast<std::size_t>(lanes);
  for (int l = 0; l < here.count; ++l) {
    Number* const row = to.data() + static_cast<std::size_t>(b * lanes + l) * width;
    for (std::size_t k = 0; k < width; ++k) row[k] = static_cast<Number>(rows[k * stride + static_cast<std::size_t>(l)]);
  }
}

template <class Real>
template <class Number>
void BatchOf<Real>::Data::observe(const Observations& observations, std::span<Number> to) {
  check_observations(observations, to.size());
  for_blocks([&](std::int64_t b, Worker& mine) { observe(observations, to, b, mine, false); });
}

template <class Real>
void BatchOf<Real>::step(std::int64_t n) {
  data_->require_starts();
  data_->for_blocks([&](std::int64_t b, typename Data::Worker& worker) { worker.block->step(data_->block(b), n); });
}

template <class Real>
void BatchOf<Real>::step(std::int64_t n, const BatchRows<Real>& rows) {
  data_->require_starts();
  const std::vector<Servo>& servos = data_->plan.effects.servos;
  const std::vector<JointFriction>& frictions = data_->plan.effects.friction;
  const auto joint = [&](Index row) { return quoted(model().names.velocity[static_cast<std::size_t>(row)]); };
  const auto of_servo = [&](Index k) { return joint(servos[static_cast<std::size_t>(k)].row); };
  std::vector<GivenRows<Real>> given{
      {"targets", "target of the servo of joint ", "servo", rows.targets, Data::count_of(servos), false, of_servo,
       [&](Index k) { return servos[static_cast<std::size_t>(k)].target_moves(); }, [&] { return servo_targets(); }},
      {"forces", "force on joint ", "joint that moves", rows.forces, data_->shape().velocities, false, joint, {}, [&] { return forces(); }},
      {"gains", "factor of the gains of the servo of joint ", "servo", rows.gains, Data::count_of(servos), true, of_servo, {},
       [&] { return gains(); }},
      {"forces of friction", "friction of joint ", "joint friction", rows.friction, Data::count_of(frictions), true,
       [&](Index k) { return joint(frictions[static_cast<std::size_t>(k)].row); }, {}, [&] { return friction(); }},
      {"coefficients of friction", "friction of the ground", "ground", rows.ground_friction, data_->plan.effects.ground ? 1 : 0, true,
       [](Index) { return ""; }, {}, [&] { return ground_friction(); }},
      {"gravity", "gravity along ", "gravity", rows.gravity, 3, false, [](Index k) { return std::string(1, "xyz"[k]); }, {},
       [&] { return gravity(); }}};
  std::erase_if(given, [](const GivenRows<Real>& one) { return one.numbers.empty(); });
  for (const GivenRows<Real>& one : given) require_count(one, size());
  const std::size_t room = std::visit([](auto to) { return to.size(); }, rows.observed);
  if (rows.observations != nullptr) {
    data_->check_observations(*rows.observations, room);
  } else if (room != 0) {
    throw InputError(fmt::format("room for {} observed numbers given and no observations; expected both or neither", room));
  }
  for (const GivenRows<Real>& one : given) require_sensible(*data_, one);

  std::vector<BatchView<Real>> views;
  for (const GivenRows<Real>& one : given) views.push_back(one.view());
  data_->for_blocks([&](std::int64_t b, typename Data::Worker& worker) {
    const Block<Real> block = data_->block(b);
    for (std::size_t k = 0; k < given.size(); ++k) spread(given[k], views[k], b, block.count);
    worker.block->step(block, n);
    if (rows.observations == nullptr) return;
    std::visit([&](auto to) { data_->observe(*rows.observations, to, b, worker, true); }, rows.observed);
  });
}

template <class Real>
typename BatchOf<Real>::Observation BatchOf<Real>::observe() const {
  const Index nv = data_->shape().velocities;
  Observation seen{std::vector<Real>(data_->p.size()), std::vector<Real>(data_->at(data_->blocks, 2)), nv, lanes(), size()};
  data_->for_blocks([&](std::int64_t b, typename Data::Worker& worker) {
    worker.block->observe(data_->block(b), seen.velocity_numbers.data() + data_->at(b, nv), seen.energy_numbers.data() + data_->at(b, 2),
                          false);
  });
  return seen;
}

template <class Real>
void BatchOf<Real>::observe(const Observations& observations, std::span<double> to) const {
  data_->observe(observations, to);
}
template <class Real>
void BatchOf<Real>::observe(const Observations& observations, std::span<float> to) const {
  data_->observe(observations, to);
}

template void BatchOf<double>::step(std::int64_t);
template void BatchOf<double>::step(std::int64_t, const BatchRows<double>&);
template BatchOf<double>::Observation BatchOf<double>::observe() const;
template void BatchOf<double>::observe(const Observations&, std::span<double>) const;
template void BatchOf<double>::observe(const Observations&, std::span<float>) const;
template void BatchOf<float>::step(std::int64_t);
template void BatchOf<float>::step(std::int64_t, const BatchRows<float>&);
template BatchOf<float>::Observation BatchOf<float>::observe() const;
template void BatchOf<float>::observe(const Observations&, std::span<double>) const;
template void BatchOf<float>::observe(const Observations&, std::span<float>) const;

}  // namespace linden

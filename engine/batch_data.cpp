#include "engine/batch_data.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <thread>

#include "engine/compose/composition.hpp"
#include "engine/scene/load_model.hpp"
#include "engine/sweeps/body_contacts.hpp"
#include "engine/threads.hpp"
#include "layout/support/input_error.hpp"

namespace linden {
namespace {

template <class Real>
BodyConstants<Real> rounded(const BodyConstants<double>& from, const Shape& shape) {
  BodyConstants<Real> to;
  to.allocate(shape);
  const auto copy = [](const auto& source, auto& target) {
    std::ranges::transform(source.flat(), target.flat().begin(), [](double value) { return static_cast<Real>(value); });
  };
  copy(from.screw, to.screw);
  copy(from.tree_placement, to.tree_placement);
  copy(from.inertia, to.inertia);
  copy(from.subtree_mass, to.subtree_mass);
  return to;
}

template <class Real>
std::unique_ptr<BlockStepper<Real>> make(Instructions instructions, const BlockSetup<Real>& setup) {
  return with_or_without(setup.plan, [&](auto effects) {
    switch (instructions) {
#ifdef LINDEN_WIDE_LANES
      case Instructions::avx512: return make_block_stepper<Instructions::avx512, effects>(setup);
      case Instructions::avx2: return make_block_stepper<Instructions::avx2, effects>(setup);
#else
      case Instructions::baseline: return make_block_stepper<Instructions::baseline, effects>(setup);
#endif
      default: return make_block_stepper<Instructions::scalar, effects>(setup);
    }
  });
}
}  // namespace

template <class Real>
BatchOf<Real>::Data::Data(std::shared_ptr<const Model> shared, std::int64_t count, const Options& given, const Effects& effects,
                          const BatchOptions& computed)
    : model(std::move(shared)), model_hash(model->hash()), constants(rounded<Real>(model->constants, shape())), options(given), size(count),
      instructions(computed.instructions.value_or(best_instructions())), lanes(lanes_of<Real>(instructions)),
      threads(computed.threads > 0 ? computed.threads : std::max(1, static_cast<int>(std::thread::hardware_concurrency()))),
      hold_factors(computed.hold_factors),
      plan(*model, options, effects),
      arena(threads) {
  check_order(options.order, *model, effects);
  require_threads(threads);
  if (plan.pairs) {
    BodyContacts none(*plan.effects.contact, *model);
    no_contacts.assign(none.memory().begin(), none.memory().end());
  }
  first_child.assign(static_cast<std::size_t>(shape().slots) + 1, 0);
  for (Index slot = 1; slot < shape().slots; ++slot) ++first_child[static_cast<std::size_t>(model->tree.parent(slot)) + 1];
  std::partial_sum(first_child.begin(), first_child.end(), first_child.begin());
  child_list.resize(static_cast<std::size_t>(shape().slots) - 1);
  std::vector<Index> next = first_child;
  for (Index slot = 1; slot < shape().slots; ++slot) {
    child_list[static_cast<std::size_t>(next[static_cast<std::size_t>(model->tree.parent(slot))]++)] = slot;
  }
  blocks = (size + lanes - 1) / lanes;
  const auto rows = [&](Index count_of_rows) { return static_cast<std::size_t>(blocks) * static_cast<std::size_t>(count_of_rows * lanes); };
  const double numbers = shape().positions + (plan.any() ? 4.0 : 1.0) * shape().velocities + plan.kept();
  const double words = static_cast<double>(past_rows()) + (holds_factor() ? packed_factor_words(*model) : 0);
  const double each = numbers * sizeof(Real) + words * sizeof(std::uint32_t) + static_cast<double>(no_contacts.size()) * sizeof(double) + sizeof(InstanceRecord);
  require_memory(fmt::format("{} instances", size), each * static_cast<double>(size));
  q.resize(rows(shape().positions));
  p.resize(rows(shape().velocities));
  past.resize(rows(past_rows()));
  if (plan.any()) {
    excess_before.resize(rows(shape().velocities));
    reading.resize(rows(shape().velocities));
    bend.assign(rows(shape().velocities), Real(kAnyBend));
  }
  kept.resize(rows(plan.kept()));
  contacts.resize(rows(count_of(no_contacts)));
  for (std::int64_t i = 0; i < size; ++i) forget_contacts(i);
  if (holds_factor()) {
    factor.resize(rows(packed_factor_words(*model)));
    held.resize(rows(kHeldNumbers));
    for (std::int64_t i = 0; i < size; ++i) forget_factor(i);
  }
  records.resize(static_cast<std::size_t>(size));
  std::vector<double> neutral = model->neutral();
  if (!model->couplings.empty()) {
    plan.put_positions(0, neutral);
    neutral_start = assemble(*model, neutral, Assembled::if_nearly_closed, plan.effects.motions);
    if (!neutral_start.closed) has_start.assign(records.size(), 0);
  }
  for_blocks([&](std::int64_t b, Worker&) {
    Real* to = q.data() + at(b, shape().positions);
    for (const double value : neutral) {
      for (int l = 0; l < lanes; ++l) *to++ = static_cast<Real>(value);
    }
  });
}

template <class Real>
Index BatchOf<Real>::Data::past_rows() const {
  return static_cast<Index>(composition(options.order).size()) * shape().velocities * kHistoryWords<Real>;
}

template <class Real>
Block<Real> BatchOf<Real>::Data::block(std::int64_t b) {
  const Index nv = shape().velocities;
  const auto rows_of = [&](auto& numbers, Index count) { return numbers.empty() ? nullptr : numbers.data() + at(b, count); };
  return {.q = rows_of(q, shape().positions),
          .p = rows_of(p, nv),
          .past = rows_of(past, past_rows()),
          .factor = rows_of(factor, packed_factor_words(*model)),
          .held = rows_of(held, kHeldNumbers),
          .applied = rows_of(applied, nv),
          .mass = rows_of(mass, shape().slots * kMassRows),
          .gravity = rows_of(gravity, 3),
          .targets = rows_of(targets, count_of(plan.effects.servos)),
          .frictions = rows_of(frictions, count_of(plan.effects.friction)),
          .gains = rows_of(gains, count_of(plan.effects.servos)),
          .ground_friction = rows_of(ground_friction, 1),
          .excess_before = rows_of(excess_before, nv),
          .reading = rows_of(reading, nv),
          .bend = rows_of(bend, nv),
          .kept = rows_of(kept, plan.kept()),
          .contacts = rows_of(contacts, count_of(no_contacts)),
          .instances = records.data() + b * lanes,
          .count = static_cast<int>(std::min<std::int64_t>(lanes, size - b * lanes))};
}

template <class Real>
typename BatchOf<Real>::Data::Worker& BatchOf<Real>::Data::worker() const {
  Worker& mine = workers.local();
  if (!mine.block) {
    mine.block = make<Real>(instructions, {*model, constants, options, plan, holds_factor()});
    mine.instance = std::make_unique<InstanceStepper>(*model, options, plan);
  }
  return mine;
}

template <class Real>
void BatchOf<Real>::Data::forget_factor(std::int64_t i) {
  if (held.empty()) return;
  const HeldFactor<Real> none;
  const BatchView<Real> numbers(held, kHeldNumbers, lanes, size);
  for (Index k = 0; k < kHeldNumbers; ++k) numbers(i, k) = none.numbers()[static_cast<std::size_t>(k)];
}

template <class Real>
void BatchOf<Real>::Data::forget_contacts(std::int64_t i) {
  if (contacts.empty()) return;
  const BatchView<double> numbers(contacts, count_of(no_contacts), lanes, size);
  for (Index k = 0; k < numbers.rows(); ++k) numbers(i, k) = no_contacts[static_cast<std::size_t>(k)];
}

template <class Real>
BatchView<Real> BatchOf<Real>::Data::asked(Numbers<Real>& numbers) {
  Index rows = 0;
  each_asked(*this, [&](Numbers<Real>& one, Index count, const auto& own) {
    if (&one != &numbers) return;
    rows = count;
    if (one.empty()) fill(one, count, own);
  });
  return {numbers, rows, lanes, size};
}

template <class Real>
void BatchOf<Real>::Data::check_count(const char* what, std::size_t found, Index expected) const {
  if (found == static_cast<std::size_t>(expected)) return;
  throw InputError(fmt::format("{}: {} numbers given for model \"{}\", expected {}", what, found, model->names.model, expected));
}

template <class Real>
void BatchOf<Real>::Data::require_starts() const {
  const auto without = std::ranges::find(has_start, 0);
  if (without == has_start.end()) return;
  try {
    require_closed(neutral_start);
  } catch (const InputError& error) {
    throw InputError(fmt::format("instance {} has not been reset: {}", without - has_start.begin(), error.what()));
  }
}

template <class Real>
void BatchOf<Real>::Data::place(std::span<const double> positions, std::span<const double> velocities, InstanceStepper& alone) const {
  alone.forget();
  std::ranges::copy(positions, alone.state().q.flat().begin());
  plan.put_positions(0, alone.state().q.flat());
  normalise_positions(*model, alone.state().q.flat());
  for (std::size_t k = 0; k < velocities.size(); ++k) {
    if (!std::isfinite(velocities[k])) throw InputError(fmt::format("velocity \"{}\" is {}", model->names.velocity[k], velocities[k]));
  }
  require_closed(alone.close_nearly_closed());
}

template <class Real>
void BatchOf<Real>::Data::start(std::int64_t i, std::span<const double> positions, std::span<const double> velocities,
                                InstanceStepper& alone) {
  place(positions, velocities, alone);
  if (!mass.empty()) {
    Field<double, 10>& inertia = alone.own_constants().inertia;
    for (Index slot = 0; slot < inertia.rows(); ++slot) {
      for (int k = 0; k < 10; ++k) inertia(slot, k) = static_cast<double>(mass_row(i, slot)[k * lanes]);
    }
  }
  std::vector<double> rates(velocities.begin(), velocities.end());
  plan.put_velocities(0, rates);
  alone.set_velocities(rates);
  const BatchView<Real> to_q(q, shape().positions, lanes, size), to_p(p, shape().velocities, lanes, size);
  for (Index row = 0; row < shape().positions; ++row) to_q(i, row) = static_cast<Real>(alone.state().q(row));
  for (Index row = 0; row < shape().velocities; ++row) to_p(i, row) = static_cast<Real>(alone.state().p(row));
  const auto clear = [&](auto& numbers, Index count_of_rows, double to = 0) {
    using Number = typename std::remove_reference_t<decltype(numbers)>::value_type;
    const BatchView<Number> rows(numbers, count_of_rows, lanes, size);
    for (Index row = 0; !numbers.empty() && row < count_of_rows; ++row) rows(i, row) = static_cast<Number>(to);
  };
  clear(past, past_rows());
  clear(excess_before, shape().velocities);
  clear(reading, shape().velocities);
  clear(bend, shape().velocities, kAnyBend);
  clear(kept, plan.kept());
  forget_factor(i);
  forget_contacts(i);
  if (!has_start.empty()) has_start[static_cast<std::size_t>(i)] = 1;
  records[static_cast<std::size_t>(i)] = {};
}

template struct BatchOf<double>::Data;
template struct BatchOf<float>::Data;

}  // namespace linden

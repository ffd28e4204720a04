// engine/batch_data.hpp
// What a Batch holds and works with, for the files that implement it.
#pragma once

#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <memory>
#include <span>
#include <vector>

#include "engine/assembly.hpp"
#include "engine/batch.hpp"
#include "engine/effects/effect_plan.hpp"
#include "engine/effects/own_numbers.hpp"
#include "engine/queries/batch_observer.hpp"
#include "engine/solve/block_stepper.hpp"
#include "engine/solve/held_factor.hpp"
#include "engine/solve/instance_stepper.hpp"
#include "layout/packed_factor.hpp"
#include "layout/packed_history.hpp"

namespace linden {

template <class Real>
struct BatchOf<Real>::Data {
  template <class T>
  using Numbers = std::vector<T, AlignedAllocator<T>>;
  /// What a thread works with.
  struct Worker {
    std::unique_ptr<BlockStepper<Real>> block;
    std::unique_ptr<InstanceStepper> instance;
    std::unique_ptr<BatchObserver<Real>> observer;  // for the observations that were asked for last
  };

  std::shared_ptr<const Model> model;
  std::uint64_t model_hash;  // takes as long as some steps of an instance
  BodyConstants<Real> constants;
  Options options;
  std::int64_t size, blocks;
  Instructions instructions;
  int lanes;
  int threads;
  bool hold_factors;
  EffectPlan plan;
  Numbers<Real> q, p, held, applied, mass, gravity, targets, gains, frictions, ground_friction, excess_before, reading, bend, kept;
  Numbers<std::uint32_t> past, factor;
  Numbers<double> contacts;             // what bodies that touch each other remember, in double precision always
  std::vector<double> no_contacts;      // the same of an instance at its start; empty where none can touch
  std::vector<Index> first_child, child_list;  // see children
  std::vector<InstanceRecord> records;
  Assembly neutral_start;               // of the zero configuration
  std::vector<std::uint8_t> has_start;  // of each instance, where the zero configuration is open; else empty
  mutable oneapi::tbb::task_arena arena;
  mutable oneapi::tbb::enumerable_thread_specific<Worker> workers;

  Data(std::shared_ptr<const Model> shared, std::int64_t count, const Options& given, const Effects& effects, const BatchOptions& computed);

  static Index count_of(const auto& entries) { return static_cast<Index>(entries.size()); }
  const Shape& shape() const { return model->tree.shape; }
  std::size_t at(std::int64_t block, Index rows) const { return static_cast<std::size_t>(block) * static_cast<std::size_t>(rows * lanes); }

  /// Whether the factor of a step serves those that follow.
  bool holds_factor() const { return hold_factors && options.order == 2 && !plan.has_states && model->couplings.empty(); }
  /// Words of an instance's displacements: of every sub-step its own.
  Index past_rows() const;
  static constexpr Index kHeldNumbers = HeldFactor<Real>::kNumbers;
  /// The next step of instance i makes one of its own.
  void forget_factor(std::int64_t i);
  /// Instance i touched nothing so far.
  void forget_contacts(std::int64_t i);
  Block<Real> block(std::int64_t b);
  Worker& worker() const;  // of the thread that asks

  /// work(k, worker) for every k below `count`, on all threads.
  template <class Work>
  void for_each(std::int64_t count, const Work& work) const {
    arena.execute([&] {
      oneapi::tbb::parallel_for(std::int64_t{0}, count, [&](std::int64_t k) { work(k, worker()); });
    });
  }
  /// work(block, worker) for every block.
  template <class Work>
  void for_blocks(const Work& work) const {
    for_each(blocks, work);
  }

  /// visit(numbers, rows) of all that is kept of the instances, in the order of a checkpoint.
  template <class Self, class Visit>
  static void each(Self& self, const Visit& visit) {
    const Index nv = self.shape().velocities;
    visit(self.q, self.shape().positions);
    visit(self.p, nv);
    visit(self.past, self.past_rows());
    visit(self.excess_before, nv);
    visit(self.reading, nv);
    visit(self.bend, nv);
    visit(self.kept, self.plan.kept());
    visit(self.contacts, count_of(self.no_contacts));
    visit(self.factor, packed_factor_words(*self.model));
    visit(self.held, kHeldNumbers);
    each_asked(self, [&](auto& numbers, Index rows, const auto&) { visit(numbers, rows); });
  }
  /// visit(numbers, rows, own) of what has no memory until it is asked for; own(row): what it holds at first.
  template <class Self, class Visit>
  static void each_asked(Self& self, const Visit& visit) {
    const Effects& effects = self.plan.effects;
    visit(self.applied, self.shape().velocities, [](std::size_t) { return 0.0; });
    visit(self.mass, self.shape().slots * kMassRows, [&](std::size_t row) {
      const auto slot = static_cast<Index>(row) / kMassRows;
      const int k = static_cast<int>(row) % kMassRows;
      return static_cast<double>(k < 10 ? self.constants.inertia(slot, k) : self.constants.subtree_mass(slot));
    });
    visit(self.gravity, 3, [&](std::size_t k) { return self.options.gravity[k]; });
    visit(self.targets, count_of(effects.servos), [&](std::size_t k) { return own_target(effects.servos[k]); });
    visit(self.gains, count_of(effects.servos), [](std::size_t) { return 1.0; });
    visit(self.frictions, count_of(effects.friction), [&](std::size_t k) { return effects.friction[k].force; });
    visit(self.ground_friction, effects.ground ? 1 : 0, [&](std::size_t) { return effects.ground->friction; });
  }
  /// The rows of one of these, which has memory from now on.
  BatchView<Real> asked(Numbers<Real>& numbers);
  /// Makes room for them, or puts them where they were at first.
  template <class Own>
  void fill(Numbers<Real>& numbers, Index rows, const Own& own) {
    numbers.resize(at(blocks, rows));
    for_blocks([&](std::int64_t b, Worker&) {
      Real* to = numbers.data() + at(b, rows);
      for (std::size_t row = 0; row < static_cast<std::size_t>(rows); ++row) {
        for (int l = 0; l < lanes; ++l) *to++ = static_cast<Real>(own(row));
      }
    });
  }

  void check_observations(const Observations& observations, std::size_t room) const;
  /// Row i of `to` is what is seen of instance i.
  template <class Number>
  void observe(const Observations& observations, std::span<Number> to);
  /// The rows of block b; stepped: as BlockStepper::observe has it.
  template <class Number>
  void observe(const Observations& observations, std::span<Number> to, std::int64_t b, Worker& mine, bool stepped);

  /// Bodies that hang on one.
  std::span<const Index> children(Index slot) const {
    const auto k = static_cast<std::size_t>(slot);
    return std::span(child_list).subspan(static_cast<std::size_t>(first_child[k]), static_cast<std::size_t>(first_child[k + 1] - first_child[k]));
  }

  Real* mass_row(std::int64_t i, Index slot) {
    return mass.data() + at(i / lanes, shape().slots * kMassRows) + static_cast<std::size_t>(slot * kMassRows * lanes + i % lanes);
  }

  void check_instance(std::int64_t i) const { require_one_of("instance", i, 0, size - 1); }
  void check_count(const char* what, std::size_t found, Index expected) const;
  void check_body(Index slot) const { require_one_of("body", slot, 1, model->tree.bodies()); }

  /// Positions into `alone`, as they are kept. Throws InputError for positions or velocities that make no sense.
  /// Throws InputError for an instance whose couplings are open.
  void require_starts() const;
  void place(std::span<const double> positions, std::span<const double> velocities, InstanceStepper& alone) const;
  void start(std::int64_t i, std::span<const double> positions, std::span<const double> velocities, InstanceStepper& alone);
};

}  // namespace linden

// engine/queries/batch_observer.hpp
// What a thread of a batch needs to observe its blocks: an observer of lanes for one schedule, and room for what it reads and writes.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "engine/effects/effect_plan.hpp"
#include "engine/queries/block_observer.hpp"
#include "engine/solve/block_stepper.hpp"

namespace linden {

template <class Real>
class BatchObserver {
 public:
  /// Model, constants, options and plan must outlive it.
  BatchObserver(std::shared_ptr<const ObservationSchedule> schedule, const BlockSetup<Real>& setup, Instructions instructions);

  const ObservationSchedule* schedule() const { return schedule_.get(); }
  /// Rows [width][lane] of a block, which last until the next. `stepper` reads its velocities; stepped: as BlockStepper::observe has it.
  std::span<const Real> observe(const Block<Real>& block, BlockStepper<Real>& stepper, bool stepped);

 private:
  void read_accelerations(const Block<Real>& block);
  void read_targets(const Block<Real>& block);

  std::shared_ptr<const ObservationSchedule> schedule_;
  BlockSetup<Real> setup_;
  int lanes_;
  std::unique_ptr<BlockObserver<Real>> observer_;
  std::vector<Real> v_, a_, targets_, time_, energy_, rows_;
};

}  // namespace linden

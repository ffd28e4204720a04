#include "engine/queries/batch_observer.hpp"

#include <algorithm>
#include <cmath>

#include "layout/packed_history.hpp"

namespace linden {

template <class Real>
BatchObserver<Real>::BatchObserver(std::shared_ptr<const ObservationSchedule> schedule, const BlockSetup<Real>& setup,
                                   Instructions instructions)
    : schedule_(std::move(schedule)),
      setup_(setup),
      lanes_(lanes_of<Real>(instructions)),
      observer_(
          make_block_observer(instructions, ObserverSetup<Real>{setup.model.tree, setup.constants, *schedule_, setup.options.gravity})) {
  const auto room = [&](bool asked, Index rows) { return asked ? static_cast<std::size_t>(rows * lanes_) : 0; };
  const Index nv = setup.model.tree.shape.velocities;
  v_.resize(room(schedule_->velocities || schedule_->energy, nv));  // kinetic energy is that of the velocities
  energy_.resize(room(schedule_->energy, 2));
  a_.resize(room(schedule_->accelerations, nv));
  targets_.resize(room(schedule_->targets, static_cast<Index>(setup.plan.effects.servos.size())));
  time_.resize(room(true, 1));
  rows_.resize(room(true, schedule_->width));
}

/// The difference of the last two displacements over the square of the step, where both are known.
template <class Real>
void BatchObserver<Real>::read_accelerations(const Block<Real>& block) {
  const int words = kHistoryWords<Real> * lanes_;
  const double rate = 1 / setup_.options.step;
  for (std::size_t k = 0; k < a_.size(); ++k) {
    const auto row = static_cast<Index>(k) / lanes_, l = static_cast<Index>(k) % lanes_;
    const bool known = l < block.count && block.instances[l].displacements > 1;
    a_[k] = known ? static_cast<Real>(rate * (rate * static_cast<double>(fine_part(block.past[row * words + lanes_ + l])))) : Real(0);
  }
}

template <class Real>
void BatchObserver<Real>::read_targets(const Block<Real>& block) {
  for (std::size_t k = 0; k < targets_.size(); ++k) {
    const Servo& servo = setup_.plan.effects.servos[k / static_cast<std::size_t>(lanes_)];
    const Real given = block.targets != nullptr ? block.targets[k] : static_cast<Real>(std::nan(""));
    targets_[k] =
        std::isnan(given) ? static_cast<Real>(servo.target_at(static_cast<double>(time_[k % static_cast<std::size_t>(lanes_)]))) : given;
  }
}

template <class Real>
std::span<const Real> BatchObserver<Real>::observe(const Block<Real>& block, BlockStepper<Real>& stepper, bool stepped) {
  for (int l = 0; l < block.count; ++l) {
    time_[static_cast<std::size_t>(l)] = static_cast<Real>(static_cast<double>(block.instances[l].steps) * setup_.options.step);
  }
  if (!v_.empty()) stepper.observe(block, v_.data(), schedule_->energy ? energy_.data() : nullptr, stepped);
  if (schedule_->accelerations) read_accelerations(block);
  if (schedule_->targets) read_targets(block);
  observer_->observe({.q = block.q,
                      .v = v_.data(),
                      .a = a_.data(),
                      .p = block.p,
                      .targets = targets_.data(),
                      .time = time_.data(),
                      .energy = energy_.data(),
                      .mass = block.mass,
                      .contacts = block.contacts,
                      .gravity = block.gravity},
                     rows_.data());
  return rows_;
}

template class BatchObserver<double>;
template class BatchObserver<float>;

}  // namespace linden

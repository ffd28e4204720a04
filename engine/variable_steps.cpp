#include "engine/variable_steps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "engine/compose/composition.hpp"
#include "engine/effects/effect_plan.hpp"
#include "engine/interpolation.hpp"
#include "engine/solve/stepper.hpp"
#include "layout/support/input_error.hpp"

namespace linden {
namespace {

/// A node so near a time is at it: of its step.
constexpr double kAt = 1e-9;

constexpr double kMostAtOnce = 1e15;  // steps

/// The first step may be longer than its own density asks for by this much, and is tried so many times.
constexpr double kFirstOff = 1.25;
constexpr int kFirstTrials = 8;

/// Before a stretch of so many steps ends it is divided evenly.
constexpr double kEvenly = 8;

/// Whether nothing that acts takes or gives energy.
bool keeps_energy(const Model& model, const Effects& effects) {
  return irreversible(effects).empty() && std::ranges::none_of(model.couplings, [](const Coupling& one) { return damps(one); });
}

/// What strikes from one step to the next, by name: nobody sees it coming.
std::string impacts(const Effects& effects) {
  std::vector<std::string> found;
  if (!effects.limits.empty()) found.push_back("limits");
  if (effects.ground) found.push_back("ground");
  if (effects.contact) found.push_back("contact");
  return fmt::format("{}", fmt::join(found, " and "));
}

}  // namespace

std::vector<double> knots_of(const Effects& effects) {
  std::vector<double> knots;
  const auto add = [&](const TimeTable& table) {
    if (table.times.size() > 1) knots.insert(knots.end(), table.times.begin(), table.times.end());
  };
  for (const Servo& servo : effects.servos) {
    add(servo.target_over_time);
    add(servo.target_velocity);
    add(servo.feedforward);
  }
  for (const JointTorque& torque : effects.torques) add(torque.force);
  for (const BodyWrench& wrench : effects.wrenches) add(wrench.scale);
  for (const JointMotion& motion : effects.motions) add(motion.position);
  std::ranges::sort(knots);
  knots.erase(std::unique(knots.begin(), knots.end()), knots.end());
  return knots;
}

Simulation::Varying::Varying(const Model& model, const Options& options, const Effects& effects)
    : choice(options, keeps_energy(model, effects)), landings(knots_of(effects)) {
  if (const std::string strikes = impacts(effects); !strikes.empty()) {
    throw InputError(fmt::format("an accuracy of {:g} is asked for, and steps that vary with the motion do not see impacts coming; the scene has "
                                 "{}: name a step, which all then are, or leave the accuracy out",
                                 *options.accuracy, strikes));
  }
  twists.allocate(model.tree.shape.slots);
  before.allocate(model.tree.shape.slots);
}

void Simulation::Varying::begin() {
  choice.begin();
  apart = 0;
}

std::optional<StepLengths> Simulation::step_lengths() const {
  if (!varying_) return std::nullopt;
  return varying_->choice.report();
}

/// The next time at which inputs jump or bend; infinite where there is none.
double Simulation::next_landing() const {
  const auto next = std::ranges::upper_bound(varying_->landings, time() + kAt * last_step());
  return next == varying_->landings.end() ? std::numeric_limits<double>::infinity() : *next;
}

/// Of the step to come: as the law says, and so that one of the next steps lands where inputs jump, none before it being tiny.
double Simulation::next_length() const {
  const double wish = varying_->choice.next(last_step_), left = next_landing() - time();
  return left < kEvenly * wish ? left / std::ceil(left / wish - kAt) : wish;
}

StepReport Simulation::variable_step() {
  if (varying_->choice.law().steps > 0) return step_halved_until_taken(next_length());
  // The first: what accelerations there are it finds out itself, and is taken again where it was far too long for them.
  look_at_energy(energy());
  stepper_->read_velocity(state_, rate_);
  stepper_->twists_of(rate_, varying_->twists);
  const std::string begin = checkpoint();
  double h = next_length();
  for (int trial = 0;; ++trial) {
    const StepReport report = step_halved_until_taken(h);
    const double wish = varying_->choice.wish();
    if (!report.ok() || last_step_ <= kFirstOff * wish || trial == kFirstTrials) return report;
    restore(begin);
    h = wish;
  }
}

/// One that fails is taken again at half the length.
StepReport Simulation::step_halved_until_taken(double h) {
  StepReport failed;
  const double landing = next_landing();
  for (int halved = 0;; ++halved) {
    if (stage_guess_ && last_step_ > 0 && h != last_step_) stage_guess_->change_length(h / last_step_);
    StepReport report = step_of(h, Then::stop);
    failed.add(report);
    if (report.ok()) {
      measure(h);
      const double end = time() + h;
      clock_ = std::abs(landing - end) <= kAt * h ? landing : end;
      last_step_ = h;
      return failed;
    }
    if (halved == options_.max_splits) return failed;
    failed.residual = 0;
    varying_->choice.count_retaken();
    h /= 2;
  }
}

/// How fast things happen, from the step of h that was just taken.
void Simulation::measure(double h) {
  Varying& now = *varying_;
  std::swap(now.twists, now.before);
  if (stage_guess_) {
    now.energy = energy();
    stepper_->twists_of(rate_, now.twists);
    now.apart = h;
  } else {
    stepper_->mean_twists(state_, now.twists);
    // the first has the velocities of the start before it
    now.apart = now.choice.law().steps == 0 ? h / 2 : (h + last_step_) / 2;
  }
  now.choice.add(h, model_->constants, now.before, now.twists, now.apart);
}

/// Of forces that are set from outside nobody keeps an account.
void Simulation::look_at_energy(const Energy& now) {
  if (!applied_.empty()) return;
  varying_->choice.steer(now.total() + effect_work_.taken() - effect_work_.given(), now.kinetic);
}

StepsReport Simulation::advance_to(double t) {
  if (!std::isfinite(t)) throw InputError(fmt::format("steps to {} s were asked for; expected a finite time", t));
  StepsReport report;
  const auto is_there = [&](double at) { return at >= t - kAt * last_step(); };
  if (!varying_) {
    // many at once, but for the one that gets there
    const double before = std::min(std::ceil((t - time()) / options_.step - kAt) - 1, kMostAtOnce);
    if (before >= 1) report.add(run(static_cast<std::int64_t>(before)));
  }
  while (report.ok() && !is_there(time())) {
    const bool may_get_there = !varying_ || varying_->choice.law().steps == 0 || is_there(time() + next_length());
    if (may_get_there) {
      std::vector<double> rates = velocities();
      step_from_ = std::make_unique<LastStep>(LastStep{steps_, time(), {positions().begin(), positions().end()}, std::move(rates)});
    }
    report.add(take_step(Then::stop));
  }
  return report;
}

std::vector<double> Simulation::positions_at(double t) {
  const bool known = step_from_ && step_from_->steps + 1 == steps_;
  const double begin = known ? step_from_->time : time(), slack = kAt * last_step();
  if (!(t >= begin - slack && t <= time() + slack)) {
    throw InputError(fmt::format("positions at {:.9g} s were asked for; expected a time from {:.9g} to {:.9g} s, within the last step of "
                                 "advance_to",
                                 t, begin, time()));
  }
  if (t >= time() || !known) return {positions().begin(), positions().end()};
  const std::vector<double> end = velocities();
  const double h = time() - begin;
  return positions_between(*model_, {step_from_->positions, step_from_->velocities, positions(), end, h}, std::max(0.0, t - begin) / h);
}

}  // namespace linden

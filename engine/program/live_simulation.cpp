#include "engine/program/live_simulation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>

#include "layout/support/input_error.hpp"

namespace linden {
namespace {

using namespace std::chrono_literals;

constexpr auto kMostMissed = 100ms;     // of the clock, that is still made up for
constexpr auto kMeasured = 500ms;       // over which a pace is measured
constexpr auto kLookAtSignals = 50ms;
constexpr std::size_t kMostLetters = 1024;

double seconds_of(LiveSimulation::Clock::duration time) { return std::chrono::duration<double>(time).count(); }
LiveSimulation::Clock::duration duration_of(double seconds) {
  return std::chrono::duration_cast<LiveSimulation::Clock::duration>(std::chrono::duration<double>(seconds));
}

std::string session_name() {
  std::random_device random;
  return fmt::format("{:08x}{:08x}", random(), random());
}

/// What a slider may ask of a servo: the joint's limits, else half a turn or half a metre to either side of where it begins.
LiveServo live_servo(const Simulation& simulation, std::size_t k, const std::string& name, double target) {
  const Model& model = simulation.model();
  const Index row = simulation.effects().servos[k].row;
  Index slot = 1;
  while (slot + 1 < model.tree.shape.slots && model.tree.first_v(slot + 1) <= row) ++slot;
  const bool turns = model.constants.screw(slot, 0) != 0;
  double least = model.attributes.lower(row), most = model.attributes.upper(row);
  for (const JointLimit& limit : simulation.effects().limits) {
    if (limit.row != row) continue;
    least = std::max(least, limit.lower);
    most = std::min(most, limit.upper);
  }
  const double usual = turns ? std::numbers::pi : 0.5;
  if (!std::isfinite(least)) least = std::isfinite(most) ? most - 2 * usual : target - usual;
  if (!std::isfinite(most)) most = least + 2 * usual;
  return {name, turns ? "rad" : "m", std::min(least, target), std::max(most, target)};
}

/// Places where the ground can push at once, at most.
std::size_t most_forces(const Effects& effects) {
  constexpr std::size_t kMost = 4096;  // that a page draws
  if (!effects.ground) return 0;
  const Contacts& contacts = effects.ground->contacts;
  return std::min(kMost, 3 * contacts.spheres.size() + 6 * contacts.rims.size() + 6 * contacts.blocks.size());
}

/// Targets as they stand in the effects: a servo that follows a table goes on with it.
std::vector<double> own_targets(const Effects& effects) {
  std::vector<double> targets;
  for (const Servo& servo : effects.servos) targets.push_back(servo.target_moves() ? std::nan("") : servo.target);
  return targets;
}

LiveFacts facts_of(Simulation& simulation) {
  LiveFacts facts;
  facts.session = session_name();
  facts.step = simulation.options().step;
  facts.most_forces = most_forces(simulation.effects());
  facts.weight = 9.81 * simulation.model().constants.subtree_mass(0);
  const std::vector<double> targets = simulation.servo_targets();
  const std::vector<std::string> names = simulation.servo_names();
  for (std::size_t k = 0; k < names.size(); ++k) facts.servos.push_back(live_servo(simulation, k, names[k], targets[k]));
  return facts;
}

}  // namespace

bool LiveInbox::put(const Letter& letter) {
  {
    const std::lock_guard lock(mutex_);
    if (letter.what == LiveEvent::What::said && letters_.size() >= kMostLetters) return false;
    letters_.push_back(letter);
  }
  arrived_.notify_one();
  return true;
}

std::vector<LiveInbox::Letter> LiveInbox::take(std::chrono::nanoseconds patience) {
  std::unique_lock lock(mutex_);
  if (patience > 0ns) arrived_.wait_for(lock, patience, [&] { return !letters_.empty(); });
  return std::exchange(letters_, {});
}

LiveSimulation::LiveSimulation(Simulation& simulation, Animator& animator, double fps)
    : simulation_(simulation),
      animator_(animator),
      facts_(facts_of(simulation)),
      start_(simulation.checkpoint()),
      between_frames_(duration_of(std::max(1 / fps, 1e-3))),
      pulls_(simulation),
      targets_(own_targets(simulation.effects())) {}

void LiveSimulation::hear(const LiveEvent& event, const LiveOutlet& outlet) {
  LiveInbox::Letter letter{event.what, event.watcher, {}};
  try {
    if (event.what == LiveEvent::What::said) {
      letter.command = live_command(event.text, animator_.animation().bodies.size(), facts_.servos.size());
    }
    if (!inbox_.put(letter)) throw InputError("commands come faster than the simulation steps; send fewer");
  } catch (const InputError& error) {
    outlet.answer(event.watcher, live_error(error.what()));
  }
}

void LiveSimulation::run(const LiveOutlet& outlet, const Interrupt& interrupt) {
  while (interrupt.signal() == 0) {
    for (const LiveInbox::Letter& letter : inbox_.take(patience(Clock::now()))) obey(letter);
    advance(Clock::now(), outlet);
    publish(Clock::now(), outlet);
  }
}

/// How long there is nothing to do, unless somebody says something.
LiveSimulation::Clock::duration LiveSimulation::patience(Clock::time_point now) const {
  if (asked_ > 0) return 0ns;
  Clock::duration wait = kLookAtSignals;
  if (frame_due_ || status_due_) wait = std::min(wait, last_frame_ + between_frames_ - now);
  if (state_ == State::running) {
    const auto next = clock_begin_ + duration_of(static_cast<double>(simulation_.steps() + 1 - clock_steps_) * facts_.step / speed_);
    wait = std::min(wait, std::max(next, last_frame_ + between_frames_) - now);
  }
  return wait;
}

void LiveSimulation::obey(const LiveInbox::Letter& letter) {
  switch (letter.what) {
    case LiveEvent::What::joined:
      watchers_.insert(letter.watcher);
      if (!std::exchange(begun_, true)) set_state(State::running);
      break;
    case LiveEvent::What::left:
      watchers_.erase(letter.watcher);
      pulls_.release(letter.watcher);
      break;
    case LiveEvent::What::said: obey(letter.watcher, letter.command); break;
  }
  frame_due_ = status_due_ = true;
}

void LiveSimulation::obey(std::uint64_t watcher, const LiveCommand& command) {
  using Do = LiveCommand::Do;
  begun_ = true;
  switch (command.what) {
    case Do::run: set_state(State::running); break;
    case Do::pause: set_state(State::paused); break;
    case Do::step:
      set_state(State::paused);
      asked_ += command.number;
      break;
    case Do::reset: reset(); break;
    case Do::speed:
      speed_ = command.value;
      start_clock();
      break;
    case Do::target:
      targets_[static_cast<std::size_t>(command.number)] = command.value;
      simulation_.set_servo_targets(targets_);
      break;
    case Do::pull: pulls_.set(watcher, {static_cast<Index>(command.number + 1), command.point, command.to}); break;
    case Do::release: pulls_.release(watcher); break;
  }
}

void LiveSimulation::reset() {
  pulls_.release_all();
  simulation_.restore(start_, "the start");
  targets_ = own_targets(simulation_.effects());
  pulls_.apply();
  ++episode_;
  asked_ = 0;
  set_state(state_ == State::running ? State::running : State::paused);
}

void LiveSimulation::set_state(State state) {
  state_ = state;
  if (state != State::failed) message_.clear();
  if (state != State::paused) asked_ = 0;
  start_clock();
}

void LiveSimulation::start_clock() {
  clock_begin_ = measured_ = Clock::now();
  clock_steps_ = measured_steps_ = simulation_.steps();
  pace_ = -1;
  slow_ = let_go_ = false;
}

std::int64_t LiveSimulation::due(Clock::time_point now) {
  if (state_ != State::running) return asked_;
  const auto steps_in = [&](Clock::duration time) { return seconds_of(time) * speed_ / facts_.step; };
  const auto taken = static_cast<double>(simulation_.steps() - clock_steps_);
  double wanted = std::floor(steps_in(now - clock_begin_) - taken);
  const double most = std::max(1.0, std::floor(steps_in(kMostMissed)));
  if (wanted > most) {
    let_go_ = true;
    clock_begin_ = now;
    clock_steps_ = simulation_.steps() - static_cast<std::int64_t>(most);
    wanted = most;
  }
  return static_cast<std::int64_t>(std::max(wanted, 0.0));
}

StepReport LiveSimulation::step(std::int64_t steps) {
  if (!pulls_.acts()) return simulation_.run(steps).last;
  StepReport report;
  for (std::int64_t k = 0; k < steps && report.ok(); ++k) {
    pulls_.apply();
    report = simulation_.step();
  }
  return report;
}

void LiveSimulation::advance(Clock::time_point now, const LiveOutlet& outlet) {
  // as many as fit between two frames
  for (const Clock::time_point end = now + between_frames_; now < end;) {
    const std::int64_t steps = std::min(due(now), at_once_);
    if (steps == 0) break;
    const std::int64_t before = simulation_.steps();
    const StepReport report = step(steps);
    const Clock::time_point then = Clock::now();
    if (then - now > 8ms) at_once_ = std::max<std::int64_t>(1, at_once_ / 2);
    if (then - now < 2ms && steps == at_once_) at_once_ = std::min<std::int64_t>(at_once_ * 2, 1 << 20);
    now = then;
    frame_due_ = true;
    asked_ -= std::min(asked_, simulation_.steps() - before);
    if (report.ok()) continue;
    message_ = simulation_.describe(report);
    set_state(State::failed);
    status_due_ = true;
    outlet.failure(message_);
    break;
  }
  if (state_ == State::running) measure(now);
}

void LiveSimulation::measure(Clock::time_point now) {
  if (now - measured_ < kMeasured) return;
  pace_ = static_cast<double>(simulation_.steps() - measured_steps_) * facts_.step / seconds_of(now - measured_);
  slow_ = let_go_ && pace_ < 0.95 * speed_;
  let_go_ = false;
  measured_ = now;
  measured_steps_ = simulation_.steps();
  status_due_ = true;
}

void LiveSimulation::publish(Clock::time_point now, const LiveOutlet& outlet) {
  if (now - last_frame_ < between_frames_ || !(frame_due_ || status_due_)) return;
  last_frame_ = now;
  if (std::exchange(status_due_, false)) outlet.status(status());
  if (!std::exchange(frame_due_, false) || watchers_.empty()) return;
  animator_.forget_frames();
  animator_.look();
  outlet.frame(live_frame(animator_.animation(), episode_, static_cast<std::uint32_t>(simulation_.steps()), pulls_.drawn()));
}

std::string LiveSimulation::status() {
  const char* const state = state_ == State::running ? "running" : state_ == State::paused ? "paused" : "failed";
  nlohmann::ordered_json json{{"is", "status"},
                              {"session", facts_.session},
                              {"state", state},
                              {"speed", speed_},
                              {"pace", nullptr},
                              {"slow", slow_},
                              {"targets", simulation_.servo_targets()},
                              {"watchers", watchers_.size()},
                              {"message", message_}};
  if (pace_ >= 0) json["pace"] = pace_;
  return json.dump(-1, ' ', true, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace linden

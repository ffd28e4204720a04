// engine/program/live_simulation.hpp
// A simulation that runs by the clock and is steered from outside.
//
//   clock      at speed 1 a second takes a second; frames go out 60 times in it, or --fps. Where steps take longer than that, time that was
//              missed is let go after a tenth of a second, and the status says at which pace it goes
//   commands   come from any thread, are looked at between steps, and take effect in the order in which they came
//   begin      waits for the first page, then runs
//   failure    a step that fails ends the run: pages are told why, the state is the last good one, and reset begins again
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "engine/program/animator.hpp"
#include "engine/program/interrupt.hpp"
#include "engine/program/live_server.hpp"
#include "engine/program/pull.hpp"
#include "engine/simulation.hpp"
#include "engine/view/live.hpp"

namespace linden {

/// What came from pages and was not looked at yet.
class LiveInbox {
 public:
  struct Letter {
    LiveEvent::What what;
    std::uint64_t watcher;
    LiveCommand command;
  };

  /// False where it is full: commands come faster than they are obeyed. That somebody came or went always has room.
  bool put(const Letter& letter);
  /// All of it; waits so long for the first.
  std::vector<Letter> take(std::chrono::nanoseconds patience);

 private:
  std::mutex mutex_;
  std::condition_variable arrived_;
  std::vector<Letter> letters_;
};

/// Where frames, status and refusals go.
struct LiveOutlet {
  std::function<void(std::string)> frame, status;
  std::function<void(std::uint64_t watcher, std::string)> answer;
  std::function<void(const std::string&)> failure;  // for the terminal
};

class LiveSimulation {
 public:
  using Clock = std::chrono::steady_clock;

  /// Both must outlive it; the state that the simulation is in is the start. fps [1/s].
  LiveSimulation(Simulation& simulation, Animator& animator, double fps);

  /// Header of the page.
  const LiveFacts& facts() const { return facts_; }

  /// From any thread: what a page has said or done. Commands that are none are answered at once.
  void hear(const LiveEvent& event, const LiveOutlet& outlet);

  /// Until a signal comes.
  void run(const LiveOutlet& outlet, const Interrupt& interrupt);

 private:
  enum class State : std::uint8_t { paused, running, failed };

  void obey(const LiveInbox::Letter& letter);
  void obey(std::uint64_t watcher, const LiveCommand& command);
  void reset();
  void set_state(State state);
  void start_clock();
  /// Steps that are to be taken now.
  std::int64_t due(Clock::time_point now);
  void advance(Clock::time_point now, const LiveOutlet& outlet);
  StepReport step(std::int64_t steps);
  void publish(Clock::time_point now, const LiveOutlet& outlet);
  void measure(Clock::time_point now);
  std::string status();
  Clock::duration patience(Clock::time_point now) const;

  Simulation& simulation_;
  Animator& animator_;
  LiveFacts facts_;
  std::string start_;  // checkpoint
  Clock::duration between_frames_;
  LiveInbox inbox_;
  Pulls pulls_;
  std::vector<double> targets_;  // of servos, NaN where a table has them
  std::set<std::uint64_t> watchers_;

  State state_ = State::paused;
  bool begun_ = false;
  std::string message_;
  double speed_ = 1;
  std::uint32_t episode_ = 0;
  std::int64_t asked_ = 0;     // steps that somebody who paused it wants taken
  std::int64_t at_once_ = 1;   // steps between two looks at the inbox

  Clock::time_point clock_begin_;   // when the simulation was, or should have been, at
  std::int64_t clock_steps_ = 0;    // these steps
  Clock::time_point measured_;      // since when
  std::int64_t measured_steps_ = 0; // and from where the pace is measured
  double pace_ = -1;                // [s/s]; below zero: not known
  bool let_go_ = false;             // of time, since then
  bool slow_ = false;

  bool frame_due_ = true, status_due_ = true;
  Clock::time_point last_frame_{}, last_status_{};
};

}  // namespace linden

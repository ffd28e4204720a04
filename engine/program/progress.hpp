// engine/program/progress.hpp
// A line on stderr that says how far a run is: only on a terminal, only for work longer than a second, erased at the end.
#pragma once

#include <chrono>
#include <cstdint>

namespace linden {

/// [s]
inline double seconds(std::chrono::steady_clock::duration time) { return std::chrono::duration<double>(time).count(); }

class Progress {
 public:
  using Clock = std::chrono::steady_clock;

  /// `steps` of `step` units each are ahead.
  Progress(std::int64_t steps, double step, const char* unit = "s");
  ~Progress() { erase(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Costs a comparison unless the line is due.
  void update(std::int64_t done, Clock::time_point now) {
    if (now >= due_) draw(done, now);
  }
  void erase();

 private:
  void draw(std::int64_t done, Clock::time_point now);

  std::int64_t steps_;
  double step_;
  const char* unit_;
  Clock::time_point begin_, due_;
  bool shown_ = false;
};

}  // namespace linden

// engine/distributed/stretches.hpp
// How far ranks step before they hear of each other: about a tenth of a second, the same number of steps for all, so that all end after the
// same step when a signal has come to one, or one has failed. Of several ranks what is told at the end of a stretch counts at the end of the
// next, so that none waits while another is a little behind.
#pragma once

#include <cstdint>

#include "engine/distributed/ranks.hpp"

namespace linden {

class Stretches {
 public:
  /// done: steps that were taken before.
  Stretches(Ranks& ranks, std::int64_t steps, std::int64_t done = 0);

  /// The step that all go up to next.
  std::int64_t end() const { return end_; }
  /// This rank is there, after so many seconds. Whether there is another stretch.
  bool next(double seconds, int signal, bool failed, bool due = false);
  /// Of those who were told of: the highest number; 0 = none.
  int signal() const { return signal_; }
  bool failed() const { return failed_; }
  /// Whether a checkpoint is due, as somebody told of the stretch that was heard of last.
  bool due() const { return due_; }

 private:
  void hear(std::int64_t steps);

  Ranks& ranks_;
  std::int64_t steps_, end_, length_ = 1, told_length_ = 0;  // told_length_: of the stretch that was told of last; 0 = none is on its way
  double step_seconds_ = 0;  // of the slowest
  int signal_ = 0;
  bool failed_ = false, due_ = false;
};

}  // namespace linden

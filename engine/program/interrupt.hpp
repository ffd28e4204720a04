// engine/program/interrupt.hpp
// Ctrl-C as a request: while an Interrupt lives, SIGINT, SIGTERM and SIGHUP are noted, not obeyed, so that what was recorded is finished and
// put in place, also while it is being packed. Further ones change nothing and are answered with a line (not within a second of the first,
// when it is the same request twice, as `timeout` sends it to a process and to its group). SIGHUP that was ignored before, as by nohup,
// stays ignored.
#pragma once

#include <csignal>

namespace linden {

class Interrupt {
 public:
  /// To be made before the first file that is to outlive an interrupt. There is one at a time.
  Interrupt();
  ~Interrupt();
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;

  /// Number of the signal that came first; 0 = none.
  int signal() const { return caught_; }

 private:
  static void note(int signal);
  static volatile std::sig_atomic_t caught_;

  static constexpr int kSignals[] = {SIGINT, SIGTERM, SIGHUP};
  struct sigaction before_[3] {};
};

}  // namespace linden

// engine/program/interrupt.hpp
// Ctrl-C as a request: while an Interrupt lives, SIGINT and SIGTERM are noted, not obeyed. One that comes more than a second after the
// first ends the program at once; sooner it is the same request twice, as `timeout` sends it to a process and to its group.
#pragma once

#include <csignal>

namespace linden {

class Interrupt {
 public:
  Interrupt();
  ~Interrupt();
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;

  /// Number of the signal that came first; 0 = none.
  int signal() const { return caught_; }

 private:
  static void note(int signal);
  static volatile std::sig_atomic_t caught_;

  struct sigaction before_int_ {}, before_term_ {};
};

}  // namespace linden

#include "engine/program/interrupt.hpp"

#include <ctime>

namespace linden {
namespace {

volatile std::time_t first_came = 0;  // [s]

}  // namespace

volatile std::sig_atomic_t Interrupt::caught_ = 0;

// only what is safe in a handler: clock_gettime, signal, raise
void Interrupt::note(int signal) {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  if (caught_ == 0) {
    caught_ = signal;
    first_came = now.tv_sec;
  } else if (now.tv_sec - first_came > 1) {
    std::signal(signal, SIG_DFL);
    std::raise(signal);
  }
}

Interrupt::Interrupt() {
  caught_ = 0;
  struct sigaction action {};
  action.sa_handler = note;
  action.sa_flags = SA_RESTART;
  sigemptyset(&action.sa_mask);
  sigaction(SIGINT, &action, &before_int_);
  sigaction(SIGTERM, &action, &before_term_);
}

Interrupt::~Interrupt() {
  sigaction(SIGINT, &before_int_, nullptr);
  sigaction(SIGTERM, &before_term_, nullptr);
}

}  // namespace linden

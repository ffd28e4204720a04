#include "engine/program/interrupt.hpp"

#include <unistd.h>

#include <cerrno>
#include <ctime>
#include <iterator>
#include <string_view>

namespace linden {
namespace {

volatile std::time_t first_came = 0;  // [s]

}  // namespace

volatile std::sig_atomic_t Interrupt::caught_ = 0;

// only what is safe in a handler: clock_gettime, write
void Interrupt::note(int signal) {
  constexpr std::string_view kPatience = "linden: finishing what was recorded; wait for it, or lose it by SIGKILL\n";
  const int error = errno;
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  if (caught_ == 0) {
    caught_ = signal;
    first_came = now.tv_sec;
  } else if (now.tv_sec - first_came > 1) {
    [[maybe_unused]] const ssize_t told = ::write(STDERR_FILENO, kPatience.data(), kPatience.size());
  }
  errno = error;
}

Interrupt::Interrupt() {
  caught_ = 0;
  struct sigaction action {};
  action.sa_handler = note;
  action.sa_flags = SA_RESTART;
  sigemptyset(&action.sa_mask);
  for (std::size_t k = 0; k < std::size(kSignals); ++k) {
    sigaction(kSignals[k], nullptr, &before_[k]);
    if (kSignals[k] == SIGHUP && before_[k].sa_handler == SIG_IGN) continue;
    sigaction(kSignals[k], &action, nullptr);
  }
}

Interrupt::~Interrupt() {
  for (std::size_t k = 0; k < std::size(kSignals); ++k) sigaction(kSignals[k], &before_[k], nullptr);
}

}  // namespace linden

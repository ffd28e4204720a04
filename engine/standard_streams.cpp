#include "engine/standard_streams.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>

#include "engine/text.hpp"

namespace linden {
namespace {

bool speaking = true;
int lost = 0;  // errno of what failed first on standard output

void note(bool fine) {
  if (!fine && lost == 0) lost = errno != 0 ? errno : EIO;
}

}  // namespace

void speak(bool whether) { speaking = whether; }

void say_text(std::string_view text) {
  if (!speaking) return;
  errno = 0;
  note(std::fwrite(text.data(), 1, text.size(), stdout) == text.size());
}

void show_text(std::string_view text) {
  if (!speaking) return;
  std::fwrite(text.data(), 1, text.size(), stderr);
  std::fflush(stderr);
}

void tell_text(std::string_view message) {
  flush_standard_output();  // what was printed before comes before
  show_text(fmt::format("linden: {}\n", printable(message)));
}

void prepare_standard_streams() {
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(stream, F_GETFD) >= 0 || errno != EBADF) continue;
    // the lowest number that is free, which is this one
    if (::open("/dev/null", O_RDONLY) < 0) return;
  }
}

int flush_standard_output() {
  errno = 0;
  note(std::fflush(stdout) == 0);
  note(std::ferror(stdout) == 0);
  return lost;
}

}  // namespace linden

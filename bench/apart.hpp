// bench/apart.hpp
// A piece of work in a process of its own, for engines that end the program they are in.
#pragma once

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <exception>
#include <functional>
#include <string>

namespace linden {

/// What `find` says, in a process of its own: an engine whose assertions fail ends that one, and what it prints nobody sees.
inline std::string apart(const std::function<std::string()>& find) {
  int ends[2];
  if (::pipe(ends) != 0) return "no pipe";
  const pid_t child = ::fork();
  if (child < 0) return "no process";
  if (child == 0) {
    ::close(ends[0]);
    const int nowhere = ::open("/dev/null", O_WRONLY);
    ::dup2(nowhere, STDOUT_FILENO);
    ::dup2(nowhere, STDERR_FILENO);
    std::string found;
    try {
      found = find();
    } catch (const std::exception& error) {
      found = fmt::format("refuses: {}", error.what());
    }
    const bool told = ::write(ends[1], found.data(), found.size()) >= 0;
    ::_exit(told ? 0 : 1);
  }
  ::close(ends[1]);
  std::string found;
  char part[256];
  for (ssize_t size = 0; (size = ::read(ends[0], part, sizeof part)) > 0;) found.append(part, static_cast<std::size_t>(size));
  ::close(ends[0]);
  int status = 0;
  ::waitpid(child, &status, 0);
  if (WIFSIGNALED(status)) return "ends the program: an assertion fails";
  return found.empty() ? "ends the program" : found;
}

}  // namespace linden

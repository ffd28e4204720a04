#include "engine/program/child_process.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <stdexcept>
#include <string_view>
#include <system_error>

extern char** environ;

namespace linden {
namespace {

void close_one(int& end) {
  if (end >= 0) close(end);
  end = -1;
}

}  // namespace

Pipe::Pipe() {
  if (pipe2(ends_, O_CLOEXEC) != 0) throw std::runtime_error(fmt::format("no pipe is to be had: {}", std::generic_category().message(errno)));
}

Pipe::~Pipe() {
  close_read();
  close_write();
}

void Pipe::close_read() { close_one(ends_[0]); }
void Pipe::close_write() { close_one(ends_[1]); }

bool Pipe::write_all(const char* bytes, std::size_t count) const {
  while (count > 0) {
    const ssize_t written = write(ends_[1], bytes, count);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    bytes += written;
    count -= static_cast<std::size_t>(written);
  }
  return true;
}

ChildProcess::ChildProcess(std::vector<std::string> words, const std::vector<std::pair<int, int>>& handed) {
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);

  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  // out of the way first: one of ours may have the number that another is to have
  constexpr int kAside = 100;
  for (std::size_t k = 0; k < handed.size(); ++k) posix_spawn_file_actions_adddup2(&actions, handed[k].first, kAside + static_cast<int>(k));
  for (const int standard : {0, 1, 2}) posix_spawn_file_actions_addopen(&actions, standard, "/dev/null", O_RDWR, 0);
  for (std::size_t k = 0; k < handed.size(); ++k) {
    posix_spawn_file_actions_adddup2(&actions, kAside + static_cast<int>(k), handed[k].second);
    posix_spawn_file_actions_addclose(&actions, kAside + static_cast<int>(k));
  }
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  posix_spawnattr_setpgroup(&attributes, 0);
  const int error = posix_spawn(&process_, words.front().c_str(), &actions, &attributes, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  if (error == 0) return;
  process_ = -1;
  throw std::runtime_error(fmt::format("{} cannot be started: {}", words.front(), std::generic_category().message(error)));
}

ChildProcess::~ChildProcess() {
  if (process_ < 0) return;
  kill(-process_, SIGKILL);
  waitpid(process_, nullptr, 0);
}

bool ChildProcess::wait() {
  int status = 0;
  while (waitpid(process_, &status, 0) < 0 && errno == EINTR) {
  }
  process_ = -1;
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

std::string find_program(const std::string& name) {
  const char* const path = std::getenv("PATH");
  std::string_view left = path ? path : "";
  while (!left.empty()) {
    const std::string_view folder = left.substr(0, left.find(':'));
    left.remove_prefix(std::min(folder.size() + 1, left.size()));
    const std::string file = fmt::format("{}/{}", folder, name);
    if (!folder.empty() && access(file.c_str(), X_OK) == 0) return file;
  }
  return "";
}

}  // namespace linden

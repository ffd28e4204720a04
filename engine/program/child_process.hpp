// engine/program/child_process.hpp
// A program that linden starts and ends: a browser that draws, ffmpeg that packs. What it says goes nowhere.
#pragma once

#include <sys/types.h>

#include <string>
#include <utility>
#include <vector>

namespace linden {

/// Both ends of a pipe, closed in programs that are started unless they are handed over.
class Pipe {
 public:
  /// Throws std::runtime_error.
  Pipe();
  ~Pipe();
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;

  int read_end() const { return ends_[0]; }
  int write_end() const { return ends_[1]; }
  void close_read();
  void close_write();
  /// All of the bytes, from the write end; false where nobody reads any more.
  bool write_all(const char* bytes, std::size_t count) const;

 private:
  int ends_[2]{-1, -1};
};

class ChildProcess {
 public:
  /// words: the program's path and its arguments. handed: descriptors of ours, and what they are called there. Ctrl-C does not reach it.
  /// Throws std::runtime_error where it cannot be started.
  ChildProcess(std::vector<std::string> words, const std::vector<std::pair<int, int>>& handed);
  /// Ends it, and what it has started, where it still runs.
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  /// Waits for its end; whether all was well with it.
  bool wait();

 private:
  pid_t process_ = -1;
};

/// Path of a program in PATH; empty where there is none.
std::string find_program(const std::string& name);

}  // namespace linden

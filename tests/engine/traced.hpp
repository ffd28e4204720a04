// The program stopped at moments of its work, which its system calls tell without any waiting for time to pass.
#pragma once

#include <fcntl.h>
#include <signal.h>
#include <sys/ptrace.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <functional>
#include <string>
#include <system_error>
#include <vector>

#include "tests/engine/folder.hpp"

namespace linden {

class Traced {
 public:
  /// A system call that begins: its number, arguments, and what two of them can stand for.
  struct Call {
    pid_t process;
    std::uint64_t number;
    std::uint64_t arguments[6];

    bool is(std::initializer_list<long> numbers) const {
      return std::ranges::any_of(numbers, [&](long one) { return static_cast<std::uint64_t>(one) == number; });
    }
    std::string text(std::size_t argument) const {
      std::string text(4096, '\0');
      iovec here{text.data(), text.size()}, there{reinterpret_cast<void*>(arguments[argument]), text.size()};
      const ssize_t count = ::process_vm_readv(process, &here, 1, &there, 1, 0);
      text.resize(count > 0 ? static_cast<std::size_t>(count) : 0);
      return text.substr(0, text.find('\0'));
    }
    /// Path of an open file.
    std::string file(std::size_t argument) const {
      std::error_code none;
      return std::filesystem::read_symlink("/proc/" + std::to_string(process) + "/fd/" + std::to_string(arguments[argument]), none).string();
    }
  };

  Traced(const Folder& folder, const std::vector<std::string>& arguments) {
    std::vector<std::string> words{LINDEN_PROGRAM};
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char*> pointers;
    for (std::string& word : words) pointers.push_back(word.data());
    pointers.push_back(nullptr);
    const std::string place = folder.path().string(), out = said_.file("out"), err = said_.file("err");
    process_ = ::fork();
    if (process_ == 0) {
      const int from = ::open("/dev/null", O_RDONLY), to = ::open(out.c_str(), O_WRONLY | O_CREAT, 0600),
                errors = ::open(err.c_str(), O_WRONLY | O_CREAT, 0600);
      ::dup2(from, 0), ::dup2(to, 1), ::dup2(errors, 2);
      for (const int number : {SIGINT, SIGTERM, SIGHUP}) ::signal(number, SIG_DFL);  // a test run by nohup ignores the last
      if (::chdir(place.c_str()) != 0 || ::ptrace(PTRACE_TRACEME, 0, nullptr, nullptr) != 0) ::_exit(126);
      ::execv(LINDEN_PROGRAM, pointers.data());
      ::_exit(127);
    }
    REQUIRE(process_ > 0);
    wait();
    if (!stopped()) return;
    constexpr long kOptions = PTRACE_O_TRACESYSGOOD | PTRACE_O_EXITKILL;
    REQUIRE(::ptrace(PTRACE_SETOPTIONS, process_, nullptr, reinterpret_cast<void*>(kOptions)) == 0);
  }
  ~Traced() {
    if (ended()) return;
    ::kill(process_, SIGKILL);
    while (!ended()) wait();
  }
  Traced(const Traced&) = delete;
  Traced& operator=(const Traced&) = delete;

  /// On to the next beginning of a call that is wanted. False where the program ended before.
  bool run_to(const std::function<bool(const Call&)>& wanted) {
    while (stopped()) {
      ::ptrace(PTRACE_SYSCALL, process_, nullptr, reinterpret_cast<void*>(signal_));
      signal_ = 0;
      wait();
      if (!stopped()) break;
      if (WSTOPSIG(status_) != (SIGTRAP | 0x80)) {
        signal_ = WSTOPSIG(status_);  // handed on
        continue;
      }
      __ptrace_syscall_info info{};
      ::ptrace(PTRACE_GET_SYSCALL_INFO, process_, reinterpret_cast<void*>(sizeof(info)), &info);
      if (info.op != PTRACE_SYSCALL_INFO_ENTRY) continue;
      Call call{process_, info.entry.nr, {}};
      std::ranges::copy(info.entry.args, call.arguments);
      if (wanted(call)) return true;
    }
    return false;
  }
  void send(int signal) const { ::kill(process_, signal); }
  /// Lets it go, and waits for its end.
  void finish() {
    if (stopped()) ::ptrace(PTRACE_DETACH, process_, nullptr, reinterpret_cast<void*>(signal_));
    while (!ended()) wait();
  }

  /// -1: it was ended by a signal.
  int exit_code() const { return WIFEXITED(status_) ? WEXITSTATUS(status_) : -1; }
  int ended_by() const { return WIFSIGNALED(status_) ? WTERMSIG(status_) : 0; }
  std::string err() const { return text_of(said_ / "err"); }
  /// 126: this machine lets nobody be traced.
  bool possible() const { return exit_code() != 126; }

 private:
  bool stopped() const { return WIFSTOPPED(status_); }
  bool ended() const { return WIFEXITED(status_) || WIFSIGNALED(status_); }
  void wait() {
    while (::waitpid(process_, &status_, 0) < 0) REQUIRE(errno == EINTR);
  }

  Folder said_;
  pid_t process_ = 0;
  int status_ = 0x7f;  // stopped
  long signal_ = 0;
};

}  // namespace linden

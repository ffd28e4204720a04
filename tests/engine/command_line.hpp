// tests/engine/command_line.hpp
// The program as people and scripts meet it: started by a shell in a folder of its own.
#pragma once

#include <fmt/format.h>
#include <sys/wait.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdlib>

#include "tests/engine/folder.hpp"

namespace linden {

using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;

struct Outcome {
  int exit_code;
  std::string out, err;
};

/// A folder in which the program runs.
class Shell : public Folder {
 public:
  /// `before` goes before the program's name, such as a command that runs others.
  Outcome linden(const std::string& arguments, const std::string& before = "") const {
    const Folder outputs;
    // fontconfig keeps what it allocates; under AddressSanitizer that would end a run that plots with 1
    outputs.write("leaks", "leak:libfontconfig\n");
    const std::string command =
        fmt::format("cd '{0}' && LSAN_OPTIONS='suppressions={1}/leaks:print_suppressions=0' {2} '{3}' {4} "
                    "> '{1}/out' 2> '{1}/err' < /dev/null",
                    path().string(), outputs.path().string(), before, LINDEN_PROGRAM, arguments);
    const int status = std::system(command.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, text_of(outputs / "out"), text_of(outputs / "err")};
  }

  /// Interrupted half a second after it has begun to listen for that, however long it takes to begin.
  Outcome interrupted(const std::string& arguments) const {
    const Folder scripts;
    scripts.write("interrupted",
                  "\"$@\" & pid=$!\n"
                  "until ! kill -0 $pid || grep -q '^SigCgt:.*[2367abef]$' /proc/$pid/status; do sleep 0.05; done\n"
                  "sleep 0.5\n"
                  "kill -INT $pid\n"
                  "wait $pid\n");
    return linden(arguments, fmt::format("sh '{}'", scripts.file("interrupted")));
  }
};

/// Exit code 2, or another, one line on stderr that says `expected`, nothing on stdout, and no file but those that were there.
inline void check_refused(const Shell& shell, const std::string& arguments, const std::string& expected, int exit_code = 2) {
  INFO(arguments);
  const std::set<std::string> before = shell.files();
  const Outcome outcome = shell.linden(arguments);
  CHECK(outcome.exit_code == exit_code);
  CHECK_THAT(outcome.err, StartsWith("linden: ") && Contains(expected));
  CHECK(std::ranges::count(outcome.err, '\n') == 1);
  CHECK(outcome.err.ends_with('\n'));
  CHECK(outcome.out.empty());
  CHECK(shell.files() == before);
}

}  // namespace linden

// tests/engine/command_line.hpp
// The program as people and scripts meet it: started by a shell in a folder of its own.
#pragma once

#include <fmt/format.h>
#include <stdlib.h>
#include <sys/wait.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <string>

namespace linden {

using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;

inline std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

struct Outcome {
  int exit_code;
  std::string out, err;
};

/// A folder that is empty at first and gone afterwards.
class Folder {
 public:
  Folder() {
    std::string name = (std::filesystem::temp_directory_path() / "linden_test_XXXXXX").string();
    REQUIRE(::mkdtemp(name.data()) != nullptr);
    path_ = name;
  }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  void write(const std::string& name, const std::string& text) const { std::ofstream(path_ / name, std::ios::binary) << text; }

  std::set<std::string> files() const {
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(path_)) names.insert(entry.path().filename().string());
    return names;
  }

  /// `before` goes before the program's name, such as a command that runs others.
  Outcome linden(const std::string& arguments, const std::string& before = "") const {
    const Folder outputs(path_.string() + ".out");
    // fontconfig keeps what it allocates; under AddressSanitizer that would end a run that plots with 1
    outputs.write("leaks", "leak:libfontconfig\n");
    const std::string command =
        fmt::format("cd '{0}' && LSAN_OPTIONS='suppressions={1}/leaks:print_suppressions=0' {2} '{3}' {4} "
                    "> '{1}/out' 2> '{1}/err' < /dev/null",
                    path_.string(), outputs.path_.string(), before, LINDEN_PROGRAM, arguments);
    const int status = std::system(command.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, text_of(outputs / "out"), text_of(outputs / "err")};
  }

 private:
  explicit Folder(std::filesystem::path path) : path_(std::move(path)) { std::filesystem::create_directory(path_); }

  std::filesystem::path path_;
};

/// Exit code 2, one line on stderr that says `expected`, nothing on stdout, and no file but those that were there.
inline void check_refused(const Folder& folder, const std::string& arguments, const std::string& expected) {
  INFO(arguments);
  const std::set<std::string> before = folder.files();
  const Outcome outcome = folder.linden(arguments);
  CHECK(outcome.exit_code == 2);
  CHECK_THAT(outcome.err, StartsWith("linden: ") && Contains(expected));
  CHECK(std::ranges::count(outcome.err, '\n') == 1);
  CHECK(outcome.err.ends_with('\n'));
  CHECK(outcome.out.empty());
  CHECK(folder.files() == before);
}

}  // namespace linden

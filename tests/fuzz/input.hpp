// tests/fuzz/input.hpp
// What the fuzzers share: their input as text or as a file, and what they hold readers to.
//
// A fuzzer passes bytes of any kind to a reader. It either returns something sound or throws InputError; all else, and whatever a
// sanitizer says, ends the fuzzer.
#pragma once

#include <fmt/format.h>
#include <stdlib.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>

#include "layout/input_error.hpp"

namespace linden {

/// Ends the fuzzer where a reader returned what it must not.
inline void require(bool holds, const std::string& what) {
  if (holds) return;
  fmt::print(stderr, "not sound: {}\n", what);
  std::abort();
}

/// `read` may throw InputError, with something short to say on one line.
template <class Read>
void read_or_refuse(const Read& read) {
  try {
    read();
  } catch (const InputError& error) {
    constexpr std::size_t kLongest = 1000;
    const std::string_view message = error.what();
    const bool sound = !message.empty() && message.size() < kLongest && message.find('\n') == message.npos;
    require(sound, fmt::format("the message is \"{}\"", message));
  }
}

inline std::string text_of(const unsigned char* data, std::size_t size) { return {reinterpret_cast<const char*>(data), size}; }

/// Files for readers that take a path, gone when the fuzzer ends well.
class InputFolder {
 public:
  InputFolder() {
    // in memory where there is such a folder: ten times as many runs a second
    const std::filesystem::path memory = "/dev/shm";
    const bool any = std::filesystem::is_directory(memory);
    std::string name = ((any ? memory : std::filesystem::temp_directory_path()) / "linden_fuzz_XXXXXX").string();
    require(::mkdtemp(name.data()) != nullptr, "no temporary folder");  // fills in the end
    path_ = name;
  }
  ~InputFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  InputFolder(const InputFolder&) = delete;
  InputFolder& operator=(const InputFolder&) = delete;

  std::string file(const std::string& name) const { return (path_ / name).string(); }
  void write(const std::string& name, const std::string& bytes) const {
    require(static_cast<bool>(std::ofstream(path_ / name, std::ios::binary) << bytes), "an input file cannot be written");
  }
  std::string read(const std::string& name) const {
    std::ifstream in(path_ / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  }

 private:
  std::filesystem::path path_;
};

}  // namespace linden

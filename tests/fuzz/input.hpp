// tests/fuzz/input.hpp
// What the fuzzers share: their input as text or as a file, and what they hold readers to.
//
// A fuzzer passes bytes of any kind to a reader. It either returns something sound or throws InputError; all else, and whatever a
// sanitizer says, ends the fuzzer.
#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>

#include "layout/support/input_error.hpp"
#include "tests/scratch_folder.hpp"

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

/// Where files for readers that take a path lie: in memory where there is such a folder, which is ten times as many runs a second.
inline std::filesystem::path input_folder() {
  const std::filesystem::path memory = "/dev/shm";
  return std::filesystem::is_directory(memory) ? memory : std::filesystem::temp_directory_path();
}

}  // namespace linden

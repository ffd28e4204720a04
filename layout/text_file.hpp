// layout/text_file.hpp
// All of a text file, or one message why not.
#pragma once

#include <cstddef>
#include <string>

namespace linden {

/// Far more than any robot, mesh or table; what is longer, such as /dev/zero, may have no end.
inline constexpr std::size_t kMostBytes = std::size_t{1} << 30;

/// All of a file, of at most `most_bytes`. `what` says in messages what it should be.
/// Throws InputError: `file: what was found; what was expected; what to do`.
std::string read_text(const std::string& file, const std::string& what, std::size_t most_bytes = kMostBytes);

}  // namespace linden

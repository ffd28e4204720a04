// layout/support/words.hpp
// Words and numbers in text that people wrote, and in the messages that answer them.
//
// Numbers are read and written as in the "C" locale, whatever the locale of the process.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace linden {

/// Text of a file inside a message: on one line, cut where it is long. An object, because a function would give way to std::quoted in files
/// that include <iomanip>.
struct Quoted {
  std::string operator()(std::string_view text) const;
};
inline constexpr Quoted quoted{};

/// Cuts the next word between spaces, tabs and line ends off `rest`; empty when there is none.
std::string_view next_word(std::string_view& rest);

/// The words between spaces, tabs and line ends; they point into `text`.
std::vector<std::string_view> words_of(std::string_view text);

/// The finite number that the word is, in any locale; nothing where a part of it is something else.
std::optional<double> number_in(std::string_view word);

/// Shortest text that reads back to the same double.
std::string text_of(double value);

/// Levenshtein's distance: letters to insert, delete or replace. cost  a.size() x b.size()
std::size_t edits_between(std::string_view a, std::string_view b);

/// The first of the names with the fewest edits to `word`, if few enough to be a slip of the finger; else empty.
std::string nearest(std::string_view word, std::span<const std::string> names);

}  // namespace linden

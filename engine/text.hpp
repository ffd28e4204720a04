// engine/text.hpp
// Small things that messages and tables of the command line are made of.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace linden {

/// 12345678 -> "12,345,678"
std::string grouped(std::int64_t number);

/// 123456789 bytes -> "118 MiB"
std::string memory_text(std::size_t bytes);

/// "3 joints", "1 joint"
std::string counted(std::int64_t number, std::string_view what);

/// The finite number or NaN or infinity that the whole of `text` is. Throws InputError: `option "text": expected ...`.
double number_from(const std::string& option, const std::string& text, std::string_view expected);
std::int64_t integer_from(const std::string& option, const std::string& text, std::string_view expected);

/// On one line and without control characters, so that no file's text can play with the terminal.
std::string printable(std::string_view text);

/// Columns as wide as their widest cell; numbers to the right. Cells longer than `widest` characters are cut.
class Table {
 public:
  enum class Align : std::uint8_t { left, right };
  struct Column {
    std::string title;
    Align align;
  };

  explicit Table(std::vector<Column> columns, std::size_t widest = 40) : columns_(std::move(columns)), widest_(widest) {}
  void add(std::vector<std::string> cells) { rows_.push_back(std::move(cells)); }
  /// Every line begins with `indent` and ends with a newline.
  std::string text(std::string_view indent = "") const;

 private:
  std::vector<Column> columns_;
  std::size_t widest_;
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace linden

#include "engine/scene/number_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string_view>

#include "layout/support/input_error.hpp"
#include "layout/support/text_file.hpp"
#include "layout/support/words.hpp"

namespace linden {
namespace {

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \t\r");
  return begin == text.npos ? std::string_view() : text.substr(begin, text.find_last_not_of(" \t\r") - begin + 1);
}

}  // namespace

NumberTable read_numbers(const std::string& file, std::size_t columns, std::size_t least_columns) {
  const std::string text = read_text(file, "a CSV file of numbers");
  NumberTable table;
  int line = 0;
  bool first = true;
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";  // spreadsheets write it
  for (std::size_t begin = text.starts_with(kByteOrderMark) ? kByteOrderMark.size() : 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string_view row_text = trimmed(std::string_view(text).substr(begin, end - begin));
    begin = end + 1;
    ++line;
    if (row_text.empty() || row_text[0] == '#') continue;
    const auto fail = [&](const std::string& found, const std::string& expected, const char* advice) {
      throw InputError(fmt::format("{}:{}: {}; expected {}; {}", file, line, found, expected, advice));
    };
    std::vector<double> row;
    std::vector<std::string_view> words;
    bool any_number = false;
    for (std::size_t at = 0; at <= row_text.size();) {
      const std::size_t comma = std::min(row_text.find(',', at), row_text.size());
      words.push_back(trimmed(row_text.substr(at, comma - at)));
      at = comma + 1;
      const std::optional<double> value = number_in(words.back());
      any_number = any_number || value;
      if (value) row.push_back(*value);
    }
    const bool header = first && !any_number;
    first = false;
    if (header) continue;
    const std::size_t expected = columns > 0 ? columns : table.rows.empty() ? words.size() : table.rows.front().size();
    if (words.size() != expected || words.size() < least_columns) {
      fail(fmt::format("{} numbers", words.size()),
           fmt::format("{} in every row, commas between", std::max(expected, least_columns)), "add or remove some");
    }
    if (row.size() != words.size()) {
      const auto wrong = std::ranges::find_if(words, [](std::string_view word) { return !number_in(word); });
      fail(quoted(*wrong), "a finite number", "correct it");
    }
    table.rows.push_back(std::move(row));
    table.lines.push_back(line);
  }
  if (table.rows.empty())
    throw InputError(fmt::format("{}: it holds no numbers; expected rows of them; check that it is the right file", file));
  return table;
}

}  // namespace linden

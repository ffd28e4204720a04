#include "engine/text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>

#include "layout/support/input_error.hpp"

namespace linden {
namespace {

bool continues_character(char c) { return (static_cast<unsigned char>(c) & 0xc0) == 0x80; }

/// Characters of UTF-8 text.
std::size_t width_of(std::string_view text) {
  return text.size() - static_cast<std::size_t>(std::ranges::count_if(text, continues_character));
}

std::string cut(std::string_view text, std::size_t widest) {
  if (width_of(text) <= widest) return std::string(text);
  std::size_t end = 0;
  for (std::size_t shown = 0; shown < widest - 3; ++shown) {
    for (++end; end < text.size() && continues_character(text[end]);) ++end;
  }
  return std::string(text.substr(0, end)) + "...";
}

template <class Number>
Number parsed(const std::string& option, const std::string& text, std::string_view expected) {
  const char* begin = text.data();
  const char* end = begin + text.size();
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') ++begin;
  Number value{};
  const auto [rest, error] = std::from_chars(begin, end, value);
  if (error != std::errc{} || rest != end) throw InputError(fmt::format("{} \"{}\": expected {}", option, text, expected));
  return value;
}

}  // namespace

std::string grouped(std::int64_t number) {
  std::string digits = fmt::format("{}", number);
  const std::size_t first = number < 0 ? 1 : 0;
  for (std::size_t at = digits.size(); at > first + 3;) digits.insert(at -= 3, 1, ',');
  return digits;
}

std::string memory_text(std::size_t bytes) {
  constexpr std::array<const char*, 5> units{"bytes", "KiB", "MiB", "GiB", "TiB"};
  double size = static_cast<double>(bytes);
  std::size_t unit = 0;
  for (; size >= 1024 && unit + 1 < units.size(); ++unit) size /= 1024;
  return unit == 0 ? fmt::format("{} bytes", bytes) : fmt::format("{:.3g} {}", size, units[unit]);
}

std::string counted(std::int64_t number, std::string_view what) {
  if (number == 1) return fmt::format("1 {}", what);
  return what.ends_with('y') ? fmt::format("{} {}ies", grouped(number), what.substr(0, what.size() - 1))
                             : fmt::format("{} {}s", grouped(number), what);
}

double number_from(const std::string& option, const std::string& text, std::string_view expected) {
  return parsed<double>(option, text, expected);
}

std::int64_t integer_from(const std::string& option, const std::string& text, std::string_view expected) {
  return parsed<std::int64_t>(option, text, expected);
}

std::string printable(std::string_view text) {
  std::string result(text);
  std::ranges::replace_if(result, [](unsigned char c) { return c < ' ' || c == 0x7f; }, ' ');
  return result;
}

std::string Table::text(std::string_view indent) const {
  std::vector<std::size_t> width;
  for (const Column& column : columns_) width.push_back(width_of(column.title));
  std::vector<std::vector<std::string>> shown = rows_;
  for (std::vector<std::string>& row : shown) {
    for (std::size_t k = 0; k < row.size(); ++k) {
      row[k] = cut(printable(row[k]), widest_);
      width[k] = std::max(width[k], width_of(row[k]));
    }
  }
  std::string result;
  const auto line = [&](const auto& cell) {
    std::string text(indent);
    for (std::size_t k = 0; k < columns_.size(); ++k) {
      const std::string& value = cell(k);
      const std::string room(width[k] - width_of(value), ' ');
      if (k > 0) text.append(2, ' ');
      text.append(columns_[k].align == Align::left ? value + room : room + value);
    }
    text.erase(text.find_last_not_of(' ') + 1);
    result += text + '\n';
  };
  line([&](std::size_t k) -> const std::string& { return columns_[k].title; });
  for (const auto& row : shown) line([&](std::size_t k) -> const std::string& { return row[k]; });
  return result;
}

}  // namespace linden

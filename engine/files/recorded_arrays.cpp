#include "engine/files/recorded_arrays.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <string_view>

#include "engine/files/array_readers.hpp"
#include "layout/support/input_error.hpp"
#include "layout/support/text_file.hpp"
#include "layout/support/words.hpp"

namespace linden {
namespace {

/// The cells of a line; a quoted one may hold commas, and quotes that are doubled (RFC 4180).
std::vector<std::string> cells_of(std::string_view line) {
  std::vector<std::string> cells(1);
  bool quoted = false;
  for (std::size_t k = 0; k < line.size(); ++k) {
    const char c = line[k];
    if (c == '"') {
      if (quoted && k + 1 < line.size() && line[k + 1] == '"') {
        cells.back() += '"';
        ++k;
      } else {
        quoted = !quoted;
      }
    } else if (c == ',' && !quoted) {
      cells.emplace_back();
    } else if (c != '\r') {
      cells.back() += c;
    }
  }
  return cells;
}

double number_of(const std::string& file, std::size_t line, const std::string& cell) {
  double number = 0;
  const auto [rest, error] = std::from_chars(cell.data(), cell.data() + cell.size(), number);
  if (error == std::errc{} && rest == cell.data() + cell.size()) return number;
  throw InputError(fmt::format("{}:{}: {} is no number; expected a table of numbers below a line of names", file, line, quoted(cell)));
}

RecordedArrays read_table(const std::string& file) {
  const std::string text = read_text(file, "a table of comma-separated numbers");
  RecordedArrays arrays;
  NumberArray time, rest;
  std::vector<std::string> names;
  std::size_t at_time = 0, number = 0;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::vector<std::string> cells = cells_of(std::string_view(text).substr(begin, end - begin));
    begin = end + 1;
    ++number;
    if (number == 1) {
      const auto found = std::ranges::find(cells, "time");
      if (found == cells.end()) throw InputError(fmt::format("{}:1: no column is called time; expected a table that linden recorded", file));
      at_time = static_cast<std::size_t>(found - cells.begin());
      names = cells;
      continue;
    }
    if (cells.size() != names.size()) {
      throw InputError(fmt::format("{}:{}: {} cells; expected {}, one for each name of the first line", file, number, cells.size(), names.size()));
    }
    for (std::size_t k = 0; k < cells.size(); ++k) (k == at_time ? time : rest).numbers.push_back(number_of(file, number, cells[k]));
  }
  if (names.empty()) throw InputError(fmt::format("{}: the file is empty; expected a table that linden recorded", file));
  names.erase(names.begin() + static_cast<std::ptrdiff_t>(at_time));
  const auto frames = static_cast<std::int64_t>(time.numbers.size());
  time.shape = {frames};
  rest.shape = {frames, 1, static_cast<std::int64_t>(names.size())};
  arrays.numbers = {{"time", std::move(time)}, {"q", std::move(rest)}};
  arrays.words = {{"positions", std::move(names)}};
  return arrays;
}

std::string ending_of(const std::string& file) { return std::filesystem::path(file).extension().string(); }

}  // namespace

bool is_recording(const std::string& file) {
  const std::string ending = ending_of(file);
  return ending == ".npz" || ending == ".h5" || ending == ".csv";
}

RecordedArrays read_recording(const std::string& file) {
  const std::string ending = ending_of(file);
  if (ending == ".npz") return npz_arrays(file);
  if (ending == ".h5") return h5_arrays(file);
  return read_table(file);
}

}  // namespace linden

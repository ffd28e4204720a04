#include "engine/files/recorder.hpp"

#include <iterator>
#include <stdexcept>
#include <string_view>
#include <unordered_set>
#include <utility>

namespace linden {
namespace {

std::string csv_cell(const std::string& name) {
  if (name.find_first_of(",\"\r\n") == name.npos) return name;
  std::string quoted = "\"";
  for (const char c : name) quoted.append(c == '"' ? 2 : 1, c);
  return quoted + '"';
}

}  // namespace

std::vector<std::string> recorded_columns(const Names& names) {
  std::vector<std::string> columns{"time", "energy"};
  columns.insert(columns.end(), names.position.begin(), names.position.end());
  std::unordered_set<std::string> taken(columns.begin(), columns.end()), seen;
  for (std::string& column : columns) {
    if (seen.insert(column).second) continue;
    int k = 2;
    while (!taken.insert(fmt::format("{}_{}", column, k)).second) ++k;
    column = fmt::format("{}_{}", column, k);
  }
  return columns;
}

Recorder::Recorder(const std::string& file, const Names& names) : out_(file) {
  const char* gap = "";
  for (const std::string& column : recorded_columns(names)) {
    fmt::format_to(std::back_inserter(text_), "{}{}", std::exchange(gap, ","), csv_cell(column));
  }
  text_.push_back('\n');
  out_.write({text_.data(), text_.size()});
}

void Recorder::add(double time, double energy, std::span<const double> positions) {
  text_.clear();
  fmt::format_to(std::back_inserter(text_), "{:.17g},{:.17g}", time, energy);
  for (const double position : positions) fmt::format_to(std::back_inserter(text_), ",{:.17g}", position);
  text_.push_back('\n');
  out_.write({text_.data(), text_.size()});
}

void Recorder::commit() {
  try {
    out_.commit();
  } catch (const std::runtime_error&) {
    out_.settle();
    if (rows() > 0) out_.commit();
    throw;
  }
}

}  // namespace linden

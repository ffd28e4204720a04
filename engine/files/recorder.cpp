#include "engine/files/recorder.hpp"

#include <iterator>
#include <string_view>

namespace linden {
namespace {

constexpr std::size_t kWriteAtOnce = 1 << 16;  // bytes

std::string csv_cell(const std::string& name) {
  if (name.find_first_of(",\"\r\n") == name.npos) return name;
  std::string quoted = "\"";
  for (const char c : name) quoted.append(c == '"' ? 2 : 1, c);
  return quoted + '"';
}

}  // namespace

Recorder::Recorder(const std::string& file, const Names& names) : out_(file) {
  fmt::format_to(std::back_inserter(text_), "time,energy");
  for (const std::string& name : names.position) fmt::format_to(std::back_inserter(text_), ",{}", csv_cell(name));
  text_.push_back('\n');
}

void Recorder::add(double time, double energy, std::span<const double> positions) {
  fmt::format_to(std::back_inserter(text_), "{:.17g},{:.17g}", time, energy);
  for (const double position : positions) fmt::format_to(std::back_inserter(text_), ",{:.17g}", position);
  text_.push_back('\n');
  rows_ += 1;
  if (text_.size() >= kWriteAtOnce) flush();
}

void Recorder::flush() {
  out_.write({text_.data(), text_.size()});
  text_.clear();
}

void Recorder::commit() {
  flush();
  out_.commit();
}

}  // namespace linden

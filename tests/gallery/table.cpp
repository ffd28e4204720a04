#include "tests/gallery/table.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace linden {
namespace {

std::string number(double value) { return fmt::format("{:.3g}", value); }

std::string bound_of(const Promise& promise) {
  return fmt::format("{} {} {}", promise.what, promise.at_least ? "≥" : "≤", number(promise.bound));
}

std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) result += c == '"' ? "\"\"" : std::string(1, c);
  return result + '"';
}

/// Within a cell of a Markdown table.
std::string cell(const std::string& text) {
  std::string result;
  for (const char c : text) result += c == '|' ? "\\|" : std::string(1, c);
  return result;
}

std::vector<std::string> engines_of(const std::vector<Shown>& gallery) {
  std::vector<std::string> engines;
  for (const Shown& shown : gallery) {
    for (const Besides& other : shown.report.besides()) {
      if (std::ranges::find(engines, other.engine) == engines.end()) engines.push_back(other.engine);
    }
  }
  return engines;
}

}  // namespace

std::string text_of(const Shown& shown) {
  const Report& report = shown.report;
  std::string text = fmt::format("{} {} ({:.1f} s)\n", report.kept() ? "kept  " : "BROKEN", shown.shown->name, shown.seconds);
  for (const Promise& promise : report.promises()) {
    text += fmt::format("       {} {}: measured {} ({})\n", promise.kept() ? " " : "!", bound_of(promise),
                        number(promise.measured), promise.reason);
  }
  for (const std::string& note : report.notes()) text += fmt::format("         {}\n", note);
  for (const Besides& other : report.besides()) text += fmt::format("         {}: {}\n", other.engine, other.found);
  if (!shown.shown->story.empty()) text += fmt::format("         {}\n", shown.shown->story);
  return text;
}

std::string markdown_of(const std::vector<Shown>& gallery) {
  const std::vector<std::string> engines = engines_of(gallery);
  std::string text = "| case | what is hard | promised | measured |";
  for (const std::string& engine : engines) text += fmt::format(" {} |", engine);
  text += "\n| --- | --- | --- | --- |";
  for (std::size_t k = 0; k < engines.size(); ++k) text += " --- |";
  text += '\n';
  for (const Shown& shown : gallery) {
    std::string promised, measured;
    for (const Promise& promise : shown.report.promises()) {
      const char* const gap = promised.empty() ? "" : "<br>";
      promised += fmt::format("{}{}", gap, cell(bound_of(promise)));
      measured += fmt::format("{}{}{}", gap, number(promise.measured), promise.kept() ? "" : " **broken**");
    }
    text += fmt::format("| `{}` | {} | {} | {} |", shown.shown->name, cell(shown.shown->hard), promised, measured);
    for (const std::string& engine : engines) {
      const auto& besides = shown.report.besides();
      const auto found = std::ranges::find(besides, engine, &Besides::engine);
      text += fmt::format(" {} |", found == besides.end() ? "" : cell(found->found));
    }
    text += '\n';
  }
  text += '\n';
  for (const Shown& shown : gallery) {
    if (!shown.shown->story.empty()) text += fmt::format("- `{}`: {}\n", shown.shown->name, shown.shown->story);
  }
  return text;
}

std::string csv_of(const std::vector<Shown>& gallery) {
  std::string text = "case,what,measured,relation,bound,kept,reason\n";
  for (const Shown& shown : gallery) {
    for (const Promise& promise : shown.report.promises()) {
      text += fmt::format("{},{},{:.6g},{},{:.6g},{},{}\n", shown.shown->name, quoted(promise.what), promise.measured,
                          promise.at_least ? ">=" : "<=", promise.bound, promise.kept() ? "yes" : "no", quoted(promise.reason));
    }
    for (const Besides& other : shown.report.besides()) {
      text += fmt::format("{},{},,,,,{}\n", shown.shown->name, quoted(other.engine), quoted(other.found));
    }
  }
  return text;
}

}  // namespace linden

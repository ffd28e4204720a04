#include "models/shapes/obj_colours.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <optional>
#include <system_error>

#include "layout/support/text_file.hpp"
#include "layout/support/words.hpp"
#include "models/shapes/text_lines.hpp"

namespace linden {
namespace {

constexpr std::size_t kMostFiles = 16, kMostMaterials = 10'000;

/// Names may hold spaces, and no more than a line.
std::string trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r"), last = text.find_last_not_of(" \t\r");
  return first == text.npos ? "" : std::string(text.substr(first, last + 1 - first));
}

bool lies_below(const std::filesystem::path& name) {
  return name.is_relative() && std::ranges::none_of(name, [](const std::filesystem::path& part) { return part == ".."; });
}

}  // namespace

void ObjColours::read(std::string_view names) {
  const std::string whole = trimmed(names);
  if (whole.find(' ') != whole.npos) {
    for (const std::string_view name : words_of(names)) read_file(std::string(name));
  }
  read_file(whole);  // a name with spaces
}

void ObjColours::read_file(const std::string& name) {
  if (name.empty() || !lies_below(name) || files_.size() == kMostFiles || !files_.emplace(name, true).second) return;
  const std::filesystem::path path = std::filesystem::path(file_).parent_path() / name;
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored)) return;
  std::ifstream in = open_to_read(path.string());
  TextLines lines(in);
  MeshColour* colour = nullptr;
  for (std::string_view line; in && lines.next(line);) {
    std::string_view rest = line;
    const std::string_view word = next_word(rest);
    if (word == "newmtl") {
      if (colours_.size() == kMostMaterials) return;
      colour = &colours_[trimmed(rest)];
      continue;
    }
    if (!colour) continue;
    const auto number = [&rest] { return number_in(next_word(rest)); };
    if (word == "map_Kd") colour->textured = true;
    if (word == "Kd") {
      const std::optional<double> red = number(), green = number(), blue = number();
      if (!red || !green || !blue) continue;
      const double opacity = colour->rgba ? (*colour->rgba)[3] : 1;
      colour->rgba = {std::clamp(*red, 0.0, 1.0), std::clamp(*green, 0.0, 1.0), std::clamp(*blue, 0.0, 1.0), opacity};
    }
    if (word == "d") {
      // what would not be seen at all is an exporter's slip
      const std::optional<double> opacity = number();
      if (opacity && *opacity > 0 && *opacity < 1) {
        if (!colour->rgba) colour->rgba = {1, 1, 1, 1};
        (*colour->rgba)[3] = *opacity;
      }
    }
  }
}

MeshColour ObjColours::called(std::string_view name) const {
  const auto found = colours_.find(trimmed(name));
  return found == colours_.end() ? MeshColour{} : found->second;
}

}  // namespace linden

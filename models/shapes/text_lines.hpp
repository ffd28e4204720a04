// models/shapes/text_lines.hpp
// Lines of a text file, one after the other, whatever it holds.
#pragma once

#include <array>
#include <fstream>
#include <limits>
#include <string_view>

namespace linden {

/// Lines of a text file. Each is cut at kLongest letters, which no line that holds a point needs.
class TextLines {
 public:
  explicit TextLines(std::ifstream& in) : in_(in) {}

  bool next(std::string_view& line) {
    in_.getline(buffer_.data(), static_cast<std::streamsize>(buffer_.size()));
    line = buffer_.data();
    if (in_.good()) return true;
    if (in_.eof()) return !line.empty();
    if (in_.bad() || in_.gcount() == 0) return false;
    in_.clear();
    in_.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
    return true;
  }

 private:
  static constexpr std::size_t kLongest = 4096;
  std::ifstream& in_;
  std::array<char, kLongest> buffer_{};
};

}  // namespace linden

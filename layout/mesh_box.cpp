#include "layout/mesh_box.hpp"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>
#include <string_view>
#include <system_error>

#include "layout/collada.hpp"
#include "layout/input_error.hpp"
#include "layout/text_file.hpp"
#include "layout/words.hpp"

namespace linden {
namespace {

using Eigen::Vector3d;

std::string lower_case(std::string_view text) {
  std::string result(text);
  for (char& c : result) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return result;
}

[[noreturn]] void fail(const std::string& file, const std::string& found, const std::string& expected) {
  throw InputError(fmt::format("{}: {}; expected {}", file, found, expected));
}

/// Lines of a text file. Each is cut at kLongest letters, which no line that holds a point needs.
class Lines {
 public:
  explicit Lines(std::ifstream& in) : in_(in) {}

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

/// The three numbers that `rest` begins with.
Vector3d point_in(std::string_view rest, const std::string& file, std::string_view line) {
  Vector3d point;
  for (double& coordinate : point) {
    const std::optional<double> number = number_in(next_word(rest));
    if (!number) fail(file, "a point reads " + quoted(line), "three finite numbers");
    coordinate = *number;
  }
  return point;
}

MeshBox text_stl_box(std::ifstream& in, const std::string& file) {
  MeshBox box;
  bool ends = false;
  Lines lines(in);
  for (std::string_view line; lines.next(line);) {
    std::string_view rest = line;
    const std::string word = lower_case(next_word(rest));
    if (word == "vertex") box.extend(point_in(rest, file, line));
    ends = word == "endsolid" || (ends && word.empty());
  }
  if (!ends) fail(file, "it breaks off", "a text STL file that closes with endsolid");
  return box;
}

std::uint32_t word32(const unsigned char* bytes) {
  return bytes[0] | static_cast<std::uint32_t>(bytes[1]) << 8 | static_cast<std::uint32_t>(bytes[2]) << 16 |
         static_cast<std::uint32_t>(bytes[3]) << 24;
}

/// A triangle of a binary STL: normal, three corners, two bytes more.
using Triangle = std::array<unsigned char, 50>;

MeshBox binary_stl_box(std::ifstream& in, const std::string& file, std::uint32_t triangles) {
  MeshBox box;
  Triangle triangle;
  for (std::uint32_t left = triangles; left > 0; --left) {
    in.read(reinterpret_cast<char*>(triangle.data()), triangle.size());
    if (!in) fail(file, "it cannot be read to its end", "a readable file");
    for (std::size_t number = 12; number < 48; number += 12) {
      Vector3d corner;
      for (std::size_t k = 0; k < 3; ++k) {
        corner[static_cast<Eigen::Index>(k)] = std::bit_cast<float>(word32(&triangle[number + 4 * k]));
      }
      if (!corner.allFinite()) fail(file, "a point of it is not finite", "finite numbers");
      box.extend(corner);
    }
  }
  return box;
}

MeshBox stl_box(std::ifstream& in, const std::string& file, std::uintmax_t bytes) {
  constexpr std::size_t kHeader = 84;  // 80 bytes of any text, then the count of triangles
  std::array<unsigned char, kHeader> header{};
  in.read(reinterpret_cast<char*>(header.data()), kHeader);
  const bool whole = in.gcount() == static_cast<std::streamsize>(kHeader);
  const std::uint32_t triangles = word32(&header[80]);
  // Binary files may begin with "solid" too, but four letters of text would count more triangles than a file holds.
  const std::uintmax_t needed = kHeader + std::uintmax_t{triangles} * sizeof(Triangle);
  if (whole && needed <= bytes) return binary_stl_box(in, file, triangles);
  std::string_view text(reinterpret_cast<const char*>(header.data()), static_cast<std::size_t>(in.gcount()));
  if (lower_case(next_word(text)) == "solid") {
    in.clear();
    in.seekg(0);
    return text_stl_box(in, file);
  }
  if (!whole) fail(file, fmt::format("it holds {} bytes", bytes), "an STL file");
  fail(file, fmt::format("it holds {} bytes", bytes), fmt::format("{} for the {} triangles it announces", needed, triangles));
}

MeshBox obj_box(std::ifstream& in, const std::string& file) {
  MeshBox box;
  Lines lines(in);
  for (std::string_view line; lines.next(line);) {
    std::string_view rest = line;
    if (next_word(rest) == "v") box.extend(point_in(rest, file, line));
  }
  return box;
}

}  // namespace

MeshBox mesh_box(const std::string& file) {
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(file, error);
  std::ifstream in = open_to_read(file);
  if (error || !in) fail(file, "it cannot be opened", "a readable file");
  const std::string ending = lower_case(std::filesystem::path(file).extension().string());
  MeshBox box;
  if (ending == ".stl") {
    box = stl_box(in, file, bytes);
  } else if (ending == ".obj") {
    box = obj_box(in, file);
  } else if (ending == ".dae") {
    box = collada_box(file);
  } else {
    fail(file, "this kind of mesh is not read", "a name that ends in .stl, .obj or .dae");
  }
  if (box.isEmpty()) fail(file, "it holds no points", "a mesh");
  if (!box.sizes().allFinite() || !box.center().allFinite()) {
    fail(file, "its points lie too far apart for numbers", "the mesh of a robot's part");
  }
  return box;
}

}  // namespace linden

#include "models/shapes/mesh_file.hpp"

#include <fmt/format.h>

#include <array>
#include <bit>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string_view>
#include <system_error>

#include "layout/support/input_error.hpp"
#include "layout/support/text_file.hpp"
#include "layout/support/words.hpp"
#include "models/shapes/collada.hpp"
#include "models/shapes/obj_colours.hpp"
#include "models/shapes/text_lines.hpp"

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

/// Corners of an STL file, three of them a triangle.
class StlTriangles {
 public:
  explicit StlTriangles(MeshSink& sink) : sink_(sink) {}
  void corner(const Vector3d& point) {
    sink_.point(point);
    corners_ += 1;
    if (corners_ % 3 == 0 && sink_.wants_triangles()) sink_.triangle(corners_ - 3, corners_ - 2, corners_ - 1);
  }

 private:
  MeshSink& sink_;
  std::uint32_t corners_ = 0;
};

void read_text_stl(std::ifstream& in, const std::string& file, MeshSink& sink) {
  StlTriangles triangles(sink);
  bool ends = false;
  TextLines lines(in);
  for (std::string_view line; lines.next(line);) {
    std::string_view rest = line;
    const std::string word = lower_case(next_word(rest));
    if (word == "vertex") triangles.corner(point_in(rest, file, line));
    ends = word == "endsolid" || (ends && word.empty());
  }
  if (!ends) fail(file, "it breaks off", "a text STL file that closes with endsolid");
}

std::uint32_t word32(const unsigned char* bytes) {
  return bytes[0] | static_cast<std::uint32_t>(bytes[1]) << 8 | static_cast<std::uint32_t>(bytes[2]) << 16 |
         static_cast<std::uint32_t>(bytes[3]) << 24;
}

/// A triangle of a binary STL: normal, three corners, two bytes more.
using Triangle = std::array<unsigned char, 50>;

void read_binary_stl(std::ifstream& in, const std::string& file, std::uint32_t count, MeshSink& sink) {
  StlTriangles triangles(sink);
  Triangle triangle;
  for (std::uint32_t left = count; left > 0; --left) {
    in.read(reinterpret_cast<char*>(triangle.data()), triangle.size());
    if (!in) fail(file, "it cannot be read to its end", "a readable file");
    for (std::size_t number = 12; number < 48; number += 12) {
      Vector3d corner;
      for (std::size_t k = 0; k < 3; ++k) {
        corner[static_cast<Eigen::Index>(k)] = std::bit_cast<float>(word32(&triangle[number + 4 * k]));
      }
      if (!corner.allFinite()) fail(file, "a point of it is not finite", "finite numbers");
      triangles.corner(corner);
    }
  }
}

void read_stl(std::ifstream& in, const std::string& file, std::uintmax_t bytes, MeshSink& sink) {
  constexpr std::size_t kHeader = 84;  // 80 bytes of any text, then the count of triangles
  std::array<unsigned char, kHeader> header{};
  in.read(reinterpret_cast<char*>(header.data()), kHeader);
  const bool whole = in.gcount() == static_cast<std::streamsize>(kHeader);
  const std::uint32_t triangles = word32(&header[80]);
  // Binary files may begin with "solid" too, but four letters of text would count more triangles than a file holds.
  const std::uintmax_t needed = kHeader + std::uintmax_t{triangles} * sizeof(Triangle);
  if (whole && needed <= bytes) return read_binary_stl(in, file, triangles, sink);
  std::string_view text(reinterpret_cast<const char*>(header.data()), static_cast<std::size_t>(in.gcount()));
  if (lower_case(next_word(text)) == "solid") {
    in.clear();
    in.seekg(0);
    return read_text_stl(in, file, sink);
  }
  if (!whole) fail(file, fmt::format("it holds {} bytes", bytes), "an STL file");
  fail(file, fmt::format("it holds {} bytes", bytes), fmt::format("{} for the {} triangles it announces", needed, triangles));
}

/// Number of the point that a corner of a face names: from 1 on, or backwards from the last one with a minus.
std::uint32_t point_of_face(std::string_view corner, std::int64_t points, const std::string& file, std::string_view line) {
  const std::string_view word = corner.substr(0, corner.find('/'));
  std::int64_t number = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
  if (number < 0) number += points + 1;
  if (error != std::errc{} || end != word.data() + word.size() || number < 1 || number > points) {
    fail(file, "a face reads " + quoted(line), fmt::format("numbers of points, of which there are {} before it", points));
  }
  return static_cast<std::uint32_t>(number - 1);
}

void read_obj(std::ifstream& in, const std::string& file, MeshSink& sink) {
  std::int64_t points = 0;
  ObjColours colours(file);
  TextLines lines(in);
  for (std::string_view line; lines.next(line);) {
    std::string_view rest = line;
    const std::string_view word = next_word(rest);
    if (word == "v") {
      sink.point(point_in(rest, file, line));
      points += 1;
    }
    if (word == "mtllib" && sink.wants_colours()) colours.read(rest);
    if (word == "usemtl" && sink.wants_colours()) sink.colour(colours.called(rest));
    if (word != "f" || !sink.wants_triangles()) continue;
    PolygonFan fan(sink);
    for (std::string_view corner = next_word(rest); !corner.empty(); corner = next_word(rest)) {
      fan.corner(point_of_face(corner, points, file, line));
    }
  }
}

}  // namespace

void PolygonFan::corner(std::uint32_t point) {
  if (corners_ == 0) first_ = point;
  if (corners_ >= 2) sink_.triangle(first_, last_, point);
  last_ = point;
  corners_ += 1;
}

void read_mesh(const std::string& file, MeshSink& sink) {
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(file, error);
  std::ifstream in = open_to_read(file);
  if (error || !in) fail(file, "it cannot be opened", "a readable file");
  const std::string ending = lower_case(std::filesystem::path(file).extension().string());
  if (ending == ".stl") {
    read_stl(in, file, bytes, sink);
  } else if (ending == ".obj") {
    read_obj(in, file, sink);
  } else if (ending == ".dae") {
    read_collada(file, sink);
  } else {
    fail(file, "this kind of mesh is not read", "a name that ends in .stl, .obj or .dae");
  }
}

}  // namespace linden

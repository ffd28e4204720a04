// models/shapes/mesh_file.hpp
// Points and triangles of a mesh file, along the file's axes, and for those who draw it their colours.
//
//   .stl  binary or text: its triangles
//   .obj  its vertices, the w and colours behind them left aside; its faces, cut into fans
//   .dae  COLLADA: the positions of all geometries that its scene shows, as its nodes place them; of all there are, where it has
//         no scene. In metres, as <unit> says. <up_axis> is not obeyed: robots' files take meshes as they stand, as RViz and
//         MoveIt do, and many call y up where they mean z. Its triangles, polygons, strips and fans.
//
//   colours  OBJ: Kd and d of the .mtl files that it names and that lie beside it; COLLADA: <diffuse> of the effect that an instance binds,
//            in one of <constant> <emission>, all opaque, since exporters disagree about what <transparency> means. Text and binary STL:
//            none. Pictures are not opened. What is wrong about a colour is no error: there is none.
//
// Contacts, masses and pictures go by the same reader: a second one from a library, beside this one or in place of it, would have to agree
// with it about units, axes and mirrored nodes to be right, and would have to be as hard to overrun by a damaged file.
//
// reads   STL and OBJ a piece at a time; COLLADA whole, with the memory of some times its size
// bounds  a count in a file is believed only where the file is long enough for it; scenes that show themselves, or one geometry
//         over and over, are refused
// source  COLLADA 1.4.1, Digital Asset Schema Release, ch. 5
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string>

namespace linden {

struct MeshColour {
  std::optional<std::array<double, 4>> rgba{};  // red, green, blue in sRGB, opacity, 0 to 1; none: the file gives none
  bool textured = false;                        // it is a picture
};

/// Takes what a file holds, in its order. A triangle names three points by the order they came in, from 0 on; all three come before it.
class MeshSink {
 public:
  virtual ~MeshSink() = default;
  virtual void point(const Eigen::Vector3d& p) = 0;  // [m]
  virtual bool wants_triangles() const { return false; }
  virtual void triangle(std::uint32_t, std::uint32_t, std::uint32_t) {}
  virtual bool wants_colours() const { return false; }
  /// Of the triangles that come next; none have any before.
  virtual void colour(const MeshColour&) {}
};

/// Cuts a polygon into triangles about its first corner.
class PolygonFan {
 public:
  explicit PolygonFan(MeshSink& sink) : sink_(sink) {}
  void corner(std::uint32_t point);

 private:
  MeshSink& sink_;
  std::uint32_t first_ = 0, last_ = 0, corners_ = 0;
};

/// Throws InputError: `file: what was found; what was expected`.
void read_mesh(const std::string& file, MeshSink& sink);

}  // namespace linden

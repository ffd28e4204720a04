// engine/view/file_mesh.hpp
// A mesh file (models/shapes/mesh_file.hpp) as it is drawn: a triangle mesh for each colour in it, with normals of its own making
// (engine/view/corner_normals.hpp). Normals in files are left aside: STL has none of points, and others are often missing or wrong.
//
// bounds  files of over 2,000,000 triangles are refused; the colours beyond 256 are the last one
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "engine/view/drawing.hpp"

namespace linden {

/// What is drawn has to fit numbers of single precision.
inline constexpr double kFarthest = 1e9;  // [m]

struct FileSurface {
  TriangleMesh mesh;
  std::optional<Colour> colour;  // none: the file gives none
};

struct FileMesh {
  std::vector<FileSurface> surfaces;  // none of them empty
  std::size_t triangles = 0;
  bool textured = false;  // some of it
};

/// `signs`: 1 or -1, that places are multiplied by along x, y, z. Throws InputError: `file: what was found; what was expected`, also for
/// files that hold no triangle.
FileMesh file_mesh(const std::string& file, const std::array<double, 3>& signs = {1, 1, 1});

}  // namespace linden

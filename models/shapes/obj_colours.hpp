// models/shapes/obj_colours.hpp
// Colours that an OBJ file names: Kd (diffuse), d (opacity) and whether there is a map_Kd, of each newmtl in its .mtl files.
//
// bounds  only files in the folder of the OBJ file or below it are opened; so many of them, and so many materials, and no more
// source  Wavefront, MTL material format, 1995
#pragma once

#include <string>
#include <string_view>
#include <unordered_map>

#include "models/shapes/mesh_file.hpp"

namespace linden {

class ObjColours {
 public:
  /// `file`: the OBJ file, which must outlive it.
  explicit ObjColours(const std::string& file) : file_(file) {}

  /// What comes after mtllib: names of files. Those that are not there or that are read already are passed over.
  void read(std::string_view names);
  /// What comes after usemtl: a name.
  MeshColour called(std::string_view name) const;

 private:
  void read_file(const std::string& name);

  const std::string& file_;
  std::unordered_map<std::string, bool> files_;
  std::unordered_map<std::string, MeshColour> colours_;
};

}  // namespace linden

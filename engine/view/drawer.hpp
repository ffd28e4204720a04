// engine/view/drawer.hpp
// Puts shapes into a drawing: finds the mesh of each, makes it where it is not there yet, and remembers which files cannot be drawn and
// why.
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "engine/view/drawing.hpp"
#include "models/build/isometry.hpp"

namespace linden {

enum class Solid : std::uint8_t { sphere, box, cylinder };

/// Whose part it is and how it is shown.
struct Seen {
  std::string link;
  Index slot = 0;
  Layer layer = Layer::visual;
  Colour colour{};
};

class Drawer {
 public:
  /// `source`: the robot's file, which names of meshes are relative to; it must outlive this. `bodies`: how many there are, on which it
  /// depends how finely they are drawn.
  Drawer(const std::string& source, Index bodies) : source_(source), bodies_(bodies) {}

  /// Scaled before it is placed. Without extent, or where a number is too large, nothing is drawn.
  void add(Solid solid, const Seen& seen, const Isometry& pose, const Eigen::Vector3d& scale);
  /// A mesh that nothing else shows.
  void add(TriangleMesh mesh, const Seen& seen, const Isometry& pose);
  /// A shape as its kind asks for. A file with colours has these in the visual layer. False where its file cannot be drawn. Not of a plane and of heights.
  bool add(const BodyShape& shape, Layer layer, const Colour& colour);

  /// Tells of the file of a shape that cannot be drawn, unless that was done; `instead`: what is drawn in its place.
  void tell_missing(const BodyShape& shape, const std::string& instead);
  /// Each text once.
  void tell(const std::string& text);

  Drawing result();

 private:
  struct Surface {
    std::uint32_t mesh;
    std::optional<Colour> colour;
  };
  /// A file with the signs of its scale.
  struct File {
    std::vector<Surface> surfaces;
    std::string trouble;  // why there are none
  };

  std::uint32_t mesh_of(Solid solid);
  const File& file_of(const BodyShape& shape);
  File read(const std::string& name, const std::array<double, 3>& signs);
  void add_part(std::uint32_t mesh, const Seen& seen, const Isometry& pose, const Eigen::Vector3d& scale);

  const std::string& source_;
  Index bodies_;
  Drawing drawing_;
  std::map<Solid, std::uint32_t> solids_;
  std::map<std::tuple<std::string, std::array<double, 3>>, File> files_;
  std::unordered_set<std::string> told_missing_, told_;
};

}  // namespace linden

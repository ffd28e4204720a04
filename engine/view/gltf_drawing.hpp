// engine/view/gltf_drawing.hpp
// What an animation looks like as glTF has it: parts that are written, meshes with a colour, materials.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "engine/view/glb.hpp"
#include "engine/view/gltf.hpp"

namespace linden {

struct GltfPart {
  const DrawnPart* part;
  std::string name;  // "LINK visual"
  std::size_t mesh;  // of the file
};

inline Index slot_of(const GltfPart& part) { return part.part->slot; }

class GltfDrawing {
 public:
  /// Throws std::runtime_error for parts and meshes that cannot be written. All that is given must outlive it.
  GltfDrawing(const Animation& animation, const GltfOptions& options, GlbNumbers& numbers, GlbRoom& room);

  const std::vector<GltfPart>& parts() const { return parts_; }  // sorted by slot; none of the ground
  const std::vector<GltfPart>& ground() const { return ground_; }
  /// "meshes" and "materials".
  void append_to(std::string& json) const;
  /// What lies in the views `vertices` and `corners`.
  void append_numbers(std::string& file) const;

 private:
  /// Accessors of a mesh.
  struct Accessors {
    std::size_t positions, normals, corners;
  };
  std::size_t mesh_of(const DrawnPart& part);
  std::size_t material_of(const Colour& colour);
  const Accessors& accessors_of(const DrawnPart& part);

  const Animation& animation_;
  GlbNumbers& numbers_;
  GlbList meshes_, materials_;
  std::vector<GltfPart> parts_, ground_;
  std::vector<const TriangleMesh*> order_;  // as their numbers lie in the file
  std::map<std::uint32_t, Accessors> accessors_;
  std::map<Colour, std::size_t> colours_;
  std::map<std::pair<std::uint32_t, std::size_t>, std::size_t> coloured_;
};

}  // namespace linden

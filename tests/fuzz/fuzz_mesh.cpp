// Bytes read as STL, as OBJ and as COLLADA have a finite box each, or are refused; so does the solid that they enclose, if any. What is
// drawn of them is whole. An OBJ file finds the same bytes again where it names mesh.mtl.
#include <algorithm>
#include <cmath>

#include "engine/view/file_mesh.hpp"
#include "models/shapes/mesh_solid.hpp"
#include "tests/fuzz/input.hpp"

namespace {

using namespace linden;

void require_drawn(const FileMesh& mesh) {
  require(!mesh.surfaces.empty(), "a mesh that nothing is drawn of");
  for (const FileSurface& surface : mesh.surfaces) {
    const auto is_finite = [](float number) { return std::isfinite(number); };
    const std::vector<float>&positions = surface.mesh.positions, &normals = surface.mesh.normals;
    const std::vector<std::uint32_t>& indices = surface.mesh.indices;
    require(positions.size() == normals.size() && !indices.empty() && indices.size() % 3 == 0, "the lists of a triangle mesh");
    require(std::ranges::all_of(positions, is_finite) && std::ranges::all_of(normals, is_finite), "the numbers of a triangle mesh");
    require(std::ranges::all_of(indices, [&](std::uint32_t index) { return 3 * std::size_t{index} < positions.size(); }), "an index");
    const auto is_part = [](float number) { return number >= 0 && number <= 1; };
    require(!surface.colour || std::ranges::all_of(*surface.colour, is_part), "a colour");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  static const ScratchFolder folder(input_folder());
  const std::string bytes = text_of(data, size);
  folder.write("mesh.mtl", bytes);
  for (const char* name : {"mesh.stl", "mesh.obj", "mesh.dae"}) {
    folder.write(name, bytes);
    read_or_refuse([&] {
      const MeshBox box = mesh_box(folder.file(name));
      require(!box.isEmpty() && box.sizes().allFinite() && box.center().allFinite(), "the box of a mesh");
    });
    read_or_refuse([&] {
      const MeshSolid solid = mesh_solid(folder.file(name), {1, -2, 3});
      require(!solid.closed || (solid.volume > 0 && solid.center.allFinite() && solid.about_center.allFinite()), "the solid of a mesh");
    });
    read_or_refuse([&] { require_drawn(file_mesh(folder.file(name), {1, -1, 1})); });
  }
  return 0;
}

// Bytes read as STL, as OBJ and as COLLADA have a finite box each, or are refused; so does the solid that they enclose, if any.
#include "models/shapes/mesh_solid.hpp"
#include "tests/fuzz/input.hpp"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  using namespace linden;
  static const ScratchFolder folder(input_folder());
  const std::string bytes = text_of(data, size);
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
  }
  return 0;
}

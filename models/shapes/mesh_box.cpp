#include "models/shapes/mesh_box.hpp"

#include <fmt/format.h>

#include "layout/support/input_error.hpp"
#include "models/shapes/mesh_file.hpp"

namespace linden {
namespace {

class Box : public MeshSink {
 public:
  void point(const Eigen::Vector3d& p) override { box.extend(p); }
  MeshBox box;
};

}  // namespace

void require_extent(const MeshBox& box, const std::string& file) {
  if (box.isEmpty()) throw InputError(fmt::format("{}: it holds no points; expected a mesh", file));
  if (!box.sizes().allFinite() || !box.center().allFinite()) {
    throw InputError(fmt::format("{}: its points lie too far apart for numbers; expected the mesh of a robot's part", file));
  }
}

MeshBox mesh_box(const std::string& file) {
  Box sink;
  read_mesh(file, sink);
  require_extent(sink.box, file);
  return sink.box;
}

}  // namespace linden

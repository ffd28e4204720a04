#include "models/shapes/contacts_of.hpp"

#include <fmt/format.h>

#include <map>
#include <optional>
#include <utility>

#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"
#include "models/build/isometry.hpp"
#include "models/build/vectors.hpp"
#include "models/shapes/mesh_box.hpp"
#include "models/shapes/mesh_path.hpp"

namespace linden {
namespace {

using Eigen::Vector3d;

/// Both ends of a length about its middle; one, where it has none.
std::vector<double> ends_of(double length) {
  if (length == 0) return {0};
  return {-length / 2, length / 2};
}

class Touch {
 public:
  Touch(const std::string& source, std::vector<std::string>& notes) : source_(source), notes_(notes) {}

  void add(const BodyShape& body) {
    const std::array<double, 3>& size = body.shape.size;
    const Isometry pose = isometry(body.pose);
    switch (body.shape.kind) {
      case ShapeKind::sphere: add_sphere(body, Vector3d::Zero(), size[0]); break;
      case ShapeKind::box: {
        const Vector3d edges(size[0], size[1], size[2]);
        add_corners(body, {-0.5 * edges, 0.5 * edges});
        break;
      }
      case ShapeKind::cylinder:
        for (const double z : ends_of(size[1])) {
          const Vector3d center = pose * Vector3d(0, 0, z), axis = pose.linear().col(2).normalized();
          contacts_.rims.push_back({body.slot, array_of(center), array_of(axis), size[0]});
        }
        break;
      case ShapeKind::capsule:
        for (const double z : ends_of(size[1])) {
          add_sphere(body, {0, 0, z}, size[0]);
          if (z != 0) contacts_.spheres.back().outward = array_of((z < 0 ? -1 : 1) * pose.linear().col(2).normalized());
        }
        add_block(body, Vector3d::Zero(), {0, 0, size[1]}, size[0]);
        break;
      case ShapeKind::mesh: add_mesh(body); break;
      case ShapeKind::ellipsoid:
      case ShapeKind::plane:
      case ShapeKind::heights: break;  // the world's own do not touch the ground
    }
  }

  Contacts result() {
    if (meshes_ == 1) notes_.push_back("1 mesh stands as the corners of its bounding box");
    if (meshes_ > 1) notes_.push_back(fmt::format("{} meshes stand as the corners of their bounding boxes", meshes_));
    return std::move(contacts_);
  }

 private:
  void add_sphere(const BodyShape& body, const Vector3d& center, double radius) {
    contacts_.spheres.push_back({body.slot, array_of(isometry(body.pose) * center), radius});
  }

  /// Nothing where all its edges are 0.
  void add_block(const BodyShape& body, const Vector3d& middle, const Vector3d& edges, double radius) {
    if (edges.isZero()) return;
    const Isometry pose = isometry(body.pose);
    const auto axis = [&](int k) { return array_of(pose.linear().col(k).normalized()); };
    contacts_.blocks.push_back({body.slot, array_of(pose * middle), {axis(0), axis(1), axis(2)}, array_of(edges / 2), radius});
  }

  void add_corners(const BodyShape& body, const MeshBox& box) {
    const Vector3d middle = box.center(), edges = box.sizes();
    add_block(body, middle, edges, 0);
    for (const double x : ends_of(edges.x())) {
      for (const double y : ends_of(edges.y())) {
        for (const double z : ends_of(edges.z())) add_sphere(body, middle + Vector3d(x, y, z), 0);
      }
    }
  }

  void add_mesh(const BodyShape& body) {
    const std::string& name = body.shape.mesh;
    const auto [read, first_time] = read_.try_emplace(name);
    if (first_time) read->second = read_mesh(name);
    if (!read->second.trouble.empty()) {
      notes_.push_back(fmt::format("link {}: {}; it touches nothing", quoted(body.link), read->second.trouble));
      return;
    }
    const Vector3d scale(body.shape.size[0], body.shape.size[1], body.shape.size[2]);
    const Vector3d one = read->second.box.min().cwiseProduct(scale), other = read->second.box.max().cwiseProduct(scale);
    const MeshBox box(one.cwiseMin(other), one.cwiseMax(other));
    if (!box.sizes().allFinite() || !box.center().allFinite()) {
      notes_.push_back(fmt::format("link {}: mesh \"{}\" is too large for numbers; it touches nothing", quoted(body.link), name));
      return;
    }
    add_corners(body, box);
    meshes_ += 1;
  }

  struct Mesh {
    MeshBox box;
    std::string trouble;  // why there is no box
  };

  Mesh read_mesh(const std::string& name) const {
    const std::optional<std::string> file = find_mesh(name, source_);
    if (!file) return {{}, fmt::format("mesh \"{}\" not found", name)};
    try {
      return {mesh_box(*file), ""};
    } catch (const InputError& error) {
      return {{}, fmt::format("mesh {}", error.what())};
    }
  }

  const std::string& source_;
  std::vector<std::string>& notes_;
  std::map<std::string, Mesh> read_;  // by name: links share meshes
  std::size_t meshes_ = 0;
  Contacts contacts_;
};

}  // namespace

Contacts contacts_of(const Model& model, std::vector<std::string>& notes) {
  Touch touch(model.source, notes);
  for (const BodyShape& shape : model.shapes) touch.add(shape);
  return touch.result();
}

}  // namespace linden

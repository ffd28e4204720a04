#include "models/shapes/convex_of.hpp"

#include <fmt/format.h>

#include <map>
#include <optional>
#include <utility>

#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"
#include "models/build/isometry.hpp"
#include "models/shapes/convex_hull.hpp"
#include "models/shapes/mesh_box.hpp"
#include "models/shapes/mesh_file.hpp"
#include "models/shapes/mesh_path.hpp"

namespace linden {
namespace {

using Eigen::Vector3d;

class ScaledPoints : public MeshSink {
 public:
  explicit ScaledPoints(const Vector3d& scale) : scale_(scale) {}
  void point(const Vector3d& p) override {
    points.push_back(p.cwiseProduct(scale_));
    box.extend(points.back());
  }
  std::vector<Vector3d> points;
  MeshBox box;

 private:
  Vector3d scale_;
};

/// A mesh about the middle of its box, or why there is none.
struct MeshHull {
  std::shared_ptr<const ConvexHull> hull;
  Vector3d middle = Vector3d::Zero();
  std::string trouble;
};

MeshHull read_hull(const std::string& name, const std::string& source, const Vector3d& scale) {
  const std::optional<std::string> file = find_mesh(name, source);
  if (!file) return {.hull = {}, .trouble = fmt::format("mesh \"{}\" not found", name)};
  ScaledPoints mesh(scale);
  try {
    read_mesh(*file, mesh);
    require_extent(mesh.box, *file);
  } catch (const InputError& error) {
    return {.hull = {}, .trouble = fmt::format("mesh {}", error.what())};
  }
  const Vector3d middle = mesh.box.center();
  for (Vector3d& p : mesh.points) p -= middle;
  MeshHull result{.hull = convex_hull(mesh.points), .middle = middle, .trouble = {}};
  if (!result.hull) result.trouble = fmt::format("mesh {}: no convex hull of its points was found", *file);
  return result;
}

/// Hulls of meshes, each read once a scale: links share them.
class ConvexShapes {
 public:
  ConvexShapes(const std::string& source, std::vector<std::string>& notes) : source_(source), notes_(notes) {}

  void add(const BodyShape& body) {
    const std::array<double, 3>& size = body.shape.size;
    ConvexShape shape;
    Pose pose = body.pose;
    switch (body.shape.kind) {
      case ShapeKind::sphere:
        shape.radius = size[0];
        break;
      case ShapeKind::box:
        shape.kind = ConvexKind::box;
        shape.half = {size[0] / 2, size[1] / 2, size[2] / 2};
        break;
      case ShapeKind::cylinder:
        shape.kind = ConvexKind::cylinder;
        shape.half = {size[0], size[0], size[1] / 2};
        break;
      case ShapeKind::capsule:
        shape.kind = ConvexKind::segment;
        shape.half = {0, 0, size[1] / 2};
        shape.radius = size[0];
        break;
      case ShapeKind::ellipsoid:
        shape.kind = ConvexKind::ellipsoid;
        shape.half = size;
        break;
      case ShapeKind::plane: shape.kind = ConvexKind::plane; break;
      case ShapeKind::heights:
        shape.kind = ConvexKind::heights;
        shape.heights = body.shape.heights;
        break;
      case ShapeKind::mesh: {
        const auto [read, first_time] = read_.try_emplace({body.shape.mesh, size});
        if (first_time) read->second = read_hull(body.shape.mesh, source_, {size[0], size[1], size[2]});
        if (!read->second.hull) {
          notes_.push_back(fmt::format("link {}: {}; it touches nothing", quoted(body.link), read->second.trouble));
          return;
        }
        shape.kind = ConvexKind::hull;
        shape.hull = read->second.hull;
        Isometry T = isometry(body.pose);
        T.translation() = T * read->second.middle;
        pose = pose_of(T);
        meshes_ += 1;
        break;
      }
    }
    shapes_.push_back({body.slot, body.link, pose, std::move(shape)});
  }

  std::vector<ConvexBody> result() {
    if (meshes_ == 1) notes_.push_back("1 mesh stands as its convex hull");
    if (meshes_ > 1) notes_.push_back(fmt::format("{} meshes stand as their convex hulls", meshes_));
    return std::move(shapes_);
  }

 private:
  const std::string& source_;
  std::vector<std::string>& notes_;
  std::map<std::pair<std::string, std::array<double, 3>>, MeshHull> read_;
  std::size_t meshes_ = 0;
  std::vector<ConvexBody> shapes_;
};

}  // namespace

std::vector<ConvexBody> convex_of(const Model& model, std::vector<std::string>& notes) {
  ConvexShapes shapes(model.source, notes);
  for (const BodyShape& shape : model.welded.shapes) shapes.add(shape);
  for (const BodyShape& shape : model.shapes) shapes.add(shape);
  return shapes.result();
}

}  // namespace linden

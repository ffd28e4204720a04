#include "engine/view/drawer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/view/file_mesh.hpp"
#include "engine/view/solid_meshes.hpp"
#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"
#include "models/shapes/mesh_path.hpp"

namespace linden {
namespace {

using Eigen::Vector3d;

constexpr double kFlattest = 1e-6;           // a scale over the largest of the three: a plate still has two sides
constexpr std::size_t kManyTriangles = 200'000;  // from which on a mesh is told: it slows down whoever draws it

/// Triangles at the pole of a sphere, rows of its faces, sides of a cylinder.
struct Fineness {
  int around, rings, sides;
};

Fineness fineness_of(Index bodies) {
  if (bodies <= 500) return {24, 12, 32};
  if (bodies <= 4000) return {12, 6, 16};
  return {8, 4, 8};
}

/// A file's name in a message; of a long one its end, which says more.
std::string name_of(const std::string& file) {
  constexpr std::size_t kShown = 100;
  std::size_t first = file.size() > kShown ? file.size() - kShown : 0;
  // whole characters of UTF-8
  while (first < file.size() && (static_cast<unsigned char>(file[first]) & 0xc0) == 0x80) ++first;
  std::string shown = file.substr(first);
  std::ranges::replace_if(shown, [](unsigned char c) { return c < ' '; }, ' ');
  return fmt::format("\"{}{}\"", first > 0 ? "..." : "", shown);
}

Isometry moved_along_z(const Isometry& pose, double z) {
  Isometry moved = pose;
  moved.translation() += z * pose.linear().col(2);
  return moved;
}

}  // namespace

void Drawer::add_part(std::uint32_t mesh, const Seen& seen, const Isometry& pose, const Vector3d& scale) {
  const double largest = scale.maxCoeff();
  if (!(largest > 0)) return;
  if (!(largest < kFarthest) || !(pose.translation().cwiseAbs().maxCoeff() < kFarthest) || !pose.matrix().allFinite()) {
    tell(fmt::format("link {}: a shape is too large or too far away to be drawn", quoted(seen.link)));
    return;
  }
  const Vector3d thick = scale.cwiseMax(kFlattest * largest);
  drawing_.parts.push_back({seen.link, seen.slot, mesh, seen.layer, pose_of(pose), {thick.x(), thick.y(), thick.z()}, seen.colour});
}

void Drawer::add(Solid solid, const Seen& seen, const Isometry& pose, const Vector3d& scale) {
  add_part(mesh_of(solid), seen, pose, scale);
}

void Drawer::add(TriangleMesh mesh, const Seen& seen, const Isometry& pose) {
  drawing_.meshes.push_back(std::move(mesh));
  add_part(static_cast<std::uint32_t>(drawing_.meshes.size() - 1), seen, pose, Vector3d::Ones());
}

bool Drawer::add(const BodyShape& shape, Layer layer, const Colour& colour) {
  const std::array<double, 3>& size = shape.shape.size;
  const Isometry pose = isometry(shape.pose);
  Seen seen{shape.link, shape.slot, layer, colour};
  switch (shape.shape.kind) {
    case ShapeKind::sphere: add(Solid::sphere, seen, pose, Vector3d::Constant(size[0])); break;
    case ShapeKind::box: add(Solid::box, seen, pose, {size[0], size[1], size[2]}); break;
    case ShapeKind::cylinder: add(Solid::cylinder, seen, pose, {size[0], size[0], size[1]}); break;
    case ShapeKind::ellipsoid: add(Solid::sphere, seen, pose, {size[0], size[1], size[2]}); break;
    case ShapeKind::plane:
    case ShapeKind::heights: break;
    case ShapeKind::capsule:
      if (size[1] > 0) add(Solid::cylinder, seen, pose, {size[0], size[0], size[1]});
      for (const double end : {-size[1] / 2, size[1] / 2}) {
        add(Solid::sphere, seen, moved_along_z(pose, end), Vector3d::Constant(size[0]));
        if (size[1] == 0) break;
      }
      break;
    case ShapeKind::mesh: {
      const File& file = file_of(shape);
      if (!file.trouble.empty()) return false;
      for (const Surface& surface : file.surfaces) {
        seen.colour = layer == Layer::visual ? surface.colour.value_or(colour) : colour;
        add_part(surface.mesh, seen, pose, Vector3d(size[0], size[1], size[2]).cwiseAbs());
      }
      break;
    }
  }
  return true;
}

std::uint32_t Drawer::mesh_of(Solid solid) {
  const auto [at, first_time] = solids_.try_emplace(solid, static_cast<std::uint32_t>(drawing_.meshes.size()));
  if (!first_time) return at->second;
  const Fineness fineness = fineness_of(bodies_);
  switch (solid) {
    case Solid::sphere: drawing_.meshes.push_back(unit_sphere(fineness.around, fineness.rings)); break;
    case Solid::box: drawing_.meshes.push_back(unit_box()); break;
    case Solid::cylinder: drawing_.meshes.push_back(unit_cylinder(fineness.sides)); break;
  }
  return at->second;
}

const Drawer::File& Drawer::file_of(const BodyShape& shape) {
  std::array<double, 3> signs{};
  std::ranges::transform(shape.shape.size, signs.begin(), [](double scale) { return scale < 0 ? -1.0 : 1.0; });
  const auto [at, first_time] = files_.try_emplace({shape.shape.mesh, signs});
  if (first_time) at->second = read(shape.shape.mesh, signs);
  return at->second;
}

Drawer::File Drawer::read(const std::string& name, const std::array<double, 3>& signs) {
  const std::optional<std::string> path = find_mesh(name, source_);
  if (!path) return {{}, fmt::format("mesh {} not found", name_of(name))};
  try {
    FileMesh mesh = file_mesh(*path, signs);
    File file;
    for (FileSurface& surface : mesh.surfaces) {
      file.surfaces.push_back({static_cast<std::uint32_t>(drawing_.meshes.size()), surface.colour});
      drawing_.meshes.push_back(std::move(surface.mesh));
    }
    if (mesh.textured) tell(fmt::format("mesh {}: its textures are not drawn", name_of(name)));
    if (mesh.triangles > kManyTriangles) {
      tell(fmt::format("mesh {} has {} triangles: drawing it may be slow; over {} are too many for most viewers", name_of(name),
                       mesh.triangles, kManyTriangles));
    }
    return file;
  } catch (const InputError& error) {
    return {{}, fmt::format("mesh {}", error.what())};
  }
}

void Drawer::tell_missing(const BodyShape& shape, const std::string& instead) {
  if (!told_missing_.insert(shape.shape.mesh).second) return;
  tell(fmt::format("link {}: {}; {}", quoted(shape.link), file_of(shape).trouble, instead));
}

void Drawer::tell(const std::string& text) {
  if (told_.insert(text).second) drawing_.warnings.push_back(text);
}

Drawing Drawer::result() {
  std::ranges::stable_sort(drawing_.parts, {}, &DrawnPart::slot);
  return std::move(drawing_);
}

}  // namespace linden

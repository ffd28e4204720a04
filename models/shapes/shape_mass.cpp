#include "models/shapes/shape_mass.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"
#include "models/build/origin_inertia.hpp"
#include "models/shapes/mesh_path.hpp"

namespace linden {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

/// A body of revolution about z with its centre at the origin.
LinkInertia turned(double mass, double along, double across) {
  return {mass, Vector3d::Zero(), Vector3d(across, across, along).asDiagonal()};
}

LinkInertia in_own_frame(const CollisionShape& shape, double density) {
  const double r = shape.size[0], l = shape.size[1], pi = std::numbers::pi;
  switch (shape.kind) {
    case ShapeKind::sphere: return sphere_inertia(density * 4 / 3 * pi * r * r * r, r, Vector3d::Zero());
    case ShapeKind::box: {
      const Vector3d size(shape.size[0], shape.size[1], shape.size[2]);
      return box_inertia(density * size.prod(), size, Vector3d::Zero());
    }
    case ShapeKind::cylinder: {
      const double m = density * pi * r * r * l;
      return turned(m, m * r * r / 2, m * (3 * r * r + l * l) / 12);
    }
    case ShapeKind::capsule: {
      const double m = density * pi * r * r * l, ends = density * 4 / 3 * pi * r * r * r;
      return turned(m + ends, m * r * r / 2 + 0.4 * ends * r * r,
                    m * (3 * r * r + l * l) / 12 + ends * (0.4 * r * r + l * l / 4 + 0.375 * l * r));
    }
    case ShapeKind::mesh:
    case ShapeKind::ellipsoid:
    case ShapeKind::plane:
    case ShapeKind::heights: break;  // of links there are none of the last three
  }
  return {};
}

LinkInertia placed(const LinkInertia& inertia, const Isometry& pose) {
  return {inertia.mass, pose * inertia.center, pose.linear() * inertia.about_center * pose.linear().transpose()};
}

}  // namespace

LinkInertia shape_inertia(const LinkShape& shape, double density) { return placed(in_own_frame(shape.shape, density), isometry(shape.pose)); }

ShapeMass::ShapeMass(double density, std::string source) : density_(density), source_(std::move(source)) {
  if (!(density > 0) || !std::isfinite(density)) {
    throw InputError(fmt::format("a density of {} kg/m^3; expected a finite number above zero, such as 1000; correct it", density));
  }
}

LinkInertia ShapeMass::mesh_inertia(const std::string& link, const LinkShape& shape) {
  const auto& [x, y, z] = shape.shape.size;
  const std::string& name = shape.shape.mesh;
  const auto [read, first_time] = read_.try_emplace(fmt::format("{} {} {} {}", name, x, y, z));
  MeshSolid& solid = read->second;
  if (first_time) {
    const std::optional<std::string> file = find_mesh(name, source_);
    try {
      if (!file) throw InputError(fmt::format("mesh \"{}\" not found", name));
      solid = mesh_solid(*file, {x, y, z});
      if (!solid.closed) boxes_.push_back(name);
    } catch (const InputError& error) {
      troubles_.push_back(fmt::format("link {}: {}; it gives no mass", quoted(link), error.what()));
    }
  }
  if (solid.box.isEmpty()) return {};
  if (!solid.closed) {
    return placed(box_inertia(density_ * solid.box.volume(), solid.box.sizes(), solid.box.center()), isometry(shape.pose));
  }
  return placed({density_ * solid.volume, solid.center, density_ * solid.about_center}, isometry(shape.pose));
}

LinkInertia ShapeMass::sum_of(const std::string& link, const std::vector<LinkShape>& shapes) {
  OriginInertia sum;
  for (const LinkShape& shape : shapes) {
    sum += OriginInertia(shape.shape.kind == ShapeKind::mesh ? mesh_inertia(link, shape) : shape_inertia(shape, density_), Isometry3d::Identity());
  }
  if (!(sum.mass > 0)) return {};
  const Vector3d center = sum.moment / sum.mass;
  return {sum.mass, center, sum.about_origin - OriginInertia::parallel_axis(sum.mass, center)};
}

LinkInertia ShapeMass::of(const std::string& link, const std::vector<LinkShape>& collision, const std::vector<LinkVisual>& visual) {
  if (collision.empty() && visual.empty()) return {};  // a frame
  LinkInertia inertia = sum_of(link, collision);
  const bool by_visuals = inertia.mass == 0;
  if (by_visuals) {
    std::vector<LinkShape> shapes;
    for (const LinkVisual& each : visual) shapes.push_back(each.shape);
    inertia = sum_of(link, shapes);
  }
  if (inertia.mass == 0) {
    without_ += 1;
    return inertia;
  }
  links_ += 1;
  of_visuals_ += by_visuals ? 1 : 0;
  all_ += inertia.mass;
  if (inertia.mass > largest_mass_) {
    largest_mass_ = inertia.mass;
    largest_ = link;
  }
  return inertia;
}

std::string ShapeMass::note() const {
  const auto links = [](int count) { return fmt::format("{} {}", count, count == 1 ? "link" : "links"); };
  if (links_ == 0) {
    return without_ == 0 ? fmt::format("density {:g} kg/m^3: every link with shapes has an inertia of its own", density_)
                         : fmt::format("density {:g} kg/m^3: the shapes of {} without inertia have no volume that could be found", density_,
                                       links(without_));
  }
  std::string text = fmt::format("{} without inertia: mass from a density of {:g} kg/m^3, {:.4g} kg in all (largest: {}, {:.4g} kg)", links(links_),
                                 density_, all_, quoted(largest_), largest_mass_);
  if (of_visuals_ > 0) text += fmt::format("; {} of them by visual shapes", of_visuals_);
  if (!boxes_.empty()) {
    text += fmt::format("; {} not closed and {} as the box about it (first: {})",
                        boxes_.size() == 1 ? "1 mesh is" : fmt::format("{} meshes are", boxes_.size()), boxes_.size() == 1 ? "counts" : "count each",
                        quoted(boxes_.front()));
  }
  if (without_ > 0) text += fmt::format("; {} with shapes but no volume stay massless", links(without_));
  return text;
}

}  // namespace linden

#include "models/build/world_shapes.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "layout/support/words.hpp"
#include "models/build/isometry.hpp"

namespace linden {
namespace {

constexpr std::string_view kWorld = "world/";

/// Numbers of its size that a kind uses.
std::size_t sizes_of(ShapeKind kind) {
  switch (kind) {
    case ShapeKind::plane:
    case ShapeKind::heights: return 0;
    case ShapeKind::sphere: return 1;
    case ShapeKind::cylinder:
    case ShapeKind::capsule: return 2;
    case ShapeKind::box:
    case ShapeKind::ellipsoid:
    case ShapeKind::mesh: break;
  }
  return 3;
}

void check(const WorldShape& one) {
  const auto fail = [&](const std::string& found, const char* expected, const char* advice) {
    throw InputError(fmt::format("shape {} of the world: {}; expected {}; {}", quoted(one.name), found, expected, advice));
  };
  if (one.name.empty()) fail("it has no name", "one that it is called by, such as table", "give it one");
  const bool mesh = one.shape.kind == ShapeKind::mesh;
  for (std::size_t k = 0; k < sizes_of(one.shape.kind); ++k) {
    const double size = one.shape.size[k];
    if (std::isfinite(size) && (mesh ? size != 0 : size > 0)) continue;
    fail(fmt::format("its {} is {:g}", mesh ? "scale" : "size", size), mesh ? "a finite number that is not zero" : "a number above zero, in m",
         "change it");
  }
  const bool has_heights = one.shape.heights != nullptr;
  if ((one.shape.kind == ShapeKind::heights) != has_heights || (has_heights && !is_whole(*one.shape.heights))) {
    fail("its heights are no grid, or it is of another kind", "columns x rows finite numbers, two of each or more, at spacings above zero", "correct them");
  }
  if (!isometry(one.pose).matrix().allFinite()) fail("its pose is not finite", "finite numbers", "check its position and rotation");
}

}  // namespace

Model with_world(Model model, const std::vector<WorldShape>& shapes) {
  for (const WorldShape& one : shapes) {
    check(one);
    const std::string link = world_link(one.name);
    if (!model.names.link.emplace(link, LinkPlace{0, one.pose}).second) {
      throw InputError(fmt::format("two links are called {}; names must be unique; give each shape of the world a name of its own", quoted(link)));
    }
    model.welded.shapes.push_back({0, link, one.pose, one.shape});
  }
  return model;
}

Pose plane_pose(const std::array<double, 3>& normal, double height) {
  const Eigen::Vector3d n(normal[0], normal[1], normal[2]);
  const double length = n.norm();
  if (!(length > 0) || !std::isfinite(length) || !std::isfinite(height)) {
    throw InputError(fmt::format("a plane of normal {:g} {:g} {:g} and height {:g}; expected finite numbers, not all of the normal zero; change them",
                                 normal[0], normal[1], normal[2], height));
  }
  Isometry T = Isometry::Identity();
  T.linear() = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), n / length).toRotationMatrix();
  T.linear().col(2) = n / length;
  T.translation() = (height / length) * n + Eigen::Vector3d::Zero();  // no -0
  return pose_of(T);
}

bool stands_in_world(std::string_view link) { return link.starts_with(kWorld); }

std::string world_link(std::string_view name) { return fmt::format("{}{}", kWorld, name); }

}  // namespace linden

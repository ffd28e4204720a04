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
    case ShapeKind::sphere: return 1;
    case ShapeKind::cylinder:
    case ShapeKind::capsule: return 2;
    case ShapeKind::box:
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

bool stands_in_world(std::string_view link) { return link.starts_with(kWorld); }

std::string world_link(std::string_view name) { return fmt::format("{}{}", kWorld, name); }

}  // namespace linden

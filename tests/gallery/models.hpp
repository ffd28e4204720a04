// tests/gallery/models.hpp
// Bodies and chains that several families of cases are made of.
#pragma once

#include <fmt/format.h>

#include <string>

#include "models/build/builder.hpp"

namespace linden {

/// One body on a joint of this type at the world's origin.
inline Model one_body(JointType type, const LinkInertia& inertia, const Eigen::Vector3d& axis = Eigen::Vector3d::UnitZ()) {
  LinkSpec link;
  link.name = "body";
  link.joint = "joint";
  link.type = type;
  link.axis = axis;
  link.inertia = inertia;
  return TreeBuilder("one body").add(link).build();
}

/// Principal moments.
inline Eigen::Matrix3d moments(double x, double y, double z) { return Eigen::Vector3d(x, y, z).asDiagonal(); }

enum class Hinges { crossed, parallel };  // about y and z in turn, or all about y

/// Links of `length` along x on hinges, the first at the world's origin; inertia(i) of link i, in its frame.
template <class Inertia>
Model hinged_chain(const std::string& name, Index links, double length, const Inertia& inertia, Hinges hinges = Hinges::crossed) {
  TreeBuilder builder(name);
  for (Index i = 0; i < links; ++i) {
    LinkSpec link;
    link.name = fmt::format("link{}", i + 1);
    link.joint = fmt::format("joint{}", i + 1);
    if (i > 0) link.parent = fmt::format("link{}", i);
    if (i > 0) link.placement.translation().x() = length;
    link.axis = i % 2 == 0 || hinges == Hinges::parallel ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitZ();
    link.inertia = inertia(i);
    builder.add(std::move(link));
  }
  return builder.build();
}

/// A thin box of that length along x; `width` as a share of it.
inline LinkInertia rod(double mass, double length, double width = 0.2) {
  return box_inertia(mass, {length, width * length, width * length}, {0.5 * length, 0, 0});
}

}  // namespace linden

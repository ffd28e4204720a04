// Mechanisms with loops, as textbooks draw them, for tests.
#pragma once

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "engine/simulation.hpp"
#include "models/build/builder.hpp"
#include "models/build/coupled_model.hpp"

namespace linden {

/// A thin rod from its joint to `to`, a kilogram a metre; it turns about `axis`.
inline LinkSpec bar(const std::string& name, const std::string& parent, const Eigen::Vector3d& at, const Eigen::Vector3d& to,
                    const Eigen::Vector3d& axis = Eigen::Vector3d::UnitY()) {
  LinkSpec link;
  link.name = name;
  link.parent = parent;
  link.joint = name + "_joint";
  link.axis = axis;
  link.placement.translation() = at;
  const double length = to.norm();
  const Eigen::Vector3d along = to / length;
  link.inertia = {length, to / 2, length * length * length / 12 * (Eigen::Matrix3d::Identity() - along * along.transpose()) + 1e-4 * Eigen::Matrix3d::Identity()};
  return link;
}

/// Crank 1 m, coupler 2 m, rocker sqrt(5) m, in the xz plane.
inline Model four_bar(CouplingKind kind) {
  TreeBuilder builder("four-bar");
  builder.add(bar("crank", "", {0, 0, 0}, {0, 0, 1}));
  builder.add(bar("coupler", "crank", {0, 0, 1}, {2, 0, 1}));
  builder.add(bar("rocker", "", {3, 0, 0}, {-1, 0, 2}));
  CouplingSpec pin{.name = "pin", .kind = kind, .link_a = "coupler", .link_b = "rocker", .at = PointAndAxis{{2, 0, 2}, {0, 1, 0}}};
  return coupled(builder.build(), {pin});
}

/// Two equal cranks and a coupler as long as the ground: all bars in one line at its change points.
inline Model parallelogram() {
  TreeBuilder builder("parallelogram");
  builder.add(bar("left", "", {0, 0, 0}, {0, 0, 1}));
  builder.add(bar("top", "left", {0, 0, 1}, {2, 0, 0}));
  builder.add(bar("right", "", {2, 0, 0}, {0, 0, 1}));
  return coupled(builder.build(), {{.name = "pin", .kind = CouplingKind::hinge, .link_a = "top", .link_b = "right", .at = PointAndAxis{{2, 0, 1}, {0, 1, 0}}}});
}

/// Bricard's octahedral loop of six rods at right angles (Masarati's benchmark): one degree of freedom, all rows of it redundant by one.
inline Model bricard() {
  TreeBuilder builder("bricard");
  using V = Eigen::Vector3d;
  const V to[] = {{1, 0, 0}, {0, 0, -1}, {0, 1, 0}, {-1, 0, 0}, {0, 0, 1}};
  const V axes[] = {{0, 0, 1}, {0, 1, 0}, {1, 0, 0}, {0, 0, 1}, {0, 1, 0}};  // at right angles to the rods on both sides
  std::string parent;
  V at(0, 0, 0), end(0, 0, 0);
  for (int k = 0; k < 5; ++k) {
    const std::string name = "rod" + std::to_string(k);
    builder.add(bar(name, parent, at, to[k], axes[k]));
    at = to[k];
    end += to[k];
    parent = name;
  }
  return coupled(builder.build(), {{.name = "last", .kind = CouplingKind::hinge, .link_a = parent, .link_b = "world", .at = PointAndAxis{end, {1, 0, 0}}}});
}

/// n rods in a regular polygon in the plane, free to move, closed by a hinge.
inline Model ring(int n) {
  TreeBuilder builder("ring");
  LinkSpec first = bar("rod0", "", {0, 0, 0}, {1.0, 0, 0});
  first.type = JointType::free;
  builder.add(first);
  const double turn = 2 * std::numbers::pi / n;
  for (int k = 1; k < n; ++k) {
    LinkSpec next = bar("rod" + std::to_string(k), "rod" + std::to_string(k - 1), {1, 0, 0}, {1.0, 0, 0});
    next.placement.linear() = Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitY()).toRotationMatrix();
    builder.add(next);
  }
  CouplingSpec pin{.name = "pin", .kind = CouplingKind::hinge, .link_a = "rod" + std::to_string(n - 1), .link_b = "rod0", .at = PointAndAxis{{0, 0, 0}, {0, 1, 0}}};
  return coupled(builder.build(), {pin});
}

/// The largest gap of any row.
inline double worst_gap(const std::vector<CouplingState>& states) {
  double worst = 0;
  for (const CouplingState& state : states) {
    for (const double gap : state.gaps) worst = std::max(worst, std::abs(gap));
  }
  return worst;
}

}  // namespace linden

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

/// Andrews' squeezing mechanism: seven bodies in the plane, three of them pinned to one point, and a spring; a benchmark of the IVP test set, with
/// its numbers and names (Schiehlen, Multibody Systems Handbook, 1990). Its crank is driven by 0.033 N m.
inline Model squeezer() {
  constexpr double xa = -0.06934, ya = -0.00227, xb = -0.03635, yb = 0.03273, xc = 0.014, yc = 0.072;
  constexpr double d = 28e-3, da = 115e-4, e = 2e-2, ea = 1421e-5, zf = 2e-2, fa = 1421e-5, rr = 7e-3, ra = 92e-5, ss = 35e-3, sa = 1874e-5, sb = 1043e-5,
                   sc = 18e-3, sd = 2e-2, zt = 4e-2, ta = 2308e-5, tb = 916e-5, u = 4e-2, ua = 1228e-5, ub = 449e-5;
  using V = Eigen::Vector3d;
  TreeBuilder builder("squeezer");
  const auto add = [&](const std::string& name, const std::string& parent, V at, double mass, V center, double inertia) {
    LinkSpec link;
    link.name = name;
    link.parent = parent;
    link.joint = name + "_joint";
    link.axis = V::UnitZ();
    link.placement.translation() = at;
    link.inertia = {mass, center, inertia * Eigen::Matrix3d::Identity()};
    builder.add(link);
  };
  add("K1", "", {0, 0, 0}, 0.04325, {ra, 0, 0}, 2.194e-6);
  add("K2", "K1", {rr, 0, 0}, 0.00365, {-da, 0, 0}, 4.410e-7);
  add("K3", "", {xb, yb, 0}, 0.02373, {sb, -sa, 0}, 5.255e-6);
  add("K5", "", {xa, ya, 0}, 0.07050, {ta, tb, 0}, 1.169e-5);
  add("K4", "K5", {zt, 0, 0}, 0.00706, {0, -(e - ea), 0}, 5.667e-7);
  add("K7", "", {xa, ya, 0}, 0.05498, {-ub, -ua, 0}, 1.912e-5);
  add("K6", "K7", {0, -u, 0}, 0.00706, {zf - fa, 0, 0}, 5.667e-7);
  const auto pin = [&](const std::string& name, const std::string& link, V at) {
    CouplingSpec spec{.name = name, .kind = CouplingKind::ball, .link_a = "K2", .link_b = link};
    spec.frame_a.translation() = V(-d, 0, 0);
    spec.frame_b.translation() = at;
    return spec;
  };
  CouplingSpec spring{.name = "spring", .kind = CouplingKind::rod, .link_a = "", .link_b = "K3", .length = 7785e-5, .shift = {4530, 0}};
  spring.frame_a.translation() = V(xc, yc, 0);
  spring.frame_b.translation() = V(sd, -sc, 0);
  return coupled(builder.build(), {pin("E", "K3", {0, -ss, 0}), pin("G", "K4", {0, -e, 0}), pin("H", "K6", {zf, 0, 0}), spring});
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

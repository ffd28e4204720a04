// Of generators.hpp: models with closed loops. In the zero configuration all of them are closed.
#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "models/build/builder.hpp"
#include "models/build/coupled_model.hpp"
#include "models/build/generators.hpp"

namespace linden {
namespace {

using Eigen::AngleAxisd;
using Eigen::Vector3d;

constexpr double kRight = std::numbers::pi / 2;

// of a bicycle chain, half an inch by 1/8
constexpr double kPitch = 0.0127, kPlatesApart = 0.005;                         // [m]
constexpr double kPlateMass = 0.9e-3, kPinMass = 0.6e-3;                        // [kg]
constexpr double kPinDiameter = 3.66e-3, kPinLength = 7.3e-3;                   // [m]
// a box with the moments of a plate of 21 x 8.3 mm with round ends and two holes [m]
constexpr double kPlateLength = 0.019, kPlateHeight = 0.008, kPlateThickness = 0.001;

/// A rod along x, `share` times as long and as heavy as those of chains; it turns about y.
LinkSpec rod_link(std::string name, std::string parent, const Isometry& placement, double share = 1) {
  LinkSpec link;
  link.joint = name + "_joint";
  link.name = std::move(name);
  link.parent = std::move(parent);
  link.placement = placement;
  link.axis = Vector3d::UnitY();
  link.inertia = box_inertia(share * kRodMass, {share * kRodLength, kRodThickness, kRodThickness}, {share * kRodLength / 2, 0, 0});
  return link;
}

/// At (x, 0, z), turned about y.
Isometry turned_at(double x, double z, double turn) {
  Isometry pose = Isometry::Identity();
  pose.linear() = AngleAxisd(turn, Vector3d::UnitY()).toRotationMatrix();
  pose.translation() = Vector3d(x, 0, z);
  return pose;
}

struct RodPlace {
  std::string link;
  double x, z;
};

/// A hinge about y, which both links have in common.
CouplingSpec hinge_pin(std::string name, const RodPlace& a, const RodPlace& b) {
  CouplingSpec spec{.name = std::move(name), .kind = CouplingKind::hinge, .link_a = a.link, .link_b = b.link};
  Eigen::Matrix3d z_along_y;
  z_along_y << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  spec.frame_a.linear() = spec.frame_b.linear() = z_along_y;
  spec.frame_a.translation() = Vector3d(a.x, 0, a.z);
  spec.frame_b.translation() = Vector3d(b.x, 0, b.z);
  return spec;
}

/// A plate of a roller chain along x; it turns about y, on the pin before it.
LinkSpec plate_link(std::string name, std::string pin, double y) {
  LinkSpec link;
  link.joint = name + "_joint";
  link.name = std::move(name);
  link.parent = std::move(pin);
  link.placement.translation() = Vector3d(0, y, 0);
  link.axis = Vector3d::UnitY();
  link.inertia = box_inertia(kPlateMass, {kPlateLength, kPlateThickness, kPlateHeight}, {kPitch / 2, 0, 0});
  return link;
}

/// A pin along y through both plates; it turns in the hole of the left one, where its frame is.
LinkSpec pin_link(std::string name, std::string left_plate) {
  LinkSpec link;
  link.joint = name + "_joint";
  link.name = std::move(name);
  link.parent = std::move(left_plate);
  link.placement.translation() = Vector3d(kPitch, 0, 0);
  link.axis = Vector3d::UnitY();
  const double square = kPinDiameter * kPinDiameter / 4, across = kPinMass * (3 * square + kPinLength * kPinLength) / 12;
  link.inertia = {kPinMass, {0, -kPlatesApart / 2, 0}, Vector3d(across, kPinMass * square / 2, across).asDiagonal()};
  return link;
}

}  // namespace

Model hanging_ring(Index rods) {
  TreeBuilder builder(fmt::format("ring:{}", rods));
  const double turn = 2 * std::numbers::pi / static_cast<double>(rods);
  for (Index i = 1; i <= rods; ++i) {
    const std::string before = i == 1 ? "" : fmt::format("link{}", i - 1);
    builder.add(rod_link(fmt::format("link{}", i), before, i == 1 ? turned_at(0, 0, 0) : turned_at(kRodLength, 0, turn)));
  }
  return coupled(builder.build(), {hinge_pin("pin", {fmt::format("link{}", rods), kRodLength, 0}, {"link1", 0, 0})});
}

Model four_bars(Index count) {
  TreeBuilder builder(fmt::format("fourbars:{}", count));
  const double ground = 1.5 * kRodLength, overhang = kRodLength / 4, lean = std::asin(0.25);
  std::vector<CouplingSpec> pins;
  for (Index i = 1; i <= count; ++i) {
    // the ground of all but the first lies on the coupler before it, and is longer than that on both sides
    const std::string before = i == 1 ? "" : fmt::format("coupler{}", i - 1);
    const Isometry base = i == 1 ? Isometry::Identity() : turned_at(-overhang, 0, -kRight);
    const std::string crank = fmt::format("crank{}", i), coupler = fmt::format("coupler{}", i), rocker = fmt::format("rocker{}", i);
    builder.add(rod_link(crank, before, base * turned_at(0, 0, lean)));
    builder.add(rod_link(coupler, crank, turned_at(kRodLength, 0, kRight - lean)));
    builder.add(rod_link(rocker, before, base * turned_at(0, -ground, -lean)));
    pins.push_back(hinge_pin(fmt::format("pin{}", i), {coupler, kRodLength, 0}, {rocker, kRodLength, 0}));
  }
  return coupled(builder.build(), pins);
}

Model ladder(Index cells) {
  TreeBuilder builder(fmt::format("ladder:{}", cells));
  const double width = kRodLength / 2;
  std::vector<CouplingSpec> pins;
  for (Index i = 1; i <= cells; ++i) {
    const std::string left = fmt::format("left{}", i), rung = fmt::format("rung{}", i), right = fmt::format("right{}", i);
    builder.add(rod_link(left, i == 1 ? "" : fmt::format("left{}", i - 1), turned_at(i == 1 ? 0 : kRodLength, 0, 0)));
    builder.add(rod_link(rung, left, turned_at(kRodLength, 0, kRight), 0.5));
    builder.add(rod_link(right, rung, turned_at(width, 0, kRight)));
    const RodPlace before = i == 1 ? RodPlace{"", 0, -width} : RodPlace{fmt::format("rung{}", i - 1), width, 0};
    pins.push_back(hinge_pin(fmt::format("pin{}", i), {right, kRodLength, 0}, before));
  }
  return coupled(builder.build(), pins);
}

Model roller_chain(Index links) {
  TreeBuilder builder(fmt::format("roller-chain:{}", links));
  std::vector<CouplingSpec> presses;
  for (Index i = 1; i <= links; ++i) {
    const std::string before = i == 1 ? "" : fmt::format("pin{}", i - 1);
    const std::string left = fmt::format("left{}", i), right = fmt::format("right{}", i), pin = fmt::format("pin{}", i);
    builder.add(plate_link(left, before, i == 1 ? kPlatesApart / 2 : 0));
    builder.add(pin_link(pin, left));
    builder.add(plate_link(right, before, i == 1 ? -kPlatesApart / 2 : -kPlatesApart));
    CouplingSpec press{.name = fmt::format("press{}", i), .kind = CouplingKind::weld, .link_a = pin, .link_b = right};
    press.frame_a.translation() = Vector3d(0, -kPlatesApart, 0);
    press.frame_b.translation() = Vector3d(kPitch, 0, 0);
    presses.push_back(std::move(press));
  }
  return coupled(builder.build(), presses);
}

Model rope_net(Index ropes, Index knots) {
  TreeBuilder builder(fmt::format("net:{}x{}", ropes, knots));
  std::vector<CouplingSpec> ties;
  for (Index a = 1; a <= ropes; ++a) {
    for (Index b = 1; b <= knots; ++b) {
      Isometry place = Isometry::Identity();
      place.translation() = b == 1 ? Vector3d(0, kRodLength * static_cast<double>(a - 1), 0) : Vector3d(kRodLength, 0, 0);
      LinkSpec link = rod_link(fmt::format("rope{}_{}", a, b), b == 1 ? "" : fmt::format("rope{}_{}", a, b - 1), place);
      link.type = JointType::ball;
      builder.add(std::move(link));
      if (a == ropes) continue;
      Isometry across = Isometry::Identity();
      across.linear() = AngleAxisd(kRight, Vector3d::UnitZ()).toRotationMatrix();
      across.translation() = Vector3d(kRodLength, 0, 0);
      const std::string name = fmt::format("across{}_{}", a, b);
      link = rod_link(name, fmt::format("rope{}_{}", a, b), across);
      link.type = JointType::ball;
      builder.add(std::move(link));
      CouplingSpec knot{.name = fmt::format("knot{}_{}", a, b), .link_a = name, .link_b = fmt::format("rope{}_{}", a + 1, b)};
      knot.frame_a.translation() = knot.frame_b.translation() = Vector3d(kRodLength, 0, 0);
      ties.push_back(std::move(knot));
    }
  }
  return coupled(builder.build(), ties);
}

}  // namespace linden

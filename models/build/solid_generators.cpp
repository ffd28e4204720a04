// Of generators.hpp: loose solids on a floor, each on a free joint of its own. In the zero configuration what touches does so without a gap.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "models/build/builder.hpp"
#include "models/build/generators.hpp"
#include "models/build/random.hpp"
#include "models/build/world_shapes.hpp"

namespace linden {
namespace {

using Eigen::AngleAxisd;
using Eigen::Vector3d;

constexpr double kBoxEdge = 0.1, kBoxMass = 1;                         // [m, kg]
constexpr double kPileSpacing = 0.18;                                  // more than the diagonal of a box [m]
const Vector3d kBrick(0.2, 0.1, 0.1);                                  // [m]
constexpr double kBrickMass = 2;                                       // [kg]
const Vector3d kCard(0.002, 0.06, 0.1);                                // of beer mats [m]
constexpr double kCardMass = 0.005, kLean = 0.35;                      // [kg; rad from upright]
constexpr double kCardGap = 0.5e-3;                                    // between cards that lie in a row [m]
const Vector3d kDomino(0.01, 0.03, 0.06);                              // [m]
constexpr double kDominoMass = 0.02, kDominoSpacing = 0.03;            // [kg, m]
constexpr double kDominoLean = 0.2;                                    // of the first; beyond atan(1/6) it falls [rad]
constexpr double kFloorThickness = 0.05;                               // [m]

Isometry at(double x, double y, double z) {
  Isometry pose = Isometry::Identity();
  pose.translation() = Vector3d(x, y, z);
  return pose;
}
/// Turned about y, from z towards x.
Isometry leaning(double x, double z, double angle) {
  Isometry pose = at(x, 0, z);
  pose.linear() = AngleAxisd(angle, Vector3d::UnitY()).toRotationMatrix();
  return pose;
}

/// Boxes, which are called after what they are and counted from 1.
class Solids {
 public:
  Solids(std::string model, std::string called) : builder_(model), called_(std::move(called)) {}

  void add(const Vector3d& size, double mass, const Isometry& pose) {
    LinkSpec link;
    count_ += 1;
    link.name = fmt::format("{}{}", called_, count_);
    link.joint = link.name + "_joint";
    link.type = JointType::free;
    link.placement = pose;
    link.inertia = box_inertia(mass, size, Vector3d::Zero());
    link.shapes = {box_shape(size, Vector3d::Zero())};
    builder_.add(std::move(link));
    const Vector3d& p = pose.translation();
    low_ = low_.cwiseMin(p);
    high_ = high_.cwiseMax(p);
  }

  /// On a floor at z = 0, which reaches beyond them by as much as they are high, and a little.
  Model on_floor() const {
    const Vector3d middle = (low_ + high_) / 2;
    const double beyond = 0.1 + high_.z();
    const CollisionShape floor{ShapeKind::box, {high_.x() - low_.x() + 2 * beyond, high_.y() - low_.y() + 2 * beyond, kFloorThickness}, ""};
    return with_world(builder_.build(), {{"floor", floor, pose_of(at(middle.x(), middle.y(), -kFloorThickness / 2))}});
  }

 private:
  TreeBuilder builder_;
  std::string called_;
  Index count_ = 0;
  Vector3d low_ = Vector3d::Zero(), high_ = Vector3d::Zero();
};

}  // namespace

Model box_stack(Index boxes) {
  Solids solids(fmt::format("boxes:{}", boxes), "box");
  for (Index i = 0; i < boxes; ++i) solids.add(Vector3d::Constant(kBoxEdge), kBoxMass, at(0, 0, kBoxEdge * (static_cast<double>(i) + 0.5)));
  return solids.on_floor();
}

Model brick_wall(Index bricks) {
  Solids solids(fmt::format("wall:{}", bricks), "brick");
  const auto whole = std::max<Index>(1, static_cast<Index>(std::lround(std::sqrt(0.5 * static_cast<double>(bricks)))));  // bricks of a course
  const Vector3d half(kBrick.x() / 2, kBrick.y(), kBrick.z());
  double x = 0;
  for (Index i = 0, course = 0, in_course = 0; i < bricks; ++i) {
    const bool halves = course % 2 == 1, is_half = halves && (in_course == 0 || in_course == whole);
    const Vector3d& size = is_half ? half : kBrick;
    solids.add(size, is_half ? kBrickMass / 2 : kBrickMass, at(x + size.x() / 2, 0, kBrick.z() * (static_cast<double>(course) + 0.5)));
    x += size.x();
    if (++in_course < (halves ? whole + 1 : whole)) continue;
    x = 0;
    in_course = 0;
    course += 1;
  }
  return solids.on_floor();
}

Model box_pile(Index boxes) {
  Solids solids(fmt::format("pile:{}", boxes), "box");
  Random random(1);
  const auto side = std::max<Index>(1, static_cast<Index>(std::lround(std::cbrt(0.5 * static_cast<double>(boxes)))));  // boxes a row of a layer
  for (Index i = 0; i < boxes; ++i) {
    const auto place = [&](Index k) { return kPileSpacing * (static_cast<double>(k) - 0.5 * static_cast<double>(side - 1)); };
    Isometry pose = at(place(i % side), place(i / side % side), kPileSpacing * (static_cast<double>(i / (side * side)) + 0.5));
    pose.linear() = random.rotation().toRotationMatrix();
    solids.add(Vector3d::Constant(kBoxEdge), kBoxMass, pose);
  }
  return solids.on_floor();
}

Model card_house(Index storeys) {
  Solids solids(fmt::format("cards:{}", storeys), "card");
  const double sine = std::sin(kLean), cosine = std::cos(kLean), thick = kCard.x(), length = kCard.z();
  const double aside = length / 2 * sine + thick / 2 * cosine;     // middle of a leaning card from the line where two meet
  const double height = length * cosine + thick * sine;            // of a storey
  const double apart = length + kCardGap;                          // lines where two meet
  const Vector3d lying(length, kCard.y(), thick);
  for (Index storey = 0; storey < storeys; ++storey) {
    const Index pairs = storeys - storey;
    const double floor = static_cast<double>(storey) * (height + thick), first = 0.5 * apart * static_cast<double>(storey);
    for (Index k = 0; k < pairs; ++k) {
      const double x = first + apart * static_cast<double>(k), z = floor + height / 2;
      solids.add(kCard, kCardMass, leaning(x - aside, z, kLean));
      solids.add(kCard, kCardMass, leaning(x + aside, z, -kLean));
      if (k + 1 < pairs) solids.add(lying, kCardMass, at(x + apart / 2, 0, floor + height + thick / 2));
    }
  }
  return solids.on_floor();
}

Model domino_row(Index count) {
  Solids solids(fmt::format("dominoes:{}", count), "domino");
  for (Index i = 0; i < count; ++i) {
    // the first stands on the edge that is foremost
    const double lean = i == 0 ? kDominoLean : 0, sine = std::sin(lean), cosine = std::cos(lean);
    const double x = kDominoSpacing * static_cast<double>(i) + kDomino.x() / 2 * (1 - cosine) + kDomino.z() / 2 * sine;
    solids.add(kDomino, kDominoMass, leaning(x, kDomino.z() / 2 * cosine + kDomino.x() / 2 * sine, lean));
  }
  return solids.on_floor();
}

}  // namespace linden

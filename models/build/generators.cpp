#include "models/build/generators.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <numbers>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "layout/support/words.hpp"
#include "models/build/builder.hpp"
#include "models/build/random.hpp"

namespace linden {
namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr Index kMostBodies = 10'000'000;

const Vector3d kBox(kRodLength, kRodThickness, kRodThickness);

LinkSpec box_link(Index i, Index parent, const Isometry3d& placement) {
  LinkSpec link;
  link.name = fmt::format("link{}", i);
  link.joint = fmt::format("joint{}", i);
  if (parent > 0) link.parent = fmt::format("link{}", parent);
  link.placement = placement;
  link.inertia = box_inertia(kRodMass, kBox, Vector3d(kRodLength / 2, 0, 0));
  return link;
}

Isometry3d shifted(double x) {
  Isometry3d pose = Isometry3d::Identity();
  pose.translation().x() = x;
  return pose;
}

Isometry3d tilted_base() {
  Isometry3d pose = Isometry3d::Identity();
  pose.linear() = AngleAxisd(std::numbers::pi / 4, Vector3d::UnitX()).toRotationMatrix();
  return pose;
}

Vector3d random_vector(Random& random, double size) {
  const double x = random.uniform(-size, size), y = random.uniform(-size, size), z = random.uniform(-size, size);
  return {x, y, z};
}

LinkInertia random_inertia(Random& random, double mass_decades) {
  // three point-like spreads along random axes: any such sum is the inertia of a body
  LinkInertia inertia;
  inertia.mass = std::pow(10.0, random.uniform(-0.5, 0.5) * mass_decades) * random.uniform(0.5, 2);
  inertia.center = random_vector(random, 0.1);
  const Vector3d spread(random.uniform(0.02, 0.1), random.uniform(0.02, 0.1), random.uniform(0.02, 0.1));
  const Vector3d s = inertia.mass * spread.cwiseProduct(spread);
  const Vector3d moments(s.y() + s.z(), s.x() + s.z(), s.x() + s.y());
  const Eigen::Matrix3d turn = random.rotation().toRotationMatrix();
  inertia.about_center = turn * moments.asDiagonal() * turn.transpose();
  return inertia;
}

/// A hinge and the box behind it.
struct Segment {
  const char* name;
  Vector3d axis;
  double along;  // height of the hinge above the one before [m]; below zero: the limb hangs
  double mass;   // [kg]
  Vector3d size;  // of the box [m]
  double center;  // height of its centre above the hinge [m]
};

/// Humanoid `number`; its names end in that number.
void add_humanoid(TreeBuilder& builder, Index number) {
  const Vector3d x = Vector3d::UnitX(), y = Vector3d::UnitY(), z = Vector3d::UnitZ(), knuckle(0.06, 0.06, 0.06);
  const Segment waist[] = {{"waist_yaw", z, 0, 1, knuckle, 0}, {"waist_roll", x, 0, 1, knuckle, 0},
                           {"torso", y, 0, 24, {0.2, 0.3, 0.45}, 0.22}};
  const Segment neck[] = {{"neck_yaw", z, 0, 0.4, knuckle, 0}, {"neck_roll", x, 0, 0.4, knuckle, 0},
                          {"head", y, 0, 4.6, {0.18, 0.15, 0.24}, 0.14}};
  const Segment arm[] = {{"shoulder_pitch", y, 0, 0.4, knuckle, 0},          {"shoulder_roll", x, 0, 0.4, knuckle, 0},
                         {"upper_arm", z, 0, 1.6, {0.08, 0.08, 0.3}, -0.15}, {"forearm", y, -0.3, 1.2, {0.07, 0.07, 0.25}, -0.12},
                         {"wrist_roll", x, -0.25, 0.2, knuckle, 0},          {"hand", y, 0, 0.4, {0.03, 0.08, 0.18}, -0.09}};
  const Segment leg[] = {{"hip_yaw", z, 0, 0.6, knuckle, 0},                  {"hip_roll", x, 0, 0.6, knuckle, 0},
                         {"thigh", y, 0, 9, {0.14, 0.14, 0.42}, -0.2},        {"shank", y, -0.42, 3.2, {0.1, 0.1, 0.43}, -0.2},
                         {"ankle_pitch", y, -0.43, 0.2, knuckle, 0},          {"foot", x, 0, 0.9, {0.26, 0.1, 0.06}, -0.03}};

  LinkSpec pelvis;
  pelvis.name = fmt::format("pelvis{}", number);
  pelvis.joint = fmt::format("base{}", number);
  pelvis.type = JointType::free;
  pelvis.placement = shifted(static_cast<double>(number - 1));
  pelvis.inertia = box_inertia(6.2, {0.2, 0.28, 0.16}, {0, 0, 0.05});
  pelvis.shapes = {box_shape({0.2, 0.28, 0.16}, {0, 0, 0.05})};
  builder.add(pelvis);
  const auto limb = [&](const char* side, const char* parent, Vector3d at, std::span<const Segment> segments) {
    std::string before = fmt::format("{}{}", parent, number);
    for (const Segment& segment : segments) {
      LinkSpec link;
      link.name = fmt::format("{}{}{}", side, segment.name, number);
      link.joint = link.name + "_joint";
      link.parent = std::exchange(before, link.name);
      link.placement = Isometry3d(Eigen::Translation3d(at + segment.along * z));
      link.axis = segment.axis;
      link.inertia = box_inertia(segment.mass, segment.size, segment.center * z);
      if (segment.size != knuckle) link.shapes = {box_shape(segment.size, segment.center * z)};
      at.setZero();
      builder.add(std::move(link));
    }
  };
  limb("", "pelvis", {0, 0, 0.12}, waist);
  limb("", "torso", {0, 0, 0.48}, neck);
  for (const double left : {1.0, -1.0}) {
    const char* side = left > 0 ? "left_" : "right_";
    limb(side, "torso", {0, 0.2 * left, 0.42}, arm);
    limb(side, "pelvis", {0, 0.09 * left, 0}, leg);
  }
}

}  // namespace

Model chain(Index links) {
  TreeBuilder builder(fmt::format("chain:{}", links));
  for (Index i = 1; i <= links; ++i) {
    LinkSpec link = box_link(i, i - 1, i == 1 ? tilted_base() : shifted(0.1));
    link.axis = i % 2 == 1 ? Vector3d::UnitY() : Vector3d::UnitZ();
    builder.add(std::move(link));
  }
  return builder.build();
}

Model paper_chain(Index links) {
  TreeBuilder builder(fmt::format("paper-chain:{}", links));
  for (Index i = 1; i <= links; ++i) {
    LinkSpec link = box_link(i, i - 1, shifted(i == 1 ? 0 : 1.5));
    link.axis = Vector3d::UnitY();
    link.inertia = box_inertia(1, Vector3d(1.5, 0.1, 0.1), Vector3d(0.75, 0, 0));
    builder.add(std::move(link));
  }
  return builder.build();
}

Model ball_chain(Index links) {
  TreeBuilder builder(fmt::format("ball-chain:{}", links));
  for (Index i = 1; i <= links; ++i) {
    LinkSpec link = box_link(i, i - 1, i == 1 ? tilted_base() : shifted(0.1));
    link.type = JointType::ball;
    builder.add(std::move(link));
  }
  return builder.build();
}

Model balanced_tree(Index bodies, Index branching) {
  TreeBuilder builder(fmt::format("tree:{}", bodies));
  for (Index i = 1; i <= bodies; ++i) {
    const Index parent = i == 1 ? 0 : (i - 2) / branching + 1;
    const Index sibling = i == 1 ? 0 : (i - 2) % branching;
    Isometry3d placement = i == 1 ? Isometry3d::Identity() : shifted(0.1);
    // siblings fan out
    placement.rotate(AngleAxisd(1.0 * (sibling + 0.5 - 0.5 * static_cast<double>(branching)), Vector3d::UnitZ()));
    LinkSpec link = box_link(i, parent, placement);
    link.axis = Vector3d::Unit(i % 3);
    builder.add(std::move(link));
  }
  return builder.build();
}

Model random_tree(const RandomTree& recipe) {
  Random random(recipe.seed);
  TreeBuilder builder(fmt::format("random:{} (seed {})", recipe.bodies, recipe.seed));
  std::vector<JointType> types;
  if (recipe.screws) types.insert(types.end(), {JointType::revolute, JointType::prismatic, JointType::helical});
  if (recipe.balls) types.push_back(JointType::ball);
  if (recipe.frees) types.push_back(JointType::free);
  if (types.empty()) throw InputError("a random tree needs at least one kind of joint");
  for (Index i = 1; i <= recipe.bodies; ++i) {
    // parents among the last few bodies: deep as well as bushy
    const Index reach = std::min<Index>(i - 1, 1 + static_cast<Index>(random.below(6)));
    const Index parent = i == 1 ? 0 : i - 1 - static_cast<Index>(random.below(static_cast<std::uint64_t>(reach)));
    Isometry3d placement = Isometry3d::Identity();
    placement.translate(random_vector(random, 0.2));
    placement.rotate(random.rotation());
    LinkSpec link = box_link(i, parent, placement);
    link.type = i == 1 && recipe.floating ? JointType::free : types[random.below(types.size())];
    const Vector3d axis = random_vector(random, 1);
    link.axis = axis.norm() > 0.1 ? axis.normalized() : Vector3d::UnitX();
    link.pitch = random.uniform(-0.1, 0.1);
    link.inertia = random_inertia(random, recipe.mass_decades);
    builder.add(std::move(link));
  }
  return builder.build();
}

Model humanoids(Index count) {
  TreeBuilder builder(fmt::format("humanoids:{}", count));
  for (Index i = 1; i <= count; ++i) add_humanoid(builder, i);
  return builder.build();
}

bool is_generated(const std::string& name) {
  const std::size_t colon = name.find(':');
  return colon != std::string::npos && name.find('/') == std::string::npos && name.find('.') == std::string::npos;
}

namespace {

/// Models that are as large as one number says.
struct GeneratedKind {
  std::string_view name;
  Model (*make)(Index);
  Index least = 1;
  double bodies = 1, rows = 0;  // of each that the number counts; its rows are solved together
  bool loose = false;           // solids that touch: those of contacts, of all of them together
};
constexpr double kRowsOfSolid = 12;  // four places where it is touched
constexpr std::string_view kCards = "cards";
constexpr GeneratedKind kGeneratedKinds[] = {
    {"chain", chain},
    {"ball-chain", ball_chain},
    {"paper-chain", paper_chain},
    {"tree", [](Index bodies) { return balanced_tree(bodies); }},
    {"random", [](Index bodies) { return random_tree({.bodies = bodies}); }},
    {"humanoids", humanoids, 1, kHumanoidBodies},
    {"ring", hanging_ring, 3},
    {"fourbars", four_bars, 1, 3, 5},
    {"ladder", ladder, 1, 3, 5},
    {"roller-chain", roller_chain, 1, 3, 6},
    {"boxes", box_stack, 1, 1, kRowsOfSolid, true},
    {"wall", brick_wall, 1, 1, kRowsOfSolid, true},
    {"pile", box_pile, 1, 1, kRowsOfSolid, true},
    {"dominoes", domino_row, 1, 1, kRowsOfSolid, true},
    {kCards, card_house, 1, 1, kRowsOfSolid, true},
};
constexpr std::string_view kNet = "net";

struct GeneratedName {
  std::string_view kind, size;

  const GeneratedKind* known() const {
    const auto found = std::ranges::find(kGeneratedKinds, kind, &GeneratedKind::name);
    return found == std::end(kGeneratedKinds) ? nullptr : found;
  }
  /// Before and after the x of a net.
  std::pair<std::string_view, std::string_view> sides() const {
    const std::size_t at = std::min(size.find('x'), size.size());
    return {size.substr(0, at), size.substr(std::min(at + 1, size.size()))};
  }
};

GeneratedName generated_parts(std::string_view name) {
  const std::size_t colon = std::min(name.find(':'), name.size());
  return {name.substr(0, colon), name.substr(std::min(colon + 1, name.size()))};
}

/// The number that the text is, all of it; zero where it is none.
Index count_written(std::string_view text) {
  Index count = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), count);
  return error == std::errc{} && end == text.data() + text.size() ? count : 0;
}

Model net_of(const std::string& name, const GeneratedName& parts) {
  const auto [ropes, knots] = parts.sides();
  const Index across = count_written(ropes), along = count_written(knots);
  if (across < 2 || along < 1 || across > kMostBodies || along > kMostBodies / across) {
    throw InputError(fmt::format("model {}: {} is no size of a net; expected ropes x knots of each, two ropes or more, and no more than {} knots; "
                                 "write for example net:4x6",
                                 quoted(name), quoted(parts.size), kMostBodies));
  }
  return rope_net(across, along);
}

}  // namespace

Model generate(const std::string& name) {
  const GeneratedName parts = generated_parts(name);
  if (parts.kind == kNet) return net_of(name, parts);
  const GeneratedKind* kind = parts.known();
  const Index count = count_written(parts.size), least = kind ? kind->least : 1;
  if (count < least || count > kMostBodies) {
    throw InputError(fmt::format("model {}: {} is no number of bodies; expected {} to {}; write for example {}:100", quoted(name),
                                 quoted(parts.size), least, kMostBodies, kind ? kind->name : "chain"));
  }
  if (kind) return kind->make(count);
  throw InputError(fmt::format("model {}: {} cannot be generated; expected chain, ball-chain, paper-chain, tree, random, humanoids, ring, "
                               "fourbars, ladder, roller-chain, net, boxes, wall, pile, cards or dominoes; choose one, or give a URDF file",
                               quoted(name), quoted(parts.kind)));
}

GeneratedSize generated_size(const std::string& name) {
  const GeneratedName parts = generated_parts(name);
  const auto number = [](std::string_view text) {
    double value = 0;
    std::from_chars(text.data(), text.data() + text.size(), value);
    return std::isnan(value) ? 0 : value;
  };
  if (parts.kind == kNet) {
    const double knots = number(parts.sides().first) * number(parts.sides().second);
    return {2 * knots, 3 * knots, 3 * knots};
  }
  const GeneratedKind* kind = parts.known();
  double count = number(parts.size);
  if (parts.kind == kCards) count *= (3 * count + 1) / 2;
  if (!kind) return {};
  return {kind->bodies * count, kind->rows * count, kind->rows * (kind->loose ? count : 1)};
}

bool needs_contact(const std::string& name) {
  const GeneratedKind* kind = is_generated(name) ? generated_parts(name).known() : nullptr;
  return kind && kind->loose;
}

}  // namespace linden

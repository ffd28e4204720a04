#include "engine/scene/scene_start.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/scene/scene_file.hpp"
#include "layout/effects.hpp"
#include "layout/support/words.hpp"
#include "models/build/isometry.hpp"
#include "models/build/vectors.hpp"

namespace linden {
namespace {

using Eigen::Vector3d;

const std::vector<std::string> kKeys{"base", "positions", "velocities", "seed", "spread"};
const std::vector<std::string> kBaseKeys{"position", "rotation", "quaternion", "velocity", "angular_velocity"};

Eigen::Matrix3d matrix_of(const std::array<double, 4>& q) { return Eigen::Quaterniond(q[3], q[0], q[1], q[2]).toRotationMatrix(); }

/// Body frame at q = 0 in the world, of a root.
Isometry placement_of(const Model& model, Index slot) {
  Isometry pose = Isometry::Identity();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      pose.linear()(row, column) = model.constants.tree_placement(slot, 3 * row + column);
    }
    pose.translation()[row] = model.constants.tree_placement(slot, 9 + row);
  }
  return pose;
}

class Start {
 public:
  Start(const Model& model, InitialState state) : model_(model), state_(std::move(state)) {}

  /// Moves a free root by the pose that its model is given.
  void place(const PlacedBase& base) {
    const Index slot = model_.names.slot_of_joint.at(base.joint);
    const Isometry placement = placement_of(model_, slot);
    put_pose(slot, placement.inverse() * isometry(base.start.pose()) * placement * pose_in(slot));
    put_velocity(slot, base.start);
  }

  /// Puts a free root where the scene says, in the world's frame; what it does not say stays.
  void put_base(Index slot, const BaseStart& start) {
    const Isometry placement = placement_of(model_, slot);
    Isometry world = placement * pose_in(slot);
    if (start.position) world.translation() = vector_of(*start.position);
    if (start.rotation) world.linear() = matrix_of(*start.rotation);
    put_pose(slot, placement.inverse() * world);
    put_velocity(slot, start);
  }

  void put_joint(const SceneValue::Entry& entry, bool velocity) {
    const SceneValue& at = entry.value;
    const Index row = at.located([&] { return row_of(model_, entry.key); });
    const Tree& tree = model_.tree;
    Index slot = 1;
    // rows ascend with slots
    for (Index low = 1, high = tree.shape.slots; low < high;) {
      const Index middle = (low + high) / 2;
      if (tree.first_v(middle) <= row) {
        slot = middle;
        low = middle + 1;
      } else {
        high = middle;
      }
    }
    for (const Mimic& mimic : model_.mimics) {
      if (mimic.follower_slot != slot) continue;
      at.fail(fmt::format("joint {} follows another", quoted(entry.key)), "a joint that follows none",
              fmt::format("name its leader {}", quoted(model_.names.joint[static_cast<std::size_t>(mimic.leader_slot)])));
    }
    switch (tree.kind(slot)) {
      case JointKind::screw: put(velocity, velocity ? tree.first_v(slot) : tree.first_q(slot), {at.number()}); break;
      case JointKind::ball:
        if (velocity) {
          put(true, tree.first_v(slot), at.numbers(3, "three numbers, the angular velocity in the body's frame"));
        } else {
          const std::array<double, 4> q = at.quaternion();
          put(false, tree.first_q(slot), {q.begin(), q.end()});
        }
        break;
      case JointKind::free:
        at.fail(fmt::format("joint {} is a free joint", quoted(entry.key)), "a joint that turns or slides",
                tree.parent(slot) == 0 ? "write initial.base, or position and velocity beside its model" : "leave it out");
    }
  }

  InitialState finish() {
    for (const Mimic& mimic : model_.mimics) {
      q(mimic.follower_q) = mimic.multiplier * q(mimic.leader_q) + mimic.offset;
      v(mimic.follower_v) = mimic.multiplier * v(mimic.leader_v);
    }
    return std::move(state_);
  }

 private:
  double& q(Index row) { return state_.positions[static_cast<std::size_t>(row)]; }
  double& v(Index row) { return state_.velocities[static_cast<std::size_t>(row)]; }

  void put(bool velocity, Index first, const std::vector<double>& values) {
    std::ranges::copy(values, velocity ? &v(first) : &q(first));
  }

  Isometry pose_in(Index slot) {
    const Index row = model_.tree.first_q(slot);
    Isometry pose = Isometry::Identity();
    pose.translation() = Vector3d(q(row), q(row + 1), q(row + 2));
    pose.linear() = Eigen::Quaterniond(q(row + 6), q(row + 3), q(row + 4), q(row + 5)).toRotationMatrix();
    return pose;
  }

  void put_pose(Index slot, const Isometry& pose) {
    Eigen::Quaterniond turn(Eigen::Matrix3d(pose.linear()));
    turn.normalize();
    const Vector3d p = pose.translation();
    put(false, model_.tree.first_q(slot), {p.x(), p.y(), p.z(), turn.x(), turn.y(), turn.z(), turn.w()});
  }

  /// From the world's frame to the body's.
  void put_velocity(Index slot, const BaseStart& start) {
    const Isometry world = placement_of(model_, slot) * pose_in(slot);
    const Index row = model_.tree.first_v(slot);
    const auto turned = [&](const std::array<double, 3>& u) {
      const Vector3d b = world.linear().transpose() * vector_of(u);
      return std::vector<double>{b.x(), b.y(), b.z()};
    };
    if (start.angular_velocity) put(true, row, turned(*start.angular_velocity));
    if (start.velocity) put(true, row + 3, turned(*start.velocity));
  }

  const Model& model_;
  InitialState state_;
};

}  // namespace

Pose BaseStart::pose() const {
  Isometry pose = Isometry::Identity();
  if (rotation) pose.linear() = matrix_of(*rotation);
  if (position) pose.translation() = vector_of(*position);
  return pose_of(pose);
}

BaseStart read_base(const SceneValue& at) {
  BaseStart start;
  if (const auto position = at.find("position")) start.position = position->vector("[x, y, z] in m");
  const auto rotation = at.find("rotation"), quaternion = at.find("quaternion");
  if (rotation && quaternion) quaternion->fail("rotation and quaternion are both given", "one of them", "leave one out");
  if (rotation) {
    const std::array<double, 3> angles = rotation->vector("[roll, pitch, yaw] in rad");
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(angles[2], Vector3d::UnitZ()) * Eigen::AngleAxisd(angles[1], Vector3d::UnitY()) *
                                  Eigen::AngleAxisd(angles[0], Vector3d::UnitX()));
    start.rotation = {turn.x(), turn.y(), turn.z(), turn.w()};
  }
  if (quaternion) start.rotation = quaternion->quaternion();
  if (const auto velocity = at.find("velocity")) start.velocity = velocity->vector("[x, y, z] in m/s");
  if (const auto velocity = at.find("angular_velocity")) start.angular_velocity = velocity->vector("[x, y, z] in rad/s");
  return start;
}

std::vector<Index> floating_roots(const Model& model) {
  std::vector<Index> slots = model.tree.roots();
  std::erase_if(slots, [&](Index root) { return model.tree.kind(root) != JointKind::free; });
  return slots;
}

std::optional<std::uint64_t> read_seed(const std::optional<SceneValue>& at, const SceneStart& given) {
  constexpr double kMostSeed = 9007199254740992.0;  // whole numbers beyond it have no double of their own
  const auto value = at ? at->find("seed") : std::nullopt;
  if (!value) return given.seed;
  const double number = value->not_negative();
  if (number != std::floor(number) || number > kMostSeed) value->refuse("a whole number, zero or more", "change it");
  return given.seed ? given.seed : static_cast<std::uint64_t>(number);
}

InitialState read_start(const std::optional<SceneValue>& at, const Model& model, const std::vector<PlacedBase>& bases,
                        const SceneStart& given, std::span<const JointLimit> limits) {
  std::optional<double> spread = given.spread;
  const bool any = at && !at->is(SceneValue::Kind::nothing);
  if (any) {
    at->entries_of(kKeys);
    if (const auto value = at->find("spread")) spread = spread.value_or(value->not_negative());
  }
  const std::optional<std::uint64_t> seed = read_seed(at, given);
  InitialState state{model.neutral(), std::vector<double>(static_cast<std::size_t>(model.tree.shape.velocities), 0.0)};
  if (seed || spread) state = random_state(model, seed.value_or(kDefaultSeed), spread.value_or(kDefaultSpread), limits);
  Start start(model, std::move(state));
  for (const PlacedBase& base : bases) start.place(base);
  if (!any) return start.finish();

  if (const auto base = at->find("base")) {
    base->entries_of(kBaseKeys);
    const std::vector<Index> roots = floating_roots(model);
    if (roots.empty()) base->fail("the scene has no floating base", "one", "write base: floating, or leave this out");
    if (roots.size() > 1) {
      base->fail(fmt::format("the scene has {} floating bases", roots.size()), "one",
                 "write position, rotation and velocity beside each model in models");
    }
    start.put_base(roots.front(), read_base(*base));
  }
  for (const bool velocity : {false, true}) {
    const auto values = at->find(velocity ? "velocities" : "positions");
    if (!values || values->is(SceneValue::Kind::nothing)) continue;
    for (const SceneValue::Entry& entry : values->entries("a map of joints")) start.put_joint(entry, velocity);
  }
  return start.finish();
}

}  // namespace linden

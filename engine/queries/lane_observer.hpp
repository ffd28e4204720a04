// engine/queries/lane_observer.hpp
// Observations of a block of W states: lane = state. Bodies are followed down the tree as far as the schedule says, then each entry is read
// off.
#pragma once

#include <algorithm>
#include <array>

#include "engine/queries/block_observer.hpp"
#include "kernels/block/lane_constants.hpp"
#include "kernels/queries/ground_push_map.hpp"
#include "kernels/queries/quaternion_of.hpp"
#include "kernels/queries/total_momentum_map.hpp"

namespace linden {

template <class Pack>
class LaneObserver final : public BlockObserver<typename ElementOf<Pack>::type> {
 public:
  using Real = typename ElementOf<Pack>::type;
  using L = LanesOf<Pack>;
  static constexpr int W = L::count;

  explicit LaneObserver(const ObserverSetup<Real>& setup)
      : tree_(setup.tree), schedule_(setup.schedule), constants_(setup.constants),
        gravity_{as<Pack>(setup.gravity[0]), as<Pack>(setup.gravity[1]), as<Pack>(setup.gravity[2])} {
    q_.allocate(tree_.shape.positions);
    v_.allocate(tree_.shape.velocities, Pack(Real(0)));
    a_.allocate(tree_.shape.velocities, Pack(Real(0)));
    if (schedule_.follows) motions_.allocate(tree_.shape);
    points_.allocate({.slots = static_cast<Index>(schedule_.ground.points.size())});
    std::ranges::fill(points_.bore.flat(), Pack(Real(0)));  // nothing is known of a step before
  }

  void observe(const ObservedBlock<Real>& block, Real* rows) override {
    if (block.gravity != nullptr) gravity_ = {L::load(block.gravity), L::load(block.gravity + W), L::load(block.gravity + 2 * W)};
    if (schedule_.follows) follow(block);
    for (const ScheduledLook& look : schedule_.looks) read(block, look, rows + look.offset * W);
  }

 private:
  void follow(const ObservedBlock<Real>& block) {
    const auto load_rows = [](const Real* from, Field<Pack>& to) LINDEN_INLINE_LAMBDA {
      for (Index row = 0; from != nullptr && row < to.rows(); ++row) to(row) = L::load(from + row * W);
    };
    load_rows(block.q, q_);
    load_rows(block.v, v_);
    load_rows(block.a, a_);
    constants_.use_masses(block.mass);
    switch (schedule_.depth) {
      case MotionDepth::poses: move<MotionDepth::poses>(); break;
      case MotionDepth::twists: move<MotionDepth::twists>(); break;
      case MotionDepth::accelerations: move<MotionDepth::accelerations>(); break;
    }
    if (schedule_.momenta) {
      total_ = total_momentum_map<true>(tree_, constants_, motions_);
    } else if (schedule_.totals) {
      total_ = total_momentum_map<false>(tree_, constants_, motions_);
    }
    if (points_.gap.rows() > 0) find_ground(schedule_.ground, motions_.pose, points_);
  }
  template <MotionDepth Depth>
  [[gnu::noinline]] void move() {
    body_motion_down<Depth>(tree_, constants_, schedule_.slots.data(), schedule_.slots.size(), q_, v_, a_, motions_);
  }

  void read(const ObservedBlock<Real>& block, const ScheduledLook& look, Real* to) {
    switch (look.what) {
      case Look::positions: return copy(block.q, look, to);
      case Look::velocities: return copy(block.v, look, to);
      case Look::accelerations: return copy(block.a, look, to);
      case Look::momenta: return copy(block.p, look, to);
      case Look::targets: return copy(block.targets, look, to);
      case Look::time: return copy(block.time, look, to);
      case Look::energy: return copy(block.energy, look, to);
      case Look::centre_of_mass: return put(total_.moment / total_.mass, to);
      case Look::centre_of_mass_velocity: return put(total_.momentum.f / total_.mass, to);
      case Look::momentum:
        put(total_.momentum.n, to);
        return put(total_.momentum.f, to + 3 * W);
      default: return read_link(block, look, to);
    }
  }

  void read_link(const ObservedBlock<Real>& block, const ScheduledLook& look, Real* to) {
    const Index i = look.link.slot;
    const Placement<Pack> link = spread(look.link.in_body);
    const auto T = load<Placement, Pack>(motions_.pose, i);
    const Mat3<Pack> R = T.R * link.R;
    switch (look.what) {
      case Look::pose:
        put(T.p + T.R * link.p, to);
        return put(quaternion_of(R), to + 3 * W);
      case Look::position: return put(T.p + T.R * link.p, to);
      case Look::quaternion: return put(quaternion_of(R), to);
      case Look::contact: {
        GroundPush<Pack> push = ground_push_map(schedule_.ground, i, load<Twist, Pack>(motions_.twist, i), points_);
        for (const ObservationSchedule::Load& of_shape : schedule_.loads) {
          if (of_shape.slot != i || block.contacts == nullptr) continue;
          push.points = push.points + remembered(block.contacts + of_shape.number * W);
          push.force = push.force + remembered(block.contacts + (of_shape.number + 1) * W);
        }
        L::store(push.points, to);
        return L::store(push.force, to + W);
      }
      default: break;
    }
    const Twist<Pack> V = to_child(link, load<Twist, Pack>(motions_.twist, i));  // in the link's frame
    if (look.what == Look::twist) {
      put(R * V.w, to);
      return put(R * V.v, to + 3 * W);
    }
    const Twist<Pack> A = to_child(link, load<Twist, Pack>(motions_.acceleration, i));
    const Vec3<Pack> linear = A.v + cross(V.w, V.v);
    const bool imu = look.what == Look::imu;
    put(imu ? V.w : R * A.w, to);
    put(imu ? linear - transpose_times(R, gravity_) : R * linear, to + 3 * W);
  }

  static Placement<Pack> spread(const Pose& pose) {
    Pack rotation[9];
    for (std::size_t k = 0; k < 9; ++k) rotation[k] = as<Pack>(pose.rotation[k]);
    return {Mat3<Pack>::from(rotation), spread3<Pack>(pose.shift)};
  }
  static Pack remembered(const double* row) {
    alignas(kAlignment) std::array<Real, W> each;
    for (std::size_t l = 0; l < W; ++l) each[l] = static_cast<Real>(row[l]);
    return L::load(each.data());
  }
  static void put(const Vec3<Pack>& a, Real* to) {
    L::store(a.x, to);
    L::store(a.y, to + W);
    L::store(a.z, to + 2 * W);
  }
  static void put(const Quaternion<Pack>& q, Real* to) {
    put(q.v, to);
    L::store(q.w, to + 3 * W);
  }
  static void copy(const Real* rows, const ScheduledLook& look, Real* to) {
    const Real* const from = rows + look.first * W;
    for (Index k = 0; k < look.count * W; ++k) to[k] = from[k];
  }

  const Tree& tree_;
  const ObservationSchedule& schedule_;
  BodyConstants<EachLane<Pack>> constants_;
  Vec3<Pack> gravity_;
  Field<Pack> q_, v_, a_;
  BodyMotions<Pack> motions_;
  TotalMomentum<Pack> total_;
  GroundPoints<Pack> points_;
};

}  // namespace linden

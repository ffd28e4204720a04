// Contacts of bodies with each other in a block of W instances: which of them have shapes that may touch in the next step. These are stepped alone
// (engine/sweeps/body_contacts.hpp), the others together and as if there were no contact at all.
//
//   near      at the beginning of a step, each pair of shapes in all lanes at once: apart as balls, or along the axes of the boxes around them, from
//             a plane along its normal, from heights above the highest;
//             what is left, lane by lane, as a step alone looks at it
//   end       of the lanes that were stepped together: nothing was borne, and shapes moved from where near saw them
//
// What is near hangs on a lane's own numbers alone.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <span>
#include <vector>

#include "engine/effects/effect_plan.hpp"
#include "engine/solve/block_stepper.hpp"
#include "engine/sweeps/body_contacts.hpp"
#include "kernels/collision/height_contacts.hpp"
#include "kernels/tree/world_placement_down.hpp"
#include "kernels/values/lanes_of.hpp"

namespace linden {

template <class Pack>
class LaneContacts {
 public:
  using Real = typename ElementOf<Pack>::type;
  using L = LanesOf<Pack>;
  static constexpr std::size_t W = static_cast<std::size_t>(L::count);

  /// The plan must outlive it.
  LaneContacts(const Tree& tree, const EffectPlan& plan) : tree_(tree), contact_(plan.pairs ? &*plan.effects.contact : nullptr) {
    if (contact_ == nullptr) return;
    numbers_of_touch_ = numbers_of_touch(*contact_);
    for (const ConvexBody& body : contact_->shapes) {
      const ConvexShape& shape = body.shape;
      Shape& one = shapes_.emplace_back();
      one.slot = body.slot;
      one.endless = is_endless(shape.kind);
      if (shape.heights) one.top = *std::ranges::max_element(shape.heights->heights);
      one.reach = core_reach(shape) + shape.radius;
      one.half = half_edges(shape);
      one.in_body = body.pose;
    }
    pose_.allocate(tree.shape.slots);
  }

  /// Those of `alive` in which shapes may touch, with the bodies placed so.
  [[gnu::noinline]] Lanes near(const Block<Real>& block, const Field<Pack, 12>& placement, Lanes alive) {
    if (contact_ == nullptr) return 0;
    world_placement_down(tree_, placement, pose_);
    for (std::size_t k = 0; k < shapes_.size(); ++k) place(block, k);
    Lanes found = 0;
    for (const auto& [a, b] : contact_->pairs) {
      const Pack margin = gap_looked_at(shapes_[a].reach, shapes_[b].reach, shapes_[a].moved, shapes_[b].moved);
      for (Lanes left = alive & ~found & maybe(shapes_[a], shapes_[b], margin); left != 0; left &= left - 1) {
        const int l = std::countr_zero(left);
        if (are_near(contact_->shapes[a].shape, pose_of(shapes_[a], l), contact_->shapes[b].shape, pose_of(shapes_[b], l),
                     static_cast<double>(L::lane(margin, l)))) {
          found |= Lanes{1} << l;
        }
      }
    }
    return found;
  }

  /// Of lanes that took the step together.
  void end(const Block<Real>& block, Lanes done) const {
    if (contact_ == nullptr) return;
    for (std::size_t k = 0; k < shapes_.size(); ++k) {
      const Vec3<Pack>& middle = shapes_[k].placed.p;
      const std::array<const Pack*, 3> along{&middle.x, &middle.y, &middle.z};
      for (std::size_t j = 0; j < 3; ++j) {
        alignas(kAlignment) std::array<Real, W> each;
        L::store(*along[j], each.data());
        double* const row = block.contacts + (kRememberedMiddle + 3 * k + j) * W;
        for (std::size_t l = 0; l < W; ++l) row[l] = (done >> l & 1u) != 0 ? static_cast<double>(each[l]) : row[l];
      }
    }
    const auto clear = [&](std::size_t number) {
      double* const row = block.contacts + number * W;
      for (std::size_t l = 0; l < W; ++l) row[l] = (done >> l & 1u) != 0 ? 0 : row[l];
    };
    for (const std::size_t none : {std::size_t{0}, kLasted, first_touch()}) clear(none);
    for (std::size_t k = 0; k < 2 * shapes_.size(); ++k) clear(remembered_load(shapes_.size()) + k);
  }

  /// What lane l remembers, into the memory of one that remembers nothing, for it to be stepped alone; and of the step that it took so.
  void take_out(const Block<Real>& block, int l, std::span<double> alone) const {
    each_remembered(alone, [&](std::size_t k) { return alone[k] = block.contacts[k * W + static_cast<std::size_t>(l)]; });
  }
  void keep_alone(const Block<Real>& block, int l, std::span<const double> alone) const {
    each_remembered(alone, [&](std::size_t k) { return block.contacts[k * W + static_cast<std::size_t>(l)] = alone[k]; });
  }

  /// Of those of a block in which something lasts, so that a step alone has more to tell of energy than lanes.
  Lanes lasting(const Block<Real>& block) const {
    Lanes lanes = 0;
    for (int l = 0; contact_ != nullptr && l < block.count; ++l) lanes |= block.contacts[kLasted * W + static_cast<std::size_t>(l)] != 0 ? Lanes{1} << l : 0;
    return lanes;
  }
  /// Energy stored at the end of the last step [J].
  Pack stored(const Block<Real>& block) const { return contact_ == nullptr ? Pack(Real(0)) : load(block.contacts); }

 private:
  struct Shape {
    Index slot;
    bool endless;                // a plane, or heights
    double top = 0;              // how high it goes along its z, where it is one of these [m]
    double reach;                // from its middle [m]
    std::array<double, 3> half;  // of a box around it, in its own axes [m]
    Pose in_body;
    Placement<Pack> placed{};    // in the world
    Pack moved{};                // in the last step [m]
  };

  static Pack number(double value) { return as<Pack>(value); }
  static Pack load(const double* row) {
    alignas(kAlignment) std::array<Real, W> each;
    for (std::size_t l = 0; l < W; ++l) each[l] = static_cast<Real>(row[l]);
    return L::load(each.data());
  }

  static std::array<double, 3> half_edges(const ConvexShape& shape) {
    std::array<double, 3> half{};
    switch (shape.kind) {
      case ConvexKind::point:
      case ConvexKind::plane:
      case ConvexKind::heights: break;
      case ConvexKind::segment: half = {0, 0, shape.half[2]}; break;
      case ConvexKind::cylinder: half = {shape.half[0], shape.half[0], shape.half[2]}; break;
      case ConvexKind::box:
      case ConvexKind::ellipsoid: half = shape.half; break;
      case ConvexKind::hull:
        for (const std::array<double, 3>& point : shape.hull->points) {
          for (std::size_t k = 0; k < 3; ++k) half[k] = std::max(half[k], std::abs(point[k]));
        }
    }
    for (double& edge : half) edge += shape.radius;
    return half;
  }

  void place(const Block<Real>& block, std::size_t k) {
    using std::sqrt;
    Shape& shape = shapes_[k];
    std::array<Pack, 12> numbers;
    for (std::size_t j = 0; j < 9; ++j) numbers[j] = number(shape.in_body.rotation[j]);
    for (std::size_t j = 0; j < 3; ++j) numbers[9 + j] = number(shape.in_body.shift[j]);
    const auto in_body = Placement<Pack>::from(numbers.data());
    const auto body = linden::load<Placement, Pack>(pose_, shape.slot);
    shape.placed = {body.R * in_body.R, body.p + body.R * in_body.p};
    const double* const before = block.contacts + (kRememberedMiddle + 3 * k) * W;
    const Vec3<Pack> step = shape.placed.p - Vec3<Pack>{load(before), load(before + W), load(before + 2 * W)};
    const Pack distance = sqrt(dot(step, step));
    shape.moved = select(distance >= number(0), distance, number(0));  // where nothing is known of a step before it is no number
  }

  /// Lanes in which the boxes around two shapes are not seen to be farther apart than this.
  static Lanes maybe(const Shape& a, const Shape& b, const Pack& margin) {
    using std::abs;
    if (a.endless) return maybe_over(a, b, margin);
    if (b.endless) return maybe_over(b, a, margin);
    const Vec3<Pack> apart = b.placed.p - a.placed.p;
    const Pack reach = number(a.reach + b.reach) + margin;
    const Lanes balls = ~L::bits(dot(apart, apart) > reach * reach);
    if ((balls & kAll) == 0) return 0;
    // of b's axes, as rows, seen along a's
    const Mat3<Pack> across = transpose(b.placed.R) * a.placed.R;
    const std::array<Vec3<Pack>, 3> rows{across.x, across.y, across.z};
    const Vec3<Pack> in_a = transpose_times(a.placed.R, apart), in_b = transpose_times(b.placed.R, apart);
    Pack of_a_x = number(a.half[0]), of_a_y = number(a.half[1]), of_a_z = number(a.half[2]);
    std::array<Pack, 3> of_b;
    for (std::size_t j = 0; j < 3; ++j) {
      const Pack x = abs(rows[j].x), y = abs(rows[j].y), z = abs(rows[j].z), half = number(b.half[j]);
      of_a_x = of_a_x + half * x;
      of_a_y = of_a_y + half * y;
      of_a_z = of_a_z + half * z;
      of_b[j] = half + number(a.half[0]) * x + number(a.half[1]) * y + number(a.half[2]) * z;
    }
    const Lanes apart_along = L::bits(abs(in_a.x) > of_a_x + margin) | L::bits(abs(in_a.y) > of_a_y + margin) |
                              L::bits(abs(in_a.z) > of_a_z + margin) | L::bits(abs(in_b.x) > of_b[0] + margin) |
                              L::bits(abs(in_b.y) > of_b[1] + margin) | L::bits(abs(in_b.z) > of_b[2] + margin);
    return balls & ~apart_along;
  }

  /// The same of what has no end and the box around a shape.
  static Lanes maybe_over(const Shape& plane, const Shape& shape, const Pack& margin) {
    using std::abs;
    const Vec3<Pack> n{plane.placed.R.x.z, plane.placed.R.y.z, plane.placed.R.z.z}, along = transpose_times(shape.placed.R, n);
    const Pack below = number(shape.half[0]) * abs(along.x) + number(shape.half[1]) * abs(along.y) + number(shape.half[2]) * abs(along.z);
    return ~L::bits(dot(n, shape.placed.p - plane.placed.p) > below + number(plane.top) + margin);
  }

  static Pose pose_of(const Shape& shape, int l) {
    std::array<Pack, 12> numbers;
    shape.placed.to(numbers.data());
    Pose pose;
    for (std::size_t j = 0; j < 9; ++j) pose.rotation[j] = static_cast<double>(L::lane(numbers[j], l));
    for (std::size_t j = 0; j < 3; ++j) pose.shift[j] = static_cast<double>(L::lane(numbers[9 + j], l));
    return pose;
  }

  /// copy(k), which returns the kth number, of all that is not behind the end of what is remembered.
  template <class Copy>
  void each_remembered(std::span<const double> alone, const Copy& copy) const {
    std::size_t k = 0;
    while (k < std::min(alone.size(), first_touch())) copy(k++);
    while (k < alone.size() && copy(k) != 0) {
      for (std::size_t j = 1; j < numbers_of_touch_; ++j) copy(k + j);
      k += numbers_of_touch_;
    }
  }

  std::size_t first_touch() const { return remembered_touch(shapes_.size(), static_cast<std::size_t>(tree_.shape.velocities)); }

  static constexpr Lanes kAll = W == 32 ? ~Lanes{0} : (Lanes{1} << W) - 1;

  const Tree& tree_;
  const PairContact* contact_;  // null: bodies do not touch each other
  std::size_t numbers_of_touch_ = 0;
  std::vector<Shape> shapes_;
  Field<Pack, 12> pose_;        // of bodies in the world
};

/// Where a scene has no effects.
struct NoLaneContacts {
  NoLaneContacts(const Tree&, const EffectPlan&) {}
};

}  // namespace linden

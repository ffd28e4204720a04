// kernels/block/lane_constants.hpp
// What never changes about the bodies of a block of instances: one robot for all, but for masses, which may be each instance's own. Which of
// the two is known when a row is read, not when a sweep is compiled: one branch a body, which a processor foresees, instead of every
// sweep twice. (The model's masses written out in every lane, so that there is nothing to ask, were measured too: 2 % slower.)
//
//   own masses    [slots x kMassRows][lane]: m, m c, xx xy xz yy yz zz, subtree mass
#pragma once

#include "kernels/values/joints.hpp"
#include "kernels/values/lanes_of.hpp"
#include "layout/body_constants.hpp"

namespace linden {

/// Rows of constants of bodies: the model's in all lanes, or those of each lane.
template <class S, int Components>
class LaneRows {
 public:
  using Real = typename ElementOf<S>::type;
  static constexpr int W = LanesOf<S>::count;

  /// first: of the rows of a body.
  LaneRows(const Field<Real, Components>& shared, int first) : shared_(shared), first_(first) {}
  /// null: the model's.
  void use(const Real* own) { own_ = own; }

  LINDEN_INLINE S operator()(Index i, int k = 0) const { return own_ == nullptr ? S(shared_(i, k)) : own(i, k); }
  LINDEN_INLINE void read(Index i, S* row) const {
    if (own_ == nullptr) {
      for (int k = 0; k < Components; ++k) row[k] = S(shared_(i, k));
    } else {
      for (int k = 0; k < Components; ++k) row[k] = own(i, k);
    }
  }

 private:
  LINDEN_INLINE S own(Index i, int k) const { return LanesOf<S>::load(own_ + (i * kMassRows + first_ + k) * W); }

  const Field<Real, Components>& shared_;
  const Real* own_ = nullptr;
  int first_;
};

template <template <class> class Value, class S, int Components>
LINDEN_INLINE Value<S> load(const LaneRows<S, Components>& rows, Index i) {
  static_assert(sizeof(Value<S>) == sizeof(S) * Components);
  S row[Components];
  rows.read(i, row);
  return Value<S>::from(row);
}

/// Of lanes of S.
template <class S>
struct EachLane {};

template <class S>
struct BodyConstants<EachLane<S>> {
  using Real = typename ElementOf<S>::type;

  explicit BodyConstants(const BodyConstants<Real>& shared)
      : screw(shared.screw), tree_placement(shared.tree_placement), inertia(shared.inertia, 0), subtree_mass(shared.subtree_mass, 10) {}
  /// Of each instance; null: the model's.
  void use_masses(const Real* own) {
    inertia.use(own);
    subtree_mass.use(own);
  }

  const Field<Real, 2>& screw;
  const Field<Real, 12>& tree_placement;
  LaneRows<S, 10> inertia;
  LaneRows<S, 1> subtree_mass;
};

}  // namespace linden

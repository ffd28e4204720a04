// tests/kernels/query_rig.hpp
// What the kernels of questions need, for any Scalar, with random states of a tree; and the proofs that each of them owes: every number
// that it is to write is written and nothing else, nothing is allocated, lanes are alike in any company and close to the plain path.
//
//   const auto kernel = [](auto& rig) { total_momentum_map<true>(rig.tree, rig.constants, rig.motions); };
//   check_query(prepare, kernel, {"momentum"});
#pragma once

#include <numeric>

#include "kernels/queries/body_motion_down.hpp"
#include "kernels/queries/jacobian_up.hpp"
#include "kernels/queries/motion_between_map.hpp"
#include "kernels/queries/newton_euler_map.hpp"
#include "kernels/queries/total_momentum_map.hpp"
#include "tests/kernels/rig.hpp"

namespace linden {

/// What a state is, and what it goes on to.
struct AskedState {
  VectorXd q, q_next, v, a, outside;

  AskedState(const Model& model, std::uint64_t seed) {
    const PlainTree plain = reference::plain_tree(model);
    const Instance instance = random_instance(plain, seed, 0.5);
    q = instance.q;
    q_next = reference::advanced(plain, instance.q, instance.delta);
    v = instance.rate;
    a = instance.right_side;
    Random random(seed);
    outside = random_vector(random, 6 * model.tree.shape.slots, 1);
  }
};

template <class S>
struct QueryRig {
  const Model& model;
  const Tree& tree;
  const BodyConstants<double>& constants;
  std::vector<Index> slots;
  Field<S> q, q_next, v, a, mass_matrix, jacobian, momentum_matrix, sums;
  Field<S, 6> outside, wrench;
  Field<S, 7> motion;
  Field<S, 10> composite;
  BodyMotions<S> motions;

  explicit QueryRig(const Model& m) : model(m), tree(m.tree), constants(m.constants), slots(static_cast<std::size_t>(tree.bodies())) {
    std::iota(slots.begin(), slots.end(), 1);
    const Index nv = tree.shape.velocities;
    for (Field<S>* field : {&q, &q_next}) field->allocate(tree.shape.positions);
    for (Field<S>* field : {&v, &a}) field->allocate(nv);
    mass_matrix.allocate(nv * nv);
    for (Field<S>* field : {&jacobian, &momentum_matrix}) field->allocate(6 * nv);
    sums.allocate(10);
    outside.allocate(tree.shape.slots);
    wrench.allocate(tree.shape.slots);
    motion.allocate(tree.shape.slots);
    composite.allocate(tree.shape.slots);
    motions.allocate(tree.shape);
    each(*this, [](const char*, auto& field) { poison(field); });
  }

  template <class Self, class Visit>
  static void each(Self& self, Visit&& visit) {
    visit("q", self.q);
    visit("q_next", self.q_next);
    visit("v", self.v);
    visit("a", self.a);
    visit("mass_matrix", self.mass_matrix);
    visit("jacobian", self.jacobian);
    visit("momentum_matrix", self.momentum_matrix);
    visit("sums", self.sums);
    visit("outside", self.outside);
    visit("wrench", self.wrench);
    visit("motion", self.motion);
    visit("composite", self.composite);
    visit("placement", self.motions.placement);
    visit("pose", self.motions.pose);
    visit("twist", self.motions.twist);
    visit("acceleration", self.motions.acceleration);
  }

  void set(const AskedState& state, std::size_t at = 0) {
    const auto copy = [&](const VectorXd& from, auto& to) {
      for (Eigen::Index k = 0; k < from.size(); ++k) set_lane(to.flat()[static_cast<std::size_t>(k)], at, from[k]);
    };
    copy(state.q, q);
    copy(state.q_next, q_next);
    copy(state.v, v);
    copy(state.a, a);
    copy(state.outside, outside);
  }
  void set(std::uint64_t seed) { set(AskedState(model, seed)); }
};

/// Before most kernels: where bodies are, how they move and accelerate.
inline constexpr auto follow_bodies = [](auto& rig) {
  body_motion_down<MotionDepth::accelerations>(rig.tree, rig.constants, rig.slots.data(), rig.slots.size(), rig.q, rig.v, rig.a,
                                               rig.motions);
};
inline constexpr auto prepare_nothing = [](auto&) {};

inline VectorXd eigen(const Field<double>& field) { return vector(field); }

/// `world_left`: fields whose row 0, the world's, is left alone.
void check_query(const OnRig<QueryRig>& prepare, const OnRig<QueryRig>& run, const std::vector<std::string>& writes,
                 const std::vector<std::string>& world_left = {});

}  // namespace linden

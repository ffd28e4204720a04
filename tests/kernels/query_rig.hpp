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

template <class Prepare, class Run>
void check_query(const Prepare& prepare, const Run& run, const std::vector<std::string>& writes,
                 const std::vector<std::string>& world_left = {}) {
  for (const Model& model : mixed_trees()) {
    constexpr std::size_t count = 2 * Pack::size + 1;
    std::vector<std::vector<double>> plain(count), packed(count);
    std::vector<AskedState> states;
    for (std::size_t k = 0; k < count; ++k) {
      states.emplace_back(model, 100 + k);
      QueryRig<double> rig(model);
      rig.set(states.back());
      prepare(rig);
      QueryRig<double>::each(rig, [&](const char* name, auto& field) {
        if (contains(writes, name)) poison(field);
      });
      const QueryRig<double> before = rig;
      const AllocationCounter counter;
      run(rig);
      const std::int64_t allocations = counter.count();
      CHECK(allocations == 0);
      std::vector<std::vector<double>> old;
      QueryRig<double>::each(before, [&](const char*, auto& field) { old.emplace_back(field.flat().begin(), field.flat().end()); });
      std::size_t at = 0, found = 0;
      QueryRig<double>::each(rig, [&](const char* name, auto& field) {
        const std::vector<double>& was = old[at++];
        INFO(model.names.model << ": " << name);
        if (contains(writes, name)) {
          found += 1;
          const std::size_t left = contains(world_left, name) ? field.flat().size() / static_cast<std::size_t>(field.rows()) : 0;
          CHECK(std::all_of(field.flat().begin() + static_cast<std::ptrdiff_t>(left), field.flat().end(),
                            [](double x) { return std::isfinite(x); }));
          plain[k].insert(plain[k].end(), field.flat().begin() + static_cast<std::ptrdiff_t>(left), field.flat().end());
        } else {
          CHECK(std::equal(was.begin(), was.end(), field.flat().begin(), same_bits));
        }
      });
      CHECK(found == writes.size());
    }
    for (const std::size_t stride : {1u, 2u}) {
      for (std::size_t round = 0; round < count; ++round) {
        QueryRig<Pack> rig(model);
        for (std::size_t l = 0; l < Pack::size; ++l) rig.set(states[(round + stride * l) % count], l);
        prepare(rig);
        run(rig);
        for (std::size_t l = 0; l < Pack::size; ++l) {
          const std::size_t k = (round + stride * l) % count;
          std::vector<double> numbers;
          QueryRig<Pack>::each(rig, [&](const char* name, auto& field) {
            if (!contains(writes, name)) return;
            const std::size_t left = contains(world_left, name) ? field.flat().size() / static_cast<std::size_t>(field.rows()) : 0;
            for (std::size_t n = left; n < field.flat().size(); ++n) numbers.push_back(lane(field.flat()[n], l));
          });
          if (packed[k].empty()) packed[k] = numbers;
          const bool equal = std::equal(numbers.begin(), numbers.end(), packed[k].begin(), same_bits);
          const auto size = static_cast<Eigen::Index>(numbers.size());
          const auto expected = Eigen::Map<const VectorXd>(plain[k].data(), size);
          const bool close =
              (Eigen::Map<const VectorXd>(numbers.data(), size) - expected).cwiseAbs().maxCoeff() <= 1e-12 * expected.cwiseAbs().maxCoeff();
          if (equal && close) continue;
          CAPTURE(model.names.model, stride, round, l);
          REQUIRE(equal);
          REQUIRE(close);
        }
      }
    }
  }
}

}  // namespace linden

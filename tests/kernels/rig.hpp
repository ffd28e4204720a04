// tests/kernels/rig.hpp
// Everything a sweep needs, for any Scalar: a tree, its fields, random inputs; and the proofs that every sweep owes.
//
//   const auto kernel = make_kernel(prepare, run, {fields it writes}, {fields it changes in place});
//   check_writes(kernel)             started from NaN every number is written, and nothing else is touched
//   check_allocates_nothing(kernel)
//   check_lanes(kernel)              the same bits in every lane and any company, close to the plain path
//
// prepare(rig) and run(rig) are generic lambdas; a kernel's return value goes to rig.result.
#pragma once

#include <algorithm>
#include <functional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "kernels/block/block_factor_up.hpp"
#include "kernels/tree/articulated_inertia_up.hpp"
#include "kernels/tree/displacement_down.hpp"
#include "kernels/tree/increment_down.hpp"
#include "kernels/tree/innovation_up.hpp"
#include "kernels/tree/momentum_map.hpp"
#include "kernels/tree/momentum_update_map.hpp"
#include "kernels/tree/motion_map.hpp"
#include "kernels/tree/newton_factor_up.hpp"
#include "kernels/tree/placement_map.hpp"
#include "kernels/tree/residual_up.hpp"
#include "layout/state.hpp"
#include "layout/workspace.hpp"
#include "models/build/generators.hpp"
#include "tests/kernels/lanes.hpp"
#include "tests/kernels/values.hpp"
#include "tests/reference/plain_tree.hpp"

namespace linden {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using reference::PlainBody;
using reference::PlainTree;

/// Random trees with joints of all kinds: deep, bushy, floating, masses over six decades, no free joints inside; one with wide levels.
std::vector<Model> mixed_trees();

/// What one instance starts from.
struct Instance {
  VectorXd q, delta, p, rate, force, right_side;
};

/// A random instance whose step turns some body by `turn` [rad] and none by more.
Instance random_instance(const PlainTree& tree, std::uint64_t seed, double turn);

VectorXd random_vector(Random& random, Index size, double bound);

/// Angle between two poses of a body, [0, pi].
double turn_between(const reference::Matrix4<double>& a, const reference::Matrix4<double>& b);

/// Largest turn of any body or joint in a step.
double largest_turn(const PlainTree& tree, const VectorXd& q, const VectorXd& delta);

/// A^-1 b by LU with pivoting.
VectorXd dense_solve(const MatrixXd& A, const VectorXd& b);

/// What another order of operations may change, in units of the largest number of a field.
constexpr double kRounding = 1e-12;

/// Behind newton_factor_up at steps of 2 rad: d may be small there, and rounding grows with the condition of what is eliminated.
constexpr double kRoundingAfterElimination = 1e-10;

template <class S>
struct Rig {
  const Model& model;
  const Tree& tree;
  const BodyConstants<double>& constants;
  State<S> state;
  Workspace<S> work;
  Field<S> rate, right_side, result;
  S h = S(0.125);
  double rounding = kRounding;

  explicit Rig(const Model& m) : model(m), tree(m.tree), constants(m.constants) {
    state.allocate(tree.shape);
    work.allocate(tree.shape);
    rate.allocate(tree.shape.velocities);
    right_side.allocate(tree.shape.velocities);
    result.allocate(1);
    each(*this, [](const char*, auto& field, Rows) { poison(field); });
  }

  void set(const Instance& instance, std::size_t at = 0) {
    const auto copy = [&](const VectorXd& from, Field<S>& to) {
      for (Index row = 0; row < to.rows(); ++row) set_lane(to(row), at, from[row]);
    };
    copy(instance.q, state.q);
    copy(instance.p, state.p);
    copy(instance.delta, work.delta);
    copy(instance.force, work.force);
    copy(instance.rate, rate);
    copy(instance.right_side, right_side);
  }

  Gains<S> gains() { return {work.gain_up, work.gain_down, work.joint_inverse}; }

  /// visit(name, field, rows) for every field.
  template <class Self, class Visit>
  static void each(Self& self, Visit&& visit) {
    const auto named = [&](const char* name, auto& field, Rows rows, const char*) {
      visit(name, field, rows);
    };
    State<S>::each(self.state, named);
    Workspace<S>::each(self.work, named);
    visit("rate", self.rate, Rows::velocities);
    visit("right_side", self.right_side, Rows::velocities);
    visit("result", self.result, Rows::blocks);
  }
};

/// visit(plain tree, instance, rig) for each of the mixed trees at three random instances, which turn bodies by up to 0.1 rad in a step.
template <class Visit>
void for_mixed_instances(const Visit& visit) {
  for (const Model& model : mixed_trees()) {
    const PlainTree tree = reference::plain_tree(model);
    for (std::uint64_t seed = 1; seed < 4; ++seed) {
      const Instance instance = random_instance(tree, seed, 0.1);
      Rig<double> rig(model);
      rig.set(instance);
      visit(tree, instance, rig);
    }
  }
}

// The sweeps of a step, each from what those above it left.

template <class S>
void place(Rig<S>& rig) {
  placement_map(rig.tree, rig.constants, rig.state.q, rig.work.placement);
  motion_map(rig.tree, rig.constants, rig.work.delta, rig.work.motion);
}

template <class S>
void displace(Rig<S>& rig) {
  place(rig);
  rig.result(0) = displacement_down(rig.tree, rig.work.placement, rig.work.motion, rig.work.displacement);
}

template <class S>
void find_momenta(Rig<S>& rig) {
  displace(rig);
  momentum_map(rig.tree, rig.constants, rig.work.displacement,
               rig.work.impulse);
}

template <class S>
void find_residual(Rig<S>& rig) {
  find_momenta(rig);
  momentum_target_map(rig.tree, rig.h, rig.state.p, rig.work.force, rig.work.momentum_target);
  residual_up(rig.tree, rig.constants, rig.work.placement, rig.work.momentum_target, rig.work.impulse,
              rig.work.residual);
}

/// One tree has a factor of its own (lanes = rows of its matrices), a block of instances another; both leave the same gains.
template <class S, class Added = NothingAdded>
void factor_newton(Rig<S>& rig, const Added& added = {}) {
  rig.rounding = kRoundingAfterElimination;
  find_momenta(rig);
  if constexpr (std::is_same_v<S, double>) {
    newton_factor_up(rig.tree, rig.constants, rig.work.placement, rig.work.motion, rig.work.displacement,
                     rig.work.articulated, rig.gains(), added);
  } else {
    static_assert(std::is_same_v<Added, NothingAdded>);
    Rig<S> block = rig;
    start_down(block.tree, block.constants, block.work);
    block_factor_up(block.tree, block.constants, block.work, block.gains(), Jacobian::exact);
    rig.work.gain_up = block.work.gain_up;
    rig.work.gain_down = block.work.gain_down;
    rig.work.joint_inverse = block.work.joint_inverse;
  }
  poison(rig.work.articulated);
}

template <class S, class Added = NothingAdded>
void factor_mass(Rig<S>& rig, const Added& added = {}) {
  place(rig);
  articulated_inertia_up(rig.tree, rig.constants, rig.work.placement, rig.work.articulated, rig.gains(), added);
}

template <class S>
void pass_up(Rig<S>& rig, const Field<S>& right_side) {
  rig.result(0) = impulse_pass_up(rig.tree, rig.constants, rig.work.placement, rig.gains(), right_side, rig.work.bias,
                                  rig.work.innovation);
}

template <class S>
void pass_down_newton(Rig<S>& rig) {
  increment_down(rig.tree, rig.constants, rig.work.placement, rig.work.motion, rig.gains(), rig.work.innovation,
                 rig.work.variation, rig.work.increment);
}

template <class S>
void pass_down_mass(Rig<S>& rig) {
  rate_down(rig.tree, rig.constants, rig.work.placement, rig.gains(), rig.work.innovation, rig.work.variation,
            rig.work.increment);
}

// Compiled once, in rig.cpp: every test of a kernel would take twice as long to compile.
#define LINDEN_RIG_SWEEPS(PREFIX, S)                                   \
  PREFIX template void place(Rig<S>&);                                 \
  PREFIX template void displace(Rig<S>&);                              \
  PREFIX template void find_momenta(Rig<S>&);                          \
  PREFIX template void find_residual(Rig<S>&);                         \
  PREFIX template void factor_newton(Rig<S>&, const NothingAdded&);    \
  PREFIX template void factor_mass(Rig<S>&, const NothingAdded&);      \
  PREFIX template void pass_up(Rig<S>&, const Field<S>&);              \
  PREFIX template void pass_down_newton(Rig<S>&);                      \
  PREFIX template void pass_down_mass(Rig<S>&)
LINDEN_RIG_SWEEPS(extern, double);
LINDEN_RIG_SWEEPS(extern, Pack);

/// A field of one component as a vector, and back.
inline VectorXd vector(const Field<double>& field) {
  return Eigen::Map<const VectorXd>(field.flat().data(), static_cast<Eigen::Index>(field.flat().size()));
}

inline void fill(Field<double>& field, const VectorXd& values) {
  std::copy(values.begin(), values.end(), field.flat().begin());
}

/// Row i of a field as an Eigen vector or matrix.
template <template <class> class Value, int Components>
auto row(const Field<double, Components>& field, Index i) {
  return eigen(load<Value, double>(field, i));
}

/// What is done with a rig of numbers and with one of packs: a generic lambda, behind one type for all, so that checks are compiled once;
/// or a lambda for numbers alone.
template <template <class> class AnyRig>
class OnRig {
 public:
  template <class Call>
    requires(!std::is_same_v<Call, OnRig>)
  OnRig(const Call& call) : plain_(call) {
    if constexpr (std::is_invocable_v<const Call&, AnyRig<Pack>&>) packed_ = call;
  }

  void operator()(AnyRig<double>& rig) const { plain_(rig); }
  void operator()(AnyRig<Pack>& rig) const { packed_(rig); }

 private:
  std::function<void(AnyRig<double>&)> plain_;
  std::function<void(AnyRig<Pack>&)> packed_;
};

struct Kernel {
  OnRig<Rig> prepare, run;
  std::vector<std::string> writes, changes;
  std::vector<std::string> scratch = {};  // may hold anything afterwards
};

inline Kernel make_kernel(OnRig<Rig> prepare, OnRig<Rig> run, std::vector<std::string> writes, std::vector<std::string> changes = {},
                          std::vector<std::string> scratch = {}) {
  return {std::move(prepare), std::move(run), std::move(writes), std::move(changes), std::move(scratch)};
}

inline bool contains(const std::vector<std::string>& names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// `with_world`: fields whose row 0, the world's, is written too; in others it is left alone.
void check_writes(const Kernel& kernel, const std::vector<std::string>& with_world = {});

/// S: double or Pack
template <class S>
void check_allocates_nothing_as(const Kernel& kernel);

void check_allocates_nothing(const Kernel& kernel);

void check_lanes(const Kernel& kernel);

}  // namespace linden

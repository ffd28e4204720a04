#include "engine/sweeps/coupling_yields.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/sweeps/coupling_sweeps.hpp"
#include "kernels/tree/articulated_inertia_up.hpp"
#include "kernels/tree/increment_down.hpp"
#include "kernels/tree/placement_map.hpp"
#include "kernels/tree/impulse_up.hpp"
#include "layout/workspace.hpp"
#include "models/build/random.hpp"

namespace linden {
namespace {

constexpr int kConfigurations = 8;

/// What slides does so by this much at most [m].
constexpr double kSlides = 0.3;

void turn_at_random(const Model& model, Random& random, Field<double>& q) {
  const Tree& tree = model.tree;
  std::ranges::copy(model.neutral(), q.flat().begin());
  for (Index i = 1; i < tree.shape.slots; ++i) {
    const Index row = tree.first_q(i);
    if (tree.kind(i) == JointKind::screw) {
      q(row) += random.uniform(-1, 1) * (model.constants.screw(i, 0) != 0 ? std::numbers::pi : kSlides);
      continue;
    }
    const Eigen::Quaterniond turned = random.rotation();
    const Index turn = tree.kind(i) == JointKind::free ? row + 3 : row;
    for (Index k = 0; k < 4; ++k) q(turn + k) = turned.coeffs()[k];
  }
  for (const Mimic& mimic : model.mimics) q(mimic.follower_q) = mimic.multiplier * q(mimic.leader_q) + mimic.offset;
}

}  // namespace

std::vector<double> row_yields(const Model& model, std::span<const Armature> rotors) {
  if (std::ranges::none_of(model.couplings, gives_way)) return {};
  const Tree& tree = model.tree;
  CouplingSweeps<double> couplings(model, {}, Serves::till_the_next, Closing::at_world);
  Workspace<double> work;
  work.allocate(tree.shape);
  Field<double> q, rotor;
  Field<double, 36> no_pull;
  q.allocate(tree.shape.positions);
  rotor.allocate(tree.shape.velocities, 0.0);
  for (const Armature& one : rotors) rotor(one.row) = one.inertia;
  const EffectsAdded<double, true, false> added{rotor, no_pull};
  const Gains<double> gains{work.gain_up, work.gain_down, work.joint_inverse};
  MimicTies<double> ties(model.mimics, tree);
  std::vector<double> yields(couplings.rows(), 0.0);
  Random random(1);
  for (int configuration = 0; configuration < kConfigurations; ++configuration) {
    turn_at_random(model, random, q);
    if (configuration == 0) std::ranges::copy(model.neutral(), q.flat().begin());
    placement_map(tree, model.constants, q, work.placement);
    if (ties.empty()) {
      articulated_inertia_up(tree, model.constants, work.placement, work.articulated, gains, added);
    } else {
      articulated_inertia_up(tree, model.constants, work.placement, work.articulated, gains, ties.held(added));
      ties.factor(
          [&](const Field<double>& r, Field<double>& x) {
            impulse_pass_up(tree, model.constants, work.placement, gains, r, work.bias, work.innovation);
            rate_down(tree, model.constants, work.placement, gains, work.innovation, work.variation, x);
          },
          [&](Index i) { return tied_load(tree, model.constants, gains, work.bias, work.variation, i); }, work.increment);
    }
    couplings.place(work.placement, q);
    couplings.up_to_closures([](Slots) {}, [&](std::size_t closure) {
      couplings.close(closure, Coupled::velocities, model.constants, work.placement, nullptr, gains, ties, true);
    });
    for (std::size_t row = 0; row < yields.size(); ++row) {
      const double yield = couplings.yield(row);
      if (std::isfinite(yield)) yields[row] = std::max(yields[row], yield);
    }
  }
  return yields;
}

}  // namespace linden

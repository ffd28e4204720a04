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

/// The mass matrix of a model, rotors included, with its couplings, factored at several configurations.
class Configurations {
 public:
  Configurations(const Model& model, std::span<const Armature> rotors, Closing closing)
      : model_(model), couplings_(model, {}, Serves::till_the_next, closing), ties_(model.mimics, model.tree) {
    work_.allocate(model.tree.shape);
    q_.allocate(model.tree.shape.positions);
    rotor_.allocate(model.tree.shape.velocities, 0.0);
    for (const Armature& one : rotors) rotor_(one.row) = one.inertia;
  }

  CouplingSweeps<double>& couplings() { return couplings_; }

  /// at(): at each of them, once all is factored.
  template <class At>
  void visit(const At& at) {
    const Tree& tree = model_.tree;
    const EffectsAdded<double, true, false> added{rotor_, no_pull_};
    for (int configuration = 0; configuration < kConfigurations; ++configuration) {
      turn_at_random(model_, random_, q_);
      if (configuration == 0) std::ranges::copy(model_.neutral(), q_.flat().begin());
      placement_map(tree, model_.constants, q_, work_.placement);
      couplings_.place(work_.placement, q_);
      couplings_.up_to_closures([&](Slots part) { factor(part, added); }, [&](std::size_t closure) { close(closure); });
      at();
    }
  }
  /// v: what joints do by impulses r of theirs, couplings closed.
  void apply_inverse(const Field<double>& r, Field<double>& v) {
    const Tree& tree = model_.tree;
    couplings_.begin_solve(Coupled::velocities);
    couplings_.up_to_closures(
        [&](Slots part) { impulse_pass_up(tree, model_.constants, work_.placement, gains(), r, part, work_.bias, work_.innovation); },
        [&](std::size_t closure) { couplings_.yield(closure, Coupled::velocities, ties_, work_.innovation, work_.bias); });
    couplings_.down_from_closures([&](Slots part) { rates_down(part, v); },
                                  [&](std::size_t closure) { couplings_.push(closure, Coupled::velocities, work_.variation, work_.innovation); });
    if (!ties_.empty()) ties_.complete(v);
  }

 private:
  Gains<double> gains() { return {work_.gain_up, work_.gain_down, work_.joint_inverse}; }
  void rates_down(Slots part, Field<double>& v) {
    rate_down(model_.tree, model_.constants, work_.placement, gains(), work_.innovation, part, work_.variation, v);
  }
  void factor(Slots part, const EffectsAdded<double, true, false>& added) {
    const Tree& tree = model_.tree;
    const auto articulate = [&](const auto& all) {
      articulated_inertia_up(tree, model_.constants, work_.placement, part, work_.articulated, gains(), all);
    };
    if (ties_.empty()) return articulate(added);
    articulate(ties_.held(added));
    ties_.factor(
        [&](const Field<double>& r, Field<double>& x) {
          impulse_pass_up(tree, model_.constants, work_.placement, gains(), r, work_.bias, work_.innovation);
          rates_down(part, x);
        },
        [&](Index i) { return tied_load(tree, model_.constants, gains(), work_.bias, work_.variation, i); }, work_.increment);
  }
  void close(std::size_t closure) {
    const std::array<double, 36> felt =
        couplings_.close(closure, Coupled::velocities, model_.constants, work_.placement, nullptr, gains(), ties_, true);
    if (const Index slot = couplings_.slot_of(closure); slot != 0) add_inertia(slot, felt, work_.articulated);
  }

  const Model& model_;
  CouplingSweeps<double> couplings_;
  MimicTies<double> ties_;
  Workspace<double> work_;
  Field<double> q_, rotor_;
  Field<double, 36> no_pull_;
  Random random_{1};
};

}  // namespace

std::vector<double> row_yields(const Model& model, std::span<const Armature> rotors) {
  if (std::ranges::none_of(model.couplings, gives_way)) return {};
  Configurations configurations(model, rotors, Closing::at_world);
  const CouplingSweeps<double>& couplings = configurations.couplings();
  std::vector<double> yields(couplings.rows(), 0.0);
  configurations.visit([&] {
    for (std::size_t row = 0; row < yields.size(); ++row) {
      const double yield = couplings.level_yield(row);
      if (std::isfinite(yield)) yields[row] = std::max(yields[row], yield);
    }
  });
  return yields;
}

std::vector<double> joint_yields(const Model& model, std::span<const Armature> rotors, std::span<const Index> rows) {
  if (rows.empty()) return {};
  Configurations configurations(model, rotors, Closing::nearest);
  std::vector<double> yields(rows.size(), 0.0);
  Field<double> impulse, moved;
  for (Field<double>* field : {&impulse, &moved}) field->allocate(model.tree.shape.velocities, 0.0);
  configurations.visit([&] {
    for (std::size_t k = 0; k < rows.size(); ++k) {
      impulse(rows[k]) = 1;
      configurations.apply_inverse(impulse, moved);
      impulse(rows[k]) = 0;
      if (std::isfinite(moved(rows[k]))) yields[k] = std::max(yields[k], moved(rows[k]));
    }
  });
  return yields;
}

}  // namespace linden

// Of tree_sweeps.hpp: where the bodies are, what potentials do to them there, and the end of a step.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <string_view>

#include "engine/sweeps/tree_kernels.hpp"
#include "engine/sweeps/tree_sweeps.hpp"

namespace linden {

/// Placements of some bodies, and gravity there.
template <bool kEffects>
void TreeSweeps<kEffects>::place(const Field<double>& q, Slots part) {
  placement_map(model_.tree, *constants_, q, part, work_.placement);
  if (strategy_.gravity) gravity_field_down(model_.tree, work_.placement, gravity(), part, work_.field);
}

/// Where branches share rows an evaluation leaves the placements of the last it met.
template <bool kEffects>
void TreeSweeps<kEffects>::place_all() {
  if (valid_.placements) return;
  placement_map(model_.tree, *constants_, *q_, work_.placement);
  valid_.placements = true;
}

/// Placements of some bodies where the rows hold another branch's.
template <bool kEffects>
void TreeSweeps<kEffects>::place_again(Slots part) {
  if (strategy_.shares_rows && part.branch > 0) placement_map(model_.tree, *constants_, *q_, part, work_.placement);
}

template <bool kEffects>
void TreeSweeps<kEffects>::find_potentials(const Field<double>& q) {
  couplings_->place(work_.placement, q);
  if (strategy_.gravity) potential_ = gravity_potential(work_.field, work_.first_moment);
  if (kEffects || couplings_->gives_way()) {
    effect_potential_ = couplings_->potential();
    if constexpr (kEffects) effect_potential_ += effects_.refresh(work_.placement, q);
    effect_potential_ += contact_potential();
    potential_ = (strategy_.gravity ? potential_ : 0) + effect_potential_;
  }
}

/// Which bodies are near each other where they are, as rows of couplings. What is told of the last step stays until the next begins.
template <bool kEffects>
void TreeSweeps<kEffects>::couple_contacts() {
  if (!contacts_) return;
  world_placement_down(model_.tree, work_.placement, pose_);
  if (contacts_->find(pose_)) couplings_.emplace(model_, row_yields_, Serves::till_the_next, Closing::nearest, contacts_->couplings());
  couplings_->place(work_.placement, *q_);
}

template <bool kEffects>
void TreeSweeps<kEffects>::begin_contacts(double h, const Field<double>& before) {
  if (!contacts_) return;
  const Vec3<double> g = gravity();
  const double weight = strategy_.gravity ? std::sqrt(dot(g, g)) : 0;
  for (std::size_t k = 0; k < contacts_->touches().size(); ++k) {
    couplings_->set_contact(k, contacts_->begin(k, h, couplings_->opened(k, before), weight), contacts_->guess_of(k, h));
  }
}

template <bool kEffects>
void TreeSweeps<kEffects>::refresh(const Field<double>& q) {
  tree_.run(
      true, false, [&](Slots part, Evaluated<double>&) { place(q, part); }, [&](Slots part, Evaluated<double>&) { forces(part); });
  valid_.placements = true;
  find_potentials(q);
}

template <bool kEffects>
void TreeSweeps<kEffects>::forces(Slots part) {
  const Tree& tree = model_.tree;
  if (strategy_.gravity) gravity_force_up(tree, *constants_, work_.placement, work_.field, part, work_.first_moment, work_.force);
  if (applied_.empty()) return;
  const Slots rows = velocities(tree, part);
  for (Index row = rows.begin; row < rows.end; ++row) {
    const double applied = applied_[static_cast<std::size_t>(row)];
    work_.force(row) = strategy_.gravity ? work_.force(row) + applied : applied;
  }
}

template <bool kEffects>
void TreeSweeps<kEffects>::apply(std::span<const double> force) {
  applied_.assign(force.begin(), force.end());
  if (!strategy_.gravity) {
    for (double& value : work_.force.flat()) value = 0;
  }
}

template <bool kEffects>
void TreeSweeps<kEffects>::use_gravity(const std::array<double, 3>& gravity) {
  options_.gravity = gravity;
  strategy_.gravity = true;
  if constexpr (kEffects) effects_.use_gravity({gravity});
}

template <bool kEffects>
void TreeSweeps<kEffects>::advance(Slots part, State<double>& state) {
  remember(work_.delta, velocities(model_.tree, part), state.history);
  advance_map(model_.tree, work_.motion, work_.delta, part, state.q);
}

/// Positions of some joints, and what depends on positions alone.
template <bool kEffects>
void TreeSweeps<kEffects>::arrive_down(Slots part, State<double>& state) {
  if (ties_.empty()) advance(part, state);
  place(state.q, part);
}

/// Forces on some joints and momenta there; found: those of the step that ends are there.
template <bool kEffects>
void TreeSweeps<kEffects>::arrive_up(Slots part, double h, bool found, State<double>& state) {
  forces(part);
  if (found) {
    momentum_end_map(model_.tree, h, work_.end_momentum, work_.force, part, state.p);
  } else {
    momentum_update_map(model_.tree, *constants_, h, work_.displacement, work_.impulse, joint_residual(), work_.force, part, state.p);
  }
}

template <bool kEffects>
void TreeSweeps<kEffects>::arrive(double h, State<double>& state) {
  if (!ties_.empty()) {
    advance(all_slots(model_.tree), state);
    for (const Mimic& mimic : mimics()) state.q(mimic.follower_q) = mimic.multiplier * state.q(mimic.leader_q) + mimic.offset;
  }
  if (!valid_.end_momenta) complete();
  tree_.run(
      true, false, [&](Slots part, Evaluated<double>&) { arrive_down(part, state); },
      [&](Slots part, Evaluated<double>&) { arrive_up(part, h, valid_.end_momenta, state); });
  valid_.placements = true;
  find_potentials(state.q);
}

#ifdef LINDEN_POISON
/// What stays between steps follows from the positions; so may the factor.
template <bool kEffects>
void TreeSweeps<kEffects>::poison_scratch() {
  constexpr std::string_view standing[] = {"placement", "force", "field", "first_moment"}, factor[] = {"gain_up", "gain_down", "joint_inverse"};
  Workspace<double>::each(work_, [&](std::string_view name, auto& field, Rows, const char*) {
    const bool stays = std::ranges::find(standing, name) != std::end(standing) ||
                       (strategy_.reuses_factor && std::ranges::find(factor, name) != std::end(factor));
    if (!stays) poison(field);
  });
}
#endif

template class TreeSweeps<LINDEN_ACTING>;

}  // namespace linden

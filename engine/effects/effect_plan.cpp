#include "engine/effects/effect_plan.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "engine/effects/plane_frame.hpp"
#include "engine/effects/stiff_contact.hpp"
#include "engine/sweeps/coupling_yields.hpp"
#include "kernels/effects/laws.hpp"
#include "kernels/tree/articulated_inertia_up.hpp"
#include "kernels/tree/increment_down.hpp"
#include "kernels/tree/mimic.hpp"
#include "kernels/tree/placement_map.hpp"
#include "kernels/values/spatial.hpp"
#include "layout/workspace.hpp"

namespace linden {
namespace {

constexpr double kUsualGravity = 9.81;

/// Share of the weight of all bodies that a contact point is taken to bear at least, where its friction is made to stick.
constexpr double kLeastLoad = 1e-2;

/// Speed at which depth that the motion did not make may come to push [m/s].
constexpr double kRecovery = 1e-3;

/// Share of critical damping from which on little of a bounce is left to lose: its rebound is down to half.
constexpr double kBouncesLittle = 0.2;

/// Mass that a force on a body is taken to move.
double moved_mass(const Model& model, Index slot) {
  const double own = model.constants.inertia(slot, 0);
  return own > 0 ? own : model.constants.subtree_mass(slot);
}

/// Mass behind a blow on a body: its own and that of links it hangs on, of these no more than its own.
double struck_mass(const Model& model, Index slot) {
  const double own = moved_mass(model, slot);
  double held = 0;
  for (Index up = model.tree.parent(slot); up > 0; up = model.tree.parent(up)) held += model.constants.inertia(up, 0);
  return own + std::min(own, held);
}

/// Inertia that each joint feels in the zero configuration, all others free: d of the mass matrix, rotors included. A leader feels that of
/// its coordinate.
std::vector<double> felt_inertia(const Model& model, const std::vector<Armature>& rotors) {
  const Tree& tree = model.tree;
  Workspace<double> work;
  work.allocate(tree.shape);
  Field<double> q;
  q.allocate(tree.shape.positions);
  std::ranges::copy(model.neutral(), q.flat().begin());
  placement_map(tree, model.constants, q, work.placement);
  const Gains<double> gains{work.gain_up, work.gain_down, work.joint_inverse};
  MimicTies<double> ties(model.mimics, tree);
  if (ties.empty()) {
    articulated_inertia_up(tree, model.constants, work.placement, work.articulated, gains);
  } else {
    articulated_inertia_up(tree, model.constants, work.placement, work.articulated, gains, ties.held(NothingAdded{}));
    ties.factor(
        [&](const Field<double>& r, Field<double>& x) {
          impulse_pass_up(tree, model.constants, work.placement, gains, r, work.bias, work.innovation);
          rate_down(tree, model.constants, work.placement, gains, work.innovation, work.variation, x);
        },
        [&](Index i) { return tied_load(tree, model.constants, gains, work.bias, work.variation, i); }, work.increment);
  }
  const Field<double>& inverse = ties.empty() ? work.joint_inverse : ties.yields(work.joint_inverse);
  std::vector<double> felt(static_cast<std::size_t>(tree.shape.velocities));
  for (Index i = 1; i < tree.shape.slots; ++i) {
    const Index n = velocity_count(tree.kind(i));
    for (Index k = 0; k < n; ++k) {
      felt[static_cast<std::size_t>(tree.first_v(i) + k)] = 1 / inverse(tree.first_block(i) + k * n + k);
    }
  }
  for (const Armature& rotor : rotors) felt[static_cast<std::size_t>(rotor.row)] += rotor.inertia;
  return felt;
}

/// Of each candidate those on the first feature that is near, on a terrain also those on further ones.
std::vector<GroundPoint> points_of(const Ground& ground) {
  std::vector<GroundPoint> points;
  const int ranks = ground.terrain ? kTerrainRanks : 1;
  for (const ContactSphere& sphere : ground.contacts.spheres) {
    for (int rank = 0; rank < ranks; ++rank) {
      points.push_back({.slot = sphere.slot, .center = sphere.center, .radius = sphere.radius, .axis = sphere.outward, .rank = rank});
    }
  }
  for (const ContactRim& rim : ground.contacts.rims) {
    for (int rank = 0; rank < ranks; ++rank) {
      for (int quarter = 0; quarter < (rank == 0 ? 4 : 1); ++quarter) {
        points.push_back({rim.slot, rim.center, 0, rim.axis, rim.radius, quarter, rank});
      }
    }
  }
  for (std::size_t k = 0; k < ground.contacts.blocks.size() && ground.terrain; ++k) {
    const ContactBlock& block = ground.contacts.blocks[k];
    for (int rank = 0; rank < kBlockRanks; ++rank) {
      points.push_back({.slot = block.slot, .center = block.center, .radius = block.radius, .rank = rank, .block = static_cast<int>(k)});
    }
  }
  std::ranges::stable_sort(points, {}, &GroundPoint::slot);
  return points;
}

}  // namespace

std::optional<StiffContact> stiffest_unresolved(const Model& model, const Options& options, const Effects& effects) {
  if (!effects.ground) return std::nullopt;
  const Ground& ground = *effects.ground;
  Index stiffest = 0;
  const auto look_at = [&](Index slot) {
    const double mass = struck_mass(model, slot), damping = 0.5 * ground.damping / std::sqrt(ground.stiffness * mass);
    const bool resolved = begin_share(options.step * options.step * ground.stiffness / mass) <= 0.5;
    if (!resolved && damping < kBouncesLittle && (stiffest == 0 || mass < struck_mass(model, stiffest))) stiffest = slot;
  };
  for (const ContactSphere& sphere : ground.contacts.spheres) look_at(sphere.slot);
  for (const ContactRim& rim : ground.contacts.rims) look_at(rim.slot);
  if (stiffest == 0) return std::nullopt;
  return StiffContact{model.names.body[static_cast<std::size_t>(stiffest)], struck_mass(model, stiffest)};
}

EffectPlan::EffectPlan(const Model& model, const Options& options, const Effects& given) : effects(given), step_(options.step) {
  check(effects, model);
  const Tree& tree = model.tree;
  std::ranges::stable_sort(effects.drag, {}, &Drag::slot);
  std::ranges::stable_sort(effects.wrenches, {}, &BodyWrench::slot);
  for (const JointMotion& motion : effects.motions) curves.emplace_back(motion.position, motion.velocities);
  each_law_type<JointLaws<double>>([&]<class Law>() { joints = joints || !effects.list<typename Law::Entry>().empty(); });
  if (joints) place_joints(model);
  each_law_type<BodyLaws<double>>([&]<class Law>() { bodies = bodies || !entries_of<typename Law::Entry>(effects).empty(); });
  for (Index slot = 0; bodies && slot < tree.shape.slots; ++slot) mass.push_back(slot == 0 ? 0 : moved_mass(model, slot));
  if (effects.ground) place_ground(model, options);
  const LawSetup known = setup(tree);
  sort_bodies(known);
  bodies = !loaded_bodies.empty();
  pairs = effects.contact && !effects.contact->pairs.empty();
  follow_laws(known);
  bounces = std::ranges::any_of(effects.limits, [](const JointLimit& limit) { return limit.restitution > 0; });
  if (std::ranges::any_of(effects.limits, [](const JointLimit& limit) { return std::isfinite(limit.velocity); })) {
    fastest.allocate(tree.shape.velocities, std::numeric_limits<double>::infinity());
    for (const JointLimit& limit : effects.limits) fastest(limit.row) = limit.velocity;
  }
  if (!effects.armature.empty()) {
    rotor.allocate(tree.shape.velocities);
    for (const Armature& one : effects.armature) rotor(one.row) += one.inertia;
  }
  row_yields = linden::row_yields(model, effects.armature);
}

void EffectPlan::place_joints(const Model& model) {
  const Tree& tree = model.tree;
  q_row.allocate(tree.shape.velocities, -1);
  for (Index i = 1; i < tree.shape.slots; ++i) {
    if (tree.kind(i) == JointKind::screw) q_row(tree.first_v(i)) = tree.first_q(i);
  }
  bool asked = false;
  each_law_type<JointLaws<double>>([&]<class Law>() {
    if constexpr (HasRatio<Law>) asked = asked || !effects.list<typename Law::Entry>().empty();
  });
  if (asked) inertia = felt_inertia(model, effects.armature);
  std::vector<Index> zones;
  for (const DeadZoneSpring& spring : effects.dead_zone_springs) zones.push_back(spring.row);
  zone_yields = joint_yields(model, effects.armature, zones);
}

void EffectPlan::place_ground(const Model& model, const Options& options) {
  ground.ground = *effects.ground;
  ground.points = points_of(*effects.ground);
  if (const auto& terrain = effects.ground->terrain) ground.highest = std::ranges::max(terrain->heights);
  if (ground.points.empty()) return;
  const double h = step_;
  ground.frame = plane_frame(effects.ground->normal);
  ground.recovery = h * kRecovery;
  least_load_mass_ = kLeastLoad * model.constants.subtree_mass(0);
  ground.least_load = least_load(options.gravity);
  for (const GroundPoint& point : ground.points) {
    ground.share.push_back(begin_share(h * h * effects.ground->stiffness / mass[static_cast<std::size_t>(point.slot)]));
  }
}

double EffectPlan::least_load(const std::array<double, 3>& gravity) const {
  const double pull = std::sqrt(gravity[0] * gravity[0] + gravity[1] * gravity[1] + gravity[2] * gravity[2]);
  return least_load_mass_ * (pull > 0 ? pull : kUsualGravity);
}

/// What the laws of bodies touch, body by body.
void EffectPlan::sort_bodies(const LawSetup& setup) {
  std::map<Index, LoadedBody> by_slot;
  std::size_t place = 0;
  each_law_type<BodyLaws<double>>([&]<class Law>() {
    const auto list = Law::touching(setup);
    for (std::size_t k = 0; k < list.size(); ++k) {
      LoadedBody& body = by_slot[list[k].slot];
      body.slot = list[k].slot;
      if (body.ranges[place].last == 0) body.ranges[place].first = k;
      body.ranges[place].last = k + 1;
    }
    ++place;
  });
  for (const auto& [slot, body] : by_slot) loaded_bodies.push_back(body);
}

/// What the steppers have to know of what acts.
void EffectPlan::follow_laws(const LawSetup& setup) {
  const auto is_implicit = [&]<class Law>(const auto& list, const auto& moved) {
    if constexpr (HasRatio<Law>) {
      for (const auto& entry : list) bends = bends || begin_share(Law::ratio(entry, step_, moved(entry))) > 0.5;
    }
  };
  each_law_type<BodyLaws<double>>([&]<class Law>() {
    const auto list = Law::touching(setup);
    if (list.empty()) return;
    kept_ += Law::kept_numbers(setup);
    has_states = has_states || Law::facts.has_states;
    is_implicit.template operator()<Law>(list, [&](const auto& entry) { return setup.mass_of(entry.slot); });
  });
  each_law_type<JointLaws<double>>([&]<class Law>() {
    const auto& list = effects.list<typename Law::Entry>();
    if (list.empty()) return;
    kept_ += Law::kept_numbers(setup);
    for (const auto& entry : list) {
      has_states = has_states || linden::settles(entry);
      balls = balls || Law::on_ball(entry, setup);
    }
    is_implicit.template operator()<Law>(list, [&](const auto& entry) { return setup.inertia_at(entry.row); });
  });
  bends = bends || settles();
}

void EffectPlan::put_positions(double time, std::span<double> q) const {
  for (std::size_t k = 0; k < curves.size(); ++k) q[static_cast<std::size_t>(q_row(effects.motions[k].row))] = curves[k].at(time);
}

void EffectPlan::put_velocities(double time, std::span<double> v) const {
  for (std::size_t k = 0; k < curves.size(); ++k) v[static_cast<std::size_t>(effects.motions[k].row)] = curves[k].slope(time);
}

}  // namespace linden

#include "engine/start_check.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <span>
#include <unordered_map>

#include "engine/effects/effect_plan.hpp"
#include "engine/scene/scene.hpp"
#include "engine/sweeps/body_contacts.hpp"
#include "kernels/effects/ground.hpp"
#include "kernels/effects/terrain_height.hpp"
#include "kernels/tree/placement_map.hpp"
#include "kernels/tree/world_placement_down.hpp"
#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"

namespace linden {
namespace {

/// What computing a follower's position in another way may round off, of the larger of both and one unit.
constexpr double kPositionRounding = 1e-9;

std::size_t at(Index row) { return static_cast<std::size_t>(row); }

std::string_view unit_of(const Model& model, Index slot) { return model.constants.screw(slot, 0) == 0 ? "m" : "rad"; }

/// "0.5 to 1 rad", "at least 0.5 rad".
std::string range_text(double lower, double upper, std::string_view unit) {
  if (!std::isfinite(lower)) return fmt::format("at most {:.10g} {}", upper, unit);
  if (!std::isfinite(upper)) return fmt::format("at least {:.10g} {}", lower, unit);
  return fmt::format("{:.10g} to {:.10g} {}", lower, upper, unit);
}

/// Slots of screws by their velocity rows.
std::unordered_map<Index, Index> screws_of(const Model& model) {
  std::unordered_map<Index, Index> slots;
  for (const Run& run : model.tree.runs) {
    if (run.kind != JointKind::screw) continue;
    for (Index i = run.begin; i < run.end; ++i) slots[model.tree.first_v(i)] = i;
  }
  return slots;
}

/// How far a sphere or rim reaches below the terrain straight under its centre [m].
double depth_below(const GroundPlan& plan, const GroundPoint& point, const Field<double, 12>& pose) {
  const auto T = load<Placement, double>(pose, point.slot);
  const Mat3<double> frame{spread3<double>(plan.frame[0]), spread3<double>(plan.frame[1]), spread3<double>(plan.frame[2])};
  const Vec3<double> center = frame * (T.R * spread3<double>(point.center) + T.p);
  const double upright = dot(frame.z, T.R * spread3<double>(point.axis));
  const double reach = point.rim_radius > 0 ? point.rim_radius * std::sqrt(std::max(0.0, 1 - upright * upright)) : point.radius;
  return height_below(*plan.ground.terrain, center.x, center.y) + plan.ground.height - center.z + reach;
}

}  // namespace

std::string StartFindings::text() const {
  if (faults.empty()) return "";
  constexpr std::size_t kMost = 6;  // whoever reads on has understood; what to write has them all
  const std::span<const std::string> shown = std::span(faults).first(std::min(kMost, faults.size()));
  const std::string more = faults.size() > kMost ? fmt::format("; and {} more", faults.size() - kMost) : "";
  return fmt::format("it starts where it cannot stay: {}{}; {}, or write start: as given (on the command line --start as-given) to begin there "
                     "all the same",
                     fmt::join(shown, "; "), more, fmt::join(advice, "; "));
}

StartCheck::StartCheck(const Model& model, const Options& options, const Effects& effects)
    : model_(model), plan_(std::make_unique<const EffectPlan>(model, options, effects)), sag_(at(model.tree.shape.slots), 0.0), root_(at(model.tree.shape.slots), 0) {
  if (!effects.ground) return;
  const auto& g = options.gravity;
  const double weight = std::sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
  for (Index i = 1; i < model.tree.shape.slots; ++i) {
    const bool is_root = model.tree.parent(i) == 0;
    root_[at(i)] = is_root ? i : root_[at(model.tree.parent(i))];
    if (is_root) sag_[at(i)] = model.constants.subtree_mass(i) * weight / effects.ground->stiffness;
  }
}

StartCheck::~StartCheck() = default;

StartFindings StartCheck::look(std::span<const double> positions) const {
  StartFindings found;
  found.positions.assign(positions.begin(), positions.end());
  if (positions.empty()) found.positions = model_.neutral();
  // what is no start at all is refused where it is taken
  if (found.positions.size() != at(model_.tree.shape.positions)) return found;
  if (!std::ranges::all_of(found.positions, [](double q) { return std::isfinite(q); })) return found;
  look_at_ties(found);
  look_at_limits(found);
  look_at_ground(found);
  look_at_contact(found);
  return found;
}

StartFindings StartCheck::look_under(std::span<const double> positions) const {
  StartFindings found;
  found.positions.assign(positions.begin(), positions.end());
  look_at_ground(found);
  return found;
}

void StartCheck::follow(std::vector<double>& positions) const {
  for (const Mimic& mimic : model_.mimics) positions[at(mimic.follower_q)] = mimic.multiplier * positions[at(mimic.leader_q)] + mimic.offset;
}

void StartCheck::look_at_ties(StartFindings& found) const {
  bool any = false;
  for (const Mimic& mimic : model_.mimics) {
    const double given = found.positions[at(mimic.follower_q)];
    const double tied = mimic.multiplier * found.positions[at(mimic.leader_q)] + mimic.offset;
    if (std::abs(given - tied) <= kPositionRounding * std::max({1.0, std::abs(given), std::abs(tied)})) continue;
    any = true;
    found.faults.push_back(fmt::format("joint {} is at {:.10g} {} and follows {}, which puts it at {:.10g}",
                                       quoted(model_.names.joint[at(mimic.follower_slot)]), given, unit_of(model_, mimic.follower_slot),
                                       quoted(model_.names.joint[at(mimic.leader_slot)]), tied));
  }
  if (any) found.advice.push_back("give followers the positions of their leaders");
  follow(found.positions);
}

void StartCheck::look_at_limits(StartFindings& found) const {
  if (plan_->effects.limits.empty()) return;
  const std::unordered_map<Index, Index> screws = screws_of(model_);
  std::vector<std::string> lines, cables;
  for (const JointLimit& limit : plan_->effects.limits) {
    const Index slot = screws.at(limit.row);
    double& q = found.positions[at(model_.tree.first_q(slot))];
    const double bound = std::clamp(q, limit.lower, limit.upper), beyond = std::abs(q - bound);
    if (!(beyond > 0)) continue;
    const std::string name = quoted(model_.names.velocity[at(limit.row)]);
    const std::string_view unit = unit_of(model_, slot);
    const bool is_cable = std::ranges::any_of(model_.couplings, [&](const Coupling& coupling) {
      return coupling.kind == CouplingKind::cable && coupling.terms.front().v_row == limit.row;
    });
    if (is_cable) {
      if (beyond <= kPositionRounding * std::max(1.0, std::abs(bound))) continue;  // it cannot be moved: its length is what it is
      found.faults.push_back(fmt::format("cable {} is {:.10g} m long, outside its limits ({})", name, q, range_text(limit.lower, limit.upper, unit)));
      cables.push_back(fmt::format("{}", name));
      continue;
    }
    if (beyond <= std::max(kPositionRounding, kWrittenDigits * std::abs(bound))) {
      found.moved.push_back(fmt::format("joint {} starts at {:.10g} {}, {:.2g} beyond its limit; moved onto it, {:.10g}", name, q, unit, beyond, bound));
      q = bound;
      continue;
    }
    found.faults.push_back(fmt::format("joint {} is at {:.10g} {}, outside its limits ({})", name, q, unit, range_text(limit.lower, limit.upper, unit)));
    lines.push_back(fmt::format("{}: {}", model_.names.velocity[at(limit.row)], text_of(bound)));
  }
  if (!lines.empty()) {
    found.advice.push_back(fmt::format("write initial: {{positions: {{{}}}}} or what else lies within, or change effects.limits", fmt::join(lines, ", ")));
  }
  if (!cables.empty()) found.advice.push_back(fmt::format("give another length to {}, or other places to what hangs on it", fmt::join(cables, ", ")));
  if (!found.moved.empty()) follow(found.positions);
}

double StartCheck::allowed(Index slot) const { return std::max(kShallow, sag_[at(root_[at(slot)])]); }

Field<double, 12> StartCheck::poses(const std::vector<double>& positions) const {
  const Tree& tree = model_.tree;
  Field<double> q;
  q.allocate(tree.shape.positions);
  std::ranges::copy(positions, q.flat().begin());
  Field<double, 12> placement, pose;
  placement.allocate(tree.shape.slots);
  pose.allocate(tree.shape.slots);
  placement_map(tree, model_.constants, q, placement);
  world_placement_down(tree, placement, pose);
  return pose;
}

void StartCheck::look_at_contact(StartFindings& found) const {
  if (!plan_->pairs) return;
  BodyContacts contacts(*plan_->effects.contact, model_);
  contacts.find(poses(found.positions));
  std::map<std::size_t, double> depth;  // of the deepest place of a pair
  for (const BodyContacts::Touch& touch : contacts.touches()) {
    if (-touch.gap > kShallow) depth[touch.pair] = std::max(depth[touch.pair], -touch.gap);
  }
  const PairContact& contact = *plan_->effects.contact;
  for (const auto& [pair, deep] : depth) {
    const auto& [a, b] = contact.pairs[pair];
    found.told.push_back(fmt::format("links {} and {} start {:.4g} m deep in each other: they are pushed apart at {:g} m/s", quoted(contact.shapes[a].link),
                                     quoted(contact.shapes[b].link), deep, kRecoverySpeed));
  }
}

void StartCheck::look_at_ground(StartFindings& found) const {
  if (plan_->ground.points.empty()) return;
  const Tree& tree = model_.tree;
  const Field<double, 12> pose = poses(found.positions);
  GroundPoints<double> points;
  points.allocate({.slots = static_cast<Index>(plan_->ground.points.size())});
  find_ground(plan_->ground, pose, points);

  std::map<Index, double> depth, across;  // of the deepest point of a body that is too deep: a fault, and to be told
  const bool level = !plan_->ground.ground.terrain;
  for (std::size_t k = 0; k < plan_->ground.points.size(); ++k) {
    const GroundPoint& point = plan_->ground.points[k];
    const auto note = [&](std::map<Index, double>& depths, double deep) {
      if (deep > allowed(point.slot)) depths[point.slot] = std::max(depths[point.slot], deep);
    };
    note(level ? depth : across, -points.gap(static_cast<Index>(k)));
    if (!level && point.block < 0 && point.begins_candidate()) note(depth, depth_below(plan_->ground, point, pose));
  }
  for (const auto& [slot, deep] : across) {
    if (depth.contains(slot)) continue;
    found.told.push_back(fmt::format("link {} starts {:.4g} m deep in the ground, measured across its slope: it is pushed out of there",
                                     quoted(model_.names.body[at(slot)]), deep));
  }
  bool floats = false, stands = false;
  double deepest = 0;
  for (const auto& [slot, deep] : depth) {
    found.faults.push_back(fmt::format("link {} is {:.4g} m deep in the ground, which at rest gives way by {:.2g} m at most",
                                       quoted(model_.names.body[at(slot)]), deep, allowed(slot)));
    (tree.kind(root_[at(slot)]) == JointKind::free ? floats : stands) = true;
    deepest = std::max(deepest, deep);
  }
  if (floats) found.advice.push_back(fmt::format("raise the base by {:.4g} m (initial: {{base: {{position: [x, y, z]}}}})", deepest));
  if (stands) found.advice.push_back(fmt::format("lower effects.ground.height by {:.4g} m, or move the joints", deepest));
}

std::vector<double> checked_start(const Scene& scene) {
  if (scene.start_as_given) return scene.initial.positions;
  StartFindings found = StartCheck(scene.model, scene.options, scene.effects).look(scene.initial.positions);
  if (!found.sound()) throw InputError(fmt::format("scene of {}: {}", quoted(scene.model.names.model), found.text()));
  if (scene.initial.positions.empty() && found.moved.empty()) return {};
  return std::move(found.positions);
}

std::vector<std::string> zeros_outside_limits(const Model& model) {
  const std::vector<double> zero = model.neutral();
  std::vector<std::string> joints;
  for (const Run& run : model.tree.runs) {
    if (run.kind != JointKind::screw) continue;
    for (Index i = run.begin; i < run.end; ++i) {
      const Index v = model.tree.first_v(i);
      const double q = zero[at(model.tree.first_q(i))], lower = model.attributes.lower(v), upper = model.attributes.upper(v);
      if (std::abs(q - std::clamp(q, lower, upper)) <= kPositionRounding) continue;
      joints.push_back(fmt::format("{} ({:.6g}, limits {})", quoted(model.names.velocity[at(v)]), q, range_text(lower, upper, unit_of(model, i))));
    }
  }
  return joints;
}

}  // namespace linden

#include "layout/effects.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <string_view>
#include <utility>

#include "layout/effects/row_facts.hpp"
#include "layout/model.hpp"
#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"

namespace linden {
namespace {

constexpr double kUnlimited = std::numeric_limits<double>::infinity();

std::string advice_for(const std::string& name, const std::vector<std::string>& known, const char* otherwise) {
  const std::string guess = nearest(name, known);
  return guess.empty() ? otherwise : fmt::format("did you mean {}?", quoted(guess));
}

}  // namespace

double BodyWrench::share_at(double time) const { return time >= from && time < to ? scale.at(time) : 0; }

double BodyWrench::mean_share(double begin, double end) const {
  const double slack = rounding_of(begin, end);
  const double first = from <= begin + slack ? begin : from, last = to >= end - slack ? end : to;
  if (!(last - first > slack)) return 0;
  return (last - first) / (end - begin) * scale.mean(first, last);
}

Followers::Followers(const Model& model) : mimics_(static_cast<std::size_t>(model.tree.shape.velocities), nullptr) {
  for (const Mimic& mimic : model.mimics) mimics_[static_cast<std::size_t>(mimic.follower_v)] = &mimic;
}

const Mimic* Followers::mimic(Index row) const {
  if (row < 0 || static_cast<std::size_t>(row) >= mimics_.size()) {
    throw InputError(fmt::format("row {} does not exist; expected 0 to {}; take it from row_of", row, mimics_.size() - 1));
  }
  return mimics_[static_cast<std::size_t>(row)];
}

std::vector<Index> rows_of_joints(const Model& model, bool with_balls) {
  const RowFacts facts(model);
  std::vector<Index> rows;
  for (Index row = 0; row < facts.count(); ++row) {
    const JointKind kind = facts.kind(row);
    if (kind == JointKind::screw || (with_balls && kind == JointKind::ball)) rows.push_back(row);
  }
  return rows;
}

const Attributes& file_of(const Model& model) { return model.attributes; }

Index row_of(const Model& model, const std::string& joint) {
  const Names& names = model.names;
  const auto found = names.slot_of_joint.find(joint);
  Index slot = found == names.slot_of_joint.end() ? 0 : found->second;
  const auto is_it = [&](Index at) { return at > 0 && names.joint[static_cast<std::size_t>(at)] == joint; };
  if (slot > 0 && !is_it(slot)) {
    throw InputError(fmt::format("joint {} is planar; expected a joint of one coordinate; name \"{}.x\", \"{}.y\" or \"{}.turn\"",
                                 quoted(joint), joint, joint, joint));
  }
  // a part of a planar joint
  for (Index i = 1; slot == 0 && i < model.tree.shape.slots; ++i) slot = is_it(i) ? i : 0;
  if (slot == 0) {
    throw InputError(fmt::format("no joint {} moves in model {}; expected one that does; {}", quoted(joint), quoted(names.model),
                                 advice_for(joint, {names.joint.begin() + 1, names.joint.end()}, "linden inspect lists them")));
  }
  return model.tree.first_v(slot);
}

const LinkPlace& place_of(const Model& model, const std::string& link) {
  const auto found = model.names.link.find(link);
  if (found != model.names.link.end()) return found->second;
  std::vector<std::string> known;
  for (const auto& [name, place] : model.names.link) known.push_back(name);
  std::ranges::sort(known);
  throw InputError(fmt::format("model {} has no link {}; expected one that it has; {}", quoted(model.names.model), quoted(link),
                               advice_for(link, known, "linden inspect lists them")));
}

std::vector<JointLimit> on_leaders(const Model& model, const std::vector<JointLimit>& list) {
  std::vector<JointLimit> result = carried(
      model, list,
      [](JointLimit entry, const Mimic& mimic) {
        entry.lower = (entry.lower - mimic.offset) / mimic.multiplier;
        entry.upper = (entry.upper - mimic.offset) / mimic.multiplier;
        if (mimic.multiplier < 0) std::swap(entry.lower, entry.upper);
        entry.velocity /= std::abs(mimic.multiplier);
        return entry;
      },
      [](JointLimit& into, const JointLimit& other) {
        into.lower = std::max(into.lower, other.lower);
        into.upper = std::min(into.upper, other.upper);
        into.restitution = std::min(into.restitution, other.restitution);
        into.velocity = std::min(into.velocity, other.velocity);
      });
  for (const JointLimit& limit : result) {
    if (limit.lower > limit.upper) {
      throw InputError(
          fmt::format("joint {}: its limits and those of the joints that follow it leave no room, {} to {}; expected "
                      "limits that overlap; widen them",
                      quoted(model.names.velocity[static_cast<std::size_t>(limit.row)]), limit.lower, limit.upper));
    }
  }
  return result;
}

std::vector<JointDamping> urdf_damping(const Model& model) { return from_file<JointDamping>(model); }

std::vector<JointFriction> urdf_friction(const Model& model) { return from_file<JointFriction>(model); }

std::vector<JointLimit> urdf_limits(const Model& model, double restitution, bool velocities) {
  const RowFacts facts(model);
  std::vector<JointLimit> list;
  for (Index row = 0; row < facts.count(); ++row) {
    const double lower = model.attributes.lower(row), upper = model.attributes.upper(row);
    const double velocity = velocities ? model.attributes.max_velocity(row) : kUnlimited;
    const bool any = std::isfinite(lower) || std::isfinite(upper) || std::isfinite(velocity);
    if (any && facts.kind(row) == JointKind::screw) list.push_back({row, lower, upper, restitution, velocity});
  }
  return on_leaders(model, list);
}

std::vector<Armature> armature_everywhere(const Model& model, double inertia) { return everywhere<Armature>(model, inertia); }

std::vector<JointDamping> damping_everywhere(const Model& model, double coefficient) { return everywhere<JointDamping>(model, coefficient); }

std::vector<JointFriction> friction_everywhere(const Model& model, double force) { return everywhere<JointFriction>(model, force); }

std::vector<JointLimit> velocity_limit_everywhere(const Model& model, double velocity) {
  std::vector<JointLimit> list;
  for (const Index row : rows_of_joints(model, false)) list.push_back({.row = row, .velocity = velocity});
  return on_leaders(model, list);
}

std::vector<Servo> servo_everywhere(const Model& model, double stiffness, double damping, const std::vector<double>& positions) {
  if (!positions.empty() && positions.size() != static_cast<std::size_t>(model.tree.shape.positions)) {
    throw InputError(fmt::format("{} positions given as targets; expected {}; give one a coordinate of model {}",
                                 positions.size(), model.tree.shape.positions, quoted(model.names.model)));
  }
  const RowFacts facts(model);
  std::vector<Servo> list;
  for (Index row = 0; row < facts.count(); ++row) {
    if (facts.kind(row) != JointKind::screw || facts.mimic(row) != nullptr) continue;
    list.push_back({.row = row,
                    .stiffness = stiffness,
                    .damping = damping,
                    .target = positions.empty() ? 0 : positions[static_cast<std::size_t>(facts.first_position(row))],
                    .max_force = model.attributes.max_effort(row)});
  }
  return list;
}

bool act_from_outside(const Effects& effects) {
  bool any = false;
  Effects::each(effects, [&]<class Entry>(std::span<const Entry> entries, std::string_view) {
    any = any || (Entry::facts.site == Site::body && !entries.empty());
  });
  // what is fixed to the world takes what it is pushed with
  const auto touches_world = [](const PairContact& contact) {
    return std::ranges::any_of(contact.pairs, [&](const auto& pair) { return contact.shapes[pair.first].slot == 0; });
  };
  return any || (effects.contact && touches_world(*effects.contact));
}

}  // namespace linden

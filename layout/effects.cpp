#include "layout/effects.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <span>
#include <string_view>
#include <unordered_set>
#include <utility>

#include "layout/model.hpp"
#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"

namespace linden {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::string advice_for(const std::string& name, const std::vector<std::string>& known, const char* otherwise) {
  const std::string guess = nearest(name, known);
  return guess.empty() ? otherwise : fmt::format("did you mean {}?", quoted(guess));
}

/// "row 7, joint elbow", for messages: the velocity's name is the joint's, with a component for ball and free joints.
std::string row_text(const Model& model, Index row) {
  return fmt::format("row {} ({})", row, model.names.velocity[static_cast<std::size_t>(row)]);
}

/// Kind of the joint that each velocity row belongs to, and the mimic that it follows by.
class RowFacts {
 public:
  explicit RowFacts(const Model& model)
      : kind_(static_cast<std::size_t>(model.tree.shape.velocities)), position_(kind_.size()), mimic_(kind_.size(), nullptr) {
    for (const Run& run : model.tree.runs) {
      for (Index i = run.begin; i < run.end; ++i) {
        for (Index k = 0; k < velocity_count(run.kind); ++k) {
          kind_[static_cast<std::size_t>(model.tree.first_v(i) + k)] = run.kind;
          position_[static_cast<std::size_t>(model.tree.first_v(i) + k)] = model.tree.first_q(i);
        }
      }
    }
    for (const Mimic& mimic : model.mimics) mimic_[static_cast<std::size_t>(mimic.follower_v)] = &mimic;
  }
  Index count() const { return static_cast<Index>(kind_.size()); }
  JointKind kind(Index row) const { return kind_[static_cast<std::size_t>(row)]; }
  Index first_position(Index row) const { return position_[static_cast<std::size_t>(row)]; }
  const Mimic* mimic(Index row) const { return mimic_[static_cast<std::size_t>(row)]; }

 private:
  std::vector<JointKind> kind_;
  std::vector<Index> position_;
  std::vector<const Mimic*> mimic_;
};

/// `carry(entry, mimic)` turns a follower's entry to its leader's, `join(into, other)` makes one of two on a row.
template <class Entry, class Carry, class Join>
std::vector<Entry> carried(const Model& model, const std::vector<Entry>& list, const Carry& carry, const Join& join) {
  const RowFacts facts(model);
  std::map<Index, Entry> at_row;
  for (Entry entry : list) {
    if (entry.row < 0 || entry.row >= facts.count()) {
      throw InputError(fmt::format("row {} does not exist; expected 0 to {}; take it from row_of", entry.row, facts.count() - 1));
    }
    if (const Mimic* mimic = facts.mimic(entry.row)) {
      // a follower that its leader does not move
      if (mimic->multiplier == 0) continue;
      entry = carry(entry, *mimic);
      entry.row = mimic->leader_v;
    }
    const auto [place, fresh] = at_row.emplace(entry.row, entry);
    if (!fresh) join(place->second, entry);
  }
  std::vector<Entry> result;
  for (const auto& [row, entry] : at_row) result.push_back(entry);
  return result;
}

template <class Entry>
std::vector<Entry> everywhere(const Model& model, double Entry::*member, double value, bool balls) {
  const RowFacts facts(model);
  std::vector<Entry> list;
  for (Index row = 0; row < facts.count(); ++row) {
    const JointKind kind = facts.kind(row);
    if (kind != JointKind::screw && !(balls && kind == JointKind::ball)) continue;
    Entry& entry = list.emplace_back();
    entry.row = row;
    entry.*member = value;
  }
  return on_leaders(model, list);
}

/// The first point after `time`.
std::size_t first_after(const Course& course, double time) {
  return static_cast<std::size_t>(std::ranges::upper_bound(course.times, time) - course.times.begin());
}

/// The line that ends at point k, at `time`; before the first point and after the last it is level.
double on_piece(const Course& course, std::size_t k, double time) {
  if (k == 0) return course.values.front();
  if (k == course.times.size()) return course.values.back();
  const double share = (time - course.times[k - 1]) / (course.times[k] - course.times[k - 1]);
  return course.values[k - 1] + share * (course.values[k] - course.values[k - 1]);
}

/// By how much the ends of a step and the times that people give may miss each other by rounding alone: each is a product or a sum of few.
double rounding_of(double begin, double end) {
  constexpr double kRoundings = 8;
  return kRoundings * std::numeric_limits<double>::epsilon() * std::max(std::abs(begin), std::abs(end));
}

/// Looks at effects one by one and says which one is wrong.
class Checker {
 public:
  Checker(const Effects& effects, const Model& model) : effects_(effects), model_(model), facts_(model) {}

  void run() {
    each("armature", effects_.armature, [&](const Armature& entry) {
      require_screw(entry.row);
      not_negative("inertia", entry.inertia);
    });
    each("springs", effects_.springs, [&](const JointSpring& entry) {
      require_screw(entry.row);
      not_negative("stiffness", entry.stiffness);
      finite("rest", entry.rest);
    });
    each("ball_springs", effects_.ball_springs, [&](const BallSpring& entry) {
      require_slot(entry.slot);
      if (model_.tree.kind(entry.slot) != JointKind::ball) {
        fail(fmt::format("joint {} is no ball joint", quoted(model_.names.joint[static_cast<std::size_t>(entry.slot)])),
             "a ball joint", "give it a JointSpring");
      }
      not_negative("stiffness", entry.stiffness);
      unit("rest", entry.rest);
    });
    each("damping", effects_.damping, [&](const JointDamping& entry) {
      require_row(entry.row);
      if (facts_.kind(entry.row) == JointKind::free)
        fail(row_text(model_, entry.row) + " is of a free joint", "a screw or ball joint", "use drag");
      not_negative("coefficient", entry.coefficient);
    });
    once("friction", effects_.friction, [&](const JointFriction& entry) {
      require_screw(entry.row);
      not_negative("force", entry.force);
    });
    once("limits", effects_.limits, [&](const JointLimit& entry) {
      require_screw(entry.row);
      if (!(entry.lower <= entry.upper)) {
        fail(fmt::format("lower is {}, upper is {}", entry.lower, entry.upper), "lower at or below upper", "exchange them");
      }
      if (entry.lower == kInfinity || entry.upper == -kInfinity) {
        fail(fmt::format("{} may only be at {}", row_text(model_, entry.row), entry.lower), "limits that a joint can be between",
             "change them");
      }
      if (!(entry.restitution >= 0 && entry.restitution <= 1)) {
        fail(fmt::format("restitution is {}", entry.restitution), "0 to 1", "0 stops, 1 bounces back at the same speed");
      }
      if (!(entry.velocity >= 0)) fail(fmt::format("velocity is {}", entry.velocity), "zero or more", "infinity is no limit");
    });
    once("servos", effects_.servos, [&](const Servo& entry) {
      require_screw(entry.row);
      not_negative("stiffness", entry.stiffness);
      not_negative("damping", entry.damping);
      finite("target", entry.target);
      if (entry.target_moves() || !entry.target_over_time.values.empty()) require_course("target_over_time", entry.target_over_time);
      require_course("target_velocity", entry.target_velocity);
      require_course("feedforward", entry.feedforward);
      if (!(entry.max_force >= 0)) fail(fmt::format("max_force is {}", entry.max_force), "zero or more", "infinity is no limit");
    });
    each("torques", effects_.torques, [&](const JointTorque& entry) {
      require_screw(entry.row);
      require_course("force", entry.force);
    });
    once("motions", effects_.motions, [&](const JointMotion& entry) {
      require_screw(entry.row);
      require_course("position", entry.position);
      const auto twice = std::ranges::adjacent_find(entry.position.times);
      if (twice != entry.position.times.end())
        fail(fmt::format("{} is at two places at {} s", row_text(model_, entry.row), *twice), "one position a time", "leave one out");
      if (!entry.velocities.empty() && entry.velocities.size() != entry.position.times.size()) {
        fail(fmt::format("position has {} times, and there are {} velocities", entry.position.times.size(), entry.velocities.size()),
             "one a time, or none", "add what is missing");
      }
      for (const double velocity : entry.velocities) finite("a velocity", velocity);
    });
    refuse_moved("friction", effects_.friction);
    refuse_moved("limits", effects_.limits);
    each("wrenches", effects_.wrenches, [&](const BodyWrench& entry) {
      require_slot(entry.slot);
      for (int k = 0; k < 3; ++k) {
        const auto at = static_cast<std::size_t>(k);
        finite("point", entry.point[at]);
        finite("force", entry.force[at]);
        finite("moment", entry.moment[at]);
      }
      if (!(entry.from <= entry.to))
        fail(fmt::format("it goes from {} to {} s", entry.from, entry.to), "from at or before to", "exchange them");
      require_course("scale", entry.scale);
    });
    each("drag", effects_.drag, [&](const Drag& entry) {
      require_slot(entry.slot);
      not_negative("linear", entry.linear);
      not_negative("quadratic", entry.quadratic);
      if (!(model_.constants.inertia(entry.slot, 0) > 0)) {
        fail(fmt::format("body {} has no mass", quoted(model_.names.body[static_cast<std::size_t>(entry.slot)])),
             "one with a centre of mass for drag to act on", "leave it out");
      }
    });
    where_ = "wind";
    for (const double speed : effects_.wind) finite("wind", speed);
    where_ = "ground";
    if (effects_.ground) check_ground(*effects_.ground);
  }

 private:
  [[noreturn]] void fail(const std::string& found, std::string_view expected, std::string_view advice) const {
    throw InputError(fmt::format("effects.{}: {}; expected {}; {}", where_, found, expected, advice));
  }

  template <class Entry, class Look>
  void each(const char* list_name, const std::vector<Entry>& list, const Look& look) {
    for (std::size_t k = 0; k < list.size(); ++k) {
      where_ = fmt::format("{}[{}]", list_name, k);
      look(list[k]);
    }
  }

  template <class Entry, class Look>
  void once(const char* list_name, const std::vector<Entry>& list, const Look& look) {
    std::unordered_set<Index> seen;
    each(list_name, list, [&](const Entry& entry) {
      look(entry);
      if (!seen.insert(entry.row).second)
        fail(row_text(model_, entry.row) + " is named twice", "one entry a joint", "leave one out");
    });
  }

  template <class Entry>
  void refuse_moved(const char* list_name, const std::vector<Entry>& list) {
    each(list_name, list, [&](const Entry& entry) {
      if (std::ranges::find(effects_.motions, entry.row, &JointMotion::row) != effects_.motions.end())
        fail(fmt::format("the motion of {} is given", row_text(model_, entry.row)), "a joint that moves by itself", "leave it out");
    });
  }

  void require_row(Index row) const {
    if (row < 0 || row >= facts_.count()) {
      fail(fmt::format("row {} does not exist", row), fmt::format("0 to {}", facts_.count() - 1), "take it from row_of");
    }
    if (const Mimic* mimic = facts_.mimic(row)) {
      fail(fmt::format("joint {} follows another", quoted(model_.names.joint[static_cast<std::size_t>(mimic->follower_slot)])),
           "a joint that follows none",
           fmt::format("name its leader {}", quoted(model_.names.joint[static_cast<std::size_t>(mimic->leader_slot)])));
    }
  }

  void require_screw(Index row) const {
    require_row(row);
    if (facts_.kind(row) != JointKind::screw) {
      fail(fmt::format("{} is of a {} joint", row_text(model_, row), facts_.kind(row) == JointKind::ball ? "ball" : "free"),
           "a joint that turns or slides about one axis", "leave it out");
    }
  }

  void require_slot(Index slot) const {
    if (slot < 1 || slot > model_.tree.bodies()) {
      fail(fmt::format("slot {} holds no body", slot), fmt::format("1 to {}", model_.tree.bodies()), "take it from place_of");
    }
  }

  void finite(const char* what, double value) const {
    if (!std::isfinite(value)) fail(fmt::format("{} is {}", what, value), "a finite number", "change it");
  }
  void not_negative(const char* what, double value) const {
    finite(what, value);
    if (value < 0) fail(fmt::format("{} is {}", what, value), "zero or more", "change its sign");
  }
  void positive(const char* what, double value) const {
    finite(what, value);
    if (!(value > 0)) fail(fmt::format("{} is {}", what, value), "more than zero", "change it");
  }

  void unit(const char* what, std::span<const double> values) const {
    constexpr double kSlack = 1e-6;
    double square = 0;
    for (const double value : values) square += value * value;
    if (!(std::abs(std::sqrt(square) - 1) <= kSlack)) {
      fail(fmt::format("{} has length {}", what, std::sqrt(square)), "unit length", "divide it by its length");
    }
  }

  void require_course(const char* what, const Course& course) const {
    if (course.times.empty() || course.times.size() != course.values.size()) {
      fail(fmt::format("{} has {} times and {} values", what, course.times.size(), course.values.size()),
           "one value a time, one or more", "add what is missing");
    }
    for (const double value : course.values) finite(what, value);
    for (std::size_t k = 0; k < course.times.size(); ++k) {
      finite("a time", course.times[k]);
      if (k > 0 && course.times[k] < course.times[k - 1]) {
        fail(fmt::format("time {} s comes after {} s", course.times[k], course.times[k - 1]), "times that ascend", "sort them");
      }
    }
  }

  void check_ground(const Ground& ground) {
    unit("normal", ground.normal);
    finite("height", ground.height);
    positive("stiffness", ground.stiffness);
    not_negative("damping", ground.damping);
    not_negative("friction", ground.friction);
    if (ground.terrain) check_terrain(*ground.terrain);
    const auto sorted = [](const auto& list) {
      return std::ranges::is_sorted(list, {}, [](const auto& entry) { return entry.slot; });
    };
    if (!sorted(ground.contacts.spheres) || !sorted(ground.contacts.rims) || !sorted(ground.contacts.blocks))
      fail("its contacts are in no order", "bodies in ascending order", "sort them by slot");
    for (const ContactSphere& sphere : ground.contacts.spheres) {
      require_slot(sphere.slot);
      for (const double value : sphere.center) finite("the centre of a contact", value);
      not_negative("the radius of a contact", sphere.radius);
    }
    for (const ContactRim& rim : ground.contacts.rims) {
      require_slot(rim.slot);
      for (const double value : rim.center) finite("the centre of a contact", value);
      unit("the axis of a contact", rim.axis);
      not_negative("the radius of a contact", rim.radius);
    }
    for (const ContactBlock& block : ground.contacts.blocks) {
      require_slot(block.slot);
      for (const double value : block.center) finite("the centre of a contact", value);
      for (const auto& axis : block.axes) unit("the axis of a contact", axis);
      for (const double value : block.half) not_negative("half an edge of a contact", value);
      not_negative("the radius of a contact", block.radius);
    }
  }

  void check_terrain(const HeightField& terrain) {
    where_ = "ground.terrain";
    if (terrain.columns < 2 || terrain.rows < 2) {
      fail(fmt::format("it has {} columns and {} rows", terrain.columns, terrain.rows), "two of each or more", "add some");
    }
    const auto expected = static_cast<std::size_t>(terrain.columns) * static_cast<std::size_t>(terrain.rows);
    if (terrain.heights.size() != expected) {
      fail(fmt::format("it has {} heights", terrain.heights.size()), fmt::format("columns x rows = {}", expected),
           "make them agree");
    }
    positive("spacing_x", terrain.spacing_x);
    positive("spacing_y", terrain.spacing_y);
    finite("origin_x", terrain.origin_x);
    finite("origin_y", terrain.origin_y);
    for (const double height : terrain.heights) finite("a height", height);
    where_ = "ground";
  }

  const Effects& effects_;
  const Model& model_;
  RowFacts facts_;
  std::string where_;
};

}  // namespace

double Course::at(double time) const { return on_piece(*this, first_after(*this, time), time); }

double Course::mean(double begin, double end) const {
  const double slack = rounding_of(begin, end), length = end - begin, last = end - slack;
  std::size_t k = first_after(*this, begin + slack);
  const auto ends = [&] { return k == times.size() || times[k] >= last; };
  if (ends()) return on_piece(*this, k, begin + 0.5 * length);
  double sum = 0;
  for (double from = begin;; ++k) {
    const bool whole = ends();
    const double to = whole ? end : times[k];
    if (to > from) sum += (to - from) * on_piece(*this, k, from + 0.5 * (to - from));
    if (whole) return sum / length;
    from = to;
  }
}

bool Servo::target_moves() const { return !target_over_time.times.empty(); }

double Servo::target_at(double time) const { return target_moves() ? target_over_time.at(time) : target; }

double BodyWrench::share_at(double time) const { return time >= from && time < to ? scale.at(time) : 0; }

double BodyWrench::mean_share(double begin, double end) const {
  const double slack = rounding_of(begin, end);
  const double first = from <= begin + slack ? begin : from, last = to >= end - slack ? end : to;
  if (!(last - first > slack)) return 0;
  return (last - first) / (end - begin) * scale.mean(first, last);
}

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

std::vector<Armature> on_leaders(const Model& model, const std::vector<Armature>& list) {
  return carried(
      model, list,
      [](Armature entry, const Mimic& mimic) {
        return Armature{entry.row, entry.inertia * mimic.multiplier * mimic.multiplier};
      },
      [](Armature& into, const Armature& other) { into.inertia += other.inertia; });
}

std::vector<JointDamping> on_leaders(const Model& model, const std::vector<JointDamping>& list) {
  return carried(
      model, list,
      [](JointDamping entry, const Mimic& mimic) {
        return JointDamping{entry.row, entry.coefficient * mimic.multiplier * mimic.multiplier};
      },
      [](JointDamping& into, const JointDamping& other) { into.coefficient += other.coefficient; });
}

std::vector<JointFriction> on_leaders(const Model& model, const std::vector<JointFriction>& list) {
  return carried(
      model, list,
      [](JointFriction entry, const Mimic& mimic) {
        return JointFriction{entry.row, entry.force * std::abs(mimic.multiplier)};
      },
      [](JointFriction& into, const JointFriction& other) { into.force += other.force; });
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

std::vector<JointDamping> urdf_damping(const Model& model) {
  const RowFacts facts(model);
  std::vector<JointDamping> list;
  for (Index row = 0; row < facts.count(); ++row) {
    const double coefficient = model.attributes.damping(row);
    if (coefficient > 0 && facts.kind(row) != JointKind::free) list.push_back({row, coefficient});
  }
  return on_leaders(model, list);
}

std::vector<JointFriction> urdf_friction(const Model& model) {
  const RowFacts facts(model);
  std::vector<JointFriction> list;
  for (Index row = 0; row < facts.count(); ++row) {
    const double force = model.attributes.friction(row);
    if (force > 0 && facts.kind(row) == JointKind::screw) list.push_back({row, force});
  }
  return on_leaders(model, list);
}

std::vector<JointLimit> urdf_limits(const Model& model, double restitution, bool velocities) {
  const RowFacts facts(model);
  std::vector<JointLimit> list;
  for (Index row = 0; row < facts.count(); ++row) {
    const double lower = model.attributes.lower(row), upper = model.attributes.upper(row);
    const double velocity = velocities ? model.attributes.max_velocity(row) : kInfinity;
    const bool any = std::isfinite(lower) || std::isfinite(upper) || std::isfinite(velocity);
    if (any && facts.kind(row) == JointKind::screw) list.push_back({row, lower, upper, restitution, velocity});
  }
  return on_leaders(model, list);
}

std::vector<Armature> armature_everywhere(const Model& model, double inertia) {
  return everywhere(model, &Armature::inertia, inertia, false);
}

std::vector<JointDamping> damping_everywhere(const Model& model, double coefficient) {
  return everywhere(model, &JointDamping::coefficient, coefficient, true);
}

std::vector<JointFriction> friction_everywhere(const Model& model, double force) {
  return everywhere(model, &JointFriction::force, force, false);
}

std::vector<JointLimit> velocity_limit_everywhere(const Model& model, double velocity) {
  return everywhere(model, &JointLimit::velocity, velocity, false);
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

bool act_from_outside(const Effects& effects) { return !effects.wrenches.empty() || !effects.drag.empty() || effects.ground; }

void check(const Effects& effects, const Model& model) { Checker(effects, model).run(); }

}  // namespace linden

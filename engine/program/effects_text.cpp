#include "engine/program/effects_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "engine/text.hpp"

namespace linden {
namespace {

using Json = nlohmann::ordered_json;

/// "0.1 to 2", "0.01" where all are alike.
template <class Entry, class Value>
std::string range_text(const std::vector<Entry>& list, const Value& value_of) {
  double least = value_of(list.front()), most = least;
  for (const Entry& entry : list) {
    least = std::min(least, value_of(entry));
    most = std::max(most, value_of(entry));
  }
  const auto text = [](double value) { return std::isinf(value) ? std::string("no limit") : fmt::format("{:.4g}", value); };
  return least == most ? text(least) : fmt::format("{} to {}", text(least), text(most));
}

/// How many slots hold the joints of these rows: a ball joint has three.
template <class Entry>
std::int64_t joints_of(const std::vector<Entry>& list, const Model& model) {
  std::set<Index> joints;
  std::vector<Index> slot_of_row(static_cast<std::size_t>(model.tree.shape.velocities));
  for (const Run& run : model.tree.runs) {
    for (Index i = run.begin; i < run.end; ++i) {
      for (Index k = 0; k < velocity_count(run.kind); ++k) slot_of_row[static_cast<std::size_t>(model.tree.first_v(i) + k)] = i;
    }
  }
  for (const Entry& entry : list) joints.insert(slot_of_row[static_cast<std::size_t>(entry.row)]);
  return static_cast<std::int64_t>(joints.size());
}

template <class Entry>
std::int64_t bodies_of(const std::vector<Entry>& list) {
  std::set<Index> slots;
  for (const Entry& entry : list) slots.insert(entry.slot);
  return static_cast<std::int64_t>(slots.size());
}

/// Units of a coefficient per angle, per shift, or both, as the joints of these rows need.
template <class Entry>
std::string unit_text(const std::vector<Entry>& list, const Model& model, const char* turning, const char* sliding) {
  bool turns = false, slides = false;
  for (const Run& run : model.tree.runs) {
    for (Index i = run.begin; i < run.end; ++i) {
      const Index first = model.tree.first_v(i);
      const bool slide = run.kind == JointKind::screw && model.constants.screw(i, 0) == 0;
      const bool named = std::ranges::any_of(
          list, [&](const Entry& entry) { return entry.row >= first && entry.row < first + velocity_count(run.kind); });
      if (named) (slide ? slides : turns) = true;
    }
  }
  return turns && slides ? fmt::format("{}, {}", turning, sliding) : slides ? sliding : turning;
}

std::string vector_text(const std::array<double, 3>& v) { return fmt::format("{:g} {:g} {:g}", v[0], v[1], v[2]); }

Json number_or_null(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

}  // namespace

std::vector<EffectLine> effect_lines(const Effects& effects, const Model& model) {
  std::vector<EffectLine> lines;
  const auto add = [&](const char* name, std::string where, std::string what) {
    lines.push_back({name, std::move(where), std::move(what)});
  };
  const auto on_joints = [&](const char* name, const auto& list, const auto& what) {
    if (!list.empty()) add(name, counted(joints_of(list, model), "joint"), what());
  };
  on_joints("armature", effects.armature, [&] {
    return range_text(effects.armature, [](const Armature& entry) { return entry.inertia; }) + " " +
           unit_text(effects.armature, model, "kg m^2", "kg");
  });
  on_joints("damping", effects.damping, [&] {
    return range_text(effects.damping, [](const JointDamping& entry) { return entry.coefficient; }) + " " +
           unit_text(effects.damping, model, "N m s/rad", "N s/m");
  });
  on_joints("friction", effects.friction, [&] {
    return range_text(effects.friction, [](const JointFriction& entry) { return entry.force; }) + " " +
           unit_text(effects.friction, model, "N m", "N");
  });
  on_joints("spring", effects.springs, [&] {
    return range_text(effects.springs, [](const JointSpring& entry) { return entry.stiffness; }) + " " +
           unit_text(effects.springs, model, "N m/rad", "N/m");
  });
  if (!effects.ball_springs.empty()) {
    add("spring", counted(bodies_of(effects.ball_springs), "ball joint"),
        range_text(effects.ball_springs, [](const BallSpring& entry) { return entry.stiffness; }) + " N m/rad");
  }
  on_joints("limits", effects.limits, [&] {
    std::string text = "restitution " + range_text(effects.limits, [](const JointLimit& entry) { return entry.restitution; });
    if (std::ranges::any_of(effects.limits, [](const JointLimit& entry) { return std::isfinite(entry.velocity); })) {
      text += fmt::format(", velocity {} {}", range_text(effects.limits, [](const JointLimit& entry) { return entry.velocity; }),
                          unit_text(effects.limits, model, "rad/s", "m/s"));
    }
    return text;
  });
  on_joints("servo", effects.servos, [&] {
    std::string over_time;
    const auto count = [&](const char* what, const auto& has) {
      const auto found = std::ranges::count_if(effects.servos, has);
      if (found > 0) over_time += ", " + counted(found, what);
    };
    const auto acts = [](const Course& course) { return std::ranges::any_of(course.values, [](double value) { return value != 0; }); };
    count("moving target", [](const Servo& entry) { return entry.target_moves(); });
    count("target velocity", [&](const Servo& entry) { return acts(entry.target_velocity); });
    count("feed-forward", [&](const Servo& entry) { return acts(entry.feedforward); });
    return fmt::format("stiffness {} {}, damping {} {}, force {} {}{}",
                       range_text(effects.servos, [](const Servo& entry) { return entry.stiffness; }),
                       unit_text(effects.servos, model, "N m/rad", "N/m"),
                       range_text(effects.servos, [](const Servo& entry) { return entry.damping; }),
                       unit_text(effects.servos, model, "N m s/rad", "N s/m"),
                       range_text(effects.servos, [](const Servo& entry) { return entry.max_force; }),
                       unit_text(effects.servos, model, "N m", "N"), over_time);
  });
  on_joints("torque", effects.torques, [&] {
    const auto tables =
        std::ranges::count_if(effects.torques, [](const JointTorque& entry) { return entry.force.times.size() > 1; });
    return tables == 0 ? std::string("constant") : fmt::format("{} over time", tables);
  });
  on_joints("motion", effects.motions, [&] {
    const auto tables = std::ranges::count_if(effects.motions, [](const JointMotion& entry) { return entry.position.times.size() > 1; });
    return tables == 0 ? std::string("held in place") : fmt::format("{} over time", tables);
  });
  if (!effects.wrenches.empty()) {
    add("wrench", counted(bodies_of(effects.wrenches), "body"), range_text(effects.wrenches, [](const BodyWrench& entry) {
                                                                  return std::hypot(entry.force[0], entry.force[1],
                                                                                    entry.force[2]);
                                                                }) + " N");
  }
  if (!effects.drag.empty()) {
    add("drag", counted(bodies_of(effects.drag), "body"),
        fmt::format("linear {} N s/m, quadratic {} N s^2/m^2, wind {} m/s",
                    range_text(effects.drag, [](const Drag& entry) { return entry.linear; }),
                    range_text(effects.drag, [](const Drag& entry) { return entry.quadratic; }), vector_text(effects.wind)));
  }
  if (effects.ground) {
    const Ground& ground = *effects.ground;
    add("ground",
        ground.terrain ? fmt::format("{} x {} heights", ground.terrain->columns, ground.terrain->rows) : std::string("plane"),
        fmt::format("normal {}, height {:g} m, stiffness {:g} N/m, damping {:g} N s/m, friction {:g}; {}",
                    vector_text(ground.normal), ground.height, ground.stiffness, ground.damping, ground.friction,
                    counted(static_cast<std::int64_t>(ground.contacts.spheres.size() + ground.contacts.rims.size()), "contact")));
  }
  return lines;
}

Json effects_json(const Effects& effects, const Model& model) {
  const auto joint = [&](Index row) { return model.names.velocity[static_cast<std::size_t>(row)]; };
  const auto body = [&](Index slot) { return model.names.body[static_cast<std::size_t>(slot)]; };
  Json result = Json::object();
  const auto list = [&](const char* name, const auto& entries, const auto& one) {
    for (const auto& entry : entries) result[name].push_back(one(entry));
  };
  const auto course = [](const Course& c) { return Json{{"times", c.times}, {"values", c.values}}; };
  list("armature", effects.armature, [&](const Armature& e) { return Json{{"joint", joint(e.row)}, {"inertia", e.inertia}}; });
  list("damping", effects.damping, [&](const JointDamping& e) {
    return Json{{"joint", joint(e.row)}, {"coefficient", e.coefficient}};
  });
  list("friction", effects.friction, [&](const JointFriction& e) { return Json{{"joint", joint(e.row)}, {"force", e.force}}; });
  list("spring", effects.springs, [&](const JointSpring& e) {
    return Json{{"joint", joint(e.row)}, {"stiffness", e.stiffness}, {"rest", e.rest}};
  });
  list("spring", effects.ball_springs, [&](const BallSpring& e) {
    return Json{{"joint", model.names.joint[static_cast<std::size_t>(e.slot)]}, {"stiffness", e.stiffness}, {"rest", e.rest}};
  });
  list("limits", effects.limits, [&](const JointLimit& e) {
    return Json{{"joint", joint(e.row)},
                {"lower", number_or_null(e.lower)},
                {"upper", number_or_null(e.upper)},
                {"restitution", e.restitution},
                {"velocity", number_or_null(e.velocity)}};
  });
  list("servo", effects.servos, [&](const Servo& e) {
    return Json{{"joint", joint(e.row)},
                {"stiffness", e.stiffness},
                {"damping", e.damping},
                {"target", e.target_moves() ? course(e.target_over_time) : Json(e.target)},
                {"target_velocity", course(e.target_velocity)},
                {"feedforward", course(e.feedforward)},
                {"max_force", number_or_null(e.max_force)}};
  });
  list("torque", effects.torques, [&](const JointTorque& e) {
    return Json{{"joint", joint(e.row)}, {"force", course(e.force)}};
  });
  list("motion", effects.motions, [&](const JointMotion& e) {
    return Json{{"joint", joint(e.row)}, {"position", course(e.position)}, {"velocities", e.velocities}};
  });
  list("wrench", effects.wrenches, [&](const BodyWrench& e) {
    return Json{{"body", body(e.slot)},
                {"point", e.point},
                {"force", e.force},
                {"moment", e.moment},
                {"frame", e.in_world ? "world" : "body"},
                {"from", number_or_null(e.from)},
                {"to", number_or_null(e.to)},
                {"scale", course(e.scale)}};
  });
  list("drag", effects.drag, [&](const Drag& e) {
    return Json{{"body", body(e.slot)}, {"linear", e.linear}, {"quadratic", e.quadratic}};
  });
  if (!effects.drag.empty()) result["wind"] = effects.wind;
  if (effects.ground) {
    const Ground& g = *effects.ground;
    result["ground"] =
        Json{{"normal", g.normal},   {"height", g.height},     {"stiffness", g.stiffness},
             {"damping", g.damping}, {"friction", g.friction}, {"contacts", g.contacts.spheres.size() + g.contacts.rims.size()}};
    if (g.terrain) {
      result["ground"]["terrain"] = Json{{"columns", g.terrain->columns},
                                         {"rows", g.terrain->rows},
                                         {"spacing", {g.terrain->spacing_x, g.terrain->spacing_y}},
                                         {"origin", {g.terrain->origin_x, g.terrain->origin_y}}};
    }
  }
  return result;
}

}  // namespace linden

#include "engine/program/effects_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <span>
#include <string_view>
#include <type_traits>

#include "engine/text.hpp"

namespace linden {
namespace {

using Json = nlohmann::ordered_json;

/// "0.1 to 2", "0.01" where all are alike.
template <class Entry, class Value>
std::string range_text(std::span<const Entry> list, const Value& value_of) {
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
std::int64_t joints_of(std::span<const Entry> list, const Model& model) {
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
std::int64_t bodies_of(std::span<const Entry> list) {
  std::set<Index> slots;
  for (const Entry& entry : list) slots.insert(entry.slot);
  return static_cast<std::int64_t>(slots.size());
}

/// Units of a coefficient per angle, per shift, or both, as the joints of these rows need.
template <class Entry>
std::string unit_text(std::span<const Entry> list, const Model& model, const Units& units) {
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
  return turns && slides ? fmt::format("{}, {}", units.turning, units.sliding) : slides ? units.sliding : units.turning;
}

std::string vector_text(const std::array<double, 3>& v) { return fmt::format("{:g} {:g} {:g}", v[0], v[1], v[2]); }

Json number_or_null(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

/// "0.1 to 2 N m s/rad": a number of all entries with its unit.
template <class Entry>
std::string number_text(std::span<const Entry> list, const Model& model, double Entry::*number, const Units& units) {
  return range_text(list, [&](const Entry& entry) { return entry.*number; }) + " " + unit_text(list, model, units);
}

// Each of the following says of one kind of effect what it is like: what_of in words, json_of one entry after its joint or body.

/// Of entries that are nothing but numbers those that a scene has to give, by their names where they are several.
template <HasFields Entry>
std::string what_of(std::span<const Entry> list, const Effects&, const Model& model) {
  std::vector<std::string> texts;
  const auto told = std::ranges::count(Entry::fields, Given::always, &NumberField<Entry>::given);
  for (const NumberField<Entry>& field : Entry::fields) {
    if (field.given != Given::always) continue;
    const std::string text = number_text(list, model, field.member, field.units);
    texts.push_back(told == 1 ? text : fmt::format("{} {}", field.name, text));
  }
  return fmt::format("{}", fmt::join(texts, ", "));
}

std::string what_of(std::span<const BallSpring> list, const Effects&, const Model&) {
  return range_text(list, [](const BallSpring& entry) { return entry.stiffness; }) + " N m/rad";
}

std::string what_of(std::span<const JointLimit> list, const Effects&, const Model& model) {
  std::string text = "restitution " + range_text(list, [](const JointLimit& entry) { return entry.restitution; });
  if (std::ranges::any_of(list, [](const JointLimit& entry) { return std::isfinite(entry.velocity); })) {
    text += ", velocity " + number_text(list, model, &JointLimit::velocity, kVelocityUnits);
  }
  return text;
}

std::string what_of(std::span<const Servo> list, const Effects&, const Model& model) {
  std::string over_time;
  const auto count = [&](const char* what, const auto& has) {
    const auto found = std::ranges::count_if(list, has);
    if (found > 0) over_time += ", " + counted(found, what);
  };
  const auto acts = [](const TimeTable& table) { return std::ranges::any_of(table.values, [](double value) { return value != 0; }); };
  count("moving target", [](const Servo& entry) { return entry.target_moves(); });
  count("target velocity", [&](const Servo& entry) { return acts(entry.target_velocity); });
  count("feed-forward", [&](const Servo& entry) { return acts(entry.feedforward); });
  return fmt::format("stiffness {}, damping {}, force {}{}", number_text(list, model, &Servo::stiffness, kStiffnessUnits),
                     number_text(list, model, &Servo::damping, kDampingUnits), number_text(list, model, &Servo::max_force, kForceUnits),
                     over_time);
}

/// How many of them go over time, or what they are where none does.
template <class Entry>
std::string time_tables_text(std::span<const Entry> list, TimeTable Entry::*table, const char* none) {
  const auto tables = std::ranges::count_if(list, [&](const Entry& entry) { return (entry.*table).times.size() > 1; });
  return tables == 0 ? std::string(none) : fmt::format("{} over time", tables);
}

std::string what_of(std::span<const JointTorque> list, const Effects&, const Model&) {
  return time_tables_text(list, &JointTorque::force, "constant");
}

std::string what_of(std::span<const JointMotion> list, const Effects&, const Model&) {
  return time_tables_text(list, &JointMotion::position, "held in place");
}

std::string what_of(std::span<const BodyWrench> list, const Effects&, const Model&) {
  return range_text(list, [](const BodyWrench& entry) { return std::hypot(entry.force[0], entry.force[1], entry.force[2]); }) + " N";
}

std::string what_of(std::span<const Drag> list, const Effects& effects, const Model&) {
  return fmt::format("linear {} N s/m, quadratic {} N s^2/m^2, wind {} m/s", range_text(list, [](const Drag& entry) { return entry.linear; }),
                     range_text(list, [](const Drag& entry) { return entry.quadratic; }), vector_text(effects.wind));
}

std::string what_of(std::span<const Ground> list, const Effects&, const Model&) {
  const Ground& ground = list.front();
  return fmt::format("normal {}, height {:g} m, stiffness {:g} N/m, damping {:g} N s/m, friction {:g}; {}", vector_text(ground.normal),
                     ground.height, ground.stiffness, ground.damping, ground.friction,
                     counted(static_cast<std::int64_t>(ground.contacts.spheres.size() + ground.contacts.rims.size()), "contact"));
}

std::string what_of(std::span<const PairContact> list, const Effects&, const Model&) {
  const PairContact& contact = list.front();
  const std::span<const ContactMaterial> materials(contact.materials);
  const auto range = [&](double ContactMaterial::* member) { return range_text(materials, [&](const ContactMaterial& one) { return one.*member; }); };
  const auto any = [&](double ContactMaterial::* member) {
    return std::ranges::any_of(materials, [&](const ContactMaterial& one) { return one.*member > 0; });
  };
  const bool rigid = std::ranges::all_of(materials, [](const ContactMaterial& one) { return std::isinf(one.stiffness); });
  std::string text = rigid ? std::string("rigid") : fmt::format("stiffness {} N/m", range(&ContactMaterial::stiffness));
  if (any(&ContactMaterial::damping)) text += fmt::format(", damping {} N s/m", range(&ContactMaterial::damping));
  text += fmt::format(", friction {}", range(&ContactMaterial::friction));
  if (any(&ContactMaterial::rolling_friction)) text += fmt::format(", rolling friction {} m", range(&ContactMaterial::rolling_friction));
  if (any(&ContactMaterial::torsional_friction)) text += fmt::format(", torsional friction {} m", range(&ContactMaterial::torsional_friction));
  if (any(&ContactMaterial::restitution)) text += fmt::format(", restitution {}", range(&ContactMaterial::restitution));
  return fmt::format("{}; {}", text, counted(std::ssize(contact.pairs), "pair"));
}

/// "23 joints", "1 body", "plane", "12 shapes".
template <class Entry>
std::string where_of(std::span<const Entry> list, const Model& model) {
  if constexpr (std::is_same_v<Entry, Ground>) {
    const auto& terrain = list.front().terrain;
    return terrain ? fmt::format("{} x {} heights", terrain->columns, terrain->rows) : std::string("plane");
  } else if constexpr (std::is_same_v<Entry, PairContact>) {
    return counted(std::ssize(list.front().shapes), "shape");
  } else if constexpr (Entry::facts.site == Site::body) {
    return counted(bodies_of(list), "body");
  } else if constexpr (requires(const Entry& entry) { entry.row; }) {
    return counted(joints_of(list, model), "joint");
  } else {
    return counted(bodies_of(list), "ball joint");
  }
}

Json json_of(const TimeTable& table) { return {{"times", table.times}, {"values", table.values}}; }

template <HasFields Entry>
Json json_of(const Entry& entry) {
  Json numbers = Json::object();
  for (const NumberField<Entry>& field : Entry::fields) numbers[field.name] = entry.*field.member;
  return numbers;
}

Json json_of(const BallSpring& e) { return {{"stiffness", e.stiffness}, {"rest", e.rest}}; }

Json json_of(const JointLimit& e) {
  return {{"lower", number_or_null(e.lower)},
          {"upper", number_or_null(e.upper)},
          {"restitution", e.restitution},
          {"velocity", number_or_null(e.velocity)}};
}

Json json_of(const Servo& e) {
  return {{"stiffness", e.stiffness},
          {"damping", e.damping},
          {"target", e.target_moves() ? json_of(e.target_over_time) : Json(e.target)},
          {"target_velocity", json_of(e.target_velocity)},
          {"feedforward", json_of(e.feedforward)},
          {"max_force", number_or_null(e.max_force)}};
}

Json json_of(const JointTorque& e) {
  Json numbers = Json::object();
  numbers["force"] = json_of(e.force);
  return numbers;
}

Json json_of(const JointMotion& e) { return {{"position", json_of(e.position)}, {"velocities", e.velocities}}; }

Json json_of(const BodyWrench& e) {
  return {{"point", e.point},
          {"force", e.force},
          {"moment", e.moment},
          {"frame", e.in_world ? "world" : "body"},
          {"from", number_or_null(e.from)},
          {"to", number_or_null(e.to)},
          {"scale", json_of(e.scale)}};
}

Json json_of(const Drag& e) { return {{"linear", e.linear}, {"quadratic", e.quadratic}}; }

Json json_of(const Ground& g) {
  Json result{{"normal", g.normal},   {"height", g.height},     {"stiffness", g.stiffness},
              {"damping", g.damping}, {"friction", g.friction}, {"contacts", g.contacts.spheres.size() + g.contacts.rims.size()}};
  if (g.terrain) {
    result["terrain"] = Json{{"columns", g.terrain->columns},
                             {"rows", g.terrain->rows},
                             {"spacing", {g.terrain->spacing_x, g.terrain->spacing_y}},
                             {"origin", {g.terrain->origin_x, g.terrain->origin_y}}};
  }
  return result;
}

Json json_of(const PairContact& contact) {
  Json materials = Json::array();
  for (const ContactMaterial& one : contact.materials) {
    Json stiffness = std::isfinite(one.stiffness) ? Json(one.stiffness) : Json("rigid");
    materials.push_back({{"stiffness", stiffness},
                         {"damping", one.damping},
                         {"friction", one.friction},
                         {"rolling_friction", one.rolling_friction},
                         {"torsional_friction", one.torsional_friction},
                         {"restitution", one.restitution}});
  }
  return {{"materials", materials}, {"shapes", contact.shapes.size()}, {"pairs", contact.pairs.size()}};
}

/// The joint or body that it acts on, and its values.
template <class Entry>
Json with_owner(const Entry& entry, const Names& names) {
  Json result = Json::object();
  if constexpr (Entry::facts.site == Site::body) {
    result["body"] = names.body[static_cast<std::size_t>(entry.slot)];
  } else if constexpr (requires { entry.row; }) {
    result["joint"] = names.velocity[static_cast<std::size_t>(entry.row)];
  } else {
    result["joint"] = names.joint[static_cast<std::size_t>(entry.slot)];
  }
  result.update(json_of(entry));
  return result;
}

}  // namespace

std::vector<EffectLine> effect_lines(const Effects& effects, const Model& model) {
  std::vector<EffectLine> lines;
  Effects::each(effects, [&]<class Entry>(std::span<const Entry> list, std::string_view) {
    if (!list.empty()) lines.push_back({std::string(Entry::facts.name), where_of(list, model), what_of(list, effects, model)});
  });
  std::vector<std::string> soft;
  for (const Coupling& coupling : model.couplings) {
    if (gives_way(coupling)) soft.push_back(kind_text(coupling));
  }
  if (soft.empty()) return lines;
  const std::string number = counted(std::ssize(soft), "coupling");
  std::ranges::sort(soft);
  soft.erase(std::unique(soft.begin(), soft.end()), soft.end());
  lines.push_back({"couplings", number, fmt::format("{}", fmt::join(soft, ", "))});
  return lines;
}

Json effects_json(const Effects& effects, const Model& model) {
  Json result = Json::object();
  Effects::each(effects, [&]<class Entry>(std::span<const Entry> list, std::string_view) {
    const std::string name(Entry::facts.name);
    if constexpr (std::is_same_v<Entry, Ground> || std::is_same_v<Entry, PairContact>) {
      if (!list.empty()) result[name] = json_of(list.front());
    } else {
      for (const Entry& entry : list) result[name].push_back(with_owner(entry, model.names));
    }
    if (std::is_same_v<Entry, Drag> && !list.empty()) result["wind"] = effects.wind;
  });
  return result;
}

}  // namespace linden

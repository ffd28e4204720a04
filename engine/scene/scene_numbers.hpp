// engine/scene/scene_numbers.hpp
// Effects whose entries are nothing but numbers, read by the tables of their fields (layout/effects/facts.hpp):
//
//   one number that leaders take over   number (all joints that can have it) | {joint: number} | urdf, where the model's file knows it
//   others                              {joint: {name: number, ...}}; joints that follow others are refused
#pragma once

#include <fmt/format.h>

#include <string>
#include <utility>
#include <vector>

#include "engine/scene/scene_joints.hpp"
#include "engine/scene/scene_yaml.hpp"
#include "layout/effects.hpp"

namespace linden {

template <class Entry>
double read_number(const SceneValue& at, const NumberField<Entry>& field) {
  return field.allowed == Allowed::not_negative ? at.not_negative() : at.number();
}

/// One number a joint. Throws InputError with file and line.
template <class Entry>
  requires(is_one_number<Entry>())
std::vector<Entry> read_list(const SceneValue& at, const SceneJoints& joints) {
  constexpr bool in_file = requires { Entry::in_file; };
  constexpr std::string_view expected = in_file ? "urdf, a number or {joint: number}" : "a number or {joint: number}";
  const Model& model = joints.model();
  if constexpr (in_file) {
    if (at.says("urdf")) return from_file<Entry>(model);
  } else if (at.says("urdf")) {
    at.refuse(expected, fmt::format("URDF files say nothing of {}: give a number, such as 0.01", Entry::facts.name));
  }
  if (at.is(SceneValue::Kind::text)) return everywhere<Entry>(model, at.not_negative(expected));
  std::vector<Entry> list;
  for (const SceneValue::Entry& entry : at.entries(expected)) {
    const NamedJoint found = Entry::facts.on_balls ? joints.joint(entry) : joints.screw(entry);
    const double number = read_number(entry.value, Entry::fields[0]);
    for (Index k = 0; k < velocity_count(found.kind); ++k) list.push_back({found.row + k, number});
  }
  return on_leaders(model, list);
}

/// Names of an entry's numbers: all of them, or those that have to be given.
template <class Entry>
std::vector<std::string> field_names(bool needed_alone = false) {
  std::vector<std::string> names;
  for (const NumberField<Entry>& field : Entry::fields) {
    if (!needed_alone || field.given == Given::always) names.push_back(field.name);
  }
  return names;
}

/// Several numbers of one joint. Throws InputError with file and line.
template <class Entry>
Entry read_entry(const SceneValue& at, Index row) {
  at.entries_of(field_names<Entry>());
  Entry entry{};
  entry.row = row;
  for (const NumberField<Entry>& field : Entry::fields) {
    if (const auto value = at.find(field.name)) {
      entry.*field.member = read_number(*value, field);
    } else if (field.given == Given::always) {
      at.fail(fmt::format("{} has no {}", at.path(), field.name), fmt::format("{}", fmt::join(field_names<Entry>(true), ", ")),
              fmt::format("add {}", field.name));
    }
  }
  return entry;
}

/// "{joint: {stiffness, rest}}"
template <class Entry>
std::string grammar_of() {
  return fmt::format("{{joint: {{{}}}}}", fmt::join(field_names<Entry>(), ", "));
}

template <HasFields Entry>
  requires(!is_one_number<Entry>())
std::vector<Entry> read_list(const SceneValue& at, const SceneJoints& joints) {
  std::vector<Entry> list;
  for (const SceneValue::Entry& entry : at.entries(grammar_of<Entry>())) {
    const NamedJoint found = joints.screw(entry);
    joints.refuse_follower(entry.value, found);
    list.push_back(read_entry<Entry>(entry.value, found.row));
  }
  return list;
}

}  // namespace linden

// layout/effects/on_rows.hpp
// Entries on many joints at once, and on those that lead: what stands on the row of a joint that follows another is carried to the row of that
// one (q_f = m q + o), one entry a row is left.
#pragma once

#include <cmath>
#include <map>
#include <vector>

#include "layout/attributes.hpp"
#include "layout/effects/facts.hpp"

namespace linden {

struct Model;

/// Which rows follow others.
class Followers {
 public:
  explicit Followers(const Model& model);
  /// By what a row follows another; null where it follows none. Throws InputError where there is no such row.
  const Mimic* mimic(Index row) const;

 private:
  std::vector<const Mimic*> mimics_;
};

/// Rows of joints about or along one axis, and of ball joints.
std::vector<Index> rows_of_joints(const Model& model, bool with_balls);

/// What the robot's file says.
const Attributes& file_of(const Model& model);

/// `carry(entry, mimic)` turns a follower's entry to its leader's, `join(into, other)` makes one of two on a row. Sorted by row.
template <class Entry, class Carry, class Join>
std::vector<Entry> carried(const Model& model, const std::vector<Entry>& list, const Carry& carry, const Join& join) {
  const Followers followers(model);
  std::map<Index, Entry> at_row;
  for (Entry entry : list) {
    if (const Mimic* mimic = followers.mimic(entry.row)) {
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

/// Entries that are one number: inertia and damping go with m^2, forces with |m|, and several on a row add up.
template <class Entry>
  requires(is_one_number<Entry>())
std::vector<Entry> on_leaders(const Model& model, const std::vector<Entry>& list) {
  constexpr NumberField<Entry> number = Entry::fields[0];
  return carried(
      model, list,
      [&](Entry entry, const Mimic& mimic) {
        const double m = mimic.multiplier;
        entry.*number.member = number.carried == Carried::by_square ? entry.*number.member * m * m : entry.*number.member * std::abs(m);
        return entry;
      },
      [&](Entry& into, const Entry& other) { into.*number.member += other.*number.member; });
}

/// The same number on every joint that can have it.
template <class Entry>
std::vector<Entry> everywhere(const Model& model, double value) {
  std::vector<Entry> list;
  for (const Index row : rows_of_joints(model, Entry::facts.on_balls)) list.push_back({row, value});
  return on_leaders(model, list);
}

/// What the robot's file says of its joints, where that is above zero.
template <class Entry>
std::vector<Entry> from_file(const Model& model) {
  std::vector<Entry> list;
  for (const Index row : rows_of_joints(model, Entry::facts.on_balls)) {
    if (const double value = (file_of(model).*Entry::in_file)(row); value > 0) list.push_back({row, value});
  }
  return on_leaders(model, list);
}

}  // namespace linden

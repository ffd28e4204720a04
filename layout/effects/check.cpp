// What entries of effects may hold: check, of layout/effects.hpp.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <string_view>
#include <type_traits>
#include <unordered_set>

#include "layout/effects.hpp"
#include "layout/effects/row_facts.hpp"
#include "layout/model.hpp"
#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"

namespace linden {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// "row 7, joint elbow", for messages: the velocity's name is the joint's, with a component for ball and free joints.
std::string row_text(const Model& model, Index row) {
  return fmt::format("row {} ({})", row, model.names.velocity[static_cast<std::size_t>(row)]);
}

/// Looks at effects one by one and says which one is wrong.
class Checker {
 public:
  Checker(const Effects& effects, const Model& model) : effects_(effects), model_(model), facts_(model) {}

  void run() {
    Effects::each(effects_, [&]<class Entry>(std::span<const Entry> entries, std::string_view list) {
      std::unordered_set<Index> seen;
      for (std::size_t k = 0; k < entries.size(); ++k) {
        where_ = std::is_same_v<Entry, Ground> || std::is_same_v<Entry, PairContact> ? std::string(list) : fmt::format("{}[{}]", list, k);
        look(entries[k]);
        if constexpr (Entry::facts.single) {
          if (!seen.insert(entries[k].row).second)
            fail(row_text(model_, entries[k].row) + " is named twice", "one entry a joint", "leave one out");
        }
      }
    });
    refuse_moved("friction", effects_.friction);
    refuse_moved("limits", effects_.limits);
    where_ = "wind";
    for (const double speed : effects_.wind) finite("wind", speed);
  }

 private:
  /// An entry that is nothing but numbers.
  template <HasFields Entry>
  void look(const Entry& entry) const {
    if constexpr (Entry::facts.on_balls) {
      require_row(entry.row);
      if (facts_.kind(entry.row) == JointKind::free)
        fail(row_text(model_, entry.row) + " is of a free joint", "a screw or ball joint", "use drag");
    } else {
      require_screw(entry.row);
    }
    for (const NumberField<Entry>& field : Entry::fields) {
      finite(field.name, entry.*field.member);
      if (field.allowed == Allowed::not_negative) not_negative(field.name, entry.*field.member);
    }
  }
  void look(const BallSpring& entry) const {
    require_slot(entry.slot);
    if (model_.tree.kind(entry.slot) != JointKind::ball) {
      fail(fmt::format("joint {} is no ball joint", quoted(model_.names.joint[static_cast<std::size_t>(entry.slot)])),
           "a ball joint", "give it a JointSpring");
    }
    not_negative("stiffness", entry.stiffness);
    unit("rest", entry.rest);
  }
  void look(const JointLimit& entry) const {
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
  }
  void look(const Servo& entry) const {
    require_screw(entry.row);
    not_negative("stiffness", entry.stiffness);
    not_negative("damping", entry.damping);
    finite("target", entry.target);
    if (entry.target_moves() || !entry.target_over_time.values.empty()) require_time_table("target_over_time", entry.target_over_time);
    require_time_table("target_velocity", entry.target_velocity);
    require_time_table("feedforward", entry.feedforward);
    if (!(entry.max_force >= 0)) fail(fmt::format("max_force is {}", entry.max_force), "zero or more", "infinity is no limit");
  }
  void look(const JointTorque& entry) const {
    require_screw(entry.row);
    require_time_table("force", entry.force);
  }
  void look(const JointMotion& entry) const {
    require_screw(entry.row);
    require_time_table("position", entry.position);
    const auto twice = std::ranges::adjacent_find(entry.position.times);
    if (twice != entry.position.times.end())
      fail(fmt::format("{} is at two places at {} s", row_text(model_, entry.row), *twice), "one position a time", "leave one out");
    if (!entry.velocities.empty() && entry.velocities.size() != entry.position.times.size()) {
      fail(fmt::format("position has {} times, and there are {} velocities", entry.position.times.size(), entry.velocities.size()),
           "one a time, or none", "add what is missing");
    }
    for (const double velocity : entry.velocities) finite("a velocity", velocity);
  }
  void look(const BodyWrench& entry) const {
    require_slot(entry.slot);
    for (int k = 0; k < 3; ++k) {
      const auto at = static_cast<std::size_t>(k);
      finite("point", entry.point[at]);
      finite("force", entry.force[at]);
      finite("moment", entry.moment[at]);
    }
    if (!(entry.from <= entry.to))
      fail(fmt::format("it goes from {} to {} s", entry.from, entry.to), "from at or before to", "exchange them");
    require_time_table("scale", entry.scale);
  }
  void look(const Drag& entry) const {
    require_slot(entry.slot);
    not_negative("linear", entry.linear);
    not_negative("quadratic", entry.quadratic);
    if (!(model_.constants.inertia(entry.slot, 0) > 0)) {
      fail(fmt::format("body {} has no mass", quoted(model_.names.body[static_cast<std::size_t>(entry.slot)])),
           "one with a centre of mass for drag to act on", "leave it out");
    }
  }
  void look(const Ground& ground) { check_ground(ground); }
  void look(const PairContact& contact) const {
    for (const ContactMaterial& material : contact.materials) {
      if (!(material.stiffness > 0)) fail(fmt::format("stiffness is {}", material.stiffness), "a positive number, infinite where it is rigid", "leave it out");
      not_negative("damping", material.damping);
      not_negative("friction", material.friction);
      not_negative("rolling_friction", material.rolling_friction);
      not_negative("torsional_friction", material.torsional_friction);
      if (!(material.restitution >= 0 && material.restitution <= 1)) fail(fmt::format("restitution is {}", material.restitution), "0 to 1", "0 where nothing bounces");
    }
    if (contact.materials.empty()) fail("it has no material", "one at least", "leave materials as they are");
    if (!contact.of_pair.empty() && (contact.of_pair.size() != contact.pairs.size() || std::ranges::max(contact.of_pair) >= contact.materials.size())) {
      fail("not every pair has one of its materials", "one number for each pair, or none at all", "leave of_pair empty");
    }
    for (const ConvexBody& shape : contact.shapes) {
      if (shape.slot != 0) require_slot(shape.slot);
      if (shape.slot != 0 && is_endless(shape.shape.kind)) {
        fail("a plane or heights are on a body that moves", "one fixed to the world", "make it a box");
      }
      not_negative("the radius of a shape", shape.shape.radius);
      for (const double half : shape.shape.half) not_negative("half an edge of a shape", half);
      if ((shape.shape.kind == ConvexKind::hull) != (shape.shape.hull != nullptr)) fail("a shape has a hull and is none, or the other way round", "one of both", "make it by convex_of");
      if (shape.shape.hull) check_hull(*shape.shape.hull);
      if ((shape.shape.kind == ConvexKind::heights) != (shape.shape.heights != nullptr)) {
        fail("a shape has heights and is none, or the other way round", "one of both", "make it by convex_of");
      }
      if (shape.shape.heights && !is_whole(*shape.shape.heights)) {
        fail("heights of a shape are no grid", "columns x rows finite numbers, two of each or more, at spacings above zero", "correct them");
      }
    }
    if (!std::ranges::is_sorted(contact.shapes, {}, &ConvexBody::slot)) fail("its shapes are in no order", "bodies in ascending order", "sort them by slot");
    for (const auto& [a, b] : contact.pairs) {
      if (a >= b || b >= contact.shapes.size()) {
        fail(fmt::format("shapes {} and {} are a pair", a, b), fmt::format("two of its {} shapes, the first before the second", contact.shapes.size()),
             "take them from pairs_of");
      }
      if (contact.shapes[a].slot == contact.shapes[b].slot) {
        fail(fmt::format("shapes {} and {} are of one body", a, b), "shapes of two bodies", "leave the pair out");
      }
    }
    if (!std::ranges::is_sorted(contact.pairs)) fail("its pairs are in no order", "pairs in ascending order", "sort them");
  }

  [[noreturn]] void fail(const std::string& found, std::string_view expected, std::string_view advice) const {
    throw InputError(fmt::format("effects.{}: {}; expected {}; {}", where_, found, expected, advice));
  }

  template <class Entry>
  void refuse_moved(const char* list_name, const std::vector<Entry>& list) {
    for (std::size_t k = 0; k < list.size(); ++k) {
      where_ = fmt::format("{}[{}]", list_name, k);
      if (std::ranges::find(effects_.motions, list[k].row, &JointMotion::row) != effects_.motions.end())
        fail(fmt::format("the motion of {} is given", row_text(model_, list[k].row)), "a joint that moves by itself", "leave it out");
    }
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

  void require_time_table(const char* what, const TimeTable& table) const {
    if (table.times.empty() || table.times.size() != table.values.size()) {
      fail(fmt::format("{} has {} times and {} values", what, table.times.size(), table.values.size()),
           "one value a time, one or more", "add what is missing");
    }
    for (const double value : table.values) finite(what, value);
    for (std::size_t k = 0; k < table.times.size(); ++k) {
      finite("a time", table.times[k]);
      if (k > 0 && table.times[k] < table.times[k - 1]) {
        fail(fmt::format("time {} s comes after {} s", table.times[k], table.times[k - 1]), "times that ascend", "sort them");
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

  /// What kernels rely on: numbers of points and faces that there are.
  void check_hull(const ConvexHull& hull) const {
    const std::size_t points = hull.points.size(), faces = hull.faces.size();
    const auto below = [](const auto& numbers, std::size_t most) { return std::ranges::all_of(numbers, [&](std::uint32_t n) { return n < most; }); };
    const auto ranges = [&](const std::vector<std::uint32_t>& first, std::size_t numbers) {
      return first.size() == points + 1 && std::ranges::is_sorted(first) && first.front() == 0 && first.back() == numbers;
    };
    bool sound = points > 0 && below(hull.corners, points) && below(hull.face_of, faces) && below(hull.neighbour, points) && below(hull.extreme, points) &&
                 ranges(hull.first_face, hull.face_of.size()) && ranges(hull.first_neighbour, hull.neighbour.size()) && std::isfinite(hull.reach);
    for (const ConvexHull::Face& face : hull.faces) {
      sound = sound && face.count > 0 && static_cast<std::size_t>(face.first) + face.count <= hull.corners.size();
    }
    for (const auto& point : hull.points) {
      for (const double coordinate : point) finite("a point of a hull", coordinate);
    }
    if (!sound) fail("a hull is damaged", "one of convex_hull", "make it anew");
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

void check(const Effects& effects, const Model& model) { Checker(effects, model).run(); }

}  // namespace linden

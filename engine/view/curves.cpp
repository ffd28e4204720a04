#include "engine/view/curves.hpp"

#include <fmt/format.h>

#include <string>
#include <string_view>

namespace linden {
namespace {

/// visit(row, slot, which of its joint's rows) for every row of q, or of v.
template <class Visit>
void each_row(const Tree& tree, bool positions, const Visit& visit) {
  for (Index i = 1; i < tree.shape.slots; ++i) {
    const Index first = positions ? tree.first_q(i) : tree.first_v(i);
    const Index count = positions ? position_count(tree.kind(i)) : velocity_count(tree.kind(i));
    for (Index k = 0; k < count; ++k) visit(first + k, i, k);
  }
}

bool turns(const Model& model, Index slot) { return model.constants.screw(slot, 0) != 0; }

/// What a row of v is measured in, without the second.
const char* unit_of_rate(const Model& model, Index slot, Index k) {
  switch (model.tree.kind(slot)) {
    case JointKind::screw: return turns(model, slot) ? "rad" : "m";
    case JointKind::ball: return "rad";
    case JointKind::free: return k < 3 ? "rad" : "m";
  }
  return "";
}

const char* unit_of_position(const Model& model, Index slot, Index k) {
  switch (model.tree.kind(slot)) {
    case JointKind::screw: return turns(model, slot) ? "rad" : "m";
    case JointKind::ball: return "";
    case JointKind::free: return k < 3 ? "m" : "";
  }
  return "";
}

std::string unit_of_force(const Model& model, Index slot, Index k) {
  return std::string_view(unit_of_rate(model, slot, k)) == "rad" ? "N m" : "N";
}

std::vector<Curve> velocity_rows(const Model& model, std::int64_t instance, const std::string& group) {
  std::vector<Curve> curves(static_cast<std::size_t>(model.tree.shape.velocities));
  each_row(model.tree, false, [&](Index row, Index slot, Index k) {
    const std::string unit = group == "force" ? unit_of_force(model, slot, k) : fmt::format("{}/s", unit_of_rate(model, slot, k));
    curves[static_cast<std::size_t>(row)] = {group, model.names.velocity[static_cast<std::size_t>(row)], unit, slot, instance, {}};
  });
  return curves;
}

}  // namespace

std::vector<Curve> position_curves(const Model& model, std::int64_t instance) {
  std::vector<Curve> curves(static_cast<std::size_t>(model.tree.shape.positions));
  each_row(model.tree, true, [&](Index row, Index slot, Index k) {
    curves[static_cast<std::size_t>(row)] = {"position", model.names.position[static_cast<std::size_t>(row)],
                                             unit_of_position(model, slot, k), slot, instance, {}};
  });
  return curves;
}

std::vector<Curve> velocity_curves(const Model& model, std::int64_t instance) { return velocity_rows(model, instance, "velocity"); }

std::vector<Curve> force_curves(const Model& model, std::int64_t instance) { return velocity_rows(model, instance, "force"); }

}  // namespace linden

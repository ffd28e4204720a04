#include "layout/model.hpp"

#include <fmt/format.h>

#include "layout/support/checksum.hpp"
#include "layout/support/input_error.hpp"

namespace linden {
std::vector<double> Model::neutral() const {
  std::vector<double> q(static_cast<std::size_t>(tree.shape.positions), 0.0);
  for (const Run& run : tree.runs) {
    if (run.kind == JointKind::screw) continue;
    const Index last = position_count(run.kind) - 1;
    for (Index i = run.begin; i < run.end; ++i) q[static_cast<std::size_t>(tree.first_q(i) + last)] = 1;
  }
  for (const Mimic& mimic : mimics) q[static_cast<std::size_t>(mimic.follower_q)] = mimic.offset;
  for (const Coupling& coupling : couplings) {
    if (coupling.kind == CouplingKind::cable) q[static_cast<std::size_t>(coupling.terms.front().q_row)] = coupling.length;
  }
  return q;
}

std::uint64_t Model::hash() const {
  Checksum hash;
  for (const Run& run : tree.runs) {
    hash.add_number(run.begin);
    hash.add_number(run.end);
    hash.add_number(run.kind);
  }
  const auto add_fields = [&](const auto& structure) {
    structure.each(structure, [&](const char*, const auto& field, Rows, const char*) {
      for (const auto& value : field.flat()) hash.add_number(value);
    });
  };
  add_fields(tree);
  add_fields(constants);
  for (const Mimic& mimic : mimics) {
    hash.add_number(mimic.follower_slot);
    hash.add_number(mimic.leader_slot);
    hash.add_number(mimic.multiplier);
    hash.add_number(mimic.offset);
  }
  for (const Coupling& coupling : couplings) {
    hash.add_number(coupling.kind);
    hash.add_number(coupling.slot_a);
    hash.add_number(coupling.slot_b);
    for (const Pose* frame : {&coupling.frame_a, &coupling.frame_b}) {
      for (const double number : frame->rotation) hash.add_number(number);
      for (const double number : frame->shift) hash.add_number(number);
    }
    hash.add_number(coupling.length);
    hash.add_number(coupling.offset);
    for (const Compliances* laws : {&coupling.shift, &coupling.turn}) {
      if (!any_gives_way(*laws)) continue;
      for (const Compliance& law : *laws) {
        hash.add_number(law.stiffness);
        hash.add_number(law.damping);
      }
    }
    for (const GearTerm& term : coupling.terms) {
      hash.add_number(term.v_row);
      hash.add_number(term.ratio);
    }
    for (const CablePoint& point : coupling.points) {
      hash.add_number(point.slot);
      for (const double number : point.at) hash.add_number(number);
    }
  }
  return hash.value();
}

void refuse_warnings(const Model& model) {
  if (model.warnings.empty()) return;
  const std::size_t others = model.warnings.size() - 1;
  const std::string more = others == 0 ? "" : fmt::format(", and {} more", others);
  throw InputError(fmt::format("{} (a warning{}; strict reading refuses them)", model.warnings.front(), more));
}

}  // namespace linden

#include "engine/queries/kinematics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "engine/simulation.hpp"
#include "engine/solve/instance_stepper.hpp"
#include "kernels/queries/body_motion_down.hpp"
#include "kernels/tree/mimic.hpp"
#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"

namespace linden {
namespace {

/// Numbers of a state; none given are zero.
void put(const char* what, std::span<const double> given, const Model& model, const std::vector<std::string>& names, Field<double>& to) {
  const std::span<double> rows = to.flat();
  if (given.empty()) {
    std::ranges::fill(rows, 0.0);
    return;
  }
  if (given.size() != rows.size()) {
    throw InputError(
        fmt::format("{}: {} numbers given for model {}, expected {}", what, given.size(), quoted(model.names.model), rows.size()));
  }
  for (std::size_t k = 0; k < given.size(); ++k) {
    if (!std::isfinite(given[k])) {
      throw InputError(fmt::format("{}: that of {} is {}; expected a finite number", what, quoted(names[k]), given[k]));
    }
  }
  std::ranges::copy(given, rows.begin());
}

std::vector<double> armature_of(const Simulation& simulation) {
  const std::vector<Armature>& entries = simulation.effects().armature;
  if (entries.empty()) return {};
  std::vector<double> rows(static_cast<std::size_t>(simulation.model().tree.shape.velocities), 0.0);
  for (const Armature& entry : entries) rows[static_cast<std::size_t>(entry.row)] += entry.inertia;
  return rows;
}

}  // namespace

Kinematics::Kinematics(const Model& model) : Kinematics(model, model.neutral()) {}

Kinematics::Kinematics(const Model& model, std::span<const double> q, std::span<const double> v, std::span<const double> a)
    : model_(&model), motions_(std::make_unique<BodyMotions<double>>()) {
  q_.allocate(model.tree.shape.positions);
  v_.allocate(model.tree.shape.velocities);
  a_.allocate(model.tree.shape.velocities);
  motions_->allocate(model.tree.shape);
  set(q, v, a);
}

Kinematics::Kinematics(Simulation& simulation) : Kinematics(simulation.model()) { set(simulation); }

Kinematics::~Kinematics() = default;
Kinematics::Kinematics(Kinematics&&) noexcept = default;
Kinematics& Kinematics::operator=(Kinematics&&) noexcept = default;
Kinematics::Kinematics(const Kinematics& other)
    : model_(other.model_), gravity_(other.gravity_), armature_(other.armature_), q_(other.q_), v_(other.v_), a_(other.a_),
      motions_(std::make_unique<BodyMotions<double>>(*other.motions_)) {}
Kinematics& Kinematics::operator=(const Kinematics& other) { return *this = Kinematics(other); }

void Kinematics::set(std::span<const double> q, std::span<const double> v, std::span<const double> a) {
  const Names& names = model_->names;
  if (q.empty() && q_.rows() > 0) {
    throw InputError(fmt::format("positions: none given for model {}, expected {}", quoted(names.model), q_.rows()));
  }
  put("positions", q, *model_, names.position, q_);
  put("velocities", v, *model_, names.velocity, v_);
  put("accelerations", a, *model_, names.velocity, a_);
  normalise_positions(*model_, q_.flat());
  spread_mimics<double>(model_->mimics, v_);
  spread_mimics<double>(model_->mimics, a_);
  evaluate();
}

void Kinematics::set(Simulation& simulation) {
  if (&simulation.model() != model_ && simulation.model().hash() != model_->hash()) {
    throw InputError(fmt::format("a state of model {} was to be taken from a simulation of {}; expected the same model",
                                 quoted(model_->names.model), quoted(simulation.model().names.model)));
  }
  gravity_ = simulation.options().gravity;
  armature_ = armature_of(simulation);
  set(simulation.positions(), simulation.velocities(), simulation.options().order > 2 ? std::vector<double>() : simulation.accelerations());
}

void Kinematics::set_armature(std::span<const double> armature) {
  if (!armature.empty() && armature.size() != static_cast<std::size_t>(model_->tree.shape.velocities)) {
    throw InputError(fmt::format("armature: {} numbers given for model {}, expected {}", armature.size(), quoted(model_->names.model),
                                 model_->tree.shape.velocities));
  }
  const Tree& tree = model_->tree;
  for (Index i = 1; i < tree.shape.slots && !armature.empty(); ++i) {
    if (tree.kind(i) != JointKind::free) continue;
    for (Index k = 0; k < velocity_count(JointKind::free); ++k) {
      if (armature[static_cast<std::size_t>(tree.first_v(i) + k)] == 0) continue;
      throw InputError(fmt::format("armature of {} on joint {}; expected none on a free joint: no rotor drives it",
                                   armature[static_cast<std::size_t>(tree.first_v(i) + k)],
                                   quoted(model_->names.joint[static_cast<std::size_t>(i)])));
    }
  }
  armature_.assign(armature.begin(), armature.end());
}

void Kinematics::evaluate() {
  std::vector<Index> slots(static_cast<std::size_t>(model_->tree.bodies()));
  std::iota(slots.begin(), slots.end(), 1);
  body_motion_down<MotionDepth::accelerations>(model_->tree, model_->constants, slots.data(), slots.size(), q_, v_, a_, *motions_);
}

}  // namespace linden

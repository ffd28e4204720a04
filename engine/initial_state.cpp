#include "engine/initial_state.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "engine/assembly.hpp"
#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"
#include "models/build/random.hpp"

namespace linden {
namespace {

/// Length uniform in [0, most], direction uniform on the sphere.
Eigen::Vector3d random_arrow(Random& random, double most) {
  const double z = random.uniform(-1, 1), turn = random.uniform(0, 2 * std::numbers::pi), length = random.uniform(0, most);
  const double across = std::sqrt(1 - z * z);
  return length * Eigen::Vector3d(across * std::cos(turn), across * std::sin(turn), z);
}

/// A limit, and the row of the position that it is on.
struct Bounded {
  std::size_t q_row;
  const JointLimit* limit;
};

std::vector<Bounded> bounded(const Model& model, std::span<const JointLimit> limits) {
  std::vector<Bounded> result;
  if (limits.empty()) return result;
  std::vector<Index> q_row(static_cast<std::size_t>(model.tree.shape.velocities));
  for (Index i = 1; i < model.tree.shape.slots; ++i) q_row[static_cast<std::size_t>(model.tree.first_v(i))] = model.tree.first_q(i);
  for (const JointLimit& limit : limits) result.push_back({static_cast<std::size_t>(q_row[static_cast<std::size_t>(limit.row)]), &limit});
  return result;
}

void close_couplings(const Model& model, std::uint64_t seed, double spread, std::vector<double>& positions,
                     const std::vector<JointMotion>& motions = {}) {
  if (model.couplings.empty()) return;
  const Assembly found = assemble(model, positions, Assembled::from_anywhere, motions);
  if (found.closed) return;
  throw InputError(fmt::format("coupling {} cannot be closed from the random positions of seed {} and spread {:g}: {:.3g} is the least that it is open by; choose "
                               "another seed, or a smaller spread",
                               quoted(found.coupling), seed, spread, found.gap));
}

/// Couplings are not looked at.
InitialState draw_state(const Model& model, std::uint64_t seed, double spread) {
  const Tree& tree = model.tree;
  const double rate = spread / std::sqrt(static_cast<double>(tree.levels() - 1));
  Random random(seed);
  InitialState state{model.neutral(), std::vector<double>(static_cast<std::size_t>(tree.shape.velocities), 0.0)};
  const auto put = [](std::vector<double>& rows, Index first, const Eigen::Vector3d& value) {
    for (int k = 0; k < 3; ++k) rows[static_cast<std::size_t>(first + k)] = value[k];
  };
  for (const Run& run : tree.runs) {
    for (Index i = run.begin; i < run.end; ++i) {
      const Index q = tree.first_q(i), v = tree.first_v(i);
      if (run.kind == JointKind::screw) {
        const double position = random.uniform(-spread, spread);
        state.positions[static_cast<std::size_t>(q)] = std::clamp(position, model.attributes.lower(v), model.attributes.upper(v));
        state.velocities[static_cast<std::size_t>(v)] = random.uniform(-rate, rate);
        continue;
      }
      const Eigen::Vector3d turn = random_arrow(random, spread);
      const double half = 0.5 * turn.norm();
      const Index first = run.kind == JointKind::free ? q + 3 : q;
      put(state.positions, first, half > 0 ? Eigen::Vector3d(std::sin(half) * turn.normalized()) : Eigen::Vector3d::Zero());
      state.positions[static_cast<std::size_t>(first + 3)] = std::cos(half);
      put(state.velocities, v, random_arrow(random, rate));
      if (run.kind == JointKind::free) put(state.velocities, v + 3, random_arrow(random, spread));
    }
  }
  return state;
}

}  // namespace

InitialState random_state(const Model& model, std::uint64_t seed, double spread, std::span<const JointLimit> limits) {
  InitialState state = draw_state(model, seed, spread);
  for (const Bounded& joint : bounded(model, limits)) {
    double& q = state.positions[joint.q_row];
    q = std::clamp(q, joint.limit->lower, joint.limit->upper);
  }
  close_couplings(model, seed, spread, state.positions);
  return state;
}

InitialState random_around(const Model& model, const InitialState& start, std::uint64_t seed, double spread, const Effects& effects) {
  const InitialState random = draw_state(model, seed, spread);
  InitialState state = start;
  if (state.positions.empty()) state.positions = model.neutral();
  state.velocities.resize(random.velocities.size(), 0.0);
  for (const Run& run : model.tree.runs) {
    if (run.kind != JointKind::screw) continue;
    for (Index i = run.begin; i < run.end; ++i) {
      const Index v = model.tree.first_v(i);
      double& q = state.positions[static_cast<std::size_t>(model.tree.first_q(i))];
      const double moved = q + random.positions[static_cast<std::size_t>(model.tree.first_q(i))];
      // a start beyond a limit is the scene's own
      q = std::clamp(moved, std::min(q, model.attributes.lower(v)), std::max(q, model.attributes.upper(v)));
    }
  }
  const std::vector<double> begin = start.positions.empty() ? model.neutral() : start.positions;
  for (const Bounded& joint : bounded(model, effects.limits)) {
    double& q = state.positions[joint.q_row];
    q = std::clamp(q, std::min(begin[joint.q_row], joint.limit->lower), std::max(begin[joint.q_row], joint.limit->upper));
  }
  for (std::size_t k = 0; k < state.velocities.size(); ++k) state.velocities[k] += random.velocities[k];
  close_couplings(model, seed, spread, state.positions, effects.motions);
  return state;
}

}  // namespace linden

// Velocities right after a blow, which means of positions do not show: the scene as it is, but without what else is sudden, and with one
// joint that meets a limit. The limit stands where the engine itself brings the joint, at a node or within the step that comes.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "engine/batch.hpp"
#include "families.hpp"
#include "models/build/random.hpp"

namespace linden {
namespace {

using Eigen::VectorXd;
using reference::PlainScene;

constexpr double kTurnsAtBlow = 0.25;  // of a body within a step: faster ones are not asked [rad]
constexpr int kPartsAtBlow = 32;       // of a step, by the plain simulator
/// Of the largest velocity there is, and of 1 rad/s or m/s: the solver's tolerance, and that of the search for a blow.
constexpr double kKnownAtBlow = 1e-5;

/// Largest number of each row's vector: the three rows of an angular or of a linear velocity are one, in a frame that turns.
VectorXd by_vector(const reference::PlainTree& tree, const VectorXd& rows) {
  VectorXd result = rows.cwiseAbs();
  for (const reference::PlainBody& body : tree.bodies) {
    if (body.kind == JointKind::screw) continue;
    for (Index first = 0; first < body.dofs(); first += 3) result.segment<3>(body.v + first).setConstant(rows.segment<3>(body.v + first).norm());
  }
  return result;
}

double fastest_turn(const PlainScene& plain) {
  double turn = 0;
  for (const auto& motion : reference::body_motions(plain.tree(), plain.q, plain.v)) turn = std::max(turn, motion.w.norm());
  return turn;
}

/// A scene of one limit, and the node at which its blow is over.
struct Landing {
  EverydayScene scene;
  JointLimit limit;
  std::int64_t node = 0;
  bool at_node = true;  // else within the step before
};

/// Joints whose motion is given, those that follow others and the lengths of cables are not stopped.
bool may_land(const EverydayScene& scene, Index slot, Index row) {
  if (scene.model->tree.kind(slot) != JointKind::screw) return false;
  const auto of_it = [row](const auto& entry) { return entry.row == row; };
  if (std::ranges::any_of(scene.effects.motions, of_it)) return false;
  if (std::ranges::any_of(scene.model->mimics, [row](const Mimic& mimic) { return mimic.follower_v == row; })) return false;
  return std::ranges::none_of(scene.model->couplings, [row](const Coupling& coupling) {
    return coupling.kind == CouplingKind::cable && coupling.terms.front().v_row == row;
  });
}

/// The joint that moves fastest by what its velocity changes by in a step; nothing where none moves far enough in a step to tell when it lands.
std::optional<Landing> landing_of(const EverydayScene& scene) {
  Random random(scene.seed * 86028121 + scene.number);
  Landing result{scene, {}, 0};
  Effects& effects = result.scene.effects;
  effects.friction.clear();
  effects.limits.clear();
  effects.ground.reset();
  result.scene.sudden = false;
  const auto node = static_cast<std::int64_t>(1 + random.below(8));
  Simulation simulation = simulation_of(result.scene, scene.options.step);
  if (!simulation.run(node).ok()) return {};
  const VectorXd q = vector_of(simulation.positions()), v = vector_of(simulation.velocities());
  if (!simulation.step().ok()) return {};
  const VectorXd ahead = vector_of(simulation.positions()), change = vector_of(simulation.velocities()) - v;
  double best = 8;
  for (Index slot = 1; slot < scene.model->tree.shape.slots; ++slot) {
    const Index row = scene.model->tree.first_v(slot);
    if (!may_land(scene, slot, row) || !(std::abs(v[row]) > best * std::abs(change[row])) || std::abs(v[row]) < 1e-3) continue;
    best = std::abs(v[row]) / std::max(std::abs(change[row]), 1e-300);
    result.limit.row = row;
    result.node = node;
  }
  if (result.node == 0) return {};
  const std::array<double, 4> shares{0, 0.5, 1, random.uniform(0.05, 1)};
  result.limit.restitution = shares[random.below(4)];
  const Index at = reference::position_rows(reference::plain_tree(*scene.model))[static_cast<std::size_t>(result.limit.row)];
  double place = q[at];
  if (random.uniform(0, 1) < 0.4) {
    place += random.uniform(0.05, 0.95) * (ahead[at] - q[at]);
    ++result.node;
    result.at_node = false;
  }
  (v[result.limit.row] > 0 ? result.limit.upper : result.limit.lower) = place;
  effects.limits = {result.limit};
  return result;
}

/// What the plain simulator makes of it: velocities after the blow, and how far the engine's may be from them.
struct After {
  VectorXd v, bound;
};

/// At the node, or where the blow comes up to half a step later. Nothing where it does not, or comes before, or comes twice.
std::optional<After> velocities_after(const Landing& landing) {
  const EverydayScene& scene = landing.scene;
  const double h = scene.options.step, part = h / kPartsAtBlow;
  const Index row = landing.limit.row;
  PlainScene plain = plain_of(scene);
  plain.advance(static_cast<double>(landing.node - 1) * h, kPartsAtBlow * static_cast<int>(landing.node - 1));
  if (landing.node > 1 && plain.sudden[row] > 0) return {};
  const VectorXd begin = plain.v;
  VectorXd before = plain.v, change = VectorXd::Zero(begin.size());
  double turn = fastest_turn(plain);
  int parts = 0;
  for (; parts < kPartsAtBlow || (plain.sudden[row] == 0 && parts < 3 * kPartsAtBlow / 2); ++parts) {
    if (plain.sudden[row] == 0) before = plain.v;
    plain.advance(part, 1);
  }
  if (plain.sudden[row] == 0) return {};
  // what stops comes to its limit within one part, and stands there from the next
  if (landing.limit.restitution == 0) plain.advance(part, 1);
  const VectorXd gave = plain.sudden;
  After result{plain.v, {}};
  turn = std::max(turn, fastest_turn(plain));
  change = by_vector(plain.tree(), before - begin);
  plain.advance(h / 2, kPartsAtBlow / 2);
  change = change.cwiseMax(2 * by_vector(plain.tree(), plain.v - result.v));
  turn = std::max(turn, fastest_turn(plain));
  if (landing.limit.restitution > 0 && (plain.sudden - gave).cwiseAbs().maxCoeff() > 0) return {};
  if (!(turn * h <= kTurnsAtBlow)) return {};
  // The engine strikes with velocities that are off by what acts within a step: all rows by their own, and by what a blow makes of that of the
  // joint that is struck.
  const VectorXd inertia = plain.row_inertia();
  const double kinetic = std::max(0.5 * begin.dot(plain.mass_matrix() * begin), 0.5 * result.v.dot(plain.mass_matrix() * result.v));
  const double rate = plain.stiffest_rate();
  const VectorXd speed = by_vector(plain.tree(), begin).cwiseMax(by_vector(plain.tree(), result.v));
  VectorXd off = 2 * change;
  for (Index k = 0; k < off.size(); ++k) {
    const double most = std::sqrt(2 * kinetic / inertia[k]);
    off[k] += left_by_second_order(h, turn, 2 * kinetic, most, inertia[k]) + 0.5 * std::pow(h * rate, 2) * speed[k];
  }
  const VectorXd passed_on = by_vector(plain.tree(), gave) / gave[row];
  result.bound = off + (1 + landing.limit.restitution) * off[row] * passed_on;
  result.bound.array() += kKnownAtBlow * (1 + result.v.cwiseAbs().maxCoeff());
  return result;
}

void compare_after(const Landing& landing, const After& expected, const VectorXd& v, const char* who, Differences& found) {
  for (Index row = 0; row < v.size(); ++row) {
    if (std::abs(v[row] - expected.v[row]) <= expected.bound[row]) continue;
    found.add(Check::blow, fmt::format("{}: {}", who, row == landing.limit.row ? "the joint that is struck" : "another joint"),
              fmt::format("after a blow of {} at step {} with restitution {:.3g} {} reads {:.6g} per s; expected {:.6g}, "
                          "the plain simulator's, within {:.2g}",
                          landing.scene.model->names.velocity[static_cast<std::size_t>(landing.limit.row)], landing.node, landing.limit.restitution,
                          landing.scene.model->names.velocity[static_cast<std::size_t>(row)], v[row], expected.v[row], expected.bound[row]));
    return;
  }
}

}  // namespace

void check_blow(const EverydayScene& scene, Differences& found) {
  if (scene.stiff || scene.effects.contact) return;
  const std::optional<Landing> landing = landing_of(scene);
  if (!landing) return;
  const std::optional<After> expected = velocities_after(*landing);
  if (!expected) return;
  Simulation simulation = simulation_of(landing->scene, scene.options.step);
  std::int64_t blows = 0;
  for (std::int64_t k = 0; k < landing->node; ++k) {
    const StepReport report = simulation.step();
    if (!report.ok()) return;  // is another check's
    blows += report.blows;
  }
  if (blows == 0) {
    found.add(Check::blow, "none", fmt::format("{} does not land on its limit until step {}; expected a blow",
                                               scene.model->names.velocity[static_cast<std::size_t>(landing->limit.row)],
                                               landing->node));
    return;
  }
  compare_after(*landing, *expected, vector_of(simulation.velocities()), "simulation", found);
  // Lanes look for blows only where something bounces: what comes to a limit at a node, to the last digits, stops within the next step. No joint
  // does but where the limit is put there.
  if (landing->at_node && landing->limit.restitution == 0) return;
  Batch batch(scene.model, 1, scene.options, landing->scene.effects, {.threads = 1});
  batch.reset(0, scene.start.positions, scene.start.velocities);
  batch.step(landing->node);
  compare_after(*landing, *expected, batch.observe().velocities().instance(0), "batch", found);
}

}  // namespace linden

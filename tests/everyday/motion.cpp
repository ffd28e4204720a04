// Checks of one instance: refusals, positions beside the plain simulator, energies, velocities.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/batch.hpp"
#include "families.hpp"
#include "models/build/random.hpp"

namespace linden {

using Eigen::VectorXd;
using reference::PlainScene;

namespace {

constexpr double kTurns = 0.5;  // of a body within a step: from there on the step does not represent the motion [rad]

std::string at(const EverydayScene& scene, std::size_t node) {
  return fmt::format("step {} ({:.4g} s)", node, static_cast<double>(node) * scene.options.step);
}

std::string row_name(const EverydayScene& scene, Index row) { return scene.model->names.velocity[static_cast<std::size_t>(row)]; }

/// Largest turn of a body within the step that follows.
double turn_within(PlainScene plain, double step) {
  constexpr int kParts = 8;
  std::vector<double> turns(plain.tree().bodies.size(), 0.0);
  double most = 0;
  // at the speeds at its beginning, and as it goes on from them
  for (const auto& motion : reference::body_motions(plain.tree(), plain.q, plain.v)) most = std::max(most, motion.w.norm() * step);
  for (int part = 0; part < kParts; ++part) {
    plain.advance(step / kParts, 2);
    const auto motions = reference::body_motions(plain.tree(), plain.q, plain.v);
    for (std::size_t i = 0; i < turns.size(); ++i) turns[i] += motions[i].w.norm() * step / kParts;
  }
  return std::max(most, *std::ranges::max_element(turns));
}

/// Where the plain simulator is at four times up to the horizon, and what its motion says about errors.
struct Track {
  std::vector<VectorXd> q;
  double bent = 0;    // sum over steps of the second difference of velocities
  VectorXd sudden;    // changes of velocity that sudden effects gave
};

constexpr std::int64_t kLooks = 4;

Track track(PlainScene plain, const EverydayScene& scene, int parts) {
  Track result;
  const double h = scene.options.step;
  VectorXd before = plain.v, earlier = plain.v;
  for (std::int64_t k = 1; k <= scene.horizon; ++k) {
    plain.advance(h, parts);
    if (k > 1) result.bent += size_of(*scene.model, plain.v - 2 * before + earlier);
    earlier = before;
    before = plain.v;
    if (k * kLooks / scene.horizon > (k - 1) * kLooks / scene.horizon) result.q.push_back(plain.q);
  }
  result.sudden = plain.sudden;
  return result;
}

/// The engine at the same times, at h / halved.
std::vector<VectorXd> looks(const EverydayScene& scene, int halved) {
  Simulation simulation = simulation_of(scene, scene.options.step / halved);
  std::vector<VectorXd> result;
  for (std::int64_t k = 1; k <= scene.horizon; ++k) {
    for (int part = 0; part < halved; ++part) {
      if (!simulation.step().ok()) return {};
    }
    if (k * kLooks / scene.horizon > (k - 1) * kLooks / scene.horizon) result.push_back(vector_of(simulation.positions()));
  }
  return result;
}

double apart(const EverydayScene& scene, const reference::PlainTree& tree, const VectorXd& a, const VectorXd& b) {
  return size_of(*scene.model, mean_velocity(tree, a, b, 1));
}

double apart(const EverydayScene& scene, const reference::PlainTree& tree, const std::vector<VectorXd>& a, const std::vector<VectorXd>& b) {
  double most = 0;
  for (std::size_t k = 0; k < a.size(); ++k) most = std::max(most, apart(scene, tree, a[k], b[k]));
  return most;
}

VectorXd random_rows(Random& random, Eigen::Index rows) {
  VectorXd result(rows);
  for (double& x : result) x = random.uniform(-1, 1);
  return result;
}

}  // namespace

void check_refused(const EverydayScene& scene, const Walk& walk, Differences& found) {
  if (walk.failed.ok()) return;
  const Node& last = walk.nodes.back();
  const auto steps = walk.nodes.size() - 1;
  const double turn = turn_within(plain_of(scene, last.q, last.v, static_cast<double>(steps) * scene.options.step), scene.options.step);
  if (turn > kTurns) return;
  constexpr std::array<const char*, 5> kStatus{"", "not converged", "past pi", "gains energy", "not finite"};
  found.add(Check::refused, kStatus[static_cast<std::size_t>(walk.failed.status)],
            fmt::format("{} is refused: {}; expected a step: bodies turn by {:.1e} rad at most within it", at(scene, steps), walk.failure,
                        turn));
}

namespace {

/// How far a second-order step may be from the plain simulator, or one of first order where something is sudden.
double position_bound(const EverydayScene& scene, const PlainScene& start, const Track& plain, const Track& coarse, int parts) {
  const reference::PlainTree& tree = start.tree();
  const double h = scene.options.step, duration = static_cast<double>(scene.horizon) * h;
  Random random(scene.seed ^ (scene.number << 20));
  if (!scene.sudden) {
    // what the motion makes of a small change of its start, over what it would do by itself
    constexpr double kSmall = 1e-6;
    PlainScene other = start;
    other.start(start.q, start.v + kSmall / duration * random_rows(random, start.v.size()));
    return 4 * h * plain.bent * std::max(1.0, apart(scene, tree, track(other, scene, parts / 2).q, coarse.q) / kSmall);
  }
  // changes of a step's size, both ways: what sudden events then do
  double spread = 0;
  const VectorXd within = h * start.acceleration();
  for (const double way : {0.5, -0.5}) {
    PlainScene other = start;
    const VectorXd kick = way * within.cwiseProduct(random_rows(random, within.size()));
    other.start(reference::advanced(tree, start.q, way * h * start.v), start.v + kick);
    spread = std::max(spread, apart(scene, tree, track(other, scene, parts / 2).q, coarse.q));
  }
  return 2 * (h * size_of(*scene.model, plain.sudden) + h * plain.bent + spread);
}

}  // namespace

void check_position(const EverydayScene& scene, Differences& found) {
  if (scene.stiff || scene.rough) return;
  const PlainScene start = plain_of(scene);
  const reference::PlainTree& tree = start.tree();
  const double h = scene.options.step, duration = static_cast<double>(scene.horizon) * h;
  const int parts = scene.sudden ? 16 : 2 * std::max(1, static_cast<int>(std::ceil(2 * start.stiffest_rate() * h)));
  const Track plain = track(start, scene, parts), coarse = track(start, scene, parts / 2);
  // infinite where a step is refused, which is another check's
  const auto error_of = [&](int halved) {
    const std::vector<VectorXd> engine = looks(scene, halved);
    return engine.empty() ? std::numeric_limits<double>::infinity() : apart(scene, tree, plain.q, engine);
  };
  const double error = error_of(1), half = error_of(2);
  if (!std::isfinite(error + half)) return;
  const double floor = 4 * apart(scene, tree, plain.q, coarse.q) + 1e-10 * (1 + size_of(*scene.model, start.v) * duration);
  const double bound = position_bound(scene, start, plain, coarse, parts);
  const char* what = scene.sudden ? "sudden" : scene.bends ? "smooth, forces that jump" : "smooth";
  const auto differs = [&](double expected, double found_at, int halved) {
    found.add(Check::position, what,
              fmt::format("after {} steps positions are off the plain simulator's by {:.3g} (rad, or 0.2 m), with half the step by {:.3g}; "
                          "expected {:.3g} at most with {} of the step, found {:.3g}",
                          scene.horizon, error, half, expected, halved == 1 ? "the whole" : halved == 2 ? "half" : "a quarter", found_at));
  };
  if (!std::isfinite(floor + bound)) return;  // too fast for the plain simulator's steps
  if (!scene.sudden && !scene.bends) {
    if (error <= 20 * floor || half <= 0.35 * error + floor) return;
    // the largest steps may be too large to tell
    const double quarter = error_of(4);
    if (!(quarter <= 0.4 * half + floor)) differs(0.4 * half + floor, quarter, 4);
  } else if (!(error <= (scene.sudden ? 4 : 20) * bound + floor)) {
    differs((scene.sudden ? 4 : 20) * bound + floor, error, 1);
  } else if (error > 0.25 * bound + floor) {
    // at a quarter of the step a quarter is left, or less; events may fall anywhere within steps; bodies that touch give way as those steps have it
    PlainScene finer = start;
    finer.ease_contact(h / 4);
    const std::vector<VectorXd> engine = looks(scene, 4);
    if (engine.empty()) return;
    const double quarter = apart(scene, tree, scene.effects.contact ? track(finer, scene, 2 * parts).q : plain.q, engine);
    if (quarter > 0.6 * error + floor && std::isfinite(quarter)) differs(0.6 * error + floor, quarter, 4);
  }
}

namespace {

/// Joint friction acts at the beginning of a step, half a step early (kernels/effects/friction.hpp): a first order of its own, h f |v|.
/// Each time a joint stops, starts or turns it does so within a step: h f at a speed of up to h f / inertia.
double friction_leaves(const EverydayScene& scene, const Walk& walk) {
  if (scene.effects.friction.empty()) return 0;
  const PlainScene plain = plain_of(scene);
  const std::vector<Index> position = reference::position_rows(plain.tree());
  const VectorXd inertia = plain.row_inertia();
  double sum = 0;
  for (const JointFriction& friction : scene.effects.friction) {
    const Index row = position[static_cast<std::size_t>(friction.row)];
    const double impulse = scene.options.step * friction.force;
    double way = 0, most = 0;
    for (std::size_t k = 1; k < walk.nodes.size(); ++k) {
      const double moved = walk.nodes[k].q[row] - walk.nodes[k - 1].q[row], now = moved > 0 ? 1 : moved < 0 ? -1 : 0;
      if (now != way) sum += impulse * impulse / inertia[friction.row];
      way = now;
      most = std::max(most, std::abs(moved));
    }
    sum += friction.force * most;
  }
  return sum;
}

/// What a limit takes within a step it takes along the mean of two displacements, between which bodies turn: of that work, the turn. Ground
/// has its friction at the beginning of a step, as joints have: first order, what it takes in one.
double stops_leave(const EverydayScene& scene, const Walk& walk) {
  double limits = 0, ground = 0, contact = 0;
  for (std::size_t k = 1; k < walk.nodes.size(); ++k) {
    const Node &before = walk.nodes[k - 1], &now = walk.nodes[k];
    const double turn = scene.options.step * std::max(size_of(*scene.model, before.v), size_of(*scene.model, now.v));
    limits += std::abs(now.work.of<JointLimit>() - before.work.of<JointLimit>()) * std::min(1.0, turn);
    ground = std::max(ground, std::abs(now.work.of<Ground>() - before.work.of<Ground>()));
    contact = std::max(contact, std::abs(now.work.of<PairContact>() - before.work.of<PairContact>()));
  }
  return limits + ground + contact;
}

/// What drives a given motion does so at the beginning of a step: of its work, what that changes by from one step to the next.
double motion_leaves(const Walk& walk) {
  double most = 0;
  for (std::size_t k = 2; k < walk.nodes.size(); ++k) {
    const auto work = [&](std::size_t node) { return walk.nodes[node].work.of<JointMotion>() - walk.nodes[node - 1].work.of<JointMotion>(); };
    most = std::max(most, std::abs(work(k) - work(k - 1)));
  }
  return 2 * most;
}

}  // namespace

/// Speed that what rests may read [rad/s, m/s].
constexpr double kRests = 3e-6;

void check_energy(const EverydayScene& scene, const Walk& walk, Differences& found) {
  if (walk.nodes.size() < 8) return;
  const double h = scene.options.step;
  // of the change of velocities that smooth forces and friction give in a step
  double second_order = 0, resting = 0, kinetic = 0, most = 0, least = 0, moved = 0;
  const std::size_t stride = std::max<std::size_t>(1, walk.nodes.size() / 24);
  for (std::size_t k = 0; k < walk.nodes.size(); ++k) {
    const Node& node = walk.nodes[k];
    kinetic = std::max(kinetic, node.energy.kinetic);
    const double potential = node.energy.potential - walk.nodes[0].energy.potential;
    most = std::max(most, potential);
    least = std::min(least, potential);
    moved = std::max(moved, node.work.magnitude());
    if (k % stride != 0 && k > 40) continue;
    const PlainScene plain = plain_of(scene, node.q, node.v, static_cast<double>(k) * h);
    VectorXd change = h * plain.acceleration();
    const VectorXd inertia = plain.row_inertia();
    double sum = 0.5 * change.dot(plain.mass_matrix() * change);
    if (k == 0) resting = 0.5 * kRests * kRests * plain.mass_matrix().trace();
    for (const JointFriction& friction : scene.effects.friction) {
      sum += 0.5 * std::pow(h * friction.force, 2) / inertia[friction.row];
    }
    for (const DeadZoneSpring& spring : scene.effects.dead_zone_springs) {
      // of an edge that is crossed within a step, no more than stops there
      const double square = node.v[spring.row] * node.v[spring.row];
      sum += std::min(spring.stiffness * h * h / 8, 0.5 * inertia[spring.row]) * square;
    }
    if (scene.effects.ground) {
      const double push = scene.effects.ground->stiffness;
      const auto motions = reference::body_motions(plain.tree(), plain.q, plain.v);
      const reference::PlainForces forces(plain.tree(), scene.effects, scene.options.gravity);
      for (const auto& contact : forces.contacts(motions)) {
        if (contact.gap > 0) continue;
        // of the push, and of its change along the way
        const double mass = scene.model->constants.inertia(contact.slot, 0);
        const auto& motion = motions[static_cast<std::size_t>(contact.slot)];
        const double sinks = reference::vector_of(scene.effects.ground->normal).dot(motion.velocity_at(contact.gauge));
        const double way = h * std::abs(sinks), impulse = h * push * (way - contact.gap);
        sum += 0.5 * impulse * impulse / mass + push * way * way;
      }
    }
    second_order = std::max(second_order, sum);
  }
  const double scale = kinetic + (most - least) + moved;
  // the solver's tolerance is 1e-10 of the root of the energy, in each step
  const double rounding = (1e-8 + 4e-10 * static_cast<double>(walk.nodes.size())) * scale;
  // features of a terrain take over from one another; the engine itself tells what gives more than a hundredth
  constexpr double kRough = 0.02;
  const double allowed = (scene.rough ? kRough * scale : 0) + rounding + resting + 8 * (second_order + stops_leave(scene, walk)) + friction_leaves(scene, walk) + motion_leaves(walk);

  const double first = walk.nodes[0].balance();
  // a blow may be booked a step or two after it: what stays counts
  constexpr std::size_t kStays = 4;
  double worst = 0;
  std::size_t where = 0;
  for (std::size_t k = 0; k + kStays <= walk.nodes.size(); ++k) {
    double stays = std::numeric_limits<double>::infinity();
    for (std::size_t j = k; j < k + kStays; ++j) stays = std::min(stays, std::abs(walk.nodes[j].balance() - first));
    if (!(stays <= worst)) {
      worst = stays;
      where = k;
    }
  }
  if (!(worst <= allowed)) {
    found.add(Check::energy, "ledger",
              fmt::format("{}: energy and what was taken less what was given strays by {:.3g} J; expected {:.3g} J at most (energies of "
                          "{:.3g} J)",
                          at(scene, where), walk.nodes[where].balance() - first, allowed, scale));
  }
  const auto gives = [&]<class Entry>(const char* effect, bool there) {
    if (!there) return;
    double peak = 0, drop = 0;
    std::size_t place = 0;
    for (std::size_t k = 0; k < walk.nodes.size(); ++k) {
      const double now = walk.nodes[k].work.of<Entry>();
      peak = std::max(peak, now);
      if (!(peak - now <= drop)) {
        drop = peak - now;
        place = k;
      }
    }
    if (!(drop <= allowed)) {
      found.add(Check::energy, fmt::format("{} gives", effect),
                fmt::format("{}: {} gave {:.3g} J; expected nothing, {:.3g} J at most (energies of {:.3g} J)", at(scene, place), effect,
                            drop, allowed, scale));
    }
  };
  gives.operator()<JointDamping>("damping", !scene.effects.damping.empty());
  gives.operator()<JointFriction>("friction", !scene.effects.friction.empty());
  gives.operator()<JointLimit>("a limit", !scene.effects.limits.empty());
  gives.operator()<Drag>("drag", !scene.effects.drag.empty() && scene.effects.wind == std::array<double, 3>{0, 0, 0});
  gives.operator()<Ground>("ground", scene.effects.ground.has_value());
  gives.operator()<PairContact>("contact", scene.effects.contact.has_value());
}

namespace {

/// Velocities read at a node, beside the means of the two steps before and the two after it.
class Reader {
 public:
  Reader(const EverydayScene& scene, const Walk& walk, const char* who) : scene_(scene), who_(who), plain_(plain_of(scene)) {
    double kinetic = 0;
    for (const Node& node : walk.nodes) kinetic = std::max(kinetic, node.energy.kinetic);
    // the solver's tolerance is of the root of the energy, which may all be one row's
    inertia_ = plain_.row_inertia();
    rate_ = plain_.stiffest_rate();
    for (const Drag& drag : scene.effects.drag) {
      rate_ = std::max(rate_, (drag.linear + 2 * drag.quadratic * std::sqrt(2 * kinetic / plain_.tree().body(drag.slot).mass())) /
                                  plain_.tree().body(drag.slot).mass());
    }
    most_ = (2 * kinetic * inertia_.cwiseInverse()).cwiseSqrt();
    known_ = 1e-8 * most_;
    known_.array() += kRests;
    first_.resize(known_.size());
    count_.setOnes(known_.size());
    for (Index i = 1; i < plain_.tree().slots(); ++i) {
      const reference::PlainBody& body = plain_.tree().body(i);
      for (Index k = 0; k < body.dofs(); ++k) {
        first_[body.v + k] = body.v + (k < 3 ? 0 : 3);
        if (body.kind != JointKind::screw) count_[body.v + k] = 3;
      }
    }
  }

  /// q: five positions, v at the middle one. blows: on limits, in the two steps around it.
  void look(std::size_t node, const std::array<const VectorXd*, 5>& q, const VectorXd& v, const std::array<int, 2>& blows,
            Differences& found) const {
    std::array<VectorXd, 4> mean;
    for (std::size_t k = 0; k < 4; ++k) mean[k] = mean_velocity(plain_.tree(), *q[k], *q[k + 1], scene_.options.step);
    // of second order are momenta too: ad_V^T ad_V^T G V h^2 / 12 of a body that turns and moves on
    double turn = 0, moving = 0;
    const auto motions = reference::body_motions(plain_.tree(), *q[2], mean[1]);
    for (std::size_t i = 1; i < motions.size(); ++i) {
      const reference::PlainBody& body = plain_.tree().bodies[i];
      turn = std::max(turn, motions[i].w.norm());
      moving += body.mass() * motions[i].velocity_at(motions[i].world(reference::center_of(body))).squaredNorm();
    }
    const double step = scene_.options.step;
    // by either: steps that turn so far may be another motion's
    double fastest = turn;
    for (const auto& motion : reference::body_motions(plain_.tree(), *q[2], v)) fastest = std::max(fastest, motion.w.norm());
    // what forces that jump at the node change there of the acceleration: means do not show it
    VectorXd jump = VectorXd::Zero(v.size());
    if (scene_.bends) {
      const double time = static_cast<double>(node) * step;
      const PlainScene before = plain_of(scene_, *q[2], mean[1], time - 0.5 * step);
      const PlainScene after = plain_of(scene_, *q[2], mean[1], time + 0.5 * step);
      jump = 0.5 * step * (after.acceleration() - before.acceleration()).cwiseAbs();
    }
    std::array<VectorXd, 3> change;
    for (std::size_t k = 0; k < 3; ++k) change[k] = mean[k + 1] - mean[k];
    for (Index row = 0; row < v.size(); ++row) {
      double speed = 0, bend = 0;
      for (std::size_t k = 0; k < 4; ++k) speed = std::max(speed, std::abs(mean[k][row]));
      // the three rows of an angular or of a linear velocity are one vector, in a frame that turns
      for (const VectorXd& one : change) bend = std::max(bend, 2 * one.segment(first_[row], count_[row]).norm());
      const double second = second_order(row, turn, moving);
      bend += second + jump[row] + known_[row];
      const auto within = [&](double rate) { return bend + 0.5 * std::pow(step * rate, 2) * speed; };
      const double middle = 0.5 * (mean[1][row] + mean[2][row]);
      if (!std::isfinite(v[row])) {
        found.add(Check::velocity, fmt::format("{}: not finite", who_),
                  fmt::format("{}: {} reads {}; expected a number", at(scene_, node), row_name(scene_, row), v[row]));
      } else if (speed <= 0.1 * known_[row]) {
        if (std::abs(v[row]) <= known_[row] + second) continue;
        if (blows[0] > 0 && leaves_limit(row, *q[2], v[row])) continue;
        found.add(Check::rest, fmt::format("{}: rests and reads a speed", who_),
                  fmt::format("{}: {} stands still and reads {:.3g} per s; expected {:.1g} at most", at(scene_, node),
                              row_name(scene_, row), v[row], known_[row]));
      } else if (!scene_.stiff && blows[0] + blows[1] == 0 && fastest * step <= kTurns && !(std::abs(v[row] - middle) <= within(rate_))) {
        // a motion may lead to where springs and dampers are stiffer than at its start
        const double allowed = within(std::max(rate_, plain_of(scene_, *q[2], v, static_cast<double>(node) * step).stiffest_rate()));
        if (std::abs(v[row] - middle) <= allowed) continue;
        found.add(Check::velocity, fmt::format("{}: not the motion's", who_),
                  fmt::format("{}: {} reads {:.6g} per s; expected {:.6g}, that of the positions around it, within {:.2g}",
                              at(scene_, node), row_name(scene_, row), v[row], middle, allowed));
      }
    }
    for (const JointLimit& limit : scene_.effects.limits) {
      after_blow(limit, node, *q[2], mean, v, second_order(limit.row, turn, moving), blows, found);
    }
  }

 private:
  double second_order(Index row, double turn, double moving) const {
    return left_by_second_order(scene_.options.step, turn, moving, most_[row], inertia_[row]);
  }
  /// A blow of another joint throws what rests on a limit off it; within the step that comes it may be back.
  bool leaves_limit(Index row, const VectorXd& q, double v) const {
    for (const Mimic& mimic : scene_.model->mimics) {
      if (mimic.follower_v == row) return leaves_limit(mimic.leader_v, q, mimic.multiplier * v);
    }
    const double place = q[reference::position_rows(plain_.tree())[static_cast<std::size_t>(row)]];
    return std::ranges::any_of(scene_.effects.limits, [&](const JointLimit& limit) {
      return limit.row == row && ((std::abs(place - limit.lower) < 1e-12 && v > 0) || (std::abs(place - limit.upper) < 1e-12 && v < 0));
    });
  }
  /// On a limit: the velocity is that with which it goes on, but for what acts in the step that comes.
  void after_blow(const JointLimit& limit, std::size_t node, const VectorXd& q, const std::array<VectorXd, 4>& mean, const VectorXd& v,
                  double second, const std::array<int, 2>& blows, Differences& found) const {
    const Index row = limit.row;
    const double place = q[reference::position_rows(plain_.tree())[static_cast<std::size_t>(row)]];
    const bool low = std::abs(place - limit.lower) < 1e-12, high = std::abs(place - limit.upper) < 1e-12;
    if (!low && !high) return;
    const double on = mean[2][row], slack = 2 * std::max(std::abs(mean[3][row] - on), std::abs(mean[1][row] - mean[0][row])) + known_[row];
    if (std::abs(v[row] - on) <= slack) return;
    // thrown off by another joint's blow, and back within the step; or thrown off by one within the step that comes
    if (blows[0] > 0 && std::abs(on) <= known_[row] && leaves_limit(row, q, v[row])) return;
    if (blows[1] > 0 && std::abs(v[row]) <= known_[row]) return;
    // what rested there and is set in motion within the step that comes reads something between
    const double into = low ? -mean[1][row] : mean[1][row];
    if (into <= known_[row] && v[row] >= std::min(mean[1][row], on) - slack && v[row] <= std::max(mean[1][row], on) + slack) return;
    const double step = scene_.options.step, middle = (static_cast<double>(node) + 0.5) * step;
    double acts = std::abs(plain_of(scene_, q, v, middle).acceleration()[row]);
    for (const JointFriction& friction : scene_.effects.friction) acts += friction.row == row ? friction.force / inertia_[row] : 0;
    const double allowed = slack + step * acts + second;
    if (std::abs(v[row] - on) <= allowed) return;
    found.add(Check::rest, fmt::format("{}: speed on a limit", who_),
              fmt::format("{}: {} is on its limit and reads {:.6g} per s; expected {:.6g}, with which it goes on, within {:.2g}",
                          at(scene_, node), row_name(scene_, row), v[row], on, allowed));
  }

  const EverydayScene& scene_;
  std::string who_;
  PlainScene plain_;
  VectorXd inertia_, most_, known_;  // of rows; what all energy would give one; what is known of it
  double rate_;                      // the fastest of damping, springs, servos and drag, at the start [1/s]
  Eigen::VectorXi first_, count_;
};

}  // namespace

void check_velocities(const EverydayScene& scene, const Walk& walk, Differences& found) {
  const std::size_t nodes = walk.nodes.size();
  if (nodes < 5) return;
  const Reader reader(scene, walk, "simulation");
  // every node where the motion begins and ends, some between
  const std::size_t stride = std::max<std::size_t>(1, nodes / 64);
  for (std::size_t k = 2; k + 2 < nodes; ++k) {
    if (k > 48 && k + 24 < nodes && k % stride != 0) continue;
    const auto q = [&](std::size_t node) { return &walk.nodes[node].q; };
    reader.look(k, {q(k - 2), q(k - 1), q(k), q(k + 1), q(k + 2)}, walk.nodes[k].v, {walk.nodes[k].blows, walk.nodes[k + 1].blows}, found);
  }
}

void check_batch_velocities(const EverydayScene& scene, const Walk& walk, Differences& found) {
  if (!walk.failed.ok() || scene.effects.contact) return;
  Batch batch(scene.model, 1, scene.options, scene.effects, {.threads = 1});
  batch.reset(0, scene.start.positions, scene.start.velocities);
  const Reader reader(scene, walk, "batch");
  std::int64_t taken = 0;
  for (const std::int64_t until : {scene.horizon, scene.steps}) {
    batch.step(until - taken - 4);
    taken = until;
    std::array<VectorXd, 5> q;
    VectorXd v;
    for (std::size_t k = 0; k < 5; ++k) {
      if (k > 0) batch.step(1);
      q[k] = batch.positions().instance(0);
      if (k == 2) v = batch.observe().velocities().instance(0);
    }
    if (batch.record(0).status != StepStatus::converged) {
      // a Simulation took these steps, or others where the motion does not bear the least difference
      const double time = static_cast<double>(batch.record(0).steps) * scene.options.step;
      const VectorXd at_q = batch.positions().instance(0), at_v = batch.observe().velocities().instance(0);
      if (turn_within(plain_of(scene, at_q, at_v, time), scene.options.step) > kTurns) return;
      found.add(Check::refused, "batch alone", fmt::format("in a batch: {}; expected what a Simulation takes", batch.describe(0)));
      return;
    }
    const auto node = static_cast<std::size_t>(until - 2);  // the same steps, to rounding
    reader.look(node, {&q[0], &q[1], &q[2], &q[3], &q[4]}, v, {walk.nodes[node].blows, walk.nodes[node + 1].blows}, found);
    if (scene.steps - scene.horizon < 8) return;
  }
}

}  // namespace linden

// Loops where they are lost: flat, overdetermined, of light links, stiff, off by a little.
//
// How far a loop may be open follows from when a step counts as solved: what is left of its motion is `tolerance`, in the norm of its energy E.
// Two rods that meet where the loop closes, whose ends weigh m each as a push there feels them, may part by as much as is
//
//   h tolerance sqrt(2 E / (m / 2)),   m = a quarter of a free rod's mass
//
// and the next step closes what the one before left: nothing adds up.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "engine/mobility.hpp"
#include "layout/support/input_error.hpp"
#include "models/build/coupled_model.hpp"
#include "tests/engine/mechanisms.hpp"
#include "tests/gallery/models.hpp"
#include "tests/gallery/scenario.hpp"

namespace linden {
namespace {

/// Of a joint that turns or slides, now [rad, m].
double coordinate(const Simulation& simulation, const std::string& joint) {
  const Model& model = simulation.model();
  return simulation.positions()[static_cast<std::size_t>(model.tree.first_q(model.names.slot_of_joint.at(joint)))];
}

/// Of a loop that reaches that far [m] and closes where rods meet of which the lighter has this mass [kg].
double closed_to(const RunRecord& record, const Options& options, double lighter, double reach) {
  return options.tolerance * options.step * std::sqrt(16 * record.drift.scale() / lighter) + 100 * kEpsilon * reach;
}

void promise_closed(Report& report, const RunRecord& record, const Options& options, double lighter, double reach) {
  report.at_most("loop open by [m]", record.gap, closed_to(record, options, lighter, reach),
                 "what the tolerance leaves of a step, and rounding of places; nothing adds up");
}

/// Two branches of a mechanism cross where it is flat, so that an angle which is off by e opens the loop by e^2 only.
void promise_branch(Report& report, const std::string& what, double off, const RunRecord& record, const Options& options) {
  report.at_most(what, off, std::sqrt(closed_to(record, options, 1, 1)),
                 "the root of what the loop may be open by, as branches cross; another branch is a radian off");
}

const std::string kOneMotion = "one motion, wherever it is cut: the solver's tolerance of the way, as a random walk";

// Change points.

/// Windows of four bars beside each other: cranks, upright at zero, one more than windows, and couplers between their ends; thin rods of 1 m and
/// 1 kg. All cranks are parallel, but where they lie flat each window may fold by itself: from there a branch leads on for every one.
///
/// source  benchmark A02 of Gonzalez, Dopico, Luaces, Cuadrado, A benchmarking system for MBS simulation software, Multibody System Dynamics 16
///         (2006): 40 windows, the first crank's end at 1 m/s, 20 s; of two windows Bayo, Avello (1994)
///
/// kind: hinges of five rows each, of which three follow from the tree's hinges, or what is left without these.
Model windows(Index count, CouplingKind kind) {
  using Eigen::Vector3d;
  TreeBuilder builder("windows");
  std::vector<CouplingSpec> pins;
  const auto add = [&](const std::string& name, const std::string& parent, const Vector3d& from, const Vector3d& to) {
    LinkSpec link = bar(name, parent, from, to);
    link.inertia.about_center = (Eigen::Matrix3d::Identity() - to * to.transpose()) / 12;
    builder.add(std::move(link));
  };
  for (Index i = 0; i <= count; ++i) {
    const std::string crank = fmt::format("crank{}", i), top = fmt::format("top{}", i);
    add(crank, "", {static_cast<double>(i), 0, 0}, Vector3d::UnitZ());
    if (i == count) break;
    add(top, crank, Vector3d::UnitZ(), Vector3d::UnitX());
    pins.push_back({.name = fmt::format("pin{}", i),
                    .kind = kind,
                    .link_a = top,
                    .link_b = fmt::format("crank{}", i + 1),
                    .at = PointAndAxis{{i + 1.0, 0, 1}, Vector3d::UnitY()}});
  }
  return coupled(builder.build(), pins);
}

/// Upright, turning at `speed`.
InitialState turning_windows(const Model& model, double speed) {
  InitialState start;
  start.velocities.resize(static_cast<std::size_t>(model.tree.shape.velocities));
  for (const auto& [joint, slot] : model.names.slot_of_joint) {
    start.velocities[static_cast<std::size_t>(model.tree.first_v(slot))] = joint.starts_with("top") ? -speed : speed;
  }
  return start;
}

/// How far the cranks are from all being parallel [rad].
double fanned(const Simulation& simulation, Index count) {
  double most = 0;
  for (Index i = 1; i <= count; ++i) {
    most = std::max(most, std::abs(coordinate(simulation, fmt::format("crank{}_joint", i)) - coordinate(simulation, "crank0_joint")));
  }
  return most;
}

/// One window without weight turns evenly for ever. So does every step of it, by D with 2/3 D + sin D = 5/3 h w: cranks of 1/3 kg m^2 turn by D, and
/// the coupler moves along the chord.
void parallelogram_passes(Report& report) {
  const double h = 5e-3, speed = 2;
  const auto passes = report.pick<std::int64_t>(4, 64, 512);
  const auto steps = static_cast<std::int64_t>(std::ceil(static_cast<double>(passes) * std::numbers::pi / (h * speed)));
  Scenario turning = scenario(windows(1, CouplingKind::hinge), {.step = h, .gravity = {0, 0, 0}}, steps);
  turning.start = turning_windows(*turning.model, speed);
  Simulation simulation = simulation_of(turning);
  double off = 0;
  const RunRecord record = run(simulation, steps, 1, [&](Simulation& now) { off = std::max(off, fanned(now, 1)); });
  double turn = h * speed;
  for (int k = 0; k < 10; ++k) turn -= (2 * turn + 3 * std::sin(turn) - 5 * h * speed) / (2 + 3 * std::cos(turn));
  const auto count = static_cast<double>(steps);
  const double walk = 2 * turning.options.tolerance * std::sqrt(count);
  report.at_most("steps that failed", static_cast<double>(steps - record.steps), 0, "every step has a solution");
  promise_branch(report, fmt::format("cranks out of parallel in {} flat passes [rad]", passes), off, record, turning.options);
  report.at_most("|angle / what even steps make it - 1|", std::abs(coordinate(simulation, "crank0_joint") / (turn * count) - 1), walk,
                 "two tolerances a step, as a random walk; nothing is lost or gained where it is flat");
  report.at_most("energy error / kinetic energy", record.energy_error / record.drift.scale(), walk, "the same");
  promise_closed(report, record, turning.options, 1, 1);
  report.note(effort(record));
}

/// Under weight the cranks turn as one pendulum with all their mass.
void benchmark_windows(Report& report, Index count, CouplingKind kind, double h, double duration) {
  const auto steps = static_cast<std::int64_t>(std::llround(duration / h));
  Scenario turning = scenario(windows(count, kind), {.step = h}, steps);
  turning.start = turning_windows(*turning.model, 1);
  Simulation simulation = simulation_of(turning);
  const double n = count, pull = 9.81 * ((n + 1) / 2 + n) / ((n + 1) / 3 + n);
  double angle = 0, rate = 1, off = 0, fan = 0;
  const auto pendulum = [&](double s) {  // Runge and Kutta's classical step, of an equation of second order
    const auto speeding = [&](double q) { return pull * std::sin(q); };
    const double a = speeding(angle), b = speeding(angle + s / 2 * rate), c = speeding(angle + s / 2 * rate + s * s / 4 * a);
    const double d = speeding(angle + s * rate + s * s / 2 * b);
    angle += s * rate + s * s / 6 * (a + b + c);
    rate += s / 6 * (a + 2 * b + 2 * c + d);
  };
  std::int64_t looks = 0;
  const RunRecord record = run(simulation, steps, 1, [&](Simulation& now) {
    if (looks++ > 0) pendulum(h);
    const double q = coordinate(now, "crank0_joint");
    off = std::max(off, std::hypot(std::sin(q) - std::sin(angle), std::cos(q) - std::cos(angle)));
    fan = std::max(fan, fanned(now, count));
  });
  promise_conservation(report, record, steps, false);
  promise_branch(report, "cranks out of parallel [rad]", fan, record, turning.options);
  report.at_most("first crank's end off that of a pendulum [m]", off, 1e-3, "what the benchmark allows where precision is to be high");
  promise_closed(report, record, turning.options, 1, n + 1);
  report.note(fmt::format("{:.0f} half turns", angle / std::numbers::pi));
}

/// A crank and a rod as long as each other: where they cover each other the slider sits on the crank's axis, all may turn about it as one, and
/// of the two rows that hold the plane one says nothing.
void slider_crank(Report& report) {
  TreeBuilder builder("slider-crank");
  builder.add(bar("crank", "", {0, 0, 0}, {1, 0, 0}));
  builder.add(bar("rod", "crank", {1, 0, 0}, {1, 0, 0}));
  LinkSpec slider = bar("slider", "", {2, 0, 0}, {0.1, 0, 0});
  slider.type = JointType::prismatic;
  slider.axis = Eigen::Vector3d::UnitX();
  builder.add(slider);
  const auto steps = report.pick<std::int64_t>(4000, 20'000, 100'000);
  Scenario turning = scenario(coupled(builder.build(), {{.name = "pin",
                                                         .kind = CouplingKind::hinge,
                                                         .link_a = "rod",
                                                         .link_b = "slider",
                                                         .at = PointAndAxis{{2, 0, 0}, Eigen::Vector3d::UnitY()}}}),
                              {.step = 1e-3, .gravity = {0, 0, 0}}, steps);
  turning.start.velocities = {3, 0, -6};
  Simulation simulation = simulation_of(turning);
  double off = 0;
  const RunRecord record = run(simulation, steps, 1, [&](Simulation& now) {
    off = std::max(off, std::abs(coordinate(now, "rod_joint") + 2 * coordinate(now, "crank_joint")));
  });
  promise_conservation(report, record, steps, report.form() != Form::quick);
  promise_branch(report, "rod off the branch on which the slider goes on [rad]", off, record, turning.options);
  promise_closed(report, record, turning.options, 0.1, 2);
  report.note(fmt::format("{:.0f} times through where the rank falls", std::abs(coordinate(simulation, "crank_joint")) / std::numbers::pi));
}

// Rows that say the same, or nearly.

/// Six hinges where six would hold a spatial loop still.
void bricard_loop(Report& report) {
  std::array<double, 3> ends{};
  for (std::size_t k = 0; k < 3; ++k) {
    const double h = 4e-3 / static_cast<double>(1 << k);
    const Scenario falling = scenario(bricard(), {.step = h}, std::llround(report.pick(2, 10, 50) / h));
    Simulation simulation = simulation_of(falling);
    const RunRecord record = run(simulation, falling.steps);
    ends[k] = simulation.positions()[0];
    if (k < 2) continue;
    promise_conservation(report, record, falling.steps, report.form() == Form::full);
    promise_closed(report, record, falling.options, 1, 2);
    const std::vector<bool> redundant = simulation.couplings()[0].redundant;
    report.at_most("|rows that follow from others - 1|", std::abs(static_cast<double>(std::ranges::count(redundant, true)) - 1), 0,
                   "five rows, and one degree of freedom left of five");
  }
  report.at_most("|what the step costs at 4 and 2 ms / 2 and 1 ms - 4|", std::abs((ends[0] - ends[1]) / (ends[1] - ends[2]) - 4), 0.2,
                 "second order; the next term is of the fourth");
}

/// The coupler's axis turned by `off` [rad].
Model crooked_four_bar(double off) {
  TreeBuilder builder("four-bar");
  builder.add(bar("crank", "", {0, 0, 0}, {0, 0, 1}));
  builder.add(bar("coupler", "crank", {0, 0, 1}, {2, 0, 1}, Eigen::Vector3d(off, 1, 0).normalized()));
  builder.add(bar("rocker", "", {3, 0, 0}, {-1, 0, 2}));
  return coupled(builder.build(),
                 {{.name = "pin", .kind = CouplingKind::hinge, .link_a = "coupler", .link_b = "rocker", .at = PointAndAxis{{2, 0, 2}, {0, 1, 0}}}});
}

void axes_off(Report& report) {
  const auto steps = report.pick<std::int64_t>(500, 2000, 10'000);
  struct Moved {
    std::vector<double> angles;  // of the crank
    double gap, failed;
  };
  const auto moved = [&](double off) {
    Scenario moving = scenario(crooked_four_bar(off), {.step = 1e-3}, steps);
    moving.start.velocities = {1, 0, 0};
    Simulation simulation = simulation_of(moving);
    Moved result{};
    const RunRecord record = run(simulation, steps, 1, [&](Simulation& now) { result.angles.push_back(coordinate(now, "crank_joint")); });
    result.gap = record.gap;
    result.failed = static_cast<double>(steps - record.steps);
    return result;
  };
  const Moved exact = moved(0), jammed = moved(1e-3);
  double way = 0, angle = 0, gap = 0, failed = exact.failed + jammed.failed;
  for (std::size_t k = 1; k < exact.angles.size(); ++k) way += std::abs(exact.angles[k] - exact.angles[k - 1]);
  const double walk = Options{}.tolerance * std::sqrt(static_cast<double>(steps)) * way;
  std::string told;
  for (const double off : {1e-12, 1e-9, 1e-7, 1e-6, 1e-5}) {
    const Moved crooked = moved(off);
    failed += crooked.failed;
    const double apart = std::abs(crooked.angles.back() - exact.angles.back());
    angle = std::max(angle, apart / (off * off * way + walk));
    gap = std::max(gap, crooked.gap / (2 * std::sqrt(5) * off + exact.gap));
    told += fmt::format("{}{:.0e}: crank {:.1e} rad off, open by {:.1e}", told.empty() ? "" : "; ", off, apart, crooked.gap);
  }
  report.at_most("steps that failed", failed, 0, "every step has a solution");
  report.at_most("1e-12 to 1e-5 rad: crank off the exact one's / (square of it + tolerance as a random walk, of the way)", angle, 1,
                 "what leaves the plane by a first power changes lengths within by the second");
  report.at_most("1e-12 to 1e-5 rad: loop open by / (4.47 m of it + what the exact one is)", gap, 1,
                 "a coupler of 2.24 m that turns about an axis which is off leaves the plane by twice that, at its end");
  report.at_most("1e-3 rad: crank moves [rad]", std::abs(jammed.angles.back()), 1e-3,
                 "axes that are not parallel hold a four-bar still, but for what they are off by");
  report.at_most("1e-3 rad: degrees of freedom told", static_cast<double>(mobility_of(crooked_four_bar(1e-3), {}).freedom), 0,
                 "inspect says so before the first step");
  report.note(told);
}

/// Two links of 1.2 m on pivots 2.41 m apart.
void cannot_close(Report& report) {
  TreeBuilder builder("too short");
  builder.add(bar("left", "", {0, 0, 0}, {1.2, 0, 0}));
  builder.add(bar("right", "", {2.41, 0, 0}, {-1.2, 0, 0}));
  CouplingSpec pin{.name = "pin", .kind = CouplingKind::ball, .link_a = "left", .link_b = "right"};
  pin.frame_a.translation() = Eigen::Vector3d(1.2, 0, 0);
  pin.frame_b.translation() = Eigen::Vector3d(-1.2, 0, 0);
  const Model model = coupled(builder.build(), {pin});
  double worst = 0;
  for (const double angle : {0.0, 0.5, 1.5, -2.0, 3.0}) {
    std::vector<double> q{angle, -0.7 * angle};
    const Assembly found = assemble(model, q, Assembled::from_anywhere);
    worst = std::max(worst, std::abs(found.gap - 0.01));
    if (found.closed) worst = std::numeric_limits<double>::infinity();
  }
  report.at_most("|gap told - 0.01| [m], from five starts", worst, 1e-6, "where both point at each other 2.41 - 2.4 is left, the least there is");
  std::string said;
  try {
    Simulation(model, {.step = 1e-3}).step();
  } catch (const InputError& error) {
    said = error.what();
  }
  report.at_least("steps from there that are refused by the loop's name", said.find("\"pin\"") != std::string::npos ? 1 : 0, 1,
                  "a loop that is open is not pulled together by whatever forces it takes");
  report.note(said);
}

// Light, massless, stiff.

/// Of a four-bar's links, what they weigh by the metre [kg/m].
struct Weights {
  double crank = 1, coupler = 1, rocker = 1;
};

/// The pin that closes it; the others are joints of the tree.
enum class Pin { crank_foot, crank_end, rocker_end, rocker_foot };

Model weighted_four_bar(const Weights& weights, Pin pin) {
  using Eigen::Vector3d;
  const Vector3d left(0, 0, 0), end(0, 0, 1), corner(2, 0, 2), right(3, 0, 0);
  TreeBuilder builder("four-bar");
  const auto add = [&](const std::string& name, const std::string& parent, const Vector3d& parent_at, const Vector3d& from, const Vector3d& to,
                       double weight) {
    LinkSpec link = bar(name, parent, from - parent_at, to - from);
    link.inertia.mass *= weight;
    link.inertia.about_center *= weight;
    builder.add(std::move(link));
  };
  const auto closed = [&](const std::string& a, const std::string& b, const Vector3d& at) {
    const PointAndAxis there{at, Vector3d::UnitY()};
    return coupled(builder.build(), {{.name = "pin", .kind = CouplingKind::hinge, .link_a = a, .link_b = b, .at = there}});
  };
  if (pin != Pin::crank_foot) add("crank", "", {0, 0, 0}, left, end, weights.crank);
  if (pin != Pin::rocker_foot) add("rocker", "", {0, 0, 0}, right, corner, weights.rocker);
  if (pin == Pin::rocker_end || pin == Pin::rocker_foot) {
    add("coupler", "crank", left, end, corner, weights.coupler);
    if (pin == Pin::rocker_end) return closed("coupler", "rocker", corner);
    add("rocker", "coupler", end, corner, right, weights.rocker);
    return closed("rocker", "", right);
  }
  add("coupler", "rocker", right, corner, end, weights.coupler);
  if (pin == Pin::crank_end) return closed("coupler", "crank", end);
  add("crank", "coupler", corner, end, left, weights.crank);
  return closed("crank", "", left);
}

/// Angle of the crank in the world, however the tree reaches it [rad].
double crank_angle(const Simulation& simulation, Pin pin) {
  const double own = coordinate(simulation, "crank_joint");
  return pin == Pin::crank_foot ? own + coordinate(simulation, "coupler_joint") + coordinate(simulation, "rocker_joint") : own;
}

/// One link of a four-bar as light as that; closed at a pin of links that weigh something.
void light_link(Report& report, double Weights::*link, Pin pin) {
  const auto steps = report.pick<std::int64_t>(1000, 2000, 20'000);
  const auto model = [&](double weight) {
    Weights weights;
    weights.*link = weight;
    return weighted_four_bar(weights, pin);
  };
  const auto end = [&](double weight) {
    Simulation simulation(model(weight), {.step = 1e-3});
    return simulation.run(std::min<std::int64_t>(steps, 2000)).ok() ? crank_angle(simulation, pin) : std::nan("");
  };
  const double first = std::abs(end(1e-3) - end(1e-6)), second = std::abs(end(1e-6) - end(1e-9));
  report.at_most("1e-6 and 1e-9 apart / (1e-3 and 1e-6 apart / 1,000)", 1000 * second / first, 1.1,
                 "where hardly anything is left to move, a thousandth of it moves the others by a thousandth");
  const Scenario moving = scenario(model(1e-9), {.step = 1e-3}, steps);
  const RunRecord record = run(moving);
  promise_conservation(report, record, steps, false);
  report.at_most("steps split", static_cast<double>(record.split), 0, "the mechanism has one way to go, and a smooth one");
  promise_closed(report, record, moving.options, 1, 3);
  report.note(fmt::format("crank off by {:.1e} and {:.1e} rad", first, second));
}

/// A heavy coupler between light links, closed at every pin in turn.
void every_pin(Report& report) {
  const auto steps = report.pick<std::int64_t>(1000, 2000, 20'000);
  std::vector<double> first;
  double off = 0, split = 0, failed = 0;
  std::string told;
  for (const Pin pin : {Pin::crank_foot, Pin::crank_end, Pin::rocker_end, Pin::rocker_foot}) {
    const Scenario moving = scenario(weighted_four_bar({.crank = 1e-6, .coupler = 1, .rocker = 1e-6}, pin), {.step = 1e-3}, steps);
    Simulation simulation = simulation_of(moving);
    std::vector<double> angles;
    const RunRecord record = run(simulation, steps, 1, [&](Simulation& now) { angles.push_back(crank_angle(now, pin)); });
    if (first.empty()) first = angles;
    for (std::size_t k = 0; k < std::min(first.size(), angles.size()); ++k) off = std::max(off, std::abs(angles[k] - first[k]));
    failed += static_cast<double>(steps - record.steps);
    split += static_cast<double>(record.split);
    told += fmt::format("{}{:.1e}", told.empty() ? "open by [m] " : ", ", record.gap);
  }
  double way = 0;
  for (std::size_t k = 1; k < first.size(); ++k) way += std::abs(first[k] - first[k - 1]);
  report.at_most("steps that failed", failed, 0, "every step has a solution");
  report.at_most("steps split", split, 0, "the mechanism has one way to go, and a smooth one");
  report.at_most("cranks apart [rad]", off, Options{}.tolerance * std::sqrt(static_cast<double>(steps)) * way, kOneMotion);
  report.note(told);
}

/// A crank, a rocker on a crooked axis, and a rod between them: on a ball joint at the rocker and a universal one at the crank. That is two hinges
/// with a cross between them that weighs nothing, and the ball closes the loop; or one coupling, which closes it, and the ball is a joint.
Model spatial_linkage(bool cross) {
  using Eigen::Vector3d;
  TreeBuilder builder("spatial linkage");
  const Vector3d tip(0, 0, 1), along(2, 0.5, 1), pivot(3, 0.8, 0);
  builder.add(bar("crank", "", {0, 0, 0}, tip));
  builder.add(bar("rocker", "", pivot, tip + along - pivot, Vector3d(0.3, 1, 0.1).normalized()));
  if (cross) {
    LinkSpec between;
    between.name = "cross";
    between.parent = "crank";
    between.joint = "cross_joint";
    between.axis = Vector3d::UnitY();
    between.placement.translation() = tip;
    builder.add(between);
    builder.add(bar("rod", "cross", {0, 0, 0}, along, Vector3d::UnitZ()));
    const PointAndAxis end{tip + along};
    return coupled(builder.build(), {{.name = "ball", .kind = CouplingKind::ball, .link_a = "rod", .link_b = "rocker", .at = end}});
  }
  LinkSpec rod = bar("rod", "rocker", tip + along - pivot, -along);
  rod.type = JointType::ball;
  builder.add(rod);
  return coupled(builder.build(), {{.name = "universal",
                                    .kind = CouplingKind::universal,
                                    .link_a = "crank",
                                    .link_b = "rod",
                                    .at = PointAndAxis{tip, Vector3d::UnitY(), Vector3d::UnitZ()}}});
}

void massless_in_loop(Report& report) {
  const auto steps = report.pick<std::int64_t>(1000, 10'000, 100'000);
  const Scenario with = scenario(spatial_linkage(true), {.step = 1e-3}, steps), without = scenario(spatial_linkage(false), with.options, steps);
  Simulation simulation = simulation_of(with);
  std::vector<double> angles;
  const RunRecord record = run(simulation, steps, 1, [&](Simulation& now) { angles.push_back(coordinate(now, "crank_joint")); });
  Simulation twin = simulation_of(without);
  double off = 0, way = 0;
  for (std::size_t k = 1; k < angles.size(); ++k) {
    if (!twin.step().ok()) off = std::nan("");
    off = std::max(off, std::abs(coordinate(twin, "crank_joint") - angles[k]));
    way += std::abs(angles[k] - angles[k - 1]);
  }
  promise_conservation(report, record, steps, report.form() != Form::quick);
  promise_closed(report, record, with.options, 1, 3);
  report.at_most("crank off that of the same linkage, closed at the joint without its cross [rad]", off,
                 with.options.tolerance * std::sqrt(static_cast<double>(steps)) * way,
                 kOneMotion);
  report.note(fmt::format("{:.0f} rad of way", way));
}

/// Both crank and rod held in the plane by a pin that gives way; 0: it does not.
Model soft_four_bar(double stiffness, double damping) {
  TreeBuilder builder("four-bar");
  builder.add(bar("crank", "", {0, 0, 0}, {0, 0, 1}));
  builder.add(bar("coupler", "crank", {0, 0, 1}, {2, 0, 1}));
  builder.add(bar("rocker", "", {3, 0, 0}, {-1, 0, 2}));
  return coupled(builder.build(), {{.name = "pin",
                                    .kind = CouplingKind::ball,
                                    .link_a = "coupler",
                                    .link_b = "rocker",
                                    .at = PointAndAxis{{2, 0, 2}, {0, 1, 0}},
                                    .shift = {stiffness, damping}}});
}

void soft_to_rigid(Report& report) {
  double spread = 0, gain = -std::numeric_limits<double>::infinity(), band = 0, failed = 0;
  std::string told;
  for (const double h : {1e-3, 1e-2}) {
    for (const double time : {0.0, 1e-3}) {  // damping over stiffness
      const auto steps = std::llround(report.pick(1.0, 2.0, 2.0) / h);
      std::vector<double> rigid;
      double least = std::numeric_limits<double>::infinity(), most = 0;
      for (const double stiffness : {0.0, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10}) {
        const Scenario falling = scenario(soft_four_bar(stiffness, time * stiffness), {.step = h}, steps);
        Simulation simulation = simulation_of(falling);
        const double start = simulation.energy().total();
        double highest = 0;
        std::vector<double> angles;
        const RunRecord record = run(simulation, steps, 1, [&](Simulation& now) {
          angles.push_back(coordinate(now, "crank_joint"));
          highest = std::max(highest, now.energy().total() + now.effect_work().taken() - start);
        });
        failed += static_cast<double>(steps - record.steps);
        if (stiffness == 0) {
          rigid = angles;
          band = record.second_order / record.drift.scale();
          continue;
        }
        gain = std::max(gain, highest / record.drift.scale() / band);
        double off = 0;
        for (std::size_t k = 0; k < std::min(rigid.size(), angles.size()); ++k) off = std::max(off, std::abs(angles[k] - rigid[k]));
        least = std::min(least, off * stiffness);
        most = std::max(most, off * stiffness);
        if (time == 0) told += fmt::format("{}{:.0e} N/m at {:.0f} ms {:.1e} rad", told.empty() ? "" : ", ", stiffness, 1e3 * h, off);
      }
      spread = std::max(spread, most / least);
    }
  }
  report.at_most("steps that failed", failed, 0, "every step has a solution");
  report.at_most("stiffness x crank off the rigid loop's, 1e5 to 1e10 N/m: largest / smallest", spread, 1.1,
                 "a pin gives way by its force over its stiffness: ten times as stiff, a tenth off");
  report.at_most("energy gained, with what pins took / second order of the rigid loop", gain, 1, "a pin that gives way gives nothing");
  report.note(told);
}

// For long.

void long_four_bar(Report& report) {
  const auto steps = report.pick<std::int64_t>(3000, 50'000, 500'000);
  Scenario moving = scenario(four_bar(CouplingKind::hinge), {.step = 1e-3}, steps);
  moving.every = report.pick(1, 1, 5);
  const RunRecord record = run(moving);
  promise_conservation(report, record, steps, report.form() != Form::quick);
  promise_closed(report, record, moving.options, 1, 3);
}

}  // namespace

std::vector<Case> loop_cases() {
  return {
      {"loop-flat", "a parallelogram through its change points, where both its branches meet", parallelogram_passes, ""},
      {"loop-windows", "two four-bars beside each other through theirs: a published benchmark", 
       [](Report& r) { benchmark_windows(r, 2, CouplingKind::hinge, 1e-3, r.pick(2, 10, 20)); }, ""},
      {"loop-windows-40", "the benchmark with its 40: where they lie flat, one degree of freedom becomes 41",
       [](Report& r) { benchmark_windows(r, 40, CouplingKind::point_on_line, r.pick(4e-3, 4e-3, 2.5e-3), r.pick(0.8, 2.0, 10.0)); }, ""},
      {"loop-rank", "a slider-crank of equal arms, in which the rank of the rows falls twice a turn", slider_crank, ""},
      {"loop-redundant", "Bricard's loop of six hinges: one row follows from the others, always another one's share", bricard_loop, ""},
      {"loop-axes", "a four-bar whose axes are off by what files round", axes_off, ""},
      {"loop-too-short", "links that cannot meet", cannot_close, ""},
      {"loop-light-crank", "a four-bar whose crank weighs 1e-9 of the others",
       [](Report& r) { light_link(r, &Weights::crank, Pin::rocker_end); }, ""},
      {"loop-light-coupler", "a four-bar whose coupler weighs 1e-9 of the others",
       [](Report& r) { light_link(r, &Weights::coupler, Pin::rocker_foot); }, ""},
      {"loop-light-rocker", "a four-bar whose rocker weighs 1e-9 of the others",
       [](Report& r) { light_link(r, &Weights::rocker, Pin::crank_end); }, ""},
      {"loop-pins", "a four-bar of a coupler between links of a millionth, closed at each of its pins", every_pin,
       "A pin of the light link itself holds it by a row of whose motion a millionth is left. Beyond a share of 1e-9 such a row counts as held by the "
       "others, and steps are refused by the loop's name: close the loop at another pin."},
      {"loop-massless", "a spatial linkage with a universal joint's cross that weighs nothing", massless_in_loop, ""},
      {"loop-stiff", "a pin of 1e5 to 1e10 N/m in the place of a rigid one, at 1 and 10 ms", soft_to_rigid, ""},
      {"loop-long", "a four-bar for half a million steps: it must not come apart", long_four_bar, ""},
  };
}

}  // namespace linden

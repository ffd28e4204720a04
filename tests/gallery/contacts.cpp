// Bodies that touch: what rolls, spins, slides with much friction, stands, falls over and is struck.
//
// Energy is that of the motion from step to step: of the mean velocity of a step, and of weight at its middle. What is read after a step belongs to
// its end, half a step from where contact works. Rigid contact stores nothing to speak of, so it never rises.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "engine/scene/load_model.hpp"
#include "models/build/builder.hpp"
#include "models/shapes/convex_hull.hpp"
#include "models/shapes/pair_contact.hpp"
#include "tests/gallery/scenario.hpp"

namespace linden {
namespace {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kWeight = 9.81, kRigidContact = std::numeric_limits<double>::infinity();
const std::string kEveryStep = "every step has a solution";

struct Solid {
  LinkInertia inertia;
  ConvexShape shape{};
  Vector3d place = Vector3d::Zero();  // of its frame
  Matrix3d turn = Matrix3d::Identity();
  Vector3d of_shape = Vector3d::Zero();  // middle of the shape in its frame
  Vector3d velocity = Vector3d::Zero(), spin = Vector3d::Zero();  // in the world
};

Solid box(double mass, const Vector3d& size, const Vector3d& place, const Matrix3d& turn = Matrix3d::Identity()) {
  return {.inertia = box_inertia(mass, size, Vector3d::Zero()),
          .shape = {ConvexKind::box, {size.x() / 2, size.y() / 2, size.z() / 2}, 0},
          .place = place,
          .turn = turn};
}
Solid ball(double mass, double radius, const Vector3d& place) {
  return {.inertia = sphere_inertia(mass, radius, Vector3d::Zero()), .shape = {ConvexKind::point, {}, radius}, .place = place};
}

/// Loose solids above a floor at z = 0, all of which touch each other.
struct Things {
  std::vector<Solid> solids{};
  ContactMaterial material{};
  double step = 1e-3;
  Vector3d gravity{0, 0, -kWeight};
  double floor_thickness = 1;  // 0: none

  /// Down a plane that is inclined: the floor is what stays level.
  void incline(double angle) { gravity = kWeight * Vector3d(std::sin(angle), 0, -std::cos(angle)); }

  Simulation start() const {
    TreeBuilder builder("things");
    Effects effects;
    PairContact contact{.materials = {material}};
    if (floor_thickness > 0) {
      Pose pose;
      pose.shift = {0, 0, -floor_thickness / 2};
      contact.shapes.push_back({0, "floor", pose, {ConvexKind::box, {50, 50, floor_thickness / 2}, 0}});
    }
    std::vector<double> q, v;
    const auto append = [](std::vector<double>& to, const auto& numbers) { to.insert(to.end(), numbers.begin(), numbers.end()); };
    for (std::size_t k = 0; k < solids.size(); ++k) {
      const Solid& solid = solids[k];
      LinkSpec link;
      link.name = fmt::format("solid{}", k + 1);
      link.joint = link.name + "_joint";
      link.type = JointType::free;
      link.inertia = solid.inertia;
      Pose pose;
      std::ranges::copy(solid.of_shape, pose.shift.begin());
      contact.shapes.push_back({static_cast<Index>(k + 1), link.name, pose, solid.shape});
      builder.add(std::move(link));
      append(q, solid.place);
      append(q, Quaterniond(solid.turn).coeffs());
      append(v, Vector3d(solid.turn.transpose() * solid.spin));
      append(v, Vector3d(solid.turn.transpose() * solid.velocity));
    }
    for (std::uint32_t a = 0; a < contact.shapes.size(); ++a) {
      for (std::uint32_t b = a + 1; b < contact.shapes.size(); ++b) contact.pairs.emplace_back(a, b);
    }
    effects.contact = std::move(contact);
    Simulation simulation(builder.build(), {.step = step, .gravity = {gravity.x(), gravity.y(), gravity.z()}}, effects);
    simulation.set_positions(q);
    simulation.set_velocities(v);
    return simulation;
  }
};

/// The last step of a run.
class Motion {
 public:
  Motion(const Things& things, const Simulation& simulation) : things_(things), simulation_(simulation), now_(copy()) {}

  void look() {
    before_ = std::move(now_);
    now_ = copy();
  }
  Vector3d place(std::size_t k) const { return Vector3d(&now_[7 * k]); }
  Matrix3d turn(std::size_t k) const { return quaternion(now_, k).toRotationMatrix(); }
  /// Mean of the step, in the world.
  Vector3d velocity(std::size_t k) const { return (Vector3d(&now_[7 * k]) - Vector3d(&before_[7 * k])) / things_.step; }
  /// Likewise, in the solid's frame.
  Vector3d spin(std::size_t k) const {
    const Quaterniond turned = quaternion(before_, k).conjugate() * quaternion(now_, k);
    const double sine = turned.vec().norm();
    if (sine == 0) return Vector3d::Zero();
    return 2 * std::atan2(sine, std::abs(turned.w())) / (sine * things_.step) * (turned.w() < 0 ? -1.0 : 1.0) * turned.vec();
  }
  double kinetic() const {
    double sum = 0;
    for (std::size_t k = 0; k < things_.solids.size(); ++k) {
      const LinkInertia& inertia = things_.solids[k].inertia;
      const Vector3d moved = center(now_, k) - center(before_, k), turns = spin(k);
      sum += 0.5 * inertia.mass * moved.squaredNorm() / (things_.step * things_.step) + 0.5 * turns.dot(inertia.about_center * turns);
    }
    return sum;
  }
  double energy() const {
    double sum = kinetic();
    for (std::size_t k = 0; k < things_.solids.size(); ++k) {
      sum -= 0.5 * things_.solids[k].inertia.mass * things_.gravity.dot(center(now_, k) + center(before_, k));
    }
    return sum;
  }

 private:
  std::vector<double> copy() const { return {simulation_.positions().begin(), simulation_.positions().end()}; }
  static Quaterniond quaternion(const std::vector<double>& q, std::size_t k) { return Quaterniond(&q[7 * k + 3]); }
  Vector3d center(const std::vector<double>& q, std::size_t k) const {
    return Vector3d(&q[7 * k]) + quaternion(q, k) * things_.solids[k].inertia.center;
  }

  const Things& things_;
  const Simulation& simulation_;
  std::vector<double> before_, now_;
};

struct Ran {
  std::int64_t failed = 0, split = 0;
  double gain = 0;     // of energy since the first step, the largest [J]
  double most = 0;     // kinetic energy, the largest [J]
  double first = 0, last = 0;  // energy of the first and of the last step [J]
  double told = 0;     // by which the energy that is told rises above what was told at the start [J]
  std::string failure;
};

Ran run_things(const Things& things, double time, const std::function<void(const Motion&, double)>& watch = {}) {
  Simulation simulation = things.start();
  Motion motion(things, simulation);
  Ran ran;
  const auto steps = static_cast<std::int64_t>(std::lround(time / things.step));
  const double start = simulation.energy().total();
  for (std::int64_t k = 0; k < steps; ++k) {
    const StepReport report = simulation.step();
    if (!report.ok()) {
      ran.failed = 1;
      ran.failure = fmt::format("step {}: {}", k + 1, simulation.describe(report));
      break;
    }
    ran.split += report.substeps > 1;
    motion.look();
    ran.last = motion.energy();
    if (k == 0) ran.first = ran.last;
    ran.gain = std::max(ran.gain, ran.last - ran.first);
    ran.most = std::max(ran.most, motion.kinetic());
    ran.told = std::max(ran.told, simulation.energy().total() - start);
    if (watch) watch(motion, simulation.time());
  }
  return ran;
}

/// Of several runs: steps that were refused; largest gain beside the largest kinetic energy of its run.
struct Tally {
  std::int64_t refused = 0, split = 0;
  double gain = 0;

  void add(const Ran& ran, Report& report, const std::string& what) {
    refused += ran.failed;
    split += ran.split;
    gain = std::max(gain, ran.gain / std::max(ran.most, std::numeric_limits<double>::min()));
    if (!ran.failure.empty()) report.note(what + ": " + ran.failure);
  }
};

void promise_steps(Report& report, std::int64_t refused) { report.at_most("steps refused", static_cast<double>(refused), 0, kEveryStep); }

// What rolls and spins.

/// A disc without thickness, whose middle rests and whose lowest point runs round at Omega^2 sin(alpha) = 4 g / r.
void euler_disk(Report& report) {
  const double radius = 0.0375, mass = 0.4, tilt = 0.3, rate = std::sqrt(4 * kWeight / (radius * std::sin(tilt)));
  Things things{.material = {.friction = 0.3}, .step = 1e-3};
  Solid disc{.inertia = {mass, Vector3d::Zero(), Vector3d(0.25, 0.25, 0.5).asDiagonal()}, .shape = {ConvexKind::cylinder, {radius, 0, 0}, 0}};
  disc.inertia.about_center *= mass * radius * radius;
  disc.turn = AngleAxisd(tilt, Vector3d::UnitY()).toRotationMatrix();
  disc.place = {0, 0, radius * std::sin(tilt)};
  disc.spin = -rate * std::sin(tilt) * disc.turn.col(0);
  things.solids = {disc};
  double angle = 0, off = 0, sank = 0;
  const Ran ran = run_things(things, report.pick(0.5, 5.0, 50.0), [&](const Motion& now, double time) {
    const Vector3d axis = now.turn(0).col(2);
    const double sine = std::hypot(axis.x(), axis.y()), next = std::atan2(axis.y(), axis.x());
    const double runs = std::remainder(next - angle, 2 * std::numbers::pi) / things.step;
    angle = next;
    if (time > 2 * things.step) off = std::max(off, std::abs(runs * runs * sine * radius / (4 * kWeight) - 1));
    sank = std::max(sank, radius * sine - now.place(0).z());
  });
  promise_steps(report, ran.failed);
  const double turn = rate * things.step;
  report.at_most("|Omega^2 sin(alpha) r / 4 g - 1|", off, turn * turn, "second order: the square of what it turns in a step");
  report.at_most("|energy - first| / first", std::abs(ran.last / ran.first - 1), turn * turn, "rolling takes nothing: it goes on so for ever");
  report.at_most("sinks [m]", sank, 1e-6, "the place that lies lowest is held, not a point of the rim that would turn on");
}

/// Mass, shape and inertia of Kane and Levinson's.
///
/// source  Kane, Levinson, Realistic mathematical modeling of the rattleback, Int. J. Non-Linear Mechanics 17 (1982)
void rattleback(Report& report) {
  const auto spun = [&](double spin, double& least, double& most) {
    Things things{.material = {.friction = 2}, .step = report.pick(1e-3, 5e-4, 1e-4)};
    Matrix3d moments;
    moments << 2e-4, -2e-5, 0, -2e-5, 1.6e-3, 0, 0, 0, 1.7e-3;
    Solid stone{.inertia = {1, Vector3d::Zero(), moments}, .shape = {ConvexKind::ellipsoid, {0.2, 0.03, 0.02}, 0}};
    stone.of_shape = {0, 0, 0.01};
    stone.place = {0, 0, 0.01};
    stone.turn = AngleAxisd(0.5 * std::numbers::pi / 180, Vector3d::UnitX()).toRotationMatrix();
    stone.spin = {0, 0, spin};
    things.solids = {stone};
    return run_things(things, report.pick(0.5, 5.5, 5.5), [&](const Motion& now, double) {
      const double yaws = (now.turn(0) * now.spin(0)).z();
      least = std::min(least, yaws);
      most = std::max(most, yaws);
    });
  };
  double least = 9, most = -9, least_back = 9, most_back = -9;
  const Ran one = spun(5, least, most), other = spun(-5, least_back, most_back);
  promise_steps(report, one.failed + other.failed);
  report.at_least("slowest of 5 rad/s, spun its way [rad/s]", least, 4.9, "this way it rolls on");
  if (report.form() != Form::quick) {
    report.at_least("spun against it, it turns back with [rad/s]", most_back, 0.5, "rocking takes its spin, and gives it back the other way");
  }
  report.at_most("energy gained / kinetic", std::max(one.gain / one.most, other.gain / other.most), 0.01,
                 "second order in the rocking, whose period is 0.1 s");
  report.note(fmt::format("of 5 and -5 rad/s energy goes from {:.5f} to {:.5f} and {:.5f} J", one.first, one.last, other.last));
}

/// A ball whose mass lies below its middle, spun: it turns over. L.r, r from the mass to where it touches, is kept by whatever force acts there.
///
/// source  Jellett 1872; sizes of Rauch-Wojciechowski, Skoeldstam, Glad, Mathematical analysis of the tippe top, Regular and Chaotic Dynamics 10
///         (2005)
void tippe_top(Report& report) {
  const double radius = 0.02, mass = 0.02, below = 0.15 * radius;
  Things things{.material = {.friction = 0.3}, .step = report.pick(1e-3, 5e-4, 1e-4)};
  Solid top{.inertia = {mass, {0, 0, -below}, Vector3d(131.0 / 350, 131.0 / 350, 0.4).asDiagonal()}, .shape = {ConvexKind::point, {}, radius}};
  top.inertia.about_center *= mass * radius * radius;
  top.place = {0, 0, radius};
  top.turn = AngleAxisd(0.3, Vector3d::UnitY()).toRotationMatrix();
  top.spin = {0, 0, 155};
  things.solids = {top};
  double first = 0, off = 0, upright = 1;
  const Ran ran = run_things(things, report.pick(0.2, 3.0, 10.0), [&](const Motion& now, double) {
    const Matrix3d turn = now.turn(0);
    const Vector3d momentum = turn * (top.inertia.about_center * now.spin(0)), to_floor = Vector3d(0, 0, -radius) - turn * top.inertia.center;
    const double jellett = momentum.dot(to_floor);
    if (first == 0) first = jellett;
    off = std::max(off, std::abs(jellett / first - 1));
    upright = turn(2, 2);
  });
  promise_steps(report, ran.failed);
  report.at_most("|Jellett's constant - first| / first", off, 155 * things.step * 0.3 * 0.3,
                 "first order while it slides: what it turns in a step, tilted by 0.3");
  report.at_most("energy gained / first", ran.gain / ran.first, 1e-6, "friction takes");
  if (report.form() != Form::quick) report.at_most("cosine of its axis in the end", upright, -0.95, "it stands on its head");
}

/// What rolls down a slope without slipping: by 1 / (1 + I / m r^2) of what slides.
void rolls_down(Report& report) {
  double off = 0, sank = 0;
  std::int64_t refused = 0;
  for (const double angle : {0.1, 0.3}) {
    for (const bool round : {true, false}) {
      Things things{.material = {.friction = 0.8}};
      things.incline(angle);
      Solid solid = ball(1, 0.1, {0, 0, 0.1});
      if (!round) {
        solid.inertia.about_center = Vector3d(0.01, 0.01, 0.005).asDiagonal();
        solid.shape = {ConvexKind::cylinder, {0.1, 0, 0.1}, 0};
        solid.turn = AngleAxisd(std::numbers::pi / 2, Vector3d::UnitX()).toRotationMatrix();
      }
      things.solids = {solid};
      double way = 0;
      const double time = report.pick(0.2, 2.0, 5.0);
      refused += run_things(things, time, [&](const Motion& now, double) {
                   way = now.place(0).x();
                   sank = std::max(sank, 0.1 - now.place(0).z());
                 }).failed;
      const double expected = (round ? 5.0 / 14 : 1.0 / 3) * kWeight * std::sin(angle) * time * time, turn = 2 * expected / time / 0.1 * things.step;
      off = std::max(off, std::abs(way / expected - 1) / (turn * turn));
    }
  }
  promise_steps(report, refused);
  report.at_most("|way / (1/2 a t^2) - 1| / square of the turn in a step", off, 0.25, "second order; a twelfth as long as it only rolls");
  report.at_most("sinks [m]", sank, 1e-8, "a cylinder rolls on its lowest line as a ball does on its lowest place");
}

// What slides.

/// A rod that slides on its lower end as it leans: beyond mu = (1 + 3 cos^2) / 3 sin cos there is no finite force, or two, and it jams.
void painleve(Report& report) {
  Tally tally;
  const double half = 0.5;
  for (const double step : {1e-3, 1e-2}) {
    for (const double friction : {0.3, 1.0, 1.5, 2.0, 3.0}) {
      for (const double degrees : {30.0, 45.0, 50.0, 60.0}) {
        for (const double speed : {-3.0, -0.5, 0.5, 3.0}) {
          if (report.form() == Form::quick && degrees != 50.0) continue;
          for (const bool edge : {false, true}) {
            Things things{.material = {.friction = friction}, .step = step};
            const double lean = degrees * std::numbers::pi / 180, thick = 0.02;
            Solid rod{.inertia = {1, Vector3d::Zero(), Vector3d(half * half / 3, half * half / 3, 1e-4).asDiagonal()}};
            rod.shape = edge ? ConvexShape{ConvexKind::box, {thick / 2, thick / 2, half}, 0} : ConvexShape{ConvexKind::segment, {0, 0, half}, thick};
            rod.place = {0, 0, half * std::sin(lean) + (edge ? thick / 2 * std::cos(lean) : thick)};
            rod.turn = AngleAxisd(std::numbers::pi / 2 - lean, Vector3d::UnitY()).toRotationMatrix();
            rod.velocity = {speed, 0, 0};
            things.solids = {rod};
            tally.add(run_things(things, report.pick(0.1, 1.0, 2.0)), report,
                      fmt::format("mu {} at {} degrees and {} m/s, h = {} s, on an {}", friction, degrees, speed, step, edge ? "edge" : "end"));
          }
        }
      }
    }
  }
  promise_steps(report, tally.refused);
  report.at_most("energy gained / kinetic", tally.gain, 1e-3, "none but what weight and a jerk make in a step of 10 ms");
  report.note(fmt::format("{} steps split", tally.split));
}

/// Coulomb's law at 0.9 and 1.1 of the angle of friction.
void slope(Report& report) {
  double creeps = 0, off = 0;
  std::int64_t refused = 0;
  const double time = report.pick(0.5, 5.0, 10.0);
  for (const double step : {1e-3, 1e-2}) {
    for (const double friction : {0.2, 1.0}) {
      for (const double share : {0.9, 1.1}) {
        Things things{.material = {.friction = friction}, .step = step};
        const double angle = std::atan(share * friction);
        things.incline(angle);
        things.solids = {box(1, {0.2, 0.2, 0.1}, {0, 0, 0.05})};
        double way = 0;
        refused += run_things(things, time, [&](const Motion& now, double) { way = now.place(0).x(); }).failed;
        if (share < 1) creeps = std::max(creeps, way / time);
        else off = std::max(off, std::abs(way / (0.5 * kWeight * (std::sin(angle) - friction * std::cos(angle)) * time * time) - 1));
      }
    }
  }
  promise_steps(report, refused);
  report.at_most("creeps at 0.9 of the angle [m/s]", creeps, 0.9e-7 * 1.01, "0.9 of a tenth of a micrometre a second");
  report.at_most("|way / Coulomb's - 1| at 1.1 of it", off, 1e-4, "sliding evenly is exact but for the creep it starts from");
}

// What stands.

/// Boxes on each other, each with twice the mass of the one below.
void doubling_stack(Report& report) {
  std::int64_t refused = 0;
  for (const auto& [stiffness, called] : {std::pair(1e6, "1e6 N/m"), std::pair(1e9, "1e9 N/m"), std::pair(kRigidContact, "rigid")}) {
    Things things{.material = {.stiffness = stiffness, .damping = stiffness == 1e6 ? 2e4 : 0, .friction = 0.5}, .step = 2e-3};
    for (int k = 0; k < 10; ++k) things.solids.push_back(box(std::pow(2, k), {0.2, 0.2, 0.2}, {0, 0, 0.1 + 0.2 * k}));
    Vector3d then, now;
    const double time = report.pick(0.4, 10.0, 20.0);
    const Ran ran = run_things(things, time, [&](const Motion& motion, double at) {
      now = motion.place(9);
      if (at <= time / 2) then = now;
    });
    refused += ran.failed;
    // each of ten floors is pressed by all that stands on it, at four corners
    double pressed = 0;
    for (int k = 0; k < 10; ++k) pressed += kWeight * (1024 - std::pow(2, k)) / 4;
    const double sinks = 1.9 - now.z();
    if (report.form() == Form::quick) continue;
    if (stiffness == kRigidContact) {
      report.at_most("rigid: the top sinks [m]", sinks, 1e-6, "a hundred thousandth of what falls in a step, at each of ten");
    } else {
      report.at_most(fmt::format("{}: |sinking / weight over stiffness - 1|", called), std::abs(sinks * stiffness / pressed - 1), 1e-6,
                     "springs in a row");
    }
    report.at_most(fmt::format("{}: the top moves in the second half [m]", called), (now - then).norm(), stiffness == 1e6 ? 1e-6 : 1e-9, "it stands");
  }
  promise_steps(report, refused);
}

/// A heavy box on one of 1 kg, rigid, laid on it off its middle and dropped.
void heavy_on_light(Report& report) {
  std::int64_t refused = 0;
  for (const double mass : {1e3, 1e4}) {
    double sinks = 0, moves = 0;
    for (const double fall : {0.0, 0.1}) {
      Things things{.material = {.friction = 0.5}};
      things.solids = {box(1, {0.2, 0.2, 0.2}, {0, 0, 0.1}), box(mass, {0.2, 0.2, 0.2}, {0.03, 0.02, 0.3 + fall})};
      Vector3d then, now;
      const double time = report.pick(0.4, 3.0, 10.0);
      refused += run_things(things, time, [&](const Motion& motion, double at) {
                   now = motion.place(1);
                   if (at <= time / 2) then = now;
                 }).failed;
      sinks = std::max(sinks, 0.3 - now.z());
      moves = std::max(moves, (now - then).norm());
    }
    const std::string ratio = fmt::format("{:.0e} to 1: ", mass);
    report.at_most(ratio + "sinks [m]", sinks, mass * kWeight * 1e-6 / 1e5, "rigid by the lighter of both: 1e-5 g h^2 for each of its weights");
    if (report.form() != Form::quick) report.at_most(ratio + "moves in the second half [m]", moves, 1e-9, "it stands");
  }
  promise_steps(report, refused);
}

/// A half ring of wedges on the floor stands where it is thicker than 0.1075 of its mean radius, and else falls by four hinges and a fifth.
///
/// source  Couplet 1730; Milankovitch 1907; Ochsendorf, The masonry arch on spreading supports, The Structural Engineer 84 (2006)
void arch(Report& report) {
  constexpr int kWedges = 15;
  std::int64_t refused = 0;
  const auto settles = [&](double thickness, double& last_half) {
    Things things{.material = {.friction = 0.8}, .step = 2e-3};
    for (int k = 0; k < kWedges; ++k) {
      const double half = std::numbers::pi / (2 * kWedges), middle = (2 * k + 1) * half, sine = std::sin(half), cosine = std::cos(half);
      const double inner = 1 - thickness / 2, outer = 1 + thickness / 2, height = thickness * cosine;
      const double center = inner * cosine + height / 3 * (inner + 2 * outer) / (inner + outer);
      std::vector<Vector3d> corners;
      for (const double radius : {inner, outer}) {
        for (const double side : {-1.0, 1.0}) {
          for (const double y : {-0.1, 0.1}) corners.emplace_back(radius * cosine - center, y, side * radius * sine);
        }
      }
      Solid wedge{.inertia = box_inertia(1000 * 0.2 * height * (inner + outer) * sine, {height, 0.2, (inner + outer) * sine}, Vector3d::Zero())};
      wedge.shape = {ConvexKind::hull, {}, 0, convex_hull(corners)};
      wedge.turn = AngleAxisd(-middle, Vector3d::UnitY()).toRotationMatrix();
      wedge.place = center * Vector3d(std::cos(middle), 0, std::sin(middle));
      things.solids.push_back(wedge);
    }
    double height = 0, then = 0;
    const double time = report.pick(0.1, 2.0, 10.0);
    const Ran ran = run_things(things, time, [&](const Motion& now, double at) {
      height = now.place(kWedges / 2).z();
      if (at <= time / 2) then = height;
    });
    refused += ran.failed;
    last_half = (then - height) / (time / 2);
    return things.solids[kWedges / 2].place.z() - height;
  };
  double creeps = 0, none = 0;
  const double stood = settles(0.11, creeps);
  report.at_most("0.11 of the radius: the crown sinks by [m]", stood, 1e-4, "it stands");
  report.at_most("and creeps at [m/s]", creeps, 5e-7, "a few of its joints at a tenth of a micrometre a second");
  if (report.form() != Form::quick) {
    report.at_least("0.105 of the radius: it falls by [m]", settles(0.105, none), 0.5, "thinner than 0.1075 no line of thrust lies within it");
  }
  promise_steps(report, refused);
}

// Of generated models, which stand or come to rest.

struct Settled {
  std::int64_t refused = 0;
  double moved = 0, last_quarter = 0, fastest = 0;  // of the places of all solids [m], [m/s]
  double told = 0;                                  // by which the energy that is told exceeds that of the start [J]
  double weighed = 0;                               // of the start [J]
  std::vector<double> turned;                       // from how each began [rad]
};

Settled settle(const std::string& name, double friction, double stiffness, double step, double time) {
  const Model model = load_model(name, std::nullopt);
  std::vector<std::string> notes;
  Effects effects;
  effects.contact = pair_contact_of(model, notes);
  effects.contact->materials = {{.stiffness = stiffness, .friction = friction}};
  Simulation simulation(model, {.step = step}, effects);
  const auto copy = [&] { return std::vector<double>(simulation.positions().begin(), simulation.positions().end()); };
  const std::vector<double> start = copy();
  std::vector<double> later;
  Settled settled;
  settled.weighed = std::abs(simulation.energy().total());
  const double begin = simulation.energy().total();
  const auto steps = static_cast<std::int64_t>(std::lround(time / step));
  for (std::int64_t k = 0; k < steps && settled.refused == 0; ++k) {
    settled.refused += !simulation.step().ok();
    settled.told = std::max(settled.told, simulation.energy().total() - begin);
    if (k == steps * 3 / 4) later = copy();
  }
  const std::vector<double> now = copy();
  const auto farthest = [&](const std::vector<double>& from) {
    double most = 0;
    for (std::size_t at = 0; at + 7 <= from.size(); at += 7) most = std::max(most, (Vector3d(&now[at]) - Vector3d(&from[at])).norm());
    return most;
  };
  settled.moved = farthest(start);
  settled.last_quarter = farthest(later);
  for (const double v : simulation.velocities()) settled.fastest = std::max(settled.fastest, std::abs(v));
  for (std::size_t at = 3; at + 4 <= now.size(); at += 7) settled.turned.push_back(Quaterniond(&now[at]).angularDistance(Quaterniond(&start[at])));
  return settled;
}

void cards(Report& report) {
  const double time = report.pick(0.05, 3.0, 10.0), step = 2e-3;
  const Settled house = settle("cards:3", 0.6, kRigidContact, step, time);
  promise_steps(report, house.refused);
  report.at_most("farthest that a card moved / time [m/s]", house.moved / time, 1e-6, "a few of its edges creep at a tenth of a micrometre a second");
  if (report.form() == Form::quick) return;
  const Settled falls = settle("cards:1", 0.3, kRigidContact, step, 1);
  report.at_least("at a friction below the tangent of the lean a card turns by [rad]", *std::ranges::max_element(falls.turned), 0.5, "it falls");
}

void wall(Report& report) {
  const double step = 2e-3;
  const Settled bricks = settle("wall:30", 0.6, kRigidContact, step, report.pick(0.08, 1.0, 10.0));
  promise_steps(report, bricks.refused);
  report.at_most("farthest that a brick moved [m]", bricks.moved, 1e-7, "rigid: a hundred thousandth of what falls in a step, at each course");
  report.at_most("fastest in the end [m/s]", bricks.fastest, 1e-9, "it stands, once what it settled by in its first ten steps has died away");
}

void heap(Report& report) {
  const double step = 5e-3;
  const Settled boxes = settle("pile:30", 0.6, kRigidContact, step, report.pick(0.05, 5.0, 20.0));
  promise_steps(report, boxes.refused);
  report.at_most("energy above that of the start / it", boxes.told / boxes.weighed, 1e-3, "blows take, and friction takes");
  if (report.form() == Form::quick) return;
  report.at_most("farthest that a box moved in the last quarter / time [m/s]", boxes.last_quarter / (0.25 * report.pick(0.05, 5.0, 20.0)), 1e-5,
                 "at rest, but for a tenth of a micrometre a second at each of what leans on each other");
}

void dominoes(Report& report) {
  const Index count = report.pick<Index>(2, 12, 30);
  const Settled row = settle(fmt::format("dominoes:{}", count), 0.3, kRigidContact, 2e-3, report.pick(0.05, 2.0, 4.0));
  promise_steps(report, row.refused);
  report.at_most("energy above that of the start / it", row.told / row.weighed, 1e-3, "falling gives none");
  if (report.form() == Form::quick) return;
  report.at_least("least that one turned [rad]", *std::ranges::min_element(row.turned), 0.5, "all fall, the last too");
}

// What is struck.

/// Five balls in a row that touch, one of which strikes at 1 m/s.
void cradle(Report& report) {
  std::int64_t refused = 0;
  const auto strike = [&](const ContactMaterial& material, double gap, double step, double time) {
    Things things{.material = material, .step = step, .gravity = Vector3d::Zero(), .floor_thickness = 0};
    for (int k = 0; k < 5; ++k) things.solids.push_back(ball(1, 0.05, {(0.1 + gap) * k - (k == 0 ? 0.01 : 0), 0, 0}));
    things.solids[0].velocity = {1, 0, 0};
    std::array<double, 5> speeds{};
    const Ran ran = run_things(things, time, [&](const Motion& now, double) {
      for (std::size_t k = 0; k < 5; ++k) speeds[k] = now.velocity(k).x();
    });
    refused += ran.failed;
    return speeds;
  };
  const auto told = [&](const std::string& what, const std::array<double, 5>& v) {
    report.note(fmt::format("{}: {:.3f} {:.3f} {:.3f} {:.3f} {:.3f} m/s", what, v[0], v[1], v[2], v[3], v[4]));
  };
  const auto closed = strike({.friction = 0, .restitution = 1}, 0, 1e-3, 0.1),
             open = strike({.friction = 0, .restitution = 1}, 2e-3, 1e-3, 0.1);
  double off = 0, off_open = 0, momentum = 0;
  for (std::size_t k = 0; k < 5; ++k) {
    off = std::max(off, std::abs(closed[k] - (k == 0 ? -0.6 : 0.4)));
    off_open = std::max(off_open, std::abs(open[k] - (k == 4 ? 1 : 0)));
    momentum += closed[k];
  }
  report.at_most("rigid, closed: |speed - Newton's law of one blow| [m/s]", off, 1e-4,
                 "all parts at once: one ball back at 0.6, four on at 0.4; no wave runs through what does not yield");
  report.at_most("rigid, 2 mm apart: |speed - that of the last ball alone| [m/s]", off_open, 1e-4, "blow after blow, each in a step of its own");
  report.at_most("|momentum - 1| [kg m/s]", std::abs(momentum - 1), 1e-10, "a step is solved to so much");
  told("rigid, closed", closed);
  const auto springs = strike({.stiffness = 1e5, .friction = 0}, 0, 2e-5, 0.05);
  promise_steps(report, refused);
  report.at_least("springs of 1e5 N/m: the last ball goes [m/s]", springs[4], 0.8, "a wave, which linear springs disperse");
  told("springs of 1e5 N/m, h = 0.02 ms", springs);
}

/// A box that falls on its corner, with a sideways speed.
void stiffnesses(Report& report) {
  Tally tally;
  double told = 0;
  for (const double step : {1e-4, 1e-3, 1e-2}) {
    if (step == 1e-4 && report.form() == Form::quick) continue;
    for (const double stiffness : {1e3, 1e5, 1e7, 1e9, 1e11, kRigidContact}) {
      for (const double damped : {0.0, 1e-3}) {
        if (damped > 0 && stiffness == kRigidContact) continue;
        Things things{.material = {.stiffness = stiffness, .damping = damped > 0 ? damped * stiffness : 0, .friction = 0.5}, .step = step};
        things.solids = {box(1, {0.2, 0.2, 0.2}, {0, 0, 0.4}, AngleAxisd(0.4, Vector3d(1, 2, 3).normalized()).toRotationMatrix())};
        things.solids[0].velocity = {0.5, 0, 0};
        const Ran ran = run_things(things, report.pick(0.3, step < 1e-3 ? 0.5 : 2.0, 5.0));
        tally.add(ran, report, fmt::format("{:.0e} N/m at {} s", stiffness, step));
        told = std::max(told, ran.told / ran.most);
      }
    }
  }
  promise_steps(report, tally.refused);
  report.at_most("energy that is told above that of the start / kinetic", told, 1e-3, "passive: none but what weight makes in a step of 10 ms");
  report.note(fmt::format("{} steps split", tally.split));
}

/// A ball, a box and a plate fly at a wall of 5 mm, at up to 1 km/s: a metre a step.
void thin_wall(Report& report) {
  std::int64_t refused = 0;
  double deepest = 0;
  for (const double speed : {1.0, 10.0, 100.0, 1000.0}) {
    for (const double thick : {0.1, 0.002}) {
      for (const bool round : {false, true}) {
        if (round && thick < 0.1) continue;
        Things things{.material = {.friction = 0.5}, .gravity = Vector3d::Zero(), .floor_thickness = 5e-3};
        // it flies for two steps before it can meet the wall
        const double away = thick / 2 + 2.5 * speed * things.step;
        things.solids = {round ? ball(1, thick / 2, {0, 0, away}) : box(1, {0.1, 0.1, thick}, {0, 0, away})};
        things.solids[0].velocity = {0, 0, -speed};
        refused += run_things(things, 0.02, [&](const Motion& now, double) { deepest = std::max(deepest, thick / 2 - now.place(0).z()); }).failed;
      }
    }
  }
  promise_steps(report, refused);
  report.at_most("deepest in the wall [m]", deepest, 1e-4, "what moved far in a step is looked for twice as far ahead, and stopped where it meets the wall");
}

}  // namespace

std::vector<Case> contact_cases() {
  return {
      {"touch-disk", "Euler's disk: its lowest point runs round eight times a second, and all of it rolls", euler_disk,
       "Held by points of its rim, which turn on, it sank by 4 cm in 8 s, or gained a fifth of its energy. What holds it is the place that lies "
       "lowest at the end of a step, and what sticks is that of its middle."},
      {"touch-rattleback", "an ellipsoid that will spin one way only", rattleback, ""},
      {"touch-tippe", "a spun ball whose mass lies low turns over, and L.r is kept (Jellett)", tippe_top, ""},
      {"touch-rolls", "a ball and a cylinder roll down a slope", rolls_down, "A cylinder sank by 3 cm in 2 s, as the disk did."},
      {"touch-painleve", "a rod slides with a friction at which no finite force does (Painleve)", painleve,
       "Loads that friction goes by swung without end, or grew by a little a round, and steps were refused. How far they go in a round follows from how "
       "the last two changed."},
      {"touch-slope", "a box at 0.9 and 1.1 of the angle of friction", slope, ""},
      {"touch-doubling", "ten boxes, each twice as heavy as the one below", doubling_stack, ""},
      {"touch-heavy", "1,000 and 10,000 kg on 1 kg", heavy_on_light, ""},
      {"touch-arch", "fifteen wedges stand as an arch, just", arch, ""},
      {"touch-cards", "a house of cards of three storeys", cards, ""},
      {"touch-wall", "thirty bricks", wall, ""},
      {"touch-heap", "thirty boxes fall on a heap", heap, ""},
      {"touch-dominoes", "a row of dominoes falls", dominoes, ""},
      {"touch-cradle", "Newton's cradle: who moves, where all balls touch?", cradle, ""},
      {"touch-stiff", "a box falls on contacts of 1e3 to 1e11 N/m and rigid ones, at 0.1 to 10 ms", stiffnesses, ""},
      {"touch-thin", "a wall of 5 mm is met at 1 m a step", thin_wall, ""},
  };
}

}  // namespace linden

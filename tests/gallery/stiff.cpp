// Springs, dampers, servos and ground from soft to 1e9, at steps far beyond their time constants.
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "models/build/builder.hpp"
#include "models/build/generators.hpp"
#include "tests/gallery/models.hpp"
#include "tests/gallery/scenario.hpp"

namespace linden {
namespace {

const std::vector<double> kStiffnesses{1, 1e3, 1e6, 1e9};
constexpr double kLength = 0.1;  // of a link [m]
constexpr double kSpreadOfStart = 0.2;  // of the start [rad, rad/s]

/// Weight acts at the ends of a step, and the middle of a parabola lies h^2 g / 8 beside its chord: that share of a link's
/// length.
const double kSag = 0.01 * 0.01 * 9.81 / (8 * kLength);
const std::string kWhySag = "passive: none but what weight makes in a step of 10 ms, h^2 g / 8 l";

/// Three links of a gram to a hundred grams, hinged, under weight.
Model light_arm() {
  return hinged_chain("light arm", 3, kLength, [](Index i) { return rod(0.1 * std::pow(0.1, i), kLength); });
}

struct Gained {
  double most = -std::numeric_limits<double>::infinity();  // energy above that of the start, the largest [J]
  double scale = 0;                                        // energy of the start, or the largest kinetic energy [J]
  std::string failure;
};

/// energy(): of the motion, asked at the start and after every step. Everything here is passive, so the energy of the start, that of
/// springs and servos included, is all there ever is.
template <class EnergyNow>
Gained gain_of(Simulation& simulation, std::int64_t steps, const EnergyNow& energy) {
  Gained gained;
  const double start = energy().total();
  for (std::int64_t k = 0; k < steps; ++k) {
    const StepReport step = simulation.step();
    if (!step.ok()) {
      gained.failure = simulation.describe(step);
      gained.most = std::nan("");
      break;
    }
    const Energy now = energy();
    gained.most = std::max(gained.most, now.total() - start);
    gained.scale = std::max(gained.scale, now.kinetic);
  }
  return gained;
}

/// Energy of the motion from step to step, its mean speed in the middle of the way: what is read off after a step, from momenta
/// with the push of one end in them, says nothing of a joint that a stiff thing stopped within that step.
Gained gain(const Scenario& scenario) {
  Simulation simulation = simulation_of(scenario);
  Effects conservative;
  conservative.springs = scenario.effects.springs;
  for (const Servo& servo : scenario.effects.servos) conservative.springs.push_back({servo.row, servo.stiffness, servo.target});
  Simulation ruler(scenario.model, scenario.options, conservative);
  std::vector<double> before, middle(simulation.positions().begin(), simulation.positions().end()), speed = simulation.velocities();
  double start = 0;
  const auto energy = [&] {
    const std::span<const double> now = simulation.positions();
    for (std::size_t row = 0; row < before.size(); ++row) {
      middle[row] = 0.5 * (before[row] + now[row]);
      speed[row] = (now[row] - before[row]) / scenario.options.step;
    }
    const bool first = before.empty();
    before.assign(now.begin(), now.end());
    ruler.set_positions(middle);
    ruler.set_velocities(speed);
    if (first) start = ruler.energy().total();
    return ruler.energy();
  };
  Gained gained = gain_of(simulation, scenario.steps, energy);
  gained.scale = std::max(gained.scale, std::abs(start));
  return gained;
}

/// The same of a body on the ground, whose speeds are read well.
Gained gain_on_ground(const Scenario& scenario) {
  Simulation simulation = simulation_of(scenario);
  return gain_of(simulation, scenario.steps, [&] { return simulation.energy(); });
}

/// Runs the same scene with every stiffness at 1 and 10 ms; make(k) gives the effects.
template <class Make>
void over_stiffnesses(Report& report, const Model& model, const std::string& what, const Make& make) {
  const auto steps = report.pick<std::int64_t>(300, 5000, 100'000);
  std::string told;
  double worst = -std::numeric_limits<double>::infinity();
  for (const double h : {1e-3, 1e-2}) {
    for (const double k : kStiffnesses) {
      Scenario pulled = scenario(model, {.step = h}, steps);
      pulled.effects = make(k);
      pulled.start = random_state(*pulled.model, 1, kSpreadOfStart);
      const Gained gained = pulled.effects.ground ? gain_on_ground(pulled) : gain(pulled);
      worst = std::max(worst, gained.most / gained.scale);
      if (std::isnan(gained.most)) {
        worst = gained.most;
        report.note(fmt::format("{} {:.0e} at {} ms: {}", what, k, 1e3 * h, gained.failure));
      }
      told +=
          fmt::format("{}{:.0e} at {:.0f} ms {:.1e}", told.empty() ? what + ": " : ", ", k, 1e3 * h, gained.most / gained.scale);
    }
  }
  report.at_most(what + ": energy gained / largest energy", worst, kSag, kWhySag);
  report.note(told);
}

std::vector<Index> rows(const Model& model) {
  std::vector<Index> list;
  for (Index row = 0; row < model.tree.shape.velocities; ++row) list.push_back(row);
  return list;
}

void springs(Report& report) {
  const Model model = light_arm();
  over_stiffnesses(report, model, "springs", [&](double k) {
    Effects effects;
    for (const Index row : rows(model)) effects.springs.push_back({.row = row, .stiffness = k});
    return effects;
  });
  // and none is lost: read at the ends of steps, where the midpoint rule keeps that of a linear spring to the last digit
  double off = 0;
  for (const double k : kStiffnesses) {
    const auto steps = report.pick<std::int64_t>(300, 20'000, 500'000);
    Scenario pulled = scenario(model, {.step = 1e-3}, steps);
    pulled.start = random_state(*pulled.model, 1, kSpreadOfStart);
    for (const Index row : rows(model)) pulled.effects.springs.push_back({.row = row, .stiffness = k});
    const RunRecord record = run(pulled);
    off = std::max(off, record.energy_error / record.drift.scale());
    if (k == 1e3 && report.form() != Form::quick) promise_no_slope(report, record);
    if (k == 1e3) run_beside(report, pulled, record.drift.scale());
  }
  report.at_most("springs at 1 ms: energy error / largest kinetic energy", off, kSpreadOfStart * kSpreadOfStart,
                 "links are coupled by the cosines of their angles: the square of those");
}

void dampers(Report& report) {
  const Model model = light_arm();
  over_stiffnesses(report, model, "dampers", [&](double k) {
    Effects effects;
    for (const Index row : rows(model)) effects.damping.push_back({.row = row, .coefficient = k});
    return effects;
  });
}

void servos(Report& report) {
  const Model model = light_arm();
  over_stiffnesses(report, model, "servos", [&](double k) {
    Effects effects;
    for (const Index row : rows(model)) effects.servos.push_back({.row = row, .stiffness = k, .damping = 0.1 * k});
    return effects;
  });
}

void together(Report& report) {
  const Model model = light_arm();
  over_stiffnesses(report, model, "all", [&](double k) {
    Effects effects;
    for (const Index row : rows(model)) {
      effects.springs.push_back({.row = row, .stiffness = k, .rest = 0.3});
      effects.damping.push_back({.row = row, .coefficient = 1e-3 * k});
      effects.friction.push_back({.row = row, .force = 0.02});
      effects.limits.push_back({.row = row, .lower = -0.25, .upper = 0.25});
    }
    return effects;
  });
}

void ground(Report& report) {
  LinkSpec box;
  box.name = "box";
  box.joint = "base";
  box.type = JointType::free;
  box.inertia = box_inertia(2, {0.2, 0.2, 0.1}, Eigen::Vector3d::Zero());
  const Model model = TreeBuilder("box").add(box).build();
  over_stiffnesses(report, model, "ground", [&](double k) {
    Effects effects;
    effects.ground = Ground{.height = -0.5, .stiffness = k, .damping = 1e-3 * k, .friction = 0.8};
    for (const double x : {-0.1, 0.1}) {
      for (const double y : {-0.1, 0.1}) {
        for (const double z : {-0.05, 0.05})
          effects.ground->contacts.spheres.push_back({.slot = 1, .center = {x, y, z}, .radius = 0});
      }
    }
    return effects;
  });
}

}  // namespace

std::vector<Case> stiff_cases() {
  return {
      {"stiff-springs", "springs of 1 to 1e9 N m/rad on links of 1 to 100 g, at 1 and 10 ms", springs, ""},
      {"stiff-dampers", "dampers of 1 to 1e9 N m s/rad", dampers, ""},
      {"stiff-servos", "servos of 1 to 1e9 N m/rad and a tenth of that in damping", servos, ""},
      {"stiff-ground", "a box of 2 kg falls on ground of 1 to 1e9 N/m with friction", ground, ""},
      {"stiff-together", "springs that push joints against their limits, dampers, friction", together,
       "Velocities read in the two steps after a stiff thing stopped a joint are those of the blow, up to 300 times the speed at "
       "which it moves on: "
       "the positions are right, so the energy is that of the motion from step to step."},
  };
}

}  // namespace linden

// Springs, dampers, servos and ground from soft to 1e9, at steps far beyond their time constants.
#include <cmath>

#include "models/generators.hpp"
#include "tests/gallery/models.hpp"
#include "tests/gallery/scenario.hpp"

namespace linden {
namespace {

const std::vector<double> kStiffnesses{1, 1e3, 1e6, 1e9};

/// Three links of a gram to a hundred grams, hinged, under weight.
Model light_arm() {
  return hinged_chain("light arm", 3, 0.1, [](Index i) { return rod(0.1 * std::pow(0.1, i), 0.1); });
}

struct Gained {
  double most = 0;     // energy above the start, and above what was given [J]
  double scale = 0;    // largest kinetic energy, or energy at the start [J]
  double far = 0;      // joint from its rest, the largest [rad]
  std::string failure;
};

Gained gain(const Scenario& scenario) {
  Gained gained;
  Simulation simulation = simulation_of(scenario);
  const double start = simulation.energy().total();
  gained.scale = std::abs(start);
  for (std::int64_t k = 0; k < scenario.steps; ++k) {
    const StepReport step = simulation.step();
    if (!step.ok()) {
      gained.failure = simulation.describe(step);
      gained.most = std::nan("");
      break;
    }
    const Energy energy = simulation.energy();
    gained.most = std::max(gained.most, energy.total() - start - simulation.effect_work().given());
    gained.scale = std::max(gained.scale, energy.kinetic);
    for (const double q : simulation.positions()) gained.far = std::max(gained.far, std::abs(q));
  }
  return gained;
}

/// Runs the same scene with every stiffness at 1 and 10 ms; make(k) gives the effects.
template <class Make>
void over_stiffnesses(Report& report, const Model& model, const std::string& what, double bound, const std::string& reason, const Make& make) {
  const auto steps = report.pick<std::int64_t>(300, 5000, 100'000);
  std::string told;
  double worst = 0;
  for (const double h : {1e-3, 1e-2}) {
    for (const double k : kStiffnesses) {
      Scenario pulled = scenario(model, {.step = h}, steps);
      pulled.effects = make(k);
      pulled.start = random_state(*pulled.model, 1, 0.2);
      const Gained gained = gain(pulled);
      worst = std::max(worst, gained.most / gained.scale);
      if (std::isnan(gained.most)) {
        worst = gained.most;
        report.note(fmt::format("{} {:.0e} at {} ms: {}", what, k, 1e3 * h, gained.failure));
      }
      told += fmt::format("{}{:.0e} at {:.0f} ms {:.1e}", told.empty() ? what + ": " : ", ", k, 1e3 * h, gained.most / gained.scale);
    }
  }
  report.at_most(what + ": energy gained / largest energy", worst, bound, reason);
  report.note(told);
}

std::vector<Index> rows(const Model& model) {
  std::vector<Index> list;
  for (Index row = 0; row < model.tree.shape.velocities; ++row) list.push_back(row);
  return list;
}

void springs(Report& report) {
  const Model model = light_arm();
  over_stiffnesses(report, model, "springs", 0.1, "", [&](double k) {
    Effects effects;
    for (const Index row : rows(model)) effects.springs.push_back({.row = row, .stiffness = k});
    return effects;
  });
}

void dampers(Report& report) {
  const Model model = light_arm();
  over_stiffnesses(report, model, "dampers", 0.1, "", [&](double k) {
    Effects effects;
    for (const Index row : rows(model)) effects.damping.push_back({.row = row, .coefficient = k});
    return effects;
  });
}

void servos(Report& report) {
  const Model model = light_arm();
  over_stiffnesses(report, model, "servos", 0.1, "", [&](double k) {
    Effects effects;
    for (const Index row : rows(model)) effects.servos.push_back({.row = row, .stiffness = k, .damping = 0.1 * k});
    return effects;
  });
}

void together(Report& report) {
  const Model model = light_arm();
  over_stiffnesses(report, model, "all", 0.1, "", [&](double k) {
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
  over_stiffnesses(report, model, "ground", 0.1, "", [&](double k) {
    Effects effects;
    effects.ground = Ground{.height = -0.5, .stiffness = k, .damping = 1e-3 * k, .friction = 0.8};
    for (const double x : {-0.1, 0.1}) {
      for (const double y : {-0.1, 0.1}) {
        for (const double z : {-0.05, 0.05}) effects.ground->contacts.spheres.push_back({.slot = 1, .center = {x, y, z}, .radius = 0});
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
      {"stiff-together", "springs that push joints against their limits, dampers, friction", together, ""},
  };
}

}  // namespace linden

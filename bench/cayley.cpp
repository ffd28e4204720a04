// bench/cayley.cpp
// What the Cayley map in place of exp and log would cost or save: the same integrator with the other map between a body's displacement and
// its mean velocity.
//
//   build/release/bench/bench_cayley
//
//   log      hV = log dT,              h mu = dlog_hV^T G hV        kernels/tree/momentum_map.hpp
//   cayley   hV~ = 2 v~ / w~           h mu = dcay_hV^T G hV        (v~, w~) the dual quaternion of dT
//
// Over dual numbers the inverse derivative of the Cayley map is y - 1/2 u x y + 1/4 u (u . y): that of log with a = 1/4 and b = 1 instead
// of two series. Both maps are symmetric, so the methods are of second order, symplectic and keep momentum alike; joints move by exp in
// both, since a hinge's coordinate is its angle. What differs is the constant of the error, and the time of one sweep.
//
// Each scene is checked before it is compared: the log column must be what linden's Simulation does, to the solver's rounding, and both
// must come nearer to the reference fourfold with half the step.
//
// source  Kobilarov, Marsden, Discrete geometric optimal control on Lie groups (2011), 4.2
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <stdexcept>

#include "engine/initial_state.hpp"
#include "engine/simulation.hpp"
#include "kernels/tree/advance_map.hpp"
#include "kernels/tree/displacement_down.hpp"
#include "kernels/tree/gravity.hpp"
#include "kernels/tree/impulse_pass_up.hpp"
#include "kernels/tree/increment_down.hpp"
#include "kernels/tree/momentum_map.hpp"
#include "kernels/tree/momentum_update_map.hpp"
#include "kernels/tree/motion_map.hpp"
#include "kernels/tree/newton_factor_up.hpp"
#include "kernels/tree/placement_map.hpp"
#include "kernels/tree/residual_up.hpp"
#include "layout/state.hpp"
#include "layout/workspace.hpp"
#include "models/build/generators.hpp"
#include "models/urdf/urdf.hpp"
#include "tests/reference/closed_forms.hpp"

namespace {

using namespace linden;

template <class S>
LINDEN_INLINE BodyMomentum<S> cayley_momentum_of(const Inertia<S>& G, const Displacement<S>& D) {
  const S quarter(0.25), half(0.5);
  const Vec3<S> w = (S(2.0) / D.r.w) * D.r.v;
  const Twist<S> u{w, D.p - half * cross(w, D.p) + (quarter * dot(w, D.p)) * w};
  const Wrench<S> m = G * u;
  const S s = quarter * dot(u.w, m.f), s_eps = quarter * (dot(u.w, m.n) + dot(u.v, m.f));
  return {u, m,
          {m.n + s * u.v + s_eps * u.w + half * (cross(u.w, m.n) + cross(u.v, m.f)), m.f + s * u.w + half * cross(u.w, m.f)}};
}

double cayley_momentum_map(const Model& model, const Field<double, 7>& displacement, Field<double, 6>& impulse) {
  double energy = 0;
  for_bodies<double>(1, model.tree.shape.slots, [&](auto bodies, Index i) {
    using B = typename decltype(bodies)::Scalar;
    const auto body =
        cayley_momentum_of(gather<Inertia>(bodies, model.constants.inertia, i), gather<Displacement>(bodies, displacement, i));
    scatter(bodies, impulse, i, body.mu);
    energy += summed(bodies, B(0.5) * dot(body.m, body.u));
  });
  return energy;
}

enum class Map { log, cayley };

/// Steps of the plainest kind: Newton's method with the factor of the log map, which is some u^2 off the other's.
class Integrator {
 public:
  Integrator(const Model& model, Map map, const Options& options, const InitialState& start) : model_(model), map_(map), options_(options) {
    work_.allocate(model.tree.shape);
    state_.allocate(model.tree.shape);
    before_.allocate(model.tree.shape.velocities);
    Simulation simulation(model, options);
    simulation.set_positions(start.positions);
    simulation.set_velocities(start.velocities);
    std::ranges::copy(simulation.positions(), state_.q.flat().begin());
    std::ranges::copy(simulation.momenta(), state_.p.flat().begin());
    for (std::size_t row = 0; row < start.velocities.size(); ++row) {
      work_.delta.flat()[row] = before_.flat()[row] = options.step * start.velocities[row];
    }
    refresh();
  }

  void step() {
    const Tree& tree = model_.tree;
    const auto& constants = model_.constants;
    const double h = options_.step;
    const Gains<double> gains{work_.gain_up, work_.gain_down, work_.joint_inverse};
    momentum_target_map(tree, h, state_.p, work_.force, work_.momentum_target);
    for (Index row = 0; row < before_.rows(); ++row) {
      const double last = work_.delta(row);
      work_.delta(row) = 2 * last - before_(row);
      before_(row) = last;
    }
    motion_map(tree, constants, work_.delta, work_.motion);
    for (int correction = 0;; ++correction) {
      displacement_down(tree, work_.placement, work_.motion, work_.displacement);
      energy_ = map_ == Map::log ? momentum_map(tree, constants, work_.displacement, work_.impulse)
                                 : cayley_momentum_map(model_, work_.displacement, work_.impulse);
      residual_up(tree, constants, work_.placement, work_.momentum_target, work_.impulse, work_.residual);
      newton_factor_up(tree, constants, work_.placement, work_.motion, work_.displacement, work_.articulated, gains);
      const double norm = impulse_pass_up(tree, constants, work_.placement, gains, work_.residual, work_.bias, work_.innovation);
      if (!std::isfinite(norm) || correction == 40) throw std::runtime_error("a step does not converge");
      if (0.5 * norm <= 1e-26 * energy_) break;
      increment_down(tree, constants, work_.placement, work_.motion, gains, work_.innovation, work_.variation, work_.increment);
      correct_motion_map(tree, constants, work_.increment, 1.0, work_.delta, work_.motion);
    }
    displacement_map(tree, work_.motion, work_.delta);
    advance_map(tree, work_.motion, work_.delta, state_.q);
    const double potential_before = potential_;
    refresh();
    momentum_update_map(tree, constants, h, work_.displacement, work_.impulse, work_.residual, work_.force, state_.p);
    // energy of the mean motion and the mean potential: what a symplectic step nearly keeps
    const double now = energy_ / (h * h) + 0.5 * (potential_before + potential_);
    highest_ = std::max(highest_, now);
    lowest_ = std::min(lowest_, now);
    kinetic_ = std::max(kinetic_, energy_ / (h * h));
  }

  std::span<const double> positions() const { return state_.q.flat(); }
  double band() const { return (highest_ - lowest_) / kinetic_; }

 private:
  void refresh() {
    const auto& g = options_.gravity;
    placement_map(model_.tree, model_.constants, state_.q, work_.placement);
    gravity_field_down(model_.tree, work_.placement, Vec3<double>{g[0], g[1], g[2]}, work_.field);
    potential_ = gravity_force_up(model_.tree, model_.constants, work_.placement, work_.field, work_.first_moment, work_.force);
  }

  const Model& model_;
  Map map_;
  Options options_;
  Workspace<double> work_;
  State<double> state_;
  Field<double> before_;
  double potential_ = 0, energy_ = 0, highest_ = -1e300, lowest_ = 1e300, kinetic_ = 0;
};

struct Case {
  const char* name;
  Model model;
  InitialState start;
  std::array<double, 3> gravity;
  double duration, step;
};

double distance(std::span<const double> a, std::span<const double> b) {
  double largest = 0;
  for (std::size_t k = 0; k < a.size(); ++k) largest = std::max(largest, std::abs(a[k] - b[k]));
  return largest;
}

std::vector<double> moved(const Case& scene, const Options& options) {
  Simulation simulation(scene.model, options);
  simulation.set_positions(scene.start.positions);
  simulation.set_velocities(scene.start.velocities);
  for (auto k = std::llround(scene.duration / options.step); k > 0; --k) {
    if (const StepReport report = simulation.step(); !report.ok()) throw std::runtime_error(simulation.describe(report));
  }
  return {simulation.positions().begin(), simulation.positions().end()};
}

void compare(const Case& scene) {
  Options options{.step = scene.step / 4, .gravity = scene.gravity, .tolerance = 1e-13};
  options.order = 8;
  const std::vector<double> truth = moved(scene, options);
  double errors[2][2]{};
  for (int halving = 0; halving < 2; ++halving) {
    options = {.step = scene.step / (1 << halving), .gravity = scene.gravity, .tolerance = 1e-13};
    double error[2], band[2];
    for (const Map map : {Map::log, Map::cayley}) {
      Integrator integrator(scene.model, map, options, scene.start);
      for (auto k = std::llround(scene.duration / options.step); k > 0; --k) integrator.step();
      const auto at = static_cast<std::size_t>(map);
      error[at] = distance(integrator.positions(), truth);
      band[at] = integrator.band();
      errors[halving][at] = error[at];
      if (map == Map::log && halving == 0) {
        const double apart = distance(integrator.positions(), moved(scene, options));
        if (!(apart < 1e-3 * error[at])) throw std::runtime_error(fmt::format("{}: {} from a Simulation", scene.name, apart));
      }
    }
    fmt::print("{:<22} {:>6g}   {:<9.2e} {:<9.2e} {:>5.2f}   {:<9.2e} {:<9.2e} {:>5.2f}\n", scene.name, 1e3 * options.step, error[0], error[1],
               error[1] / error[0], band[0], band[1], band[1] / band[0]);
  }
  for (const int map : {0, 1}) {
    const double order = std::log2(errors[0][map] / errors[1][map]);
    if (!(std::abs(order - 2) < 0.3)) throw std::runtime_error(fmt::format("{}: order {:.2f}, expected 2", scene.name, order));
  }
}

/// Least ns per body and call over rounds of many calls, each after `begin`.
template <class Begin, class Call>
double cost(const Model& model, int calls, const Begin& begin, const Call& call) {
  using Clock = std::chrono::steady_clock;
  double least = 1e300;
  for (int round = 0; round < 20; ++round) {
    begin();
    const auto start = Clock::now();
    for (int k = 0; k < calls; ++k) call();
    least = std::min(least, std::chrono::duration<double>(Clock::now() - start).count());
  }
  return 1e9 * least / (calls * static_cast<double>(model.tree.bodies()));
}

void time_maps() {
  const Model model = chain(256);
  Workspace<double> work;
  work.allocate(model.tree.shape);
  for (Index i = 1; i < model.tree.shape.slots; ++i) {
    const double x = 1e-3 * static_cast<double>(i % 17);
    store(work.displacement, i, exp(Twist<double>{{0.02, x, -0.01}, {1e-3, 2e-3, x}}));
  }
  double sum = 0;
  const auto nothing = [] {};
  const double with_log = cost(model, 2000, nothing, [&] {
    sum += momentum_map(model.tree, model.constants, work.displacement, work.impulse);
  });
  const double with_cayley = cost(model, 2000, nothing, [&] { sum += cayley_momentum_map(model, work.displacement, work.impulse); });
  if (!std::isfinite(sum)) throw std::runtime_error("energies are not finite");

  Simulation simulation(model);
  const InitialState start = random_state(model, 1, 0.1);
  double evaluations = 0, steps = 0;
  const auto again = [&] {
    simulation.set_positions(start.positions);
    simulation.set_velocities(start.velocities);
  };
  const double whole = cost(model, 200, again, [&] {
    evaluations += simulation.step().evaluations;
    steps += 1;
  });
  const double saved = evaluations / steps * (with_log - with_cayley);
  fmt::print("\nmomentum_map, ns per body: log {:.2f}, cayley {:.2f}; a step of {} links takes {:.0f}, {:.2f} evaluations: {:.1f} % of it saved\n",
             with_log, with_cayley, model.tree.bodies(), whole, evaluations / steps, 100 * saved / whole);
}

}  // namespace

int main() {
  try {
    const FreeBody body;
    Case tumbling{"free body", FreeBody::model(), {}, {0, 0, 0}, 10, 2e-2};
    for (const long double component : body.orientation(0)) tumbling.start.positions.push_back(static_cast<double>(component));
    for (const long double component : body.velocity(0)) tumbling.start.velocities.push_back(static_cast<double>(component));
    const auto top_q = LagrangeTop::start();
    const auto top_v = LagrangeTop().start_velocity();
    const Model humanoid = load_urdf(LINDEN_MODELS_DIR "/humanoid.urdf", Base::floating), links = chain(10);
    const Case cases[] = {
        {"pendulum", Pendulum::model(), {{2.8}, {0}}, {0, 0, -9.81}, 10, 8e-3},
        tumbling,
        {"heavy top", LagrangeTop::model(), {{top_q.begin(), top_q.end()}, {top_v.begin(), top_v.end()}}, {0, 0, -9.81}, 2, 1e-3},
        {"ten-link chain", links, {links.neutral(), std::vector<double>(10, 0.0)}, {0, 0, -9.81}, 1, 1e-3},
        {"humanoid, weightless", humanoid, random_state(humanoid, 1, 0.5), {0, 0, 0}, 2, 2e-3},
    };
    fmt::print("{:<22} {:>6}   {:<9} {:<9} {:>5}   {:<9} {:<9} {:>5}\n", "", "h [ms]", "error log", "cayley", "ratio", "band log", "cayley", "ratio");
    for (const Case& scene : cases) compare(scene);
    time_maps();
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "bench_cayley: {}\n", error.what());
    return 1;
  }
}

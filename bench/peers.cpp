// bench/peers.cpp
// The same robots in linden and, where they are installed, in MuJoCo and DART: env-steps per second, and what each keeps of the energy.
//
//   build/release/bench/bench_peers [--benchmark_filter=humanoid]
//
// A robot floats and falls, all its joints limp: no contact, limits, damping, friction or motors in any engine. Every engine starts
// from the same random states, one for each instance, and takes steps of 1 ms, ten in one call. The others are measured as they are
// installed: Debian compiles them for any processor of the family, linden is compiled for this one.
//
// Before timing, each engine must have linden's robot: the mass, the degrees of freedom, the energy of random states (which no other
// inertias or frames would give) and, after 0.1 s in steps of 0.1 ms, the positions to what a first-order method makes of them.
//
//   items_per_second   steps of one instance, all instances together
//   energy_change      over 2 s from the first of the timed states: largest change of energy, as a share of the largest kinetic energy.
//                      A first-order step is half a step late in free fall; at 1 ms that alone is 5e-4
//   weightless_change  the same without gravity, joints at up to half a radian a second: what their motion alone makes of it
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <map>
#include <stdexcept>

#include "bench/installed_peers.hpp"
#include "bench/machine.hpp"
#include "models/urdf/urdf.hpp"

namespace linden {
namespace {

constexpr double kStep = 1e-3;
constexpr double kSpread = 0.3;  // of the random states that are timed [rad, rad/s, m/s]
constexpr double kLively = 2;    // of those where joints must pull at each other
constexpr int kStepsPerCall = 10;
constexpr int kCallsPerStart = 200;  // then everything starts anew: a robot that fell for minutes moves at a kilometre per second

void start(Peer& peer, const Robot& robot, std::int64_t instances) {
  for (std::int64_t i = 0; i < instances; ++i) {
    peer.reset(i, random_state(*robot.model, static_cast<std::uint64_t>(i + 1), kSpread));
  }
  peer.step(kStepsPerCall);  // so that memory has been touched and first guesses have a past
}

/// Not a number where either is none: what blows up must not look exact.
double larger(double a, double b) { return std::isnan(a) || a >= b ? a : b; }

/// Largest difference of two positions [rad, m]; a quaternion and its opposite are one rotation.
double distance(const Model& model, std::vector<double> a, const std::vector<double>& b) {
  for (Index slot = 1; slot < model.tree.shape.slots; ++slot) {
    if (model.tree.kind(slot) == JointKind::screw) continue;
    const auto end = static_cast<std::size_t>(model.tree.first_q(slot) + position_count(model.tree.kind(slot)));
    double product = 0;
    for (std::size_t row = end - 4; row < end; ++row) product += a[row] * b[row];
    for (std::size_t row = end - 4; row < end; ++row) a[row] = std::copysign(1, product) * a[row];
  }
  double largest = 0;
  for (std::size_t row = 0; row < a.size(); ++row) largest = larger(largest, std::abs(a[row] - b[row]));
  return largest;
}

/// Throws std::runtime_error where the contender has another robot than linden, or moves it differently.
void require_same_robot(const Contender& contender, const Robot& robot) {
  const Plan plan{.step = 1e-4};
  const std::unique_ptr<Peer> linden = linden_contenders().front().make(robot, plan), peer = contender.make(robot, plan);
  if (peer->degrees_of_freedom() != linden->degrees_of_freedom()) {
    throw std::runtime_error(
        fmt::format("{} degrees of freedom; linden has {}", peer->degrees_of_freedom(), linden->degrees_of_freedom()));
  }
  if (!(std::abs(peer->mass() - linden->mass()) < 1e-9 * linden->mass())) {
    throw std::runtime_error(fmt::format("a mass of {} kg; linden has {} kg", peer->mass(), linden->mass()));
  }
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const InitialState state = random_state(*robot.model, seed, seed == 1 ? kSpread : kLively);
    linden->reset(0, state);
    peer->reset(0, state);
    const Energy ours = linden->energy(0), theirs = peer->energy(0);
    const double metre_up = linden->mass() * plan.gravity;
    if (!(std::abs(theirs.kinetic - ours.kinetic) < contender.rounding * ours.kinetic &&
          std::abs(theirs.potential - ours.potential) < contender.rounding * metre_up)) {
      throw std::runtime_error(
          fmt::format("energy {} + {} J; linden has {} + {} J", theirs.kinetic, theirs.potential, ours.kinetic, ours.potential));
    }
  }
  linden->step(1000);
  peer->step(1000);
  const double apart = distance(*robot.model, peer->positions(0), linden->positions(0));
  constexpr double most = 1e-4;  // twice the half step of free fall: 1/2 h g t
  if (!(apart < most)) throw std::runtime_error(fmt::format("{} away from linden after 0.1 s; expected {} at most", apart, most));
}

/// Largest change of energy over 2 s, as a share of the largest kinetic energy met.
double energy_change(const Contender& contender, const Robot& robot, const Plan& plan, double spread) {
  const std::unique_ptr<Peer> peer = contender.make(robot, plan);
  peer->reset(0, random_state(*robot.model, 1, spread));
  const Energy first = peer->energy(0);
  double change = 0, scale = first.kinetic;
  for (int k = 0; k < 2000; ++k) {
    peer->step(1);
    const Energy now = peer->energy(0);
    change = larger(change, std::abs(now.total() - first.total()));
    scale = larger(scale, now.kinetic);
  }
  return change / scale;
}

struct Accuracy {
  double falling, weightless;  // energy_change
};

/// Checks and measures each contender once for each robot.
Accuracy accuracy(const Contender& contender, const Robot& robot) {
  static std::map<std::string, Accuracy> known;
  const std::string key = robot.name + "/" + contender.name;
  if (const auto found = known.find(key); found != known.end()) return found->second;
  require_same_robot(contender, robot);
  const Accuracy found{.falling = energy_change(contender, robot, {.step = kStep}, kSpread),
                       .weightless = energy_change(contender, robot, {.step = kStep, .gravity = 0}, kLively)};
  return known[key] = found;
}

void race(benchmark::State& state, const Contender& contender, const Robot& robot, const Plan& plan) {
  try {
    const Accuracy kept = accuracy(contender, robot);
    const std::unique_ptr<Peer> peer = contender.make(robot, plan);
    std::int64_t calls = 0;
    for (auto _ : state) {
      if (calls++ % kCallsPerStart == 0) {
        state.PauseTiming();
        start(*peer, robot, plan.instances);
        state.ResumeTiming();
      }
      peer->step(kStepsPerCall);
    }
    state.SetItemsProcessed(state.iterations() * kStepsPerCall * plan.instances);
    state.counters["instances"] = static_cast<double>(plan.instances);
    state.counters["threads"] = plan.threads;
    state.counters["energy_change"] = kept.falling;
    state.counters["weightless_change"] = kept.weightless;
  } catch (const std::exception& error) {
    state.SkipWithError(error.what());
  }
}

std::vector<Contender> contenders() {
  std::vector<Contender> all = linden_contenders();
  std::ranges::move(installed_peers(), std::back_inserter(all));
  return all;
}

void add(const Robot& robot) {
  constexpr Plan plans[] = {{kStep, 1, 1}, {kStep, 1024, 1}, {kStep, 1024, 2}};
  for (const Plan& plan : plans) {
    for (const Contender& contender : contenders()) {
      if (!(plan.instances == 1 ? contender.alone : contender.many)) continue;
      const std::string name = fmt::format("{}/{}/instances:{}/threads:{}", robot.name, contender.name, plan.instances, plan.threads);
      benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& state) { race(state, contender, robot, plan); })->UseRealTime();
    }
  }
}

}  // namespace
}  // namespace linden

int main(int argc, char** argv) {
  using namespace linden;
  for (const char* file : {LINDEN_MODELS_DIR "/humanoid.urdf", LINDEN_ROBOTS_DIR "/g1_29dof.urdf"}) {
    if (!std::filesystem::exists(file)) continue;
    add({std::filesystem::path(file).stem().string(), file, std::make_shared<const Model>(load_urdf(file, Base::floating))});
  }
  describe_machine();
  for (const Contender& contender : contenders()) benchmark::AddCustomContext(contender.name, contender.description);
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}

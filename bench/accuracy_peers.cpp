// bench/accuracy_peers.cpp
// What other engines keep of energy and momentum, and for how much CPU time, beside linden's orders: ten-link chain and weightless,
// tumbling humanoid.
//
//   build/release/bench/bench_accuracy_peers FILE.csv [SECONDS]
//
// SECONDS: of the longest runs, default 1,000, some half an hour in all. Each engine starts from linden's numbers (bench/peer.hpp), takes
// steps of 4, 2, 1 and 0.5 ms (the last not beyond 10 s), and is asked for its own energy and momentum every 16 ms. All of it is on one thread.
//
//   energy_band   largest less smallest total energy, over the largest kinetic energy that linden's order 6 meets in that time
//   *_drift       of momentum, where nothing outside gives any: the largest change, over the most that the kinetic energy allows
//                 (engine/drift.hpp), angular about the world's origin, from which what floats goes away
//   cpu           of the steps alone, for a simulated second
//
// Before anything is measured an engine must have the same energy and momentum as linden at the start, to its rounding, and be within 1e-4 of linden
// after 20 ms in steps of 10 us.
#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "bench/apart.hpp"
#include "bench/installed_peers.hpp"
#include "engine/drift.hpp"
#include "models/build/generators.hpp"
#include "models/urdf/urdf.hpp"

namespace {

using namespace linden;

constexpr double kEvery = 16e-3;  // [s]
constexpr double kSteps[] = {4e-3, 2e-3, 1e-3, 0.5e-3};
constexpr double kBlownUp = 1e3;  // times the largest kinetic energy so far
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
constexpr double kFine = 0.5e-3, kLongestFine = 10;

struct Stage {
  Robot robot;
  double gravity;
  InitialState start;
};

std::vector<Contender> contenders() {
  std::vector<Contender> all;
  for (const int order : {2, 4, 6}) all.push_back(linden_of_order(order));
  std::ranges::move(installed_peers(), std::back_inserter(all));
  return all;
}

double cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

void require_same(const Contender& contender, const Stage& scene) {
  const Plan plan{.step = 1e-5, .gravity = scene.gravity};
  const auto linden = linden_of_order(2).make(scene.robot, plan), peer = contender.make(scene.robot, plan);
  linden->reset(0, scene.start);
  peer->reset(0, scene.start);
  const double scale = linden->energy(0).kinetic + linden->mass() * 9.81;
  if (!(std::abs(peer->energy(0).total() - linden->energy(0).total()) < contender.rounding * scale)) {
    throw std::runtime_error(fmt::format("{} has {} J at the start of {}, linden {} J", contender.name, peer->energy(0).total(),
                                         scene.robot.name, linden->energy(0).total()));
  }
  if (const auto ours = linden->momentum(0), theirs = peer->momentum(0); ours && theirs) {
    const double most = std::sqrt(2 * linden->mass() * linden->energy(0).kinetic);  // [kg m/s]; lengths are of the order of a metre
    for (std::size_t k = 0; k < 3; ++k) {
      const double apart = std::max(std::abs(ours->linear[k] - theirs->linear[k]), std::abs(ours->angular[k] - theirs->angular[k]));
      if (apart > 10 * contender.rounding * most) {
        throw std::runtime_error(fmt::format("the momentum of {} is {} from linden's at the start of {}", contender.name, apart, scene.robot.name));
      }
    }
  }
  linden->step(2000);
  peer->step(2000);
  const std::vector<double> a = linden->positions(0), b = peer->positions(0);
  for (std::size_t k = 0; k < a.size(); ++k) {
    // a quaternion and its opposite are one rotation; components of no other kind have the opposite sign
    const double apart = std::min(std::abs(a[k] - b[k]), std::abs(a[k] + b[k]));
    if (!(apart < 1e-4)) throw std::runtime_error(fmt::format("{} is {} from linden after 20 ms of {}", contender.name, apart, scene.robot.name));
  }
}

struct Conserved {
  double band = 0, slope = 0, kinetic = 0, cpu = 0;
  double linear = kUnknown, angular = kUnknown;  // drift of momentum
  std::string failure;
};

Conserved run_here(const Contender& contender, const Stage& scene, double step, double duration) {
  const auto peer = contender.make(scene.robot, {.step = step, .gravity = scene.gravity});
  peer->reset(0, scene.start);
  const auto samples = std::llround(duration / kEvery);
  const int chunk = static_cast<int>(std::lround(kEvery / step));
  EnergyDrift drift(samples + 1);
  Conserved kept;
  drift.add(0, peer->energy(0));
  std::optional<MomentumDrift> momentum;
  if (const auto first = peer->momentum(0); first && scene.gravity == 0) {
    momentum = MomentumDrift::of(*scene.robot.model, {0, 0, 0}, 0, scene.start.positions, *first);
  }
  try {
    for (std::int64_t k = 1; k <= samples; ++k) {
      const double begin = cpu_seconds();
      peer->step(chunk);
      kept.cpu += cpu_seconds() - begin;
      const Energy now = peer->energy(0);
      if (!(std::abs(now.total()) < kBlownUp * drift.scale() || drift.scale() == 0)) {
        throw std::runtime_error(fmt::format("blown up at {:.3g} s", static_cast<double>(k) * kEvery));
      }
      drift.add(static_cast<double>(k) * kEvery, now);
      if (momentum) momentum->add(static_cast<double>(k) * kEvery, *peer->momentum(0), now);
    }
  } catch (const std::exception& error) {
    kept.failure = error.what();
  }
  kept.band = drift.band();
  kept.slope = drift.slope();
  kept.kinetic = drift.scale();
  kept.cpu /= duration;
  if (momentum) {
    kept.linear = momentum->linear();
    kept.angular = momentum->angular();
  }
  return kept;
}

/// A stream does not read NaN: where nothing is known, -1.
double readable(double number) { return std::isfinite(number) ? number : -1; }

/// In a process of its own: DART ends the program where a motion blows up.
Conserved run(const Contender& contender, const Stage& scene, double step, double duration) {
  const std::string told = apart([&] {
    const Conserved kept = run_here(contender, scene, step, duration);
    return fmt::format("{} {} {} {} {} {} {}", kept.band, kept.slope, kept.kinetic, kept.cpu, readable(kept.linear), readable(kept.angular), kept.failure);
  });
  Conserved kept;
  std::istringstream numbers(told);
  if (!(numbers >> kept.band >> kept.slope >> kept.kinetic >> kept.cpu >> kept.linear >> kept.angular)) {
    return {kUnknown, kUnknown, kUnknown, kUnknown, kUnknown, kUnknown, told};
  }
  if (kept.linear < 0) kept.linear = kept.angular = kUnknown;
  std::getline(numbers >> std::ws, kept.failure);
  return kept;
}

std::vector<Stage> scenes() {
  const auto links = std::make_shared<const Model>(chain(10));
  const std::string file = LINDEN_MODELS_DIR "/humanoid.urdf";
  const auto humanoid = std::make_shared<const Model>(load_urdf(file, Base::floating));
  return {{{"chain:10", "", links}, 9.81, {links->neutral(), std::vector<double>(10, 0.0)}},
          {{"humanoid", file, humanoid}, 0, random_state(*humanoid, 1, 0.5)}};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2 || argc > 3) {
    fmt::print(stderr, "expected: bench_accuracy_peers FILE.csv [SECONDS]\n");
    return 2;
  }
  try {
    const double longest = argc > 2 ? std::stod(argv[2]) : 1000;
    std::ofstream csv(argv[1]);
    if (!csv) throw std::runtime_error(fmt::format("{} cannot be written", argv[1]));
    csv << "model,engine,step_s,duration_s,energy_band,energy_slope_per_s,linear_drift,angular_drift,cpu_s_per_s,failure\n";
    fmt::print("{:<10} {:<18} {:>8} {:>8}  {:<10} {:<11} {:<8} {:<8} {:>12}\n", "model", "engine", "h [ms]", "over [s]", "band", "slope [1/s]",
               "linear", "angular", "CPU [ms/s]");
    for (const Stage& scene : scenes()) {
      for (const Contender& contender : contenders()) require_same(contender, scene);  // an engine with another model measures nothing
      for (const double duration : {1.0, 10.0, longest}) {
        const double kinetic = run(linden_of_order(6), scene, 1e-3, std::min(duration, kLongestFine)).kinetic;
        for (const Contender& contender : contenders()) {
          for (const double step : kSteps) {
            if (step == kFine && duration > kLongestFine) continue;
            const Conserved kept = run(contender, scene, step, duration);
            fmt::print("{:<10} {:<18} {:>8g} {:>8g}  {:<10.1e} {:<11.1e} {:<8.1e} {:<8.1e} {:>12.4g}  {}\n", scene.robot.name, contender.name, 1e3 * step, duration,
                       kept.band / kinetic, kept.slope / kinetic, kept.linear, kept.angular, 1e3 * kept.cpu, kept.failure);
            std::fflush(stdout);
            csv << fmt::format("{},{},{},{},{:.3g},{:.3g},{:.3g},{:.3g},{:.4g},\"{}\"\n", scene.robot.name, contender.name, step, duration, kept.band / kinetic,
                               kept.slope / kinetic, kept.linear, kept.angular, kept.cpu, kept.failure);
          }
        }
      }
    }
    return csv.flush() ? 0 : 1;
  } catch (const std::exception& error) {
    fmt::print(stderr, "bench_accuracy_peers: {}\n", error.what());
    return 1;
  }
}

// bench/block.cpp
// Where the time of a block's step goes: each of its six sweeps, in ns per body and instance, and as a share of the processor's peak.
//
//   build/release/bench/bench_block
//
// Operations are counted, not estimated: the sweeps are run once with a number that counts what is done to it. The peak is what a loop of
// independent fused multiplications and additions reaches on the same core, two operations each. A whole step of the block is
// compared with the same step by other sweeps (those of one instance) before anything is timed.
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <xsimd/xsimd.hpp>

#include "bench/machine.hpp"
#include "engine/initial_state.hpp"
#include "kernels/block/advance_down.hpp"
#include "kernels/block/block_factor_up.hpp"
#include "kernels/tree/innovation_up.hpp"
#include "kernels/tree/momentum_update_map.hpp"
#include "kernels/tree/newton_factor_up.hpp"
#include "kernels/tree/residual_up.hpp"
#include "layout/state.hpp"
#include "models/build/generators.hpp"
#include "models/urdf/urdf.hpp"

namespace linden {
namespace {

/// A number that counts the operations done to it.
struct Counted {
  double value = 0;
  static inline std::int64_t operations = 0;

  Counted() = default;
  explicit Counted(double v) : value(v) {}
  static Counted done(double v) {
    operations += 1;
    return Counted(v);
  }
  friend Counted operator+(const Counted& a, const Counted& b) { return done(a.value + b.value); }
  friend Counted operator-(const Counted& a, const Counted& b) { return done(a.value - b.value); }
  friend Counted operator*(const Counted& a, const Counted& b) { return done(a.value * b.value); }
  friend Counted operator/(const Counted& a, const Counted& b) { return done(a.value / b.value); }
  friend Counted operator-(const Counted& a) { return Counted(-a.value); }
  friend bool operator<(const Counted& a, const Counted& b) { return a.value < b.value; }
  friend bool operator>(const Counted& a, const Counted& b) { return a.value > b.value; }
  friend Counted abs(const Counted& a) { return Counted(std::abs(a.value)); }
  friend Counted floor(const Counted& a) { return done(std::floor(a.value)); }
};

template <class S>
std::size_t lanes() {
  if constexpr (requires { S::size; }) {
    return S::size;
  } else {
    return 1;
  }
}

/// A block at the beginning of a step.
template <class S>
struct Bench {
  using Real = typename ElementOf<S>::type;

  const Model& model;
  BodyConstants<Real> constants;
  State<S> state;
  Workspace<S> work;
  Field<S> delta;
  S h = as<S>(1e-3);

  explicit Bench(const Model& m) : model(m) {
    const Tree& tree = m.tree;
    constants.allocate(tree.shape);
    const auto copy = [](const auto& from, auto& to) {
      for (std::size_t k = 0; k < to.flat().size(); ++k) to.flat()[k] = static_cast<Real>(from.flat()[k]);
    };
    copy(m.constants.screw, constants.screw);
    copy(m.constants.tree_placement, constants.tree_placement);
    copy(m.constants.inertia, constants.inertia);
    copy(m.constants.subtree_mass, constants.subtree_mass);
    state.allocate(tree.shape);
    work.allocate(tree.shape);
    delta.allocate(tree.shape.velocities);
    // one motion in all lanes: what is timed does not depend on the numbers
    const InitialState start = random_state(m, 1, 0.3);
    for (Index row = 0; row < tree.shape.positions; ++row) state.q(row) = as<S>(start.positions[static_cast<std::size_t>(row)]);
    for (Index row = 0; row < tree.shape.velocities; ++row) delta(row) = as<S>(1e-3 * start.velocities[static_cast<std::size_t>(row)]);
    work.delta = delta;
    const auto none = h < S(0.0);
    motion_map(tree, constants, work.delta, work.motion);
    const Vec3<S> g = gravity();
    advance_down<true>(tree, constants, g, none, work, state.q);
    const Field<S>* const nothing = nullptr;
    momentum_up<true>(tree, constants, h, none, nothing, work, state.p);
    // the momentum that makes this displacement nearly the solution
    start_down(tree, constants, work);
    impulse_up(tree, constants, work.placement, work.impulse, work.momentum_target);
    start_down(tree, constants, work);
  }

  static Vec3<S> gravity() { return {S(0.0), S(0.0), as<S>(-9.81)}; }

  Gains<S> gains() { return {work.gain_up, work.gain_down, work.joint_inverse}; }
  void start() { start_down(model.tree, constants, work); }
  void factor() { block_factor_up(model.tree, constants, work, gains(), Jacobian::first_order); }
  void factor_exactly() { block_factor_up(model.tree, constants, work, gains(), Jacobian::exact); }
  void correct() { correct_down(model.tree, constants, h > S(0.0), work); }
  void check() { innovation_up(model.tree, constants, work); }
  void advance() {
    const Vec3<S> g = gravity();
    advance_down<true>(model.tree, constants, g, h < S(0.0), work, state.q);
  }
  void momentum() {
    const Field<S>* const nothing = nullptr;
    momentum_up<true>(model.tree, constants, h, h < S(0.0), nothing, work, state.p);
  }
};

/// Whether an evaluation, a factor and a correction of a block give what the sweeps of one instance give.
bool agrees(const Model& model) {
  Bench<double> block(model), plain(model);
  for (double& target : block.work.momentum_target.flat()) target *= 1.001;
  plain.work.momentum_target = block.work.momentum_target;
  block.factor_exactly();
  block.check();
  block.correct();
  const Tree& tree = model.tree;
  Workspace<double>& work = plain.work;
  const Gains<double> gains{work.gain_up, work.gain_down, work.joint_inverse};
  displacement_down(tree, work.placement, work.motion, work.displacement);
  momentum_map(tree, model.constants, work.displacement, work.impulse);
  residual_up(tree, model.constants, work.placement, work.momentum_target, work.impulse, work.residual);
  newton_factor_up(tree, model.constants, work.placement, work.motion, work.displacement, work.articulated, gains);
  impulse_pass_up(tree, model.constants, work.placement, gains, work.residual, work.bias, work.innovation);
  increment_down(tree, model.constants, work.placement, work.motion, gains, work.innovation, work.variation, work.increment);
  double worst = 0, scale = 0;
  for (Index row = 0; row < tree.shape.velocities; ++row) {
    worst = std::max(worst, std::abs(work.increment(row) - block.work.increment(row)));
    scale = std::max(scale, std::abs(work.increment(row)));
  }
  return worst < 1e-6 * scale;  // measured: 3e-11 for robots, 2e-7 for a chain of 100, whose mass matrix is that badly conditioned
}

/// Operations a second of one core that does nothing but multiply and add.
template <class S>
double peak() {
  constexpr int kChains = 16;
  constexpr int kRounds = 2'000'000;
  static double best = 0;
  if (best > 0) return best;
  for (int attempt = 0; attempt < 5; ++attempt) {
    S sums[kChains];
    for (S& sum : sums) sum = S(1.0);
    S factor = as<S>(0.999), shift = as<S>(0.001);
    const auto begin = std::chrono::steady_clock::now();
    for (int round = 0; round < kRounds; ++round) {
      for (S& sum : sums) sum = sum * factor + shift;
    }
    const double taken = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    benchmark::DoNotOptimize(sums);
    best = std::max(best, 2.0 * kChains * kRounds * static_cast<double>(lanes<S>()) / taken);
  }
  return best;
}

template <class S>
void sweep(benchmark::State& state, const Model& model, void (Bench<S>::*action)(), void (Bench<Counted>::*counted)()) {
  if (!agrees(model)) return state.SkipWithError("the sweeps of a block do not agree with those of one instance");
  Bench<Counted> counting(model);
  counting.factor();
  counting.check();
  Counted::operations = 0;
  (counting.*counted)();
  const auto operations = static_cast<double>(Counted::operations);
  Bench<S> bench(model);
  bench.factor();
  bench.check();
  for (auto _ : state) {
    // corrections of nearly nothing, so that the motion stays what it is
    (bench.*action)();
  }
  const double instances = static_cast<double>(lanes<S>());
  state.counters["per_body"] = benchmark::Counter(model.tree.bodies() * instances,
                                                  benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
  state.counters["operations"] = operations / model.tree.bodies();
  state.counters["peak_share"] = benchmark::Counter(operations * instances / peak<S>(), benchmark::Counter::kIsIterationInvariantRate);
}

template <class S>
void add(const std::string& precision, const std::string& name, const std::shared_ptr<const Model>& model) {
  struct Named {
    const char* name;
    void (Bench<S>::*action)();
    void (Bench<Counted>::*counted)();
  };
  const Named list[] = {{"start_down", &Bench<S>::start, &Bench<Counted>::start},
                        {"block_factor_up", &Bench<S>::factor, &Bench<Counted>::factor},
                        {"correct_down", &Bench<S>::correct, &Bench<Counted>::correct},
                        {"innovation_up", &Bench<S>::check, &Bench<Counted>::check},
                        {"advance_down", &Bench<S>::advance, &Bench<Counted>::advance},
                        {"momentum_up", &Bench<S>::momentum, &Bench<Counted>::momentum},
                        {"block_factor_up_exact", &Bench<S>::factor_exactly, &Bench<Counted>::factor_exactly}};
  for (const Named& one : list) {
    benchmark::RegisterBenchmark(fmt::format("{}/{}/{}", name, precision, one.name).c_str(),
                                 [=](benchmark::State& state) { sweep<S>(state, *model, one.action, one.counted); });
  }
}

}  // namespace
}  // namespace linden

int main(int argc, char** argv) {
  using namespace linden;
  const auto shared = [](Model model) { return std::make_shared<const Model>(std::move(model)); };
  std::vector<std::pair<std::string, std::shared_ptr<const Model>>> scenes{
      {"humanoid", shared(load_urdf(LINDEN_MODELS_DIR "/humanoid.urdf", Base::floating))}, {"chain:100", shared(chain(100))}};
  if (const char* g1 = LINDEN_ROBOTS_DIR "/g1_29dof.urdf"; std::filesystem::exists(g1)) {
    scenes.emplace_back("g1", shared(load_urdf(g1, Base::floating)));
  }
  for (const auto& [name, model] : scenes) {
    add<xsimd::batch<double>>("double", name, model);
    add<xsimd::batch<float>>("float", name, model);
  }
  describe_machine();
  benchmark::AddCustomContext("peak, double", fmt::format("{:.1f} Gflop/s a core", 1e-9 * peak<xsimd::batch<double>>()));
  benchmark::AddCustomContext("peak, float", fmt::format("{:.1f} Gflop/s a core", 1e-9 * peak<xsimd::batch<float>>()));
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}

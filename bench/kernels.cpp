// bench/kernels.cpp
// Time of every kernel, by its own name, over chains of hinges and of ball joints and over binary trees.
//
//   build/release/bench/bench_kernels [--benchmark_filter=newton]
//
// First the kernels run once in the order of a step, and the result is checked against a plain twin; only then are they timed, on the
// state of a moving system. Kernels that sum in place (impulse_up, residual_up, newton_factor_up, ...) are timed with what fills their input.
#include <fmt/format.h>

#include <cstdio>

#include "bench/machine.hpp"
#include "engine/initial_state.hpp"
#include "engine/simulation.hpp"
#include "kernels/tree/advance_map.hpp"
#include "kernels/tree/articulated_inertia_up.hpp"
#include "kernels/tree/displacement_down.hpp"
#include "kernels/tree/gravity.hpp"
#include "kernels/tree/increment_down.hpp"
#include "kernels/tree/momentum_map.hpp"
#include "kernels/tree/momentum_update_map.hpp"
#include "kernels/tree/motion_map.hpp"
#include "kernels/tree/newton_factor_up.hpp"
#include "kernels/tree/placement_map.hpp"
#include "kernels/tree/residual_up.hpp"
#include "kernels/tree/velocity_down.hpp"
#include "models/build/generators.hpp"
#include "tests/reference/del_literal.hpp"
#include "tests/reference/dense_jacobian.hpp"

namespace linden {
namespace {

constexpr double kStep = 1e-3;

/// A moving system and the workspace of its next step, filled kernel by kernel.
struct Rig {
  Model model;
  State<double> state;
  Workspace<double> work;
  Field<double> rate;

  explicit Rig(Model made) : model(std::move(made)) {
    state.allocate(model.tree.shape);
    work.allocate(model.tree.shape);
    rate.allocate(model.tree.shape.velocities);
    const InitialState start = random_state(model, 1, 0.1);
    std::ranges::copy(start.positions, state.q.flat().begin());
    std::ranges::copy(start.velocities, rate.flat().begin());
    for (Index row = 0; row < model.tree.shape.velocities; ++row) work.delta(row) = kStep * rate(row);
    placement();
    gravity();
    velocity();
    impulse_up(model.tree, model.constants, work.placement, work.impulse, state.p);
    momentum_target_map(model.tree, kStep, state.p, work.force, work.momentum_target);
    motion();
    displacement();
    momentum();
    residual();
    newton_factor();
    pass_up();
    increment();
  }

  Gains<double> gains() { return {work.gain_up, work.gain_down, work.joint_inverse}; }

  void placement() { placement_map(model.tree, model.constants, state.q, work.placement); }
  void gravity() {
    gravity_field_down(model.tree, work.placement, Vec3<double>{0, 0, -9.81}, work.field);
    gravity_force_up(model.tree, model.constants, work.placement, work.field, work.first_moment, work.force);
  }
  void velocity() {
    velocity_down(model.tree, model.constants, work.placement, rate, work.variation);
    momentum_of_map(model.tree, model.constants, work.variation, work.impulse);
  }
  void motion() { motion_map(model.tree, model.constants, work.delta, work.motion); }
  void displacement() { displacement_down(model.tree, work.placement, work.motion, work.displacement); }
  void momentum() {
    momentum_map(model.tree, model.constants, work.displacement, work.impulse);
  }
  void residual() {
    residual_up(model.tree, model.constants, work.placement, work.momentum_target, work.impulse, work.residual);
  }
  void newton_factor() {
    newton_factor_up(model.tree, model.constants, work.placement, work.motion, work.displacement, work.articulated,
                     gains());
  }
  void inertia_factor() { articulated_inertia_up(model.tree, model.constants, work.placement, work.articulated, gains()); }
  void pass_up() {
    impulse_pass_up(model.tree, model.constants, work.placement, gains(), work.residual, work.bias, work.innovation);
  }
  void increment() {
    increment_down(model.tree, model.constants, work.placement, work.motion, gains(), work.innovation, work.variation,
                   work.increment);
  }
  void rates() {
    rate_down(model.tree, model.constants, work.placement, gains(), work.innovation, work.variation, work.increment);
  }
  void correction() { correct_motion_map(model.tree, model.constants, work.increment, 0.0, work.delta, work.motion); }
  void update() {
    momentum_update_map(model.tree, model.constants, kStep, work.displacement, work.impulse, work.residual, work.force, state.p);
  }
  void advance() { advance_map(model.tree, work.motion, work.delta, state.q); }
};

/// The kernels in the order of a step against the plain twin: residual by matrices, correction by a dense solve.
bool agrees_with_plain_twin(Model model) {
  Rig rig(std::move(model));
  const reference::PlainTree tree = reference::plain_tree(rig.model);
  const auto flat = [](const Field<double>& field) {
    return Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(field.flat().data(), field.rows()));
  };
  const Eigen::MatrixXd J = reference::dense_jacobian(rig.model, rig.work.placement, rig.work.motion);
  const Eigen::VectorXd expected = J.fullPivLu().solve(flat(rig.work.residual));
  const double error = (flat(rig.work.increment) - expected).norm() / expected.norm();
  if (error < 1e-9) return true;
  fmt::print(stderr, "{}: the correction differs from the dense solve by {:.2e}\n", rig.model.names.model, error);
  return false;
}

using Kernel = void (Rig::*)();
struct Named {
  const char* name;
  std::vector<Kernel> kernels;
};

const std::vector<Named> kKernels{
    {"placement_map", {&Rig::placement}},
    {"gravity", {&Rig::gravity}},
    {"motion_map", {&Rig::motion}},
    {"displacement_down", {&Rig::displacement}},
    {"momentum_map", {&Rig::momentum}},
    {"momentum_map+residual_up", {&Rig::momentum, &Rig::residual}},
    {"newton_factor_up", {&Rig::newton_factor}},
    {"articulated_inertia_up", {&Rig::inertia_factor}},
    {"impulse_pass_up", {&Rig::pass_up}},
    {"increment_down", {&Rig::increment}},
    {"rate_down", {&Rig::rates}},
    {"correct_motion_map", {&Rig::correction}},
    {"momentum_update_map", {&Rig::update}},
    {"advance_map", {&Rig::advance}},
    {"velocity_down", {&Rig::velocity}},
};

void register_all(const char* shape, Model (*make)(Index), const std::vector<Index>& sizes) {
  for (const Named& named : kKernels) {
    for (const Index size : sizes) {
      benchmark::RegisterBenchmark(fmt::format("{}/{}:{}", named.name, shape, size).c_str(), [=](benchmark::State& state) {
        Rig rig(make(size));
        for (auto _ : state) {
          for (const Kernel kernel : named.kernels) (rig.*kernel)();
          benchmark::ClobberMemory();
        }
        per_body(state, size);
      });
    }
  }
}

}  // namespace
}  // namespace linden

int main(int argc, char** argv) {
  using namespace linden;
  const auto tree = [](Index bodies) { return balanced_tree(bodies); };
  if (!agrees_with_plain_twin(chain(12)) || !agrees_with_plain_twin(ball_chain(5)) || !agrees_with_plain_twin(tree(15))) return 1;
  register_all("chain", chain, {10, 100, 1000, 10000, 100000});
  register_all("ball-chain", ball_chain, {1000});
  register_all("tree", tree, {1023});
  describe_machine();
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
}

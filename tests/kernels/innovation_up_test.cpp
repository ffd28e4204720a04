#include "kernels/tree/innovation_up.hpp"

#include <catch2/catch.hpp>
#include <limits>

#include "tests/kernels/rig.hpp"

namespace linden::innovation_up_test {
namespace {

/// Momenta and displacements of the step, gains of the exact Jacobian, and what innovation_up is to find h mu in.
const auto prepare = [](auto& rig) {
  using S = std::decay_t<decltype(rig.h)>;
  find_residual(rig);
  factor_newton(rig);
  start_down(rig.tree, rig.constants, rig.work);
  momentum_target_map(rig.tree, rig.h, rig.state.p, rig.work.force, rig.work.momentum_target);
  for (int k = 0; k < 6; ++k) rig.work.impulse(0, k) = S(0.0);
};

const auto innovation =
    make_kernel(prepare, [](auto& rig) { rig.result(0) = innovation_up(rig.tree, rig.constants, rig.work); },
                {"innovation", "result"}, {"impulse"});

/// The same by residual_up, newton_factor_up and impulse_pass_up: impulse holds F, bias b.
Rig<double> plain(const Rig<double>& from) {
  Rig<double> rig = from;
  find_residual(rig);
  factor_newton(rig);
  find_residual(rig);
  pass_up(rig, rig.work.residual);
  return rig;
}

TEST_CASE("innovation_up carries residual and yielding joints in one wrench: E = F - b") {
  double worst = 0;
  for (const Model& model : mixed_trees()) {
    for (const double turn : {1e-3, 0.5}) {
      Rig<double> rig(model);
      rig.set(random_instance(reference::plain_tree(model), 3, turn));
      const Rig<double> expected = plain(rig);
      prepare(rig);
      const double norm = innovation_up(rig.tree, rig.constants, rig.work);
      CHECK(norm == Approx(expected.result(0)).epsilon(1e-11));
      see(worst, relative_error(vector(rig.work.innovation), vector(expected.work.innovation)));
      for (Index i = 1; i < rig.tree.shape.slots; ++i) {
        const auto F = row<Wrench>(expected.work.impulse, i), b = row<Wrench>(expected.work.bias, i);
        see(worst, (row<Wrench>(rig.work.impulse, i) - (F - b)).norm() / (F.norm() + b.norm()));
      }
    }
  }
  INFO("largest difference: " << worst);
  CHECK(worst < 1e-11);
}

TEST_CASE("a solved step leaves no innovation") {
  const Model model = random_tree({.bodies = 1, .seed = 3, .screws = false, .balls = false});
  Rig<double> rig(model);
  const PlainTree tree = reference::plain_tree(rig.model);
  rig.set(random_instance(tree, 3, 0.5));
  find_momenta(rig);
  const reference::Vector6<double> mu = row<Wrench>(rig.work.impulse, 1);
  const auto norm_at = [&](const reference::Vector6<double>& target) {
    find_momenta(rig);
    prepare(rig);
    fill(rig.work.momentum_target, target);
    return innovation_up(rig.tree, rig.constants, rig.work);
  };
  // squares, each of a number that is known to its epsilon
  constexpr double epsilon = std::numeric_limits<double>::epsilon();
  CHECK(norm_at(mu) <= 36 * epsilon * epsilon * norm_at(reference::Vector6<double>::Zero()));
}

TEST_CASE("innovation_up writes all it is to write and nothing else") {
  check_writes(innovation, {"impulse"});
}

TEST_CASE("innovation_up allocates nothing") {
  check_allocates_nothing(innovation);
}

TEST_CASE("innovation_up gives equal bits in every lane") {
  check_lanes(innovation);
}

}  // namespace
}  // namespace linden::innovation_up_test

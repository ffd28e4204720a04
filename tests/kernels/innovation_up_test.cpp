#include "kernels/tree/innovation_up.hpp"

#include <catch2/catch.hpp>
#include <limits>

#include "tests/kernels/rig.hpp"

namespace linden {
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

const auto first_order =
    make_kernel(prepare, [](auto& rig) { rig.result(0) = newton_up<true>(rig.tree, rig.constants, rig.work); },
                {"innovation", "result", "gain_up", "gain_down", "joint_inverse"}, {"impulse"}, {"articulated"});

const auto exact =
    make_kernel(prepare, [](auto& rig) { rig.result(0) = newton_up<false>(rig.tree, rig.constants, rig.work); },
                {"innovation", "result", "gain_up", "gain_down", "joint_inverse"}, {"impulse"}, {"articulated"});

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

TEST_CASE("newton_up with the exact K leaves the gains of newton_factor_up on the way") {
  double worst = 0;
  for (const Model& model : mixed_trees()) {
    for (const double turn : {1e-3, 0.5}) {
      Rig<double> rig(model);
      rig.set(random_instance(reference::plain_tree(model), 3, turn));
      const Rig<double> expected = plain(rig);
      prepare(rig);
      const double norm = newton_up<false>(rig.tree, rig.constants, rig.work);
      CHECK(norm == Approx(expected.result(0)).epsilon(1e-10));
      see(worst, relative_error(vector(rig.work.innovation), vector(expected.work.innovation)),
          relative_error(vector(rig.work.joint_inverse), vector(expected.work.joint_inverse)));
      for (Index k = 0; k < rig.tree.shape.velocities; ++k) {
        see(worst, relative_error(row<Wrench>(rig.work.gain_up, k), row<Wrench>(expected.work.gain_up, k)),
            relative_error(row<Twist>(rig.work.gain_down, k), row<Twist>(expected.work.gain_down, k)));
      }
    }
  }
  INFO("largest difference: " << worst);
  CHECK(worst < 1e-9);
}

TEST_CASE("the gains to first order are off by the square of the turn") {
  for (const Model& model : mixed_trees()) {
    for (const double turn : {1e-2, 1e-3, 1e-4}) {
      Rig<double> rig(model);
      rig.set(random_instance(reference::plain_tree(model), 3, turn));
      const Rig<double> expected = plain(rig);
      prepare(rig);
      newton_up<true>(rig.tree, rig.constants, rig.work);
      INFO(model.names.model << ", turn " << turn);
      // the factor: masses here are spread over six decades
      CHECK(relative_error(vector(rig.work.joint_inverse), vector(expected.work.joint_inverse)) < 1e3 * turn * turn);
    }
  }
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

TEST_CASE("innovation_up and newton_up write all they are to write and nothing else") {
  check_writes(innovation, {"impulse"});
  check_writes(first_order, {"impulse"});
  check_writes(exact, {"impulse"});
}

TEST_CASE("innovation_up and newton_up allocate nothing") {
  check_allocates_nothing(innovation);
  check_allocates_nothing(first_order);
  check_allocates_nothing(exact);
}

TEST_CASE("innovation_up and newton_up give equal bits in every lane") {
  check_lanes(innovation);
  check_lanes(first_order);
  check_lanes(exact);
}

}  // namespace
}  // namespace linden

#include "kernels/block/block_factor_up.hpp"

#include <catch2/catch.hpp>

#include "tests/kernels/rig.hpp"

namespace linden::block_factor_up_test {
namespace {

/// Displacements of the step; no gains yet.
const auto prepare = [](auto& rig) {
  rig.rounding = kRoundingAfterElimination;
  find_momenta(rig);
  start_down(rig.tree, rig.constants, rig.work);
};

const auto first_order =
    make_kernel(prepare, [](auto& rig) { block_factor_up(rig.tree, rig.constants, rig.work, rig.gains(), Jacobian::first_order); },
                {"gain_up", "gain_down", "joint_inverse"}, {}, {"articulated"});

const auto exact =
    make_kernel(prepare, [](auto& rig) { block_factor_up(rig.tree, rig.constants, rig.work, rig.gains(), Jacobian::exact); },
                {"gain_up", "gain_down", "joint_inverse"}, {}, {"articulated"});

/// The factor of a block of one, and that of one tree.
std::pair<Rig<double>, Rig<double>> factored(const Model& model, double turn, Jacobian jacobian) {
  Rig<double> rig(model);
  rig.set(random_instance(reference::plain_tree(model), 3, turn));
  Rig<double> expected = rig;
  factor_newton(expected);
  prepare(rig);
  block_factor_up(rig.tree, rig.constants, rig.work, rig.gains(), jacobian);
  return {std::move(rig), std::move(expected)};
}

TEST_CASE("block_factor_up with the exact K leaves the gains of newton_factor_up") {
  double worst = 0;
  for (const Model& model : mixed_trees()) {
    for (const double turn : {1e-3, 0.5}) {
      const auto [rig, expected] = factored(model, turn, Jacobian::exact);
      see(worst, relative_error(vector(rig.work.joint_inverse), vector(expected.work.joint_inverse)));
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
      const auto [rig, expected] = factored(model, turn, Jacobian::first_order);
      INFO(model.names.model << ", turn " << turn);
      // the factor: masses here are spread over six decades
      CHECK(relative_error(vector(rig.work.joint_inverse), vector(expected.work.joint_inverse)) < 1e3 * turn * turn);
    }
  }
}

TEST_CASE("block_factor_up writes all it is to write and nothing else") {
  check_writes(first_order);
  check_writes(exact);
}

TEST_CASE("block_factor_up allocates nothing") {
  check_allocates_nothing(first_order);
  check_allocates_nothing(exact);
}

TEST_CASE("block_factor_up gives equal bits in every lane") {
  check_lanes(first_order);
  check_lanes(exact);
}

}  // namespace
}  // namespace linden::block_factor_up_test

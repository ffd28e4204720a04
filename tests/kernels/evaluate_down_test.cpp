#include "kernels/block/evaluate_down.hpp"

#include <catch2/catch.hpp>

#include "models/build/builder.hpp"
#include "tests/kernels/rig.hpp"

namespace linden::evaluate_down_test {
namespace {

const auto start = make_kernel(
    [](auto& rig) {
      place(rig);
      for (auto& delta : rig.work.delta.flat()) delta = delta * decltype(rig.h)(0.5);
    },
    [](auto& rig) {
      const auto found = start_down(rig.tree, rig.constants, rig.work);
      rig.result(0) = found.least_w + found.energy;
    },
    {"displacement", "turn", "impulse", "result"}, {"motion"});

const auto correct = make_kernel(
    [](auto& rig) {
      factor_newton(rig);
      find_residual(rig);
      pass_up(rig, rig.work.residual);
      // a small right side: the correction is to stay within the range of exp
      for (auto& u : rig.work.innovation.flat()) u = u * decltype(rig.h)(1e-3);
    },
    [](auto& rig) {
      const auto found = correct_down(rig.tree, rig.constants, rig.h > decltype(rig.h)(0), rig.work);
      rig.result(0) = found.least_w + found.energy;
    },
    {"displacement", "turn", "impulse", "variation", "increment", "result"}, {"delta", "motion"});

/// Largest difference of a field's rows from slot 1 on, in units of the field's largest number.
template <int Components>
double difference(const Field<double, Components>& found, const Field<double, Components>& expected) {
  double worst = 0, scale = 0;
  for (Index i = 1; i < found.rows(); ++i) {
    for (int k = 0; k < Components; ++k) {
      see(worst, std::abs(found(i, k) - expected(i, k)));
      scale = std::max(scale, std::abs(expected(i, k)));
    }
  }
  return worst / scale;
}

double largest_difference(const Rig<double>& found, const Rig<double>& expected) {
  double worst = 0;
  see(worst, difference(found.work.displacement, expected.work.displacement),
      difference(found.work.impulse, expected.work.impulse));
  for (Index i = 1; i < found.tree.shape.slots; ++i) {
    const Twist<double> u = log(load<Displacement, double>(expected.work.displacement, i));
    see(worst, (row<Vec3>(found.work.turn, i) - eigen(u.w)).norm());
    for (const int k : {2, 3, 6}) see(worst, std::abs(found.work.motion(i, k) - expected.work.motion(i, k)));
  }
  return worst;
}

TEST_CASE("start_down is motion_map, displacement_down and momentum_map") {
  double worst = 0;
  for (const Model& model : mixed_trees()) {
    for (const double turn : {1e-3, 0.1, 0.5, 2.5}) {
      Rig<double> rig(model);
      rig.set(random_instance(reference::plain_tree(model), 3, turn));
      Rig<double> fused = rig;
      find_momenta(rig);
      place(fused);
      const Evaluation<double> found = start_down(fused.tree, fused.constants, fused.work);
      displace(rig);
      const double least_w = rig.result(0);
      const double energy = momentum_map(rig.tree, rig.constants, rig.work.displacement, rig.work.impulse);
      see(worst, std::abs(found.least_w - least_w), std::abs(found.energy - energy) / energy);
      see(worst, largest_difference(fused, rig));
    }
  }
  INFO("largest difference: " << worst / kEpsilon << " epsilon");
  CHECK(worst < 64 * kEpsilon);
}

TEST_CASE("correct_down is increment_down, correct_motion_map, displacement_down and momentum_map") {
  double worst = 0;
  for (const Model& model : mixed_trees()) {
    for (const double turn : {1e-3, 0.5}) {
      Rig<double> rig(model);
      rig.set(random_instance(reference::plain_tree(model), 4, turn));
      correct.prepare(rig);
      Rig<double> fused = rig;
      const Evaluation<double> found = correct_down(fused.tree, fused.constants, true, fused.work);
      pass_down_newton(rig);
      correct_motion_map(rig.tree, rig.constants, rig.work.increment, 1.0, rig.work.delta, rig.work.motion);
      const double least_w = displacement_down(rig.tree, rig.work.placement, rig.work.motion, rig.work.displacement);
      const double energy = momentum_map(rig.tree, rig.constants, rig.work.displacement, rig.work.impulse);
      see(worst, std::abs(found.least_w - least_w), std::abs(found.energy - energy) / energy);
      see(worst, largest_difference(fused, rig), relative_error(vector(fused.work.increment), vector(rig.work.increment)),
          relative_error(vector(fused.work.delta), vector(rig.work.delta)));
    }
  }
  INFO("largest difference: " << worst);
  CHECK(worst < 1e-12);
}

TEST_CASE("what is not corrected stays as it is, to the bit") {
  for (const Model& model : mixed_trees()) {
    Rig<double> rig(model);
    rig.set(random_instance(reference::plain_tree(model), 4, 0.5));
    correct.prepare(rig);
    correct_down(rig.tree, rig.constants, true, rig.work);
    Rig<double> held = rig;
    correct_down(held.tree, held.constants, false, held.work);
    CHECK(held.work.delta == rig.work.delta);
    CHECK(held.work.displacement == rig.work.displacement);
    for (Index i = 1; i < rig.tree.shape.slots; ++i) {
      for (int k = 0; k < 7; ++k) CHECK(held.work.motion(i, k) == rig.work.motion(i, k));
      CHECK(row<Wrench>(held.work.impulse, i) == row<Wrench>(rig.work.impulse, i));
    }
  }
}

TEST_CASE("a hinge that turns by 1 rad about its own axis has its inertia for h mu") {
  LinkSpec link;
  link.name = link.joint = "wheel";
  link.axis = Eigen::Vector3d::UnitZ();
  link.inertia.mass = 1;
  link.inertia.about_center = Eigen::Vector3d(2, 3, 4).asDiagonal();
  const Model model = TreeBuilder("wheel").add(link).build();
  Rig<double> rig(model);
  rig.state.q(0) = 0.3;
  rig.work.delta(0) = 1;
  place(rig);
  const Evaluation<double> found = start_down(rig.tree, rig.constants, rig.work);
  CHECK(rig.work.impulse(1, 2) == Approx(4).epsilon(1e-15));
  CHECK(rig.work.turn(1, 2) == Approx(1).epsilon(1e-15));
  CHECK(found.least_w == Approx(std::cos(0.5)).epsilon(1e-15));
  CHECK(found.energy == Approx(2).epsilon(1e-15));
}

TEST_CASE("start_down and correct_down write all they are to write and nothing else") {
  check_writes(start, {"displacement"});
  check_writes(correct, {"displacement", "variation"});
}

TEST_CASE("start_down and correct_down allocate nothing") {
  check_allocates_nothing(start);
  check_allocates_nothing(correct);
}

TEST_CASE("start_down and correct_down give equal bits in every lane") {
  check_lanes(start);
  check_lanes(correct);
}

}  // namespace
}  // namespace linden::evaluate_down_test

#include "kernels/block/advance_down.hpp"

#include <catch2/catch.hpp>

#include "kernels/tree/innovation_up.hpp"
#include "tests/kernels/rig.hpp"

namespace linden::advance_down_test {
namespace {

template <class S>
Vec3<S> field_of_test() {
  return {S(1.5), S(-2.0), S(-9.0)};
}

/// A step up to its last evaluation; the rates stand in for forces given from outside.
const auto prepare = [](auto& rig) {
  find_residual(rig);
  factor_newton(rig);
  start_down(rig.tree, rig.constants, rig.work);
  innovation_up(rig.tree, rig.constants, rig.work);
  displacement_map(rig.tree, rig.work.motion, rig.work.delta);
};

const auto down_kernel = make_kernel(
    prepare,
    [](auto& rig) {
      using S = std::decay_t<decltype(rig.h)>;
      const Vec3<S> gravity = field_of_test<S>();
      advance_down<true>(rig.tree, rig.constants, gravity, rig.h > S(0.0), rig.work, rig.state.q);
    },
    {"placement", "field"}, {"q"});

const auto up_kernel = make_kernel(
    [](auto& rig) {
      prepare(rig);
      down_kernel.run(rig);
    },
    [](auto& rig) {
      rig.result(0) =
          momentum_up<true>(rig.tree, rig.constants, rig.h, rig.h > decltype(rig.h)(0.0), &rig.rate, rig.work, rig.state.p);
    },
    {"first_moment", "force", "result"}, {"p"});

TEST_CASE("the end of a step for blocks is advance_map, placement_map, gravity and momentum_update_map") {
  double worst = 0;
  for (const Model& model : mixed_trees()) {
    Rig<double> rig(model);
    rig.set(random_instance(reference::plain_tree(model), 3, 0.5));
    prepare(rig);
    Rig<double> fused = rig;
    down_kernel.run(fused);
    up_kernel.run(fused);

    advance_map(rig.tree, rig.work.motion, rig.work.delta, rig.state.q);
    placement_map(rig.tree, rig.constants, rig.state.q, rig.work.placement);
    gravity_field_down(rig.tree, rig.work.placement, field_of_test<double>(), rig.work.field);
    const double potential = gravity_force_up(rig.tree, rig.constants, rig.work.placement, rig.work.field,
                                              rig.work.first_moment, rig.work.force);
    fill(rig.work.force, vector(rig.work.force) + vector(rig.rate));
    momentum_update_map(rig.tree, rig.constants, rig.h, rig.work.displacement, rig.work.impulse, rig.work.innovation,
                        rig.work.force, rig.state.p);
    CHECK(fused.result(0) == Approx(potential).epsilon(1e-13));
    see(worst, relative_error(vector(fused.state.q), vector(rig.state.q)),
        relative_error(vector(fused.work.force), vector(rig.work.force)),
        relative_error(vector(fused.state.p), vector(rig.state.p)));
    for (Index i = 1; i < rig.tree.shape.slots; ++i) {
      see(worst, relative_error(row<Placement>(fused.work.placement, i), row<Placement>(rig.work.placement, i)));
    }
  }
  INFO("largest difference: " << worst / kEpsilon << " epsilon");
  CHECK(worst < 64 * kEpsilon);
}

TEST_CASE("where nothing moves positions and momenta stay, to the bit, and placements and forces are those of the positions") {
  for (const Model& model : mixed_trees()) {
    Rig<double> rig(model);
    rig.set(random_instance(reference::plain_tree(model), 3, 0.5));
    prepare(rig);
    down_kernel.run(rig);
    up_kernel.run(rig);
    Rig<double> held = rig;
    const Vec3<double> gravity = field_of_test<double>();
    advance_down<true>(held.tree, held.constants, gravity, false, held.work, held.state.q);
    momentum_up<true>(held.tree, held.constants, held.h, false, &held.rate, held.work, held.state.p);
    CHECK(held.state.q == rig.state.q);
    CHECK(held.state.p == rig.state.p);
    CHECK(held.work.force == rig.work.force);
    for (Index i = 1; i < rig.tree.shape.slots; ++i) {
      CHECK(row<Placement>(held.work.placement, i) == row<Placement>(rig.work.placement, i));
    }
  }
}

TEST_CASE("without gravity the forces are those from outside, or none") {
  const Model model = random_tree({.bodies = 6, .seed = 5});
  Rig<double> rig(model);
  rig.set(random_instance(reference::plain_tree(rig.model), 3, 0.1));
  prepare(rig);
  advance_down<false>(rig.tree, rig.constants, Vec3<double>{0, 0, 0}, true, rig.work, rig.state.q);
  CHECK(momentum_up<false>(rig.tree, rig.constants, rig.h, true, &rig.rate, rig.work, rig.state.p) == 0);
  CHECK(rig.work.force == rig.rate);
  const Field<double>* const nothing = nullptr;
  momentum_up<false>(rig.tree, rig.constants, rig.h, true, nothing, rig.work, rig.state.p);
  CHECK(vector(rig.work.force).isZero(0));
}

TEST_CASE("the sweeps at the end of a step write all they are to write and nothing else") {
  check_writes(down_kernel, {"field"});
  check_writes(up_kernel, {"first_moment"});
}

TEST_CASE("the sweeps at the end of a step allocate nothing") {
  check_allocates_nothing(down_kernel);
  check_allocates_nothing(up_kernel);
}

TEST_CASE("the sweeps at the end of a step give equal bits in every lane") {
  check_lanes(down_kernel);
  check_lanes(up_kernel);
}

}  // namespace
}  // namespace linden::advance_down_test

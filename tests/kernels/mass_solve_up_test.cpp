#include "kernels/block/mass_solve_up.hpp"

#include <catch2/catch.hpp>
#include <limits>

#include "tests/kernels/rig.hpp"
#include "tests/reference/mass_matrix_plain.hpp"

namespace linden::mass_solve_up_test {
namespace {

const auto run = [](auto& rig, const auto& added) {
  mass_solve_up(rig.tree, rig.constants, rig.work.placement, rig.right_side, rig.work.articulated, rig.work.gain_down,
                rig.work.joint_inverse, rig.work.bias, rig.work.innovation, added);
};

const auto kernel = make_kernel([](auto& rig) { place(rig); }, [](auto& rig) { run(rig, NothingAdded{}); },
                                {"gain_down", "joint_inverse", "innovation"}, {}, {"articulated", "bias"});

TEST_CASE("mass_solve_up and rate_down apply the inverse of the mass matrix of body Jacobians") {
  double worst = 0;
  for_mixed_instances([&](const PlainTree& tree, const Instance& instance, Rig<double>& rig) {
    place(rig);
    kernel.run(rig);
    pass_down_mass(rig);
    const VectorXd expected = dense_solve(reference::mass_matrix(tree, instance.q), instance.right_side);
    see(worst, relative_error(vector(rig.work.increment), expected));
  });
  INFO("worst relative error: " << worst);
  CHECK(worst < 1e-11);
}

TEST_CASE("mass_solve_up is articulated_inertia_up and impulse_pass_up, whatever is added to joints, and where they are held") {
  constexpr double kHeld = std::numeric_limits<double>::infinity();
  double worst = 0;
  for (const Model& model : mixed_trees()) {
    Rig<double> rig(model);
    rig.set(random_instance(reference::plain_tree(model), 5, 0.1));
    Field<double> stiffness;
    Field<double, 36> none;
    stiffness.allocate(model.tree.shape.velocities);
    for (Index row = 0; row < stiffness.rows(); ++row) stiffness(row) = row % 3 == 0 ? kHeld : row % 3 == 1 ? 0.5 : 0;
    for (const Run& part : model.tree.runs) {  // joints of several degrees of freedom are not held one by one
      if (part.kind == JointKind::screw) continue;
      for (Index i = part.begin; i < part.end; ++i) {
        const double of_each = part.kind == JointKind::ball ? 0.25 : 0;
        for (Index k = 0; k < velocity_count(part.kind); ++k) stiffness(model.tree.first_v(i) + k) = of_each;
      }
    }
    const EffectsAdded<double, true, false> added{stiffness, none};
    Rig<double> apart = rig;
    place(apart);
    articulated_inertia_up(apart.tree, apart.constants, apart.work.placement, apart.work.articulated, apart.gains(), added);
    pass_up(apart, apart.right_side);
    pass_down_mass(apart);
    place(rig);
    run(rig, added);
    pass_down_mass(rig);
    see(worst, relative_error(vector(rig.work.innovation), vector(apart.work.innovation)),
        relative_error(vector(rig.work.joint_inverse), vector(apart.work.joint_inverse)),
        relative_error(vector(rig.work.increment), vector(apart.work.increment)));
    for (Index row = 0; row < stiffness.rows(); ++row) {
      if (stiffness(row) == kHeld) CHECK(rig.work.increment(row) == 0);
    }
  }
  INFO("largest difference: " << worst);
  CHECK(worst < 1e-12);
}

TEST_CASE("mass_solve_up writes all it is to write and nothing else") { check_writes(kernel); }
TEST_CASE("mass_solve_up allocates nothing") { check_allocates_nothing(kernel); }
TEST_CASE("mass_solve_up gives equal bits in every lane") { check_lanes(kernel); }

}  // namespace
}  // namespace linden::mass_solve_up_test

// Loops that close at the nearest body, at the world, and in one dense matrix: the same solve.
#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <numbers>

#include "engine/sweeps/coupling_sweeps.hpp"
#include "engine/sweeps/tree_kernels.hpp"
#include "models/build/coupled_model.hpp"
#include "models/build/generators.hpp"
#include "models/build/random.hpp"
#include "tests/reference/dense_jacobian.hpp"

namespace linden::closures_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Couplings of any kind between bodies anywhere; the last says once more what the first says.
Model with_random_loops(const RandomTree& recipe, int count) {
  Model model = random_tree(recipe);
  Random random(recipe.seed + 1000);
  const auto link = [&] { return model.names.body[1 + random.below(static_cast<std::uint64_t>(model.tree.bodies()))]; };
  const auto frame = [&] {
    Isometry placed = Isometry::Identity();
    placed.linear() = random.rotation().toRotationMatrix();
    placed.translation() = Eigen::Vector3d(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    return placed;
  };
  std::vector<CouplingSpec> specs;
  constexpr CouplingKind kinds[] = {CouplingKind::hinge, CouplingKind::ball, CouplingKind::rod, CouplingKind::point_on_plane, CouplingKind::universal};
  while (static_cast<int>(specs.size()) < count) {
    CouplingSpec spec;
    spec.name = "coupling" + std::to_string(specs.size());
    spec.kind = kinds[specs.size() % std::size(kinds)];
    spec.link_a = link();
    spec.link_b = link();
    spec.frame_a = frame();
    spec.frame_b = frame();
    if (spec.link_a != spec.link_b) specs.push_back(std::move(spec));
  }
  specs.push_back(specs.front());
  specs.back().name = "again";
  return coupled(std::move(model), specs);
}

/// A solve of a step from anywhere, whose residual and positions are anything.
class Solve {
 public:
  explicit Solve(const Model& model) : model_(model) {
    work_.allocate(model.tree.shape);
    q_.allocate(model.tree.shape.positions);
    Random random(7);
    std::ranges::copy(model.neutral(), q_.flat().begin());
    for (Index i = 1; i < model.tree.shape.slots; ++i) {
      if (model.tree.kind(i) == JointKind::screw) q_(model.tree.first_q(i)) += random.uniform(-1, 1);
    }
    placement_map(model.tree, model.constants, q_, all_slots(model.tree), work_.placement);
    for (double& number : work_.delta.flat()) number = random.uniform(-0.05, 0.05);
    for (double& number : work_.residual.flat()) number = random.uniform(-1, 1);
    motion_map(model.tree, model.constants, work_.delta, all_slots(model.tree), work_.motion);
    displacement_down(model.tree, work_.placement, work_.motion, all_slots(model.tree), work_.displacement);
  }

  /// Delta of A Delta + G^T dlambda = r, J Delta = g.
  VectorXd by_sweeps(Closing closing) {
    const Tree& tree = model_.tree;
    const Slots all = all_slots(tree);
    const Gains<double> gains{work_.gain_up, work_.gain_down, work_.joint_inverse};
    MimicTies<double> ties(model_.mimics, tree);
    CouplingSweeps<double> couplings(model_, {}, Serves::till_the_next, closing);
    couplings.place(work_.placement, q_);
    couplings.begin(1e-3);
    couplings.find_gaps(work_.placement, work_.motion, work_.delta, Asked::rows);
    couplings.up_to_closures(
        [&](Slots part) {
          newton_factor_up(tree, model_.constants, work_.placement, work_.motion, work_.displacement, part, work_.articulated, gains, NothingAdded{});
        },
        [&](std::size_t closure) {
          const auto felt = couplings.close(closure, Coupled::step, model_.constants, work_.placement, &work_.motion, gains, ties, true);
          if (couplings.slot_of(closure) != 0) add_inertia(tree, all, couplings.slot_of(closure), felt, work_.articulated);
        });
    couplings.begin_solve(Coupled::step);
    couplings.up_to_closures(
        [&](Slots part) { impulse_pass_up(tree, model_.constants, work_.placement, gains, work_.residual, part, work_.bias, work_.innovation); },
        [&](std::size_t closure) { couplings.yield(closure, Coupled::step, ties, work_.innovation, work_.bias); });
    couplings.down_from_closures(
        [&](Slots part) {
          increment_down<true>(tree, model_.constants, work_.placement, work_.motion, gains, work_.innovation, part, work_.variation, work_.increment);
        },
        [&](std::size_t closure) { couplings.push(closure, Coupled::step, work_.variation, work_.innovation); });
    held_.clear();
    for (std::size_t row = 0; row < couplings.rows(); ++row) held_.push_back(couplings.is_held_already(row));
    return Eigen::Map<const VectorXd>(work_.increment.flat().data(), work_.increment.rows());
  }
  /// Of the sweeps made last.
  const std::vector<bool>& held_already() const { return held_; }

  /// With the rows that the sweeps made last did not take for held.
  VectorXd by_dense_matrix() {
    CouplingRows<double> rows(model_, Closing::nearest);
    rows.place(work_.placement, q_);
    rows.find_gaps(work_.placement, work_.motion, work_.delta, Asked::rows);
    const MatrixXd A = reference::dense_jacobian(model_, work_.placement, work_.motion);
    const Index n = model_.tree.shape.velocities, m = static_cast<Index>(rows.count());
    MatrixXd whole = MatrixXd::Zero(n + m, n + m);
    VectorXd right_side = VectorXd::Zero(n + m);
    whole.topLeftCorner(n, n) = A;
    std::vector<double> unit(static_cast<std::size_t>(m), 0.0);
    Field<double> column;
    column.allocate(n);
    for (Index j = 0; j < m; ++j) {
      if (held_[static_cast<std::size_t>(j)]) continue;
      unit.assign(unit.size(), 0.0);
      unit[static_cast<std::size_t>(j)] = 1;
      const auto sum = [](double now, double pushed) { return now + pushed; };
      std::ranges::fill(column.flat(), 0.0);
      rows.push(unit, rows.at_begin(), column, sum);
      for (Index row = 0; row < n; ++row) whole(row, n + j) = column(row);
      std::ranges::fill(column.flat(), 0.0);
      rows.push(unit, rows.at_end(), column, sum);
      for (Index row = 0; row < n; ++row) whole(n + j, row) = column(row);
      right_side[n + j] = rows.gaps()[static_cast<std::size_t>(j)];
    }
    for (Index row = 0; row < n; ++row) right_side[row] = work_.residual(row);
    return whole.completeOrthogonalDecomposition().solve(right_side).head(n);
  }

 private:
  const Model& model_;
  Workspace<double> work_;
  Field<double> q_;
  std::vector<bool> held_;
};

}  // namespace

TEST_CASE("A solve is the same wherever loops close, and that of one dense matrix") {
  int passed = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    RandomTree recipe{.bodies = 24, .seed = seed};
    recipe.frees = seed % 2 == 0;
    const Model model = with_random_loops(recipe, 1 + static_cast<int>(seed) % 5);
    const CouplingPaths paths(model, Closing::nearest, 1);
    for (const CouplingPath& path : paths.all()) passed += static_cast<int>(path.passed.size());
    Solve solve(model);
    const VectorXd nearest = solve.by_sweeps(Closing::nearest);
    const std::vector<bool> held = solve.held_already();
    CHECK(std::ranges::count(held, true) >= 1);
    const VectorXd at_world = solve.by_sweeps(Closing::at_world);
    const VectorXd dense = solve.by_dense_matrix();
    INFO("seed " << seed << ", largest " << dense.cwiseAbs().maxCoeff());
    const double scale = std::max(1.0, dense.cwiseAbs().maxCoeff());
    CHECK((nearest - dense).cwiseAbs().maxCoeff() < 1e-9 * scale);
    CHECK((at_world - dense).cwiseAbs().maxCoeff() < 1e-9 * scale);
  }
  CHECK(passed > 20);  // loops within loops
}

TEST_CASE("What closes a loop feels what hangs in it, and nothing above") {
  const Model model = generate("ladder:40");
  const CouplingPaths paths(model, Closing::nearest, 1);
  CHECK(paths.closures().size() == 40);
  for (const CouplingPath& path : paths.all()) {
    CHECK(path.joints.size() <= 4);
    CHECK(path.passed.size() <= 1);
  }
  const CouplingPaths at_world(model, Closing::at_world, 1);
  CHECK(at_world.closures().size() == 1);
  CHECK(at_world.all().back().joints.size() > 40);
}

}  // namespace linden::closures_test

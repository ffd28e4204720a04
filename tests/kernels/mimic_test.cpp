#include "kernels/mimic.hpp"

#include <catch2/catch.hpp>

#include "tests/kernels/rig.hpp"
#include "tests/reference/dense_jacobian.hpp"
#include "tests/reference/mass_matrix_plain.hpp"

namespace linden {
namespace {

/// Ties `count` screws, drawn at random, to other screws; a leader may have several followers, followers lead nobody.
std::vector<Mimic> random_ties(const Tree& tree, std::uint64_t seed, std::size_t count) {
  Random random(seed);
  std::vector<Index> screws;
  for (Index i = 1; i < tree.shape.slots; ++i) {
    if (tree.kind(i) == JointKind::screw) screws.push_back(i);
  }
  for (std::size_t k = screws.size(); k > 1; --k) std::swap(screws[k - 1], screws[random.below(k)]);
  REQUIRE(screws.size() > count);
  const std::size_t leaders = std::min(screws.size() - count, count > 1 ? count - 1 : count);
  std::vector<Mimic> ties;
  for (std::size_t k = 0; k < count; ++k) {
    const Index follower = screws[k], leader = screws[count + k % leaders];
    const double multiplier = random.uniform(0.3, 2) * (k % 2 == 0 ? 1 : -1);
    ties.push_back({follower, leader, tree.first_v(follower), tree.first_v(leader), tree.first_q(follower),
                    tree.first_q(leader), multiplier, 0.25});
  }
  return ties;
}

/// A: free coordinates -> all coordinates, Delta = A x.
MatrixXd tie_matrix(const std::vector<Mimic>& ties, Index velocities) {
  MatrixXd A = MatrixXd::Identity(velocities, velocities);
  for (const Mimic& tie : ties) {
    A.row(tie.follower_v).setZero();
    A(tie.follower_v, tie.leader_v) = tie.multiplier;
  }
  MatrixXd result(velocities, velocities - static_cast<Index>(ties.size()));
  Index next = 0;
  for (Index column = 0; column < velocities; ++column) {
    const bool follows =
        std::any_of(ties.begin(), ties.end(), [&](const Mimic& tie) { return tie.follower_v == column; });
    if (!follows) result.col(next++) = A.col(column);
  }
  return result;
}

template <class S>
void solve_newton(Rig<S>& rig, const Field<S>& r, Field<S>& x) {
  pass_up(rig, r);
  pass_down_newton(rig);
  for (Index row = 0; row < x.rows(); ++row) x(row) = rig.work.increment(row);
}

template <class S>
void solve_mass(Rig<S>& rig, const Field<S>& r, Field<S>& x) {
  pass_up(rig, r);
  pass_down_mass(rig);
  for (Index row = 0; row < x.rows(); ++row) x(row) = rig.work.increment(row);
}

std::vector<Model> trees_with_screws() {
  return {random_tree({.bodies = 12, .seed = 31, .frees = false}), random_tree({.bodies = 14, .seed = 32}),
          random_tree({.bodies = 10, .seed = 33, .balls = false, .frees = false, .floating = true})};
}

TEST_CASE("fold_mimics is the transpose of spread_mimics") {
  for (const Model& model : trees_with_screws()) {
    const Index n = model.tree.shape.velocities;
    const std::vector<Mimic> ties = random_ties(model.tree, 1, 3);
    const MatrixXd A = tie_matrix(ties, n);
    Random random(2);
    const VectorXd r = random_vector(random, n, 1), x = random_vector(random, n, 1);
    Field<double> impulse, rate;
    impulse.allocate(n);
    rate.allocate(n);
    fill(impulse, r);
    fill(rate, x);
    fold_mimics<double>(ties, impulse);
    spread_mimics<double>(ties, rate);
    // what is left on the free coordinates is A^T r, and what is spread from them A x
    MatrixXd pick = MatrixXd::Zero(A.cols(), n);
    Index next = 0;
    for (Index row = 0; row < n; ++row) {
      const bool follows =
          std::any_of(ties.begin(), ties.end(), [&](const Mimic& tie) { return tie.follower_v == row; });
      if (follows) CHECK(impulse(row) == 0);
      if (!follows) pick(next++, row) = 1;
    }
    CHECK(relative_error(pick * vector(impulse), A.transpose() * r) < 4 * kEpsilon);
    CHECK(relative_error(vector(rate), A * (pick * x)) < 4 * kEpsilon);
  }
}

TEST_CASE("a tied solve is the dense solve with A^T J A, for the exact Jacobian and for the mass matrix") {
  double worst_newton = 0, worst_mass = 0;
  for (const Model& model : trees_with_screws()) {
    const PlainTree tree = reference::plain_tree(model);
    for (const std::size_t count : {1u, 2u, 3u}) {
      for (const double turn : {1e-3, 0.5, 2.0}) {
        const std::vector<Mimic> ties = random_ties(model.tree, 10 + count, count);
        const MatrixXd A = tie_matrix(ties, tree.velocities);
        const Instance instance = random_instance(tree, 4, turn);
        const auto dense = [&](const MatrixXd& J) {
          const MatrixXd tied = A.transpose() * J * A;
          return VectorXd(A * dense_solve(tied, A.transpose() * instance.right_side));
        };
        Rig<double> rig(model);
        rig.set(instance);
        fold_mimics<double>(ties, rig.right_side);
        MimicTies<double> mimics(ties, tree.velocities);
        CHECK(!mimics.empty());
        CHECK(mimics.mimics().size() == count);
        Field<double> x;
        x.allocate(tree.velocities);

        factor_newton(rig);
        mimics.factor([&](const Field<double>& r, Field<double>& out) { solve_newton(rig, r, out); }, rig.rate);
        solve_newton(rig, rig.right_side, x);
        mimics.complete(x);
        const VectorXd newton = dense(reference::dense_jacobian(model, rig.work.placement, rig.work.motion));
        see(worst_newton, relative_error(vector(x), newton));
        for (const Mimic& tie : ties) CHECK(x(tie.follower_v) == tie.multiplier * x(tie.leader_v));

        factor_mass(rig);
        mimics.factor([&](const Field<double>& r, Field<double>& out) { solve_mass(rig, r, out); }, rig.rate);
        solve_mass(rig, rig.right_side, x);
        mimics.complete(x);
        see(worst_mass, relative_error(vector(x), dense(reference::mass_matrix(tree, instance.q))));
      }
    }
  }
  INFO("worst relative error with the Jacobian: " << worst_newton << ", with M: " << worst_mass);
  CHECK(worst_newton < 1e-10);
  CHECK(worst_mass < 1e-10);
}

TEST_CASE("how an impulse is shared between leader and follower does not matter once it is folded") {
  const Model model = random_tree({.bodies = 12, .seed = 31, .frees = false});
  const PlainTree tree = reference::plain_tree(model);
  const std::vector<Mimic> ties = random_ties(model.tree, 5, 1);
  Rig<double> rig(model);
  rig.set(random_instance(tree, 4, 0.5));
  factor_newton(rig);
  MimicTies<double> mimics(ties, tree.velocities);
  mimics.factor([&](const Field<double>& r, Field<double>& out) { solve_newton(rig, r, out); }, rig.rate);
  const auto solved = [&] {
    Field<double> x;
    x.allocate(tree.velocities);
    solve_newton(rig, rig.right_side, x);
    mimics.complete(x);
    return vector(x);
  };
  const VectorXd unfolded = solved();
  fold_mimics<double>(ties, rig.right_side);
  CHECK(relative_error(solved(), unfolded) < 1e-11);
}

TEST_CASE("two equal wheels geared one to minus two turn as one of five times the inertia") {
  LinkSpec first, second;
  first.name = first.joint = "first";
  second.name = second.joint = "second";
  first.inertia = second.inertia = sphere_inertia(1, 1, Eigen::Vector3d::Zero());
  second.mimic = "first";
  second.multiplier = -2;
  const Model model = TreeBuilder("gear").add(first).add(second).build();
  REQUIRE(model.mimics.size() == 1);
  Rig<double> rig(model);
  fill(rig.state.q, Eigen::Vector2d::Zero());
  fill(rig.work.delta, Eigen::Vector2d::Zero());
  factor_mass(rig);
  MimicTies<double> mimics(model.mimics, 2);
  mimics.factor([&](const Field<double>& r, Field<double>& out) { solve_mass(rig, r, out); }, rig.rate);
  fill(rig.right_side, Eigen::Vector2d(4, 0));
  Field<double> x;
  x.allocate(2);
  solve_mass(rig, rig.right_side, x);
  mimics.complete(x);
  const Mimic& tie = model.mimics[0];
  // 4 on the leader: or, where the builder put the leader second, on the follower, -2 times as much on the leader
  const double push = tie.leader_v == 0 ? 4 : -8;
  CHECK(x(tie.leader_v) == Approx(push / (0.4 * 5)));
  CHECK(x(tie.follower_v) == Approx(-2 * push / (0.4 * 5)));
}

TEST_CASE("ties allocate nothing once they are made") {
  const Model model = random_tree({.bodies = 12, .seed = 31, .frees = false});
  const PlainTree tree = reference::plain_tree(model);
  const std::vector<Mimic> ties = random_ties(model.tree, 5, 3);
  Rig<double> rig(model);
  rig.set(random_instance(tree, 4, 0.5));
  factor_newton(rig);
  MimicTies<double> mimics(ties, tree.velocities);
  Field<double> x;
  x.allocate(tree.velocities);
  const AllocationCounter counter;
  fold_mimics<double>(ties, rig.right_side);
  mimics.factor([&](const Field<double>& r, Field<double>& out) { solve_newton(rig, r, out); }, rig.rate);
  solve_newton(rig, rig.right_side, x);
  mimics.complete(x);
  spread_mimics<double>(ties, x);
  const std::int64_t allocations = counter.count();
  CHECK(allocations == 0);
}

TEST_CASE("a tied solve gives equal bits in every lane") {
  const auto kernel =
      make_kernel([](auto& rig) { factor_newton(rig); },
                  [](auto& rig) {
                    using S = std::decay_t<decltype(rig.h)>;
                    const std::vector<Mimic> ties = random_ties(rig.tree, 6, 2);
                    MimicTies<S> mimics(ties, rig.tree.shape.velocities);
                    mimics.factor([&](const Field<S>& r, Field<S>& out) { solve_newton(rig, r, out); }, rig.rate);
                    fold_mimics<S>(ties, rig.right_side);
                    solve_newton(rig, rig.right_side, rig.work.residual);
                    mimics.complete(rig.work.residual);
                  },
                  {"residual"});
  check_lanes(kernel, kAfterElimination);
}

}  // namespace
}  // namespace linden

#include "kernels/tree/mimic.hpp"

#include <catch2/catch.hpp>

#include "models/build/builder.hpp"
#include "tests/kernels/rig.hpp"
#include "tests/reference/dense_jacobian.hpp"
#include "tests/reference/mass_matrix_plain.hpp"

namespace linden::mimic_test {
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

/// x = A^-1 r of a factor of either kind, tied rows held.
template <class S>
void solve(Rig<S>& rig, bool newton, const Field<S>& r, Field<S>& x) {
  pass_up(rig, r);
  newton ? pass_down_newton(rig) : pass_down_mass(rig);
  for (Index row = 0; row < x.rows(); ++row) x(row) = rig.work.increment(row);
}

template <class S>
void factor_ties(Rig<S>& rig, bool newton, MimicTies<S>& ties) {
  ties.factor([&](const Field<S>& r, Field<S>& x) { solve(rig, newton, r, x); },
              [&](Index i) { return tied_load(rig.tree, rig.constants, rig.gains(), rig.work.bias, rig.work.variation, i); }, rig.rate);
}

/// The factor of the exact Jacobian or of the mass matrix, with what effects add to it, and of the ties.
template <class Added = NothingAdded>
void factor(Rig<double>& rig, bool newton, MimicTies<double>& ties, const Added& added = {}) {
  newton ? factor_newton(rig, ties.held(added)) : factor_mass(rig, ties.held(added));
  factor_ties(rig, newton, ties);
}

/// What the right side of the rig makes all coordinates do.
template <class S>
VectorXd solved(Rig<S>& rig, bool newton, MimicTies<S>& ties) {
  Field<S> x;
  x.allocate(rig.tree.shape.velocities);
  solve(rig, newton, rig.right_side, x);
  ties.complete(x);
  return vector(x);
}

/// The exact Jacobian, or the mass matrix, of all coordinates.
MatrixXd matrix_of(const Model& model, const Rig<double>& rig, const Instance& instance, bool newton) {
  if (newton) return reference::dense_jacobian(model, rig.work.placement, rig.work.motion);
  return reference::mass_matrix(reference::plain_tree(model), instance.q);
}

/// The matrix that the tied solve has to invert on free coordinates.
MatrixXd tied_matrix(const Model& model, const Rig<double>& rig, const Instance& instance, const MatrixXd& A, bool newton) {
  return A.transpose() * matrix_of(model, rig, instance, newton) * A;
}

std::vector<Model> trees_with_screws(Index more = 0) {
  return {random_tree({.bodies = 12 + more, .seed = 31, .frees = false}), random_tree({.bodies = 14 + more, .seed = 32}),
          random_tree({.bodies = 10 + more, .seed = 33, .balls = false, .frees = false, .floating = true})};
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
  double worst[] = {0, 0};
  for (const Model& model : trees_with_screws()) {
    const PlainTree tree = reference::plain_tree(model);
    for (const std::size_t count : {1u, 2u, 3u}) {
      for (const double turn : {1e-3, 0.5, 2.0}) {
        const std::vector<Mimic> ties = random_ties(model.tree, 10 + count, count);
        const MatrixXd A = tie_matrix(ties, tree.velocities);
        const Instance instance = random_instance(tree, 4, turn);
        Rig<double> rig(model);
        rig.set(instance);
        MimicTies<double> mimics(ties, model.tree);
        CHECK(!mimics.empty());
        CHECK(mimics.mimics().size() == count);
        for (const bool newton : {false, true}) {
          factor(rig, newton, mimics);
          const VectorXd x = solved(rig, newton, mimics);
          const MatrixXd dense = tied_matrix(model, rig, instance, A, newton);
          see(worst[newton], relative_error(x, A * dense_solve(dense, A.transpose() * instance.right_side)));
          for (const Mimic& tie : ties) CHECK(x[tie.follower_v] == tie.multiplier * x[tie.leader_v]);
        }
      }
    }
  }
  INFO("worst relative error with M: " << worst[0] << ", with the Jacobian: " << worst[1]);
  CHECK(worst[0] < 1e-10);
  CHECK(worst[1] < 1e-10);
}

/// The bodies of some joints without inertia.
Model without_inertia(Model model, const std::vector<Index>& slots) {
  for (const Index slot : slots) std::fill_n(model.constants.inertia.row(slot), 10, 0.0);
  return model;
}

TEST_CASE("a joint that moves nothing by itself moves with the coordinate that it is part of") {
  enum class Massless { follower, leader, all_but_one };
  double worst[] = {0, 0};
  for (const Model& tree : trees_with_screws(20)) {
    std::vector<Index> leaves;
    for (Index i = 1; i < tree.tree.shape.slots; ++i) {
      if (tree.tree.kind(i) == JointKind::screw && tree.tree.is_leaf(i) != 0) leaves.push_back(i);
    }
    REQUIRE(leaves.size() >= 3);
    const auto tie = [&](Index follower, Index leader, double multiplier) {
      const Tree& t = tree.tree;
      return Mimic{follower, leader, t.first_v(follower), t.first_v(leader), t.first_q(follower), t.first_q(leader), multiplier, 0};
    };
    const std::vector<Mimic> ties{tie(leaves[0], leaves[1], -1.5), tie(leaves[2], leaves[1], 0.25)};
    for (const Massless massless : {Massless::follower, Massless::leader, Massless::all_but_one}) {
      const std::vector<Index> slots = massless == Massless::follower ? std::vector{leaves[0]}
                                       : massless == Massless::leader ? std::vector{leaves[1]}
                                                                      : std::vector{leaves[0], leaves[1]};
      const Model model = without_inertia(tree, slots);
      const PlainTree plain = reference::plain_tree(model);
      const MatrixXd A = tie_matrix(ties, plain.velocities);
      for (const double turn : {1e-3, 0.5}) {
        const Instance instance = random_instance(plain, 4, turn);
        Rig<double> rig(model);
        rig.set(instance);
        MimicTies<double> mimics(ties, model.tree);
        for (const bool newton : {false, true}) {
          factor(rig, newton, mimics);
          const VectorXd x = solved(rig, newton, mimics);
          const MatrixXd dense = tied_matrix(model, rig, instance, A, newton);
          see(worst[newton], relative_error(x, A * dense_solve(dense, A.transpose() * instance.right_side)));
        }
      }
    }
  }
  INFO("worst relative error with M: " << worst[0] << ", with the Jacobian: " << worst[1]);
  CHECK(worst[0] < 1e-10);
  CHECK(worst[1] < 1e-10);
}

TEST_CASE("a coordinate feels the stiffness of all its joints, and what holds one of them holds all") {
  const Model model = random_tree({.bodies = 12, .seed = 31, .frees = false});
  const PlainTree tree = reference::plain_tree(model);
  const std::vector<Mimic> ties = random_ties(model.tree, 5, 3);
  const MatrixXd A = tie_matrix(ties, tree.velocities);
  const Instance instance = random_instance(tree, 4, 0.5);
  Rig<double> rig(model);
  rig.set(instance);
  MimicTies<double> mimics(ties, model.tree);
  Field<double> stiffness;
  const Field<double, 36> none;
  const Index leader = ties[0].leader_v;
  const auto is_of_leader = [&](const Mimic& tie) { return tie.leader_v == leader; };
  REQUIRE(std::ranges::count_if(ties, is_of_leader) < 3);
  for (const bool newton : {false, true}) {
    stiffness.allocate(tree.velocities);
    Random random(8);
    for (const Mimic& tie : ties) {
      stiffness(tie.leader_v) = random.uniform(0.1, 3);
      stiffness(tie.follower_v) = random.uniform(0.1, 3);
    }
    factor(rig, newton, mimics, EffectsAdded<double, true, false>{stiffness, none});
    MatrixXd matrix = matrix_of(model, rig, instance, newton);
    matrix.diagonal() += vector(stiffness);
    const VectorXd x = solved(rig, newton, mimics);
    CHECK(relative_error(x, A * dense_solve(A.transpose() * matrix * A, A.transpose() * instance.right_side)) < 1e-11);

    stiffness(leader) = std::numeric_limits<double>::infinity();
    factor(rig, newton, mimics, EffectsAdded<double, true, false>{stiffness, none});
    matrix(leader, leader) = 0;  // what is held has no column: its row is the impulse that holds it
    MatrixXd others(A.rows(), 0);
    for (Index c = 0; c < A.cols(); ++c) {
      if (A(leader, c) != 0) continue;
      others.conservativeResize(Eigen::NoChange, others.cols() + 1);
      others.rightCols<1>() = A.col(c);
    }
    REQUIRE(others.cols() == A.cols() - 1);
    const VectorXd held = solved(rig, newton, mimics);
    const MatrixXd left = others.transpose() * matrix * others;
    CHECK(relative_error(held, others * dense_solve(left, others.transpose() * instance.right_side)) < 1e-11);
    CHECK(held[leader] == 0);
    for (const Mimic& tie : ties) {
      if (is_of_leader(tie)) CHECK(held[tie.follower_v] == 0);
    }
  }
}

TEST_CASE("how an impulse is shared between leader and follower does not matter once it is folded") {
  const Model model = random_tree({.bodies = 12, .seed = 31, .frees = false});
  const PlainTree tree = reference::plain_tree(model);
  const std::vector<Mimic> ties = random_ties(model.tree, 5, 1);
  Rig<double> rig(model);
  rig.set(random_instance(tree, 4, 0.5));
  MimicTies<double> mimics(ties, model.tree);
  factor(rig, true, mimics);
  const VectorXd unfolded = solved(rig, true, mimics);
  fold_mimics<double>(ties, rig.right_side);
  CHECK(relative_error(solved(rig, true, mimics), unfolded) < 1e-11);
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
  MimicTies<double> mimics(model.mimics, model.tree);
  factor(rig, false, mimics);
  fill(rig.right_side, Eigen::Vector2d(4, 0));
  const VectorXd x = solved(rig, false, mimics);
  const Mimic& tie = model.mimics[0];
  // 4 on the leader: or, where the builder put the leader second, on the follower, -2 times as much on the leader
  const double push = tie.leader_v == 0 ? 4 : -8;
  CHECK(x[tie.leader_v] == Approx(push / (0.4 * 5)));
  CHECK(x[tie.follower_v] == Approx(-2 * push / (0.4 * 5)));
}

TEST_CASE("ties allocate nothing once they are made") {
  const Model model = random_tree({.bodies = 12, .seed = 31, .frees = false});
  const PlainTree tree = reference::plain_tree(model);
  const std::vector<Mimic> ties = random_ties(model.tree, 5, 3);
  Rig<double> rig(model);
  rig.set(random_instance(tree, 4, 0.5));
  find_momenta(rig);
  MimicTies<double> mimics(ties, model.tree);
  Field<double> x;
  x.allocate(tree.velocities);
  const AllocationCounter counter;
  fold_mimics<double>(ties, rig.right_side);
  factor(rig, true, mimics);
  solve(rig, true, rig.right_side, x);
  mimics.complete(x);
  mimics.yields(rig.work.joint_inverse);
  spread_mimics<double>(ties, x);
  const std::int64_t allocations = counter.count();
  CHECK(allocations == 0);
}

TEST_CASE("a tied solve gives equal bits in every lane") {
  const auto kernel = make_kernel([](auto&) {},
                                  [](auto& rig) {
                                    using S = std::decay_t<decltype(rig.h)>;
                                    const std::vector<Mimic> ties = random_ties(rig.tree, 6, 2);
                                    MimicTies<S> mimics(ties, rig.tree);
                                    rig.rounding = kRoundingAfterElimination;
                                    factor_mass(rig, mimics.held(NothingAdded{}));
                                    factor_ties(rig, false, mimics);
                                    fold_mimics<S>(ties, rig.right_side);
                                    solve(rig, false, rig.right_side, rig.work.residual);
                                    mimics.complete(rig.work.residual);
                                  },
                                  {"residual"});
  check_lanes(kernel);
}

}  // namespace
}  // namespace linden::mimic_test

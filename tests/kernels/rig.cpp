#include "tests/kernels/rig.hpp"

namespace linden {

namespace {

/// Levels of 9 and 18 bodies, more than a register holds; they turn, slide or do both.
Model wide_tree() {
  Model model = balanced_tree(28, 9);
  for (Index i = 1; i < model.tree.shape.slots; ++i) {
    model.constants.screw(i, 0) = i % 3 == 0 ? 0 : 1;
    model.constants.screw(i, 1) = i % 3 == 1 ? 0 : 1 - 0.9 * (i % 3 == 2);
  }
  return model;
}

}  // namespace

std::vector<Model> mixed_trees() {
  std::vector<Model> models;
  models.push_back(random_tree({.bodies = 12, .seed = 11}));
  models.push_back(random_tree({.bodies = 14, .seed = 12, .frees = false}));
  models.push_back(random_tree({.bodies = 10, .seed = 13, .frees = false, .floating = true}));
  models.push_back(random_tree({.bodies = 10, .seed = 14, .frees = false, .mass_decades = 6}));
  models.push_back(random_tree({.bodies = 9, .seed = 15, .balls = false, .frees = false}));
  models.push_back(random_tree({.bodies = 6, .seed = 16, .screws = false}));
  models.push_back(wide_tree());
  return models;
}

VectorXd random_vector(Random& random, Index size, double bound) {
  VectorXd result(size);
  for (double& x : result) x = random.uniform(-bound, bound);
  return result;
}

double turn_between(const reference::Matrix4<double>& a, const reference::Matrix4<double>& b) {
  const double cosine = ((a.topLeftCorner<3, 3>().transpose() * b.topLeftCorner<3, 3>()).trace() - 1) / 2;
  return std::acos(std::clamp(cosine, -1.0, 1.0));
}

double largest_turn(const PlainTree& tree, const VectorXd& q, const VectorXd& delta) {
  const auto before = reference::poses(tree, q), after = reference::poses(tree, reference::advanced(tree, q, delta));
  double largest = 0;
  for (Index i = 1; i < tree.slots(); ++i) {
    const PlainBody& body = tree.body(i);
    largest = std::max(largest, turn_between(before[static_cast<std::size_t>(i)], after[static_cast<std::size_t>(i)]));
    largest = std::max(largest, (body.S * delta.segment(body.v, body.dofs())).head<3>().norm());
  }
  return largest;
}

Instance random_instance(const PlainTree& tree, std::uint64_t seed, double turn) {
  Random random(seed);
  Instance instance;
  VectorXd neutral = VectorXd::Zero(tree.positions);
  for (Index i = 1; i < tree.slots(); ++i) {
    if (tree.body(i).kind != JointKind::screw) neutral[tree.body(i).q + position_count(tree.body(i).kind) - 1] = 1;
  }
  instance.q = reference::advanced(tree, neutral, random_vector(random, tree.velocities, 1.5));
  const VectorXd direction = random_vector(random, tree.velocities, 1);
  double reached = turn / 64, beyond = turn / 64;
  if (turn < 1e-3) {
    instance.delta = turn * direction;  // angles of matrices are too coarse to measure
  } else {
    while (beyond < 8 && largest_turn(tree, instance.q, beyond * direction) < turn) {
      reached = beyond;
      beyond *= 1.05;
    }
    for (int cut = 0; cut < 30; ++cut) {
      const double middle = (reached + beyond) / 2;
      (largest_turn(tree, instance.q, middle * direction) < turn ? reached : beyond) = middle;
    }
    instance.delta = reached * direction;
  }
  instance.p = random_vector(random, tree.velocities, 1);
  instance.rate = random_vector(random, tree.velocities, 1);
  instance.force = random_vector(random, tree.velocities, 1);
  instance.right_side = random_vector(random, tree.velocities, 1);
  return instance;
}

VectorXd dense_solve(const MatrixXd& A, const VectorXd& b) { return A.partialPivLu().solve(b); }

#define LINDEN_HERE
LINDEN_RIG_SWEEPS(LINDEN_HERE, double);
LINDEN_RIG_SWEEPS(LINDEN_HERE, Pack);

}  // namespace linden

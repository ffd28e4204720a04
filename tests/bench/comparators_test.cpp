#include <catch2/catch.hpp>

#include "bench/comparators/broyden.hpp"
#include "bench/comparators/drnea.hpp"
#include "bench/comparators/integrator.hpp"
#include "bench/comparators/newton_dense.hpp"
#include "bench/comparators/svi.hpp"
#include "bench/comparators/svi_log.hpp"
#include "engine/initial_state.hpp"
#include "engine/simulation.hpp"
#include "kernels/tree/gravity.hpp"
#include "kernels/tree/placement_map.hpp"
#include "models/build/generators.hpp"
#include "models/build/random.hpp"
#include "tests/reference/dense_jacobian_plain.hpp"
#include "tests/reference/mass_matrix_plain.hpp"

namespace linden::comparators {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

const Vec3d kGravity{1.5, -2, -9.81};

/// Hinges, slides and helices.
std::vector<Model> screw_trees() {
  std::vector<Model> models;
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    models.push_back(random_tree({.bodies = 11, .seed = seed, .balls = false, .frees = false}));
  }
  models.push_back(chain(7));
  return models;
}

VectorXd random_vector(Index size, std::uint64_t seed, double bound) {
  Random random(seed);
  VectorXd result(size);
  for (double& x : result) x = random.uniform(-bound, bound);
  return result;
}

/// A step of some size from a random state.
struct Step {
  const Model& model;
  State<double> state;
  Workspace<double> work;
  Field<double> delta, hr;
  double h;

  Step(const Model& of, double size, double seconds = 1e-2) : model(of), h(seconds) {
    state.allocate(model.tree.shape);
    work.allocate(model.tree.shape);
    for (Field<double>* field : {&delta, &hr}) field->allocate(model.tree.shape.velocities);
    const Index n = model.tree.shape.velocities;
    vector(state.q) = random_vector(n, 5, 1);
    vector(state.p) = random_vector(n, 6, 1);
    vector(delta) = random_vector(n, 7, size);
    place();
  }
  void place() {
    placement_map(model.tree, model.constants, state.q, work.placement);
    gravity_field_down(model.tree, work.placement, kGravity, work.field);
    gravity_force_up(model.tree, model.constants, work.placement, work.field, work.first_moment, work.force);
  }
  StepStart start() const { return {state, work, kGravity, h}; }
  VectorXd residual(Equation& equation) {
    equation.begin(start());
    REQUIRE(equation.residual(delta, hr));
    return vector(hr);
  }
};

double relative_difference(const MatrixXd& found, const MatrixXd& expected) {
  return (found - expected).norm() / expected.norm();
}

TEST_CASE("Algorithm 4 is the derivative of the paper's residual, by dual numbers, in small steps and in large ones") {
  for (const Model& model : screw_trees()) {
    const reference::PlainTree tree = reference::plain_tree(model);
    for (const double size : {1e-3, 0.3}) {
      Step step(model, size);
      Drnea drnea(model);
      step.residual(drnea);
      MatrixXd J;
      drnea.jacobian(J);
      const VectorXd q = vector(step.state.q), next = q + vector(step.delta);
      const MatrixXd expected = reference::dense_jacobian_plain(tree, q, next);
      CHECK(relative_difference(J, expected) < 1e-11);
    }
  }
}

TEST_CASE("sums over bodies and coordinates find the residual, the derivative and the momentum that the recursions find") {
  for (const Model& model : screw_trees()) {
    for (const double size : {1e-3, 0.3}) {
      Step step(model, size);
      Drnea drnea(model);
      SviLog sums(model);
      const VectorXd expected = step.residual(drnea);
      CHECK(relative_difference(step.residual(sums), expected) < 1e-13);

      MatrixXd J, J_sums;
      drnea.jacobian(J);
      sums.jacobian(J_sums);
      CHECK(relative_difference(J_sums, J) < 1e-13);
    }
    // at the end of a step, the one after a root has been found
    Settings settings{.gravity = kGravity};
    settings.stop.tolerance = 1e-12;
    settings.root_finding = RootFinding::newton_dense;
    Integrator drnea(model, settings);
    settings.evaluation = Evaluation::svi_log;
    Integrator sums(model, settings);
    const VectorXd q = random_vector(model.tree.shape.velocities, 8, 1), v = random_vector(model.tree.shape.velocities, 9, 1);
    const auto span = [](const VectorXd& x) { return std::span(x.data(), static_cast<std::size_t>(x.size())); };
    for (Integrator* integrator : {&drnea, &sums}) integrator->set(span(q), span(v));
    REQUIRE(drnea.step().converged);
    REQUIRE(sums.step().converged);
    for (std::size_t row = 0; row < drnea.momenta().size(); ++row) {
      CHECK(sums.momenta()[row] == Approx(drnea.momenta()[row]).epsilon(1e-10).margin(1e-11));
    }
  }
}

/// h L at the mean position and mean velocity, varied at the begin or the end of the step.
VectorXd midpoint_action_slope(const reference::PlainTree& tree, const VectorXd& q, const VectorXd& delta, double h,
                               double sign) {
  const VectorXd middle = q + 0.5 * delta;
  const Eigen::Vector3d g(kGravity.x, kGravity.y, kGravity.z);
  return reference::gradient(tree.velocities, [&](const auto& eps) {
    using T = reference::Dual<8>;
    const auto pose = reference::poses<T>(tree, middle, eps * T(0.5));
    const reference::VectorX<T> v = (delta.cast<T>() + eps * T(sign)) / T(h);
    T action(0.0);
    for (Index i = 1; i < tree.slots(); ++i) {
      const reference::Vector6<T> V = reference::body_jacobian<T>(tree, pose, i) * v;
      const reference::Vector6<T> m = tree.body(i).G.cast<T>() * V;
      const auto& X = pose[static_cast<std::size_t>(i)];
      const reference::Vector3<T> moment = X.template topLeftCorner<3, 3>() * tree.body(i).moment().cast<T>() +
                                           T(tree.body(i).mass()) * X.template topRightCorner<3, 1>();
      action = action + T(h) * (T(0.5) * V.dot(m) + g.cast<T>().dot(moment));
    }
    return action;
  });
}

TEST_CASE("SVI's residual and momentum are the slopes of its discrete action, brute force") {
  for (const Model& model : screw_trees()) {
    const reference::PlainTree tree = reference::plain_tree(model);
    Step step(model, 0.3);
    Svi svi(model);
    const VectorXd residual = step.residual(svi);
    const VectorXd q = vector(step.state.q), delta = vector(step.delta), p = vector(step.state.p);
    const VectorXd at_begin = midpoint_action_slope(tree, q, delta, step.h, -1);
    CHECK(relative_difference(residual, -step.h * (at_begin + p)) < 1e-12);

    Field<double> momentum;
    momentum.allocate(model.tree.shape.velocities);
    svi.momentum(step.start(), momentum);
    CHECK(relative_difference(vector(momentum), midpoint_action_slope(tree, q, delta, step.h, 1)) < 1e-12);
  }
}

TEST_CASE("SVI's second derivatives are the differences of its residual") {
  for (const Model& model : screw_trees()) {
    Step step(model, 0.3, 0.1);  // so long a step that gravity has its share in the derivative
    Svi svi(model);
    step.residual(svi);
    MatrixXd J;
    svi.jacobian(J);
    MatrixXd expected(J.rows(), J.cols());
    const auto varied = [&](Index j, double by) {
      const double before = step.delta(j);
      step.delta(j) += by;
      const VectorXd result = step.residual(svi);
      step.delta(j) = before;
      return result;
    };
    constexpr double kStep = 1e-3;
    for (Index j = 0; j < J.cols(); ++j) {
      // fourth order
      const VectorXd near = varied(j, kStep) - varied(j, -kStep), far = varied(j, 2 * kStep) - varied(j, -2 * kStep);
      expected.col(j) = (8 * near - far) / (12 * kStep);
    }
    CHECK(relative_difference(J, expected) < 1e-9);
  }
}

/// Positions after some steps of every kind.
VectorXd trajectory(const Model& model, const Settings& settings, int steps, int most_iterations = 1000) {
  Integrator integrator(model, settings);
  const InitialState start = random_state(model, 4, 0.5);
  integrator.set(start.positions, start.velocities);
  for (int k = 0; k < steps; ++k) {
    const Solved solved = integrator.step();
    REQUIRE(solved.converged);
    REQUIRE(solved.iterations <= most_iterations);
  }
  return Eigen::Map<const VectorXd>(integrator.positions().data(), static_cast<Eigen::Index>(integrator.positions().size()));
}

TEST_CASE("every root finder follows the same trajectory, that of the engine") {
  for (const Model& model : screw_trees()) {
    Simulation simulation(model, {.step = 1e-3, .gravity = {kGravity.x, kGravity.y, kGravity.z}});
    const InitialState start = random_state(model, 4, 0.5);
    simulation.set_positions(start.positions);
    simulation.set_velocities(start.velocities);
    for (int k = 0; k < 50; ++k) REQUIRE(simulation.step().ok());
    const VectorXd expected =
        Eigen::Map<const VectorXd>(simulation.positions().data(), static_cast<Eigen::Index>(simulation.positions().size()));
    for (const Evaluation evaluation : {Evaluation::drnea, Evaluation::svi_log, Evaluation::svi}) {
      for (const RootFinding root_finding : {RootFinding::riqn, RootFinding::newton_dense, RootFinding::broyden,
                                             RootFinding::broyden_kept, RootFinding::newton_linear}) {
        if (root_finding == RootFinding::newton_linear && evaluation != Evaluation::drnea) continue;
        INFO(name(root_finding, evaluation));
        Settings settings{.evaluation = evaluation, .root_finding = root_finding, .gravity = kGravity};
        settings.stop.tolerance = 1e-12;
        const VectorXd found = trajectory(model, settings, 50);
        // SVI's equation is another one of the same order
        CHECK((found - expected).norm() < (evaluation == Evaluation::svi ? 1e-4 : 1e-9));
      }
    }
  }
}

TEST_CASE("Newton needs no more than three corrections, with DRNEA's derivative and with SVI's") {
  for (const Evaluation evaluation : {Evaluation::drnea, Evaluation::svi_log, Evaluation::svi}) {
    Settings settings{.evaluation = evaluation, .root_finding = RootFinding::newton_dense, .gravity = kGravity};
    settings.stop.tolerance = 1e-11;
    trajectory(chain(20), settings, 20, 3);
  }
}

/// A x - b = 0
class Linear : public Equation {
 public:
  MatrixXd A;
  VectorXd b;
  void begin(const StepStart&) override {}
  bool residual(const Field<double>& x, Field<double>& r) override {
    vector(r) = A * vector(x) - b;
    return true;
  }
  void jacobian(MatrixXd& J) override { J = A; }
  void momentum(const StepStart&, Field<double>&) override {}
};

TEST_CASE("Broyden's method solves a linear equation of n unknowns in 2n corrections, whatever Jacobian it kept") {
  constexpr Index n = 5;
  Linear equation;
  Field<double> x, r;
  x.allocate(n);
  r.allocate(n);
  Broyden broyden(FirstJacobian::kept);
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    equation.A = 2 * MatrixXd::Identity(n, n) + random_vector(n * n, seed, 0.5).reshaped(n, n);
    equation.b = random_vector(n, seed + 10, 1);
    vector(x).setZero();
    Solved solved;
    broyden.solve(equation, 1, {.tolerance = 1e-9, .max_iterations = 2 * n}, x, r, solved);
    INFO(solved.iterations << " corrections");
    CHECK(solved.converged);
    // the first equation's differences are exact; what is kept from it is wrong for the next
    if (seed > 1) CHECK(solved.iterations > 2);
  }
}

TEST_CASE("SVI and DRNEA differ by the square of the step") {
  const Model model = chain(5);
  const auto difference = [&](double h) {
    Settings settings{.root_finding = RootFinding::newton_dense, .step = h, .gravity = kGravity};
    const int steps = static_cast<int>(std::lround(0.1 / h));
    const VectorXd drnea = trajectory(model, settings, steps);
    settings.evaluation = Evaluation::svi;
    return (trajectory(model, settings, steps) - drnea).norm();
  };
  const double ratio = difference(4e-3) / difference(2e-3);
  CHECK(ratio > 3.8);
  CHECK(ratio < 4.2);
}

TEST_CASE("a step that does not converge says so and leaves the state as it was") {
  const Model model = chain(6);
  Settings settings{.stop = {.tolerance = 1e-300, .max_iterations = 4}};
  Integrator integrator(model, settings);
  const InitialState start = random_state(model, 4, 0.5);
  integrator.set(start.positions, start.velocities);
  std::vector<double> residuals;
  const Solved solved = integrator.step(&residuals);
  CHECK_FALSE(solved.converged);
  CHECK(solved.iterations == 4);
  CHECK(residuals.size() == 5);
  CHECK(std::ranges::equal(integrator.positions(), start.positions));
}

TEST_CASE("Newton in O(n) solves with the derivative of Algorithm 4") {
  for (const Model& model : screw_trees()) {
    Step step(model, 0.3);
    Drnea drnea(model);
    const VectorXd r = step.residual(drnea);
    MatrixXd J;
    drnea.jacobian(J);
    drnea.factor();
    Field<double> x = step.delta;
    drnea.apply_inverse(step.hr, x);
    CHECK(relative_difference(J * vector(x), r) < 1e-11);
  }
  CHECK_THROWS_AS(Integrator(chain(3), {.evaluation = Evaluation::svi, .root_finding = RootFinding::newton_linear}),
                  std::invalid_argument);
}

TEST_CASE("joints of more than one degree of freedom are refused") {
  CHECK_THROWS_AS(Integrator(ball_chain(3), Settings{}), std::invalid_argument);
}

}  // namespace
}  // namespace linden::comparators

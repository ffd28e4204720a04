#include "kernels/tree/displacement_down.hpp"

#include <catch2/catch.hpp>

#include "tests/kernels/rig.hpp"

namespace linden::displacement_down_test {
namespace {

const auto kernel = make_kernel([](auto& rig) { place(rig); },
                                [](auto& rig) {
                                  rig.result(0) = displacement_down(rig.tree, rig.work.placement, rig.work.motion,
                                                                    rig.work.displacement);
                                },
                                {"displacement", "result"});

/// dT_i by (19) literally, in long double, from the placements and motions as they are stored. What was rounded is not
/// quite a rotation: a transpose that is no inverse, or a quaternion not of unit length, would drown a small step.
std::vector<reference::Matrix4<long double>> literal_displacements(const Rig<double>& rig) {
  using Matrix = reference::Matrix4<long double>;
  std::vector<Matrix> result(static_cast<std::size_t>(rig.tree.shape.slots), Matrix::Identity());
  for (Index i = 1; i < rig.tree.shape.slots; ++i) {
    const Matrix X = row<Placement>(rig.work.placement, i).cast<long double>();
    const auto motion = load<Displacement, double>(rig.work.motion, i);
    Matrix M = Matrix::Identity();
    M.topLeftCorner<3, 3>() = reference::rotation_matrix<long double>(eigen(motion.r).cast<long double>().normalized());
    M.topRightCorner<3, 1>() = eigen(motion.p).cast<long double>();
    const Matrix& parent = result[static_cast<std::size_t>(rig.tree.parent(i))];
    result[static_cast<std::size_t>(i)] = X.inverse() * parent * X * M;
  }
  return result;
}

TEST_CASE("displacement_down is T(k)^-1 T(k+1) of bodies placed in the world by 4 x 4 matrices") {
  double worst = 0;
  for (const Model& model : mixed_trees()) {
    const PlainTree tree = reference::plain_tree(model);
    for (const double turn : {1e-3, 0.3, 2.0, 3.0}) {
      const Instance instance = random_instance(tree, 7, turn);
      Rig<double> rig(model);
      rig.set(instance);
      kernel.prepare(rig);
      kernel.run(rig);
      const auto before = reference::poses(tree, instance.q);
      const auto after = reference::poses(tree, reference::advanced(tree, instance.q, instance.delta));
      double least = 1;
      for (Index i = 1; i < tree.slots(); ++i) {
        const auto at = static_cast<std::size_t>(i);
        const reference::Matrix4<double> expected = reference::inverse<double>(before[at]) * after[at];
        see(worst, (row<Displacement>(rig.work.displacement, i) - expected).cwiseAbs().maxCoeff());
        const PlainBody& body = tree.body(i);
        const double own = (body.S * instance.delta.segment(body.v, body.dofs())).head<3>().norm();
        least = std::min({least, std::cos(own / 2), std::cos(turn_between(before[at], after[at]) / 2)});
      }
      CHECK(rig.result(0) == Approx(least).epsilon(0).margin(1e-7));
      if (turn > 1) CHECK(rig.result(0) == Approx(std::cos(turn / 2)).epsilon(1e-4));
    }
  }
  INFO("worst difference: " << worst / kEpsilon << " epsilon");
  CHECK(worst < 64 * kEpsilon);
}

TEST_CASE("the world does not move") {
  const Model model = chain(3);
  Rig<double> rig(model);
  rig.set(random_instance(reference::plain_tree(model), 1, 0.1));
  kernel.prepare(rig);
  kernel.run(rig);
  const auto world = numbers_of<double>(load<Displacement, double>(rig.work.displacement, 0));
  CHECK(world == std::array<double, 7>{0, 0, 0, 1, 0, 0, 0});
}

TEST_CASE("a step of 1e-12 rad keeps its relative accuracy: log dT is the body's Jacobian times delta") {
  double worst = 0;
  for (const Model& model : mixed_trees()) {
    const PlainTree tree = reference::plain_tree(model);
    const Instance instance = random_instance(tree, 3, 1e-12);
    Rig<double> rig(model);
    rig.set(instance);
    kernel.prepare(rig);
    kernel.run(rig);
    // the first order of dT; the second is 1e-12 of it
    std::vector<reference::Vector6<double>> twist(tree.bodies.size(), reference::Vector6<double>::Zero());
    for (Index i = 1; i < tree.slots(); ++i) {
      const PlainBody& body = tree.body(i);
      const auto X = row<Placement>(rig.work.placement, i);
      auto& u = twist[static_cast<std::size_t>(i)];
      u = reference::adjoint<double>(reference::inverse<double>(X)) * twist[static_cast<std::size_t>(body.parent)] +
          body.S * instance.delta.segment(body.v, body.dofs());
      const auto D = load<Displacement, double>(rig.work.displacement, i);
      see(worst, relative_error(2 * eigen(D.r).head<3>(), u.head<3>()), relative_error(eigen(D.p), u.tail<3>()));
    }
  }
  INFO("worst relative error: " << worst);
  CHECK(worst < 1e-11);
}

TEST_CASE("a middling step agrees with (19) in long double to a few epsilon of its own size") {
  double worst = 0;
  for (const Model& model : mixed_trees()) {
    Rig<double> rig(model);
    rig.set(random_instance(reference::plain_tree(model), 3, 1e-2));
    kernel.prepare(rig);
    kernel.run(rig);
    const auto expected = literal_displacements(rig);
    for (Index i = 1; i < rig.tree.shape.slots; ++i) {
      const auto truth = reference::log<long double>(expected[static_cast<std::size_t>(i)]).cast<double>().eval();
      see(worst, relative_error(eigen(log(load<Displacement, double>(rig.work.displacement, i))), truth));
    }
  }
  INFO("worst relative error of log dT: " << worst / kEpsilon << " epsilon");
  CHECK(worst < 64 * kEpsilon);
}

TEST_CASE("a chain of 1,000 links ends where (19) in long double says") {
  const Model model = chain(1000);
  Rig<double> rig(model);
  Random random(9);
  for (Index k = 0; k < 1000; ++k) {
    rig.state.q(k) = random.uniform(-1, 1);
    rig.work.delta(k) = random.uniform(-0.01, 0.01);
  }
  kernel.prepare(rig);
  kernel.run(rig);
  const auto expected = literal_displacements(rig);
  double worst = 0;
  for (Index i = 1; i <= 1000; ++i) {
    const auto truth = reference::log<long double>(expected[static_cast<std::size_t>(i)]).cast<double>().eval();
    see(worst, relative_error(eigen(log(load<Displacement, double>(rig.work.displacement, i))), truth));
  }
  INFO("worst relative error of log dT: " << worst / kEpsilon << " epsilon");
  CHECK(worst < 200 * kEpsilon);
}

TEST_CASE("a body that turns by more than pi is seen, whether its joint turns so far or its parents add up") {
  const auto least = [](const Model& model, double delta) {
    Rig<double> rig(model);
    fill(rig.state.q, VectorXd::Zero(model.tree.shape.positions));
    fill(rig.work.delta, VectorXd::Constant(model.tree.shape.velocities, delta));
    kernel.prepare(rig);
    kernel.run(rig);
    return rig.result(0);
  };
  CHECK(least(paper_chain(1), 3.1) > 0);
  CHECK(least(paper_chain(1), 3.15) < 0);
  CHECK(least(paper_chain(3), 1.04) > 0);
  CHECK(least(paper_chain(3), 1.05) < 0);
  // a joint turned by more than pi under a parent that turns back as far
  const Model pair = paper_chain(2);
  Rig<double> rig(pair);
  fill(rig.state.q, Eigen::Vector2d::Zero());
  fill(rig.work.delta, Eigen::Vector2d(3.0, -3.3));
  kernel.prepare(rig);
  kernel.run(rig);
  CHECK(rig.result(0) < 0);
}

TEST_CASE("displacement_down writes every displacement and nothing else") { check_writes(kernel, {"displacement"}); }
TEST_CASE("displacement_down allocates nothing") { check_allocates_nothing(kernel); }
TEST_CASE("displacement_down gives equal bits in every lane") { check_lanes(kernel); }

}  // namespace
}  // namespace linden::displacement_down_test

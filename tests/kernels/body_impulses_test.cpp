#include "kernels/effects/body_impulses.hpp"

#include <Eigen/Core>
#include <catch2/catch.hpp>
#include <cmath>

#include "kernels/effects/drag.hpp"
#include "kernels/effects/wrench.hpp"

namespace linden::body_impulses_test {
namespace {

constexpr double kStep = 1e-3;

using Vector6 = Eigen::Matrix<double, 6, 1>;

/// One body whose frame stands turned in the world.
struct TouchedOnce {
  BodyImpulses<double> sum;
  Field<double, 6> impulse;
  Field<double, 7> displacement;
  Displacement<double> D = exp(Twist<double>{{0.02, -0.03, 0.01}, {2e-3, -1e-3, -3e-3}});

  TouchedOnce() {
    const Shape shape{.slots = 2, .positions = 7, .velocities = 6, .blocks = 36};
    sum.allocate(shape);
    impulse.allocate(2);
    displacement.allocate(2);
    store(sum.pose, 1, Placement<double>{rotation(exp(Twist<double>{{0.3, 0.2, -0.4}, {0, 0, 0}}).r), {0.1, 0.2, 0.3}});
  }
  /// What `effect` adds to the impulse of the beginning, once the body is moved by eta further.
  template <class Effect>
  Vector6 added(const Effect& effect, const Vector6& eta) {
    clear_body(sum, 1);
    for (int k = 0; k < 6; ++k) impulse(1, k) = 0;
    store(displacement, 1, D * exp(Twist<double>{{eta[0], eta[1], eta[2]}, {eta[3], eta[4], eta[5]}}));
    effect(*this);
    return Eigen::Map<const Vector6>(impulse.row(1));
  }
};

/// The factor's share of an effect is the derivative of what it adds.
template <class Effect>
void check_derivative(const Effect& effect) {
  TouchedOnce body;
  constexpr double kMove = 1e-7;
  for (int k = 0; k < 6; ++k) {
    const Vector6 eta = kMove * Vector6::Unit(k);
    const Vector6 difference = (body.added(effect, eta) - body.added(effect, -eta)) / (2 * kMove);
    body.added(effect, Vector6::Zero());
    const auto pull = Mat6<double>::from(body.sum.body_stiffness.row(1));
    const Wrench<double> w =
        pull * Twist<double>{{eta[0] / kMove, eta[1] / kMove, eta[2] / kMove}, {eta[3] / kMove, eta[4] / kMove, eta[5] / kMove}};
    Vector6 derivative;
    w.to(derivative.data());
    INFO("direction " << k << ": " << difference.transpose() << " and " << derivative.transpose());
    CHECK((difference - derivative).norm() < 1e-5 * (difference.norm() + 1e-9));
  }
}

}  // namespace

TEST_CASE("the factor's share of drag is the derivative of its force") {
  BodyConstants<double> constants;
  constants.allocate({.slots = 2, .positions = 7, .velocities = 6, .blocks = 36});
  constants.inertia(1, 0) = 2;
  constants.inertia(1, 1) = 0.2;
  constants.inertia(1, 3) = -0.1;
  const std::vector<Drag> entries{{.slot = 1, .linear = 3, .quadratic = 5}};
  const std::vector<double> share{0.7};
  check_derivative([&](TouchedOnce& body) {
    Drags<double> drags{entries, share, {1, -2, 0.5}, {}};
    drags.loss.allocate(1);
    drag_map(drags, 0, 1, constants, kStep, body.displacement, body.sum, body.impulse);
  });
}

TEST_CASE("forces of both ends are one wrench in space") {
  TouchedOnce body;
  const std::vector<BodyWrench> entries{{.slot = 1, .point = {0.1, 0, 0.2}, .force = {3, 1, -2}, .moment = {0.1, 0.2, 0.3}, .in_world = false}};
  Wrenches<double> wrenches{entries, {}, {}};
  wrenches.scale.allocate(1, 1.0);
  wrenches.work.allocate(1);
  const Vector6 begin = -body.added([&](TouchedOnce& it) { wrench_map(wrenches, 0, 1, kStep, it.displacement, it.sum, it.impulse); }, Vector6::Zero());
  const auto both = load<Wrench, double>(body.sum.applied, 1);
  // what is left for the end, seen from there, is the same force in the body's frame
  const Wrench<double> end = carried(body.D, both - Wrench<double>::from(begin.data()));
  Vector6 numbers;
  end.to(numbers.data());
  CHECK((numbers - begin).norm() < 1e-15);
}

}  // namespace linden::body_impulses_test

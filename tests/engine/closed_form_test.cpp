// Every order against motions that are known in closed form, and the order itself from the errors at two steps.
#include <cmath>
#include <functional>

#include "tests/engine/scenes.hpp"
#include "tests/reference/closed_forms.hpp"

namespace linden::closed_form_test {
namespace {

/// Largest error over a motion, looked at `looks` times.
using Error = std::function<double(int order, double h)>;

template <class Exact>
double largest(Simulation& simulation, double duration, int looks, const Exact& exact) {
  const int every = static_cast<int>(std::lround(duration / looks / simulation.options().step));
  double most = 0;
  for (int look = 0; look < looks; ++look) {
    run(simulation, every);
    most = std::max(most, exact.error(simulation.time(), simulation.positions()));
  }
  return most;
}

void check_orders(const Error& error, const std::array<double, 4>& steps, const std::array<double, 4>& most) {
  for (std::size_t k = 0; k < 4; ++k) {
    const int order = 2 * static_cast<int>(k) + 2;
    const double coarse = error(order, steps[k]), fine = error(order, steps[k] / 2);
    CAPTURE(order, steps[k], coarse, fine);
    CHECK(std::log2(coarse / fine) == Approx(order).margin(0.15));
    CHECK(fine < most[k]);
  }
}

Options options(int order, double h) { return {.step = h, .order = order, .tolerance = 1e-14}; }

TEST_CASE("elliptic functions are those of the tables") {
  CHECK(static_cast<double>(quarter_period(0)) == Approx(std::numbers::pi / 2).epsilon(1e-15));
  CHECK(static_cast<double>(quarter_period(std::sqrt(0.5L))) == Approx(1.8540746773013719).epsilon(1e-15));
  // half the quarter period: sn^2 = 1 / (1 + k')
  const long double k = 0.9L, half = std::sqrt(1 - k * k);
  const Elliptic e = elliptic(quarter_period(k) / 2, k);
  CHECK(static_cast<double>(e.sn * e.sn) == Approx(static_cast<double>(1 / (1 + half))).epsilon(1e-15));
  CHECK(static_cast<double>(e.dn * e.dn) == Approx(static_cast<double>(half)).epsilon(1e-15));
  CHECK(static_cast<double>(e.sn * e.sn + e.cn * e.cn) == Approx(1).epsilon(1e-15));
  const Elliptic full = elliptic(quarter_period(k), k);
  CHECK(static_cast<double>(full.sn) == Approx(1).epsilon(1e-15));
}

TEST_CASE("a pendulum let go from 2.8 rad follows the elliptic functions over 10 s, to every order") {
  const Pendulum pendulum(2.8);
  const auto error = [&](int order, double h) {
    Simulation simulation(Pendulum::model(), options(order, h));
    simulation.set_positions(std::vector<double>{pendulum.start()});
    return largest(simulation, 10, 25, pendulum);
  };
  check_orders(error, {4e-3, 20e-3, 40e-3, 80e-3}, {1e-4, 1e-6, 1e-7, 1e-9});
}

TEST_CASE("a free asymmetric body turns over as Jacobi's solution has it, to every order") {
  const FreeBody body;
  const auto error = [&](int order, double h) {
    Options weightless = options(order, h);
    weightless.gravity = {0, 0, 0};
    Simulation simulation(FreeBody::model(), weightless);
    std::vector<double> q, v;
    for (const long double component : body.orientation(0)) q.push_back(static_cast<double>(component));
    for (const long double component : body.velocity(0)) v.push_back(static_cast<double>(component));
    simulation.set_positions(q);
    simulation.set_velocities(v);
    return largest(simulation, 10, 10, body);
  };
  check_orders(error, {10e-3, 40e-3, 40e-3, 200e-3}, {1e-2, 1e-6, 1e-8, 1e-8});
}

TEST_CASE("the turning over is real: about the middle axis the body changes sides within 10 s") {
  const FreeBody body;
  double least = 1, most = -1;
  for (int k = 0; k < 1000; ++k) {
    const auto rate = body.velocity(0.01L * k);
    least = std::min(least, static_cast<double>(rate[1]));
    most = std::max(most, static_cast<double>(rate[1]));
  }
  CHECK(least < -2);
  CHECK(most > 2);
}

TEST_CASE("Lagrange's top nutates as its elliptic function says, to every order") {
  const auto error = [&](int order, double h) {
    Simulation simulation(LagrangeTop::model(), options(order, h));
    const auto q = LagrangeTop::start();
    const auto v = LagrangeTop().start_velocity();
    simulation.set_positions(q);
    simulation.set_velocities(v);
    return largest(simulation, 2, 25, LagrangeTop());
  };
  check_orders(error, {2e-3, 8e-3, 8e-3, 20e-3}, {2e-3, 1e-6, 1e-8, 1e-9});
}

}  // namespace
}  // namespace linden::closed_form_test

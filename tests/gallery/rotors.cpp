// Spinning bodies whose motion is known in closed form.
#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "tests/gallery/scenario.hpp"
#include "tests/reference/closed_forms.hpp"

namespace linden {
namespace {

/// What a method may be off by, relative, and why.
struct Allowed {
  int order;
  double h, bound;
  const char* reason;
};

/// The body that turns over about its middle axis, again and again: Dzhanibekov's wing nut. Its rates are a1 cn, a2 sn, a3 dn, so
/// the angle atan2(w2 / a2, w1 / a1) is the amplitude of the elliptic functions, which tells the time; at a whole number of flips
/// dn = 1.
void flips(Report& report) {
  const FreeBody body;
  const int flips = report.pick(20, 1000, 1000);
  const double turn = 1e-3 * 4.1;  // of the body in a millisecond [rad]
  const double duration = flips * static_cast<double>(body.flip_time());
  const auto exact = body.velocity(0);
  const double middle = static_cast<double>(body.velocity(static_cast<long double>(0.25L) * 2 * body.flip_time())[1]);
  for (const Allowed allowed :
       {Allowed{2, 1e-3, turn * turn, "second order: the square of the turn in a step"},
        Allowed{8, 1e-2, 1e-11, "eighth order at 0.04 rad a step: (h w)^8 = 8e-12, and solves to 1e-14"}}) {
    Simulation simulation(FreeBody::model(),
                          {.step = allowed.h, .order = allowed.order, .gravity = {0, 0, 0}, .tolerance = 1e-14});
    std::vector<double> q, v;
    for (const long double component : body.orientation(0)) q.push_back(static_cast<double>(component));
    for (const long double component : exact) v.push_back(static_cast<double>(component));
    simulation.set_positions(q);
    simulation.set_velocities(v);
    const double energy = simulation.energy().total();
    double lag = 0, off = 0;
    int turned_over = 0;
    bool up = true;
    const std::int64_t steps = std::llround(duration / allowed.h);
    for (std::int64_t k = 0; k < steps; ++k) {
      if (!simulation.step().ok()) lag = std::nan("");
      if (k % 10 != 0) continue;
      off = std::max(off, std::abs(simulation.energy().total() - energy) / energy);
      const double rate = simulation.velocities()[0] / v[0];
      if (std::abs(rate) > 0.5 && (rate > 0) != up) {
        up = !up;
        turned_over += 1;
      }
    }
    const auto phase = [&](double w1, double w2) { return std::atan2(w2 / middle, w1 / static_cast<double>(exact[0])); };
    const auto there = body.velocity(static_cast<long double>(simulation.time()));
    const std::vector<double> here = simulation.velocities();
    const double behind = std::remainder(
        phase(here[0], here[1]) - phase(static_cast<double>(there[0]), static_cast<double>(there[1])), 2 * std::numbers::pi);
    lag += std::abs(behind) / (std::numbers::pi * flips);
    report.at_most(fmt::format("order {}: phase off / phase", allowed.order), lag, allowed.bound, allowed.reason);
    report.at_most(fmt::format("order {}: flips missed", allowed.order), std::abs(flips - turned_over), 0,
                   "the closed form's number");
    report.note(fmt::format("order {}, h = {:.0e} s: {} flips in {:.0f} s, energy within {:.1e}", allowed.order, allowed.h,
                            turned_over, simulation.time(), off));
  }
  Scenario spinning = scenario(FreeBody::model(), {.step = 1e-3, .gravity = {0, 0, 0}}, std::llround(duration / 1e-3));
  for (const long double component : body.orientation(0)) spinning.start.positions.push_back(static_cast<double>(component));
  for (const long double component : exact) spinning.start.velocities.push_back(static_cast<double>(component));
  spinning.every = 10;
  run_beside(report, spinning, simulation_of(spinning).energy().kinetic);
}

/// Lagrange's top at 1e4 rad/s: it nods by a few millionths 580 times a second and goes round the vertical once in two and a half
/// minutes.
void fast_top(Report& report) {
  const LagrangeTop top(1e4);
  const double duration = report.pick(0.02, 0.5, 10.0);
  const double amplitude = static_cast<double>(top.upright(0) - top.upright(std::numbers::pi / top.nutation()));
  // precession by Simpson's rule over the nutations
  const auto goes_round = [&](double time) {
    const int intervals = 2 * static_cast<int>(50 * top.nutation() * time);
    const long double h = static_cast<long double>(time) / intervals;
    long double sum = top.precession(top.upright(0)) + top.precession(top.upright(time));
    for (int i = 1; i < intervals; ++i) sum += (i % 2 == 1 ? 4 : 2) * top.precession(top.upright(h * i));
    return static_cast<double>(sum * h / 3);
  };
  for (const Allowed allowed : {Allowed{2, 1e-5, 0.01, "second order: the square of 0.1 rad a step"},
                                Allowed{8, 2e-5, 3e-6, "eighth order: (h w)^8 of 0.2 rad a step"}}) {
    Simulation simulation(LagrangeTop::model(), {.step = allowed.h, .order = allowed.order, .tolerance = 1e-14});
    simulation.set_positions(LagrangeTop::start());
    simulation.set_velocities(top.start_velocity());
    const std::int64_t steps = std::llround(duration / allowed.h);
    double nods = 0, nutation_off = 0;
    for (std::int64_t k = 0; k < steps; ++k) {
      if (!simulation.step().ok()) nods = std::nan("");
      const auto q = simulation.positions();
      const double upright = 1 - 2 * (q[0] * q[0] + q[1] * q[1]);
      nods = std::max(nods, static_cast<double>(top.upright(0)) - upright);
      nutation_off = std::max(nutation_off, top.error(simulation.time(), q));
    }
    const auto q = simulation.positions();
    // the axis z of the body, seen from above: it began over -y
    const double x = 2 * (q[0] * q[2] + q[1] * q[3]), y = 2 * (q[1] * q[2] - q[0] * q[3]);
    const double round = std::atan2(x, -y), exact = goes_round(simulation.time());
    report.at_most(fmt::format("order {}: precession off, relative", allowed.order),
                   std::abs(std::remainder(round - exact, 2 * std::numbers::pi)) / exact, allowed.bound, allowed.reason);
    report.at_most(fmt::format("order {}: amplitude of nutation off, relative", allowed.order), std::abs(nods / amplitude - 1),
                   allowed.bound, allowed.reason);
    if (allowed.order == 8) {
      report.at_most("order 8: cosine of the tilt off / amplitude of nutation", nutation_off / amplitude,
                     allowed.bound * top.nutation() * duration, "the same for each radian of nutation");
    }
    report.note(fmt::format("order {}, h = {:.0e} s: precessed {:.6f} rad in {:.2f} s, exact {:.6f}", allowed.order, allowed.h,
                            round, simulation.time(), exact));
  }
}

}  // namespace

std::vector<Case> rotor_cases() {
  return {
      {"flips", "Dzhanibekov's body over 1,000 flips", flips, ""},
      {"fast-top", "a heavy top at 1e4 rad/s: nods of 1e-5 and a slow precession", fast_top, ""},
  };
}

}  // namespace linden

// Andrews' squeezing mechanism: seven bodies within a tenth of a metre, three of them pinned to one point of a fourth, and a spring. Its crank,
// 0.04 kg driven by 0.033 N m, goes round two and a half times in 30 ms, and its pins bear up to 200 N.
//
//   measured        h = 40 us   20 us      10 us      5 us
//   beta [rad]      5.2e-4      1.3e-4     3.3e-5     8.2e-6      of 15.8
//   epsilon [rad]   1.5e-7      3.7e-8     9.3e-9     2.3e-9      of 1.05
//   1.0 corrections a step
//
// source  Mazzia, Magherini, Test Set for Initial Value Problem Solvers, release 2.4, University of Bari (2008), problem "Andrews' squeezing
//         mechanism", index 3: numbers, start, and reference at 0.03 s, by PSIDE at a tolerance of 1e-14; equations: Hairer, Wanner, Solving
//         Ordinary Differential Equations II, VII.7; first in Schiehlen (ed.), Multibody Systems Handbook (1990)
#include <catch2/catch.hpp>

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/simulation.hpp"
#include "tests/engine/mechanisms.hpp"

namespace linden::andrews_test {
namespace {

/// An angle of the publication: the joint that carries a body here.
struct Angle {
  const char *name, *body;
  double start;       // [rad]; all are at rest there
  double end, speed;  // at 0.03 s [rad, rad/s]
  double error, speed_error;  // at h = 10 us: bounds, a tenth above what was measured
};

constexpr std::array<Angle, 7> kAngles{{
    {"beta", "K1", -0.0617138900142764496, 15.81077119629904, 1139.920302151208, 3.6e-5, 7.2e-3},
    {"Theta", "K2", 0, -15.75637105984298, -1424.379294994111, 4.5e-5, 9.7e-3},
    {"gamma", "K3", 0.455279819163070380, 0.04082224013073101, 11.03291221937134, 3.5e-7, 1.1e-2},
    {"Phi", "K4", 0.222668390165885885, -0.5347301163226948, 19.29337464421385, 6.1e-7, 1.8e-2},
    {"delta", "K5", 0.487364979543842550, 0.5244099658805304, 0.5735699284790808, 1.9e-8, 5.3e-4},
    {"Omega", "K6", -0.222668390165885885, 0.5347301163226948, -19.29337464421385, 6.1e-7, 1.8e-2},
    {"epsilon", "K7", 1.23054744454982119, 1.048080741042263, 0.3231791658026955, 1.1e-8, 3.1e-4},
}};

/// Lagrange multipliers at 0.03 s, a pair for each pin: the force that K2 exerts there, in the world's frame [N].
struct Pin {
  const char* name;
  Eigen::Vector2d force;
};
const std::array<Pin, 3> kPins{{{"E", {199.1753333731910, -29.75531228015052}},
                                {"G", {23.06654119098399, 31.45271365475927}},
                                {"H", {22.64249232082739, 11.61740700019673}}}};

std::size_t row_of(const Model& model, const Angle& angle) {
  return static_cast<std::size_t>(linden::row_of(model, std::string(angle.body) + "_joint"));
}

struct End {
  std::array<double, 7> angles, speeds;   // off the publication's
  std::array<Eigen::Vector2d, 3> forces;  // at the beginning of the last step
  double gap;
};

End end_of(std::int64_t steps) {
  const Model model = squeezer();
  Effects effects;
  effects.torques.push_back({static_cast<Index>(row_of(model, kAngles[0])), {{0}, {0.033}}});
  Options options{.step = 0.03 / static_cast<double>(steps)};
  options.gravity = {0, 0, 0};
  Simulation simulation(model, options, effects);
  std::vector<double> q(kAngles.size());
  for (const Angle& angle : kAngles) q[row_of(model, angle)] = angle.start;
  simulation.set_positions(q);
  CHECK(simulation.openness().gap < 1e-15);  // the publication's start is closed
  const StepsReport report = simulation.run(steps);
  INFO(simulation.describe(report.last));
  REQUIRE(report.ok());
  CHECK(report.split_steps == 0);
  End end{};
  const std::vector<double> speeds = simulation.velocities();
  for (std::size_t k = 0; k < kAngles.size(); ++k) {
    end.angles[k] = simulation.positions()[row_of(model, kAngles[k])] - kAngles[k].end;
    end.speeds[k] = speeds[row_of(model, kAngles[k])] - kAngles[k].speed;
  }
  const double turn = simulation.positions()[row_of(model, kAngles[0])] + simulation.positions()[row_of(model, kAngles[1])];
  for (const CouplingState& coupling : simulation.couplings()) {
    for (std::size_t k = 0; k < kPins.size(); ++k) {
      if (coupling.name != kPins[k].name) continue;
      end.gap = std::max(end.gap, worst_gap({coupling}));
      end.forces[k] = Eigen::Rotation2Dd(turn) * Eigen::Vector2d(coupling.forces[0], coupling.forces[1]);
    }
  }
  return end;
}

}  // namespace

TEST_CASE("Andrews' squeezing mechanism comes to its published reference, with errors of second order") {
  const End whole = end_of(1500), half = end_of(3000);  // 20 and 10 us
  for (std::size_t k = 0; k < kAngles.size(); ++k) {
    INFO(kAngles[k].name);
    CHECK(std::abs(half.angles[k]) < kAngles[k].error);
    CHECK(std::abs(whole.angles[k]) < 4 * kAngles[k].error);
    CHECK(whole.angles[k] / half.angles[k] == Approx(4).epsilon(0.02));
    CHECK(std::abs(half.speeds[k]) < kAngles[k].speed_error);
    CHECK(std::abs(whole.speeds[k]) < 4 * kAngles[k].speed_error);
    CHECK(whole.speeds[k] / half.speeds[k] == Approx(4).epsilon(0.02));
  }
  // what a tolerance of 1e-10 leaves in a step of 10 us, of 0.5 J and links of 4 g on: h tolerance sqrt(16 E / m)
  CHECK(half.gap < 5e-14);
}

TEST_CASE("The pins of Andrews' squeezing mechanism bear what its published multipliers say") {
  // those of a step are its beginning's: off by first order, which the line through two of them leaves out
  const End whole = end_of(3000), half = end_of(6000), quarter = end_of(12000);  // 10, 5 and 2.5 us
  for (std::size_t k = 0; k < kPins.size(); ++k) {
    INFO(kPins[k].name);
    const double coarse = (2 * half.forces[k] - whole.forces[k] - kPins[k].force).norm();
    const double fine = (2 * quarter.forces[k] - half.forces[k] - kPins[k].force).norm();
    CHECK((whole.forces[k] - kPins[k].force).norm() < 0.4);  // measured 0.33, 0.18 and 0.32 N
    CHECK(fine < 7e-3);                                      // measured 5.9e-3, 5.0e-3 and 6.5e-3 N
    CHECK(coarse / fine == Approx(4).epsilon(0.05));
  }
}

}  // namespace linden::andrews_test

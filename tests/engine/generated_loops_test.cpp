// Generated models with closed loops.
#include <catch2/catch.hpp>

#include "engine/queries/kinematics.hpp"
#include "engine/queries/link_motion.hpp"
#include "engine/scene/load_model.hpp"
#include "engine/simulation.hpp"
#include "layout/couplings.hpp"
#include "mechanisms.hpp"
#include "models/build/generators.hpp"
#include "models/build/isometry.hpp"

namespace linden::generated_loops_test {
namespace {

struct Loops {
  const char* name;
  Index bodies, freedom, couplings, rows;
  int left;  // degrees of freedom that the loops leave
};

constexpr Loops kLoops[] = {
    {"ring:3", 3, 3, 1, 5, 1},    {"ring:4", 4, 4, 1, 5, 2},       {"ring:12", 12, 12, 1, 5, 10},  {"fourbars:1", 3, 3, 1, 5, 1},
    {"fourbars:4", 12, 12, 4, 20, 4}, {"ladder:1", 3, 3, 1, 5, 1}, {"ladder:5", 15, 15, 5, 25, 5}, {"net:2x1", 3, 9, 1, 3, 6},
    {"net:3x4", 20, 60, 8, 24, 36},   {"roller-chain:1", 3, 3, 1, 6, 1}, {"roller-chain:40", 120, 120, 40, 240, 40},
};

double mass_of(const Model& model) {
  double mass = 0;
  for (Index slot = 1; slot < model.tree.shape.slots; ++slot) mass += model.constants.inertia(slot, 0);
  return mass;
}

}  // namespace

TEST_CASE("generated loops have the bodies, rows and degrees of freedom that their names say, and are closed at zero") {
  for (const Loops& loops : kLoops) {
    CAPTURE(loops.name);
    Simulation simulation(generate(loops.name));
    const Model& model = simulation.model();
    CHECK(model.names.model == loops.name);
    CHECK(model.tree.bodies() == loops.bodies);
    CHECK(model.tree.shape.velocities == loops.freedom);
    CHECK(static_cast<Index>(model.couplings.size()) == loops.couplings);
    CHECK(row_count(model.couplings) == loops.rows);
    CHECK(simulation.openness().closed);
    if (loops.freedom == loops.bodies) {
      for (const double q : simulation.positions()) CHECK(std::abs(q) < 1e-13);
    }
    const std::vector<CouplingState> states = simulation.couplings();
    CHECK(worst_gap(states) < 1e-15 * static_cast<double>(loops.bodies));
  }
}

TEST_CASE("generated loops fall, stay closed and keep as much freedom as is said") {
  for (const Loops& loops : kLoops) {
    CAPTURE(loops.name);
    Simulation simulation(generate(loops.name), {.step = 1e-3});
    double worst = 0, kinetic = 0;
    for (int k = 0; k < 100; ++k) {
      const StepReport report = simulation.step();
      INFO(simulation.describe(report));
      REQUIRE(report.ok());
      worst = std::max(worst, worst_gap(simulation.couplings()));
      kinetic = std::max(kinetic, simulation.energy().kinetic);
    }
    CHECK(worst < 1e-12);
    CHECK(kinetic > 0.01 * mass_of(simulation.model()));
    int held = 0;
    for (const CouplingState& state : simulation.couplings()) held += static_cast<int>(std::ranges::count(state.redundant, false));
    CHECK(static_cast<int>(loops.freedom) - held == loops.left);
  }
}

TEST_CASE("the energy of generated loops swings about the true one, by a quarter where the step is halved") {
  const auto band = [](const char* name, double step) {
    Simulation simulation(generate(name), {.step = step});
    const double start = simulation.energy().total();
    double most = 0, kinetic = 0;
    for (int k = 0; k < std::lround(1 / step); ++k) {
      REQUIRE(simulation.step().ok());
      kinetic = std::max(kinetic, simulation.energy().kinetic);
      most = std::max(most, std::abs(simulation.energy().total() - start));
    }
    CHECK(worst_gap(simulation.couplings()) < 1e-12);
    return most / kinetic;
  };
  for (const auto& [name, most] : {std::pair{"ring:3", 5e-5}, {"ring:6", 3e-3}, {"fourbars:1", 1e-3}, {"fourbars:3", 1e-3},
                                  {"ladder:3", 1e-3}}) {
    CAPTURE(name);
    const double coarse = band(name, 1e-3), fine = band(name, 5e-4);
    INFO("band " << coarse);
    CHECK(coarse < most);
    CHECK(coarse / fine == Approx(4).epsilon(0.1));
  }
}

TEST_CASE("a roller chain swings about its first pin, its energy in a band that steps of half the length make a quarter of") {
  const auto band = [](double step) {
    Simulation simulation(roller_chain(10), {.step = step});
    const double start = simulation.energy().total();
    double most = 0, kinetic = 0, shift = 0, turn = 0;
    for (int k = 0; k < std::lround(0.3 / step); ++k) {
      REQUIRE(simulation.step().ok());
      kinetic = std::max(kinetic, simulation.energy().kinetic);
      most = std::max(most, std::abs(simulation.energy().total() - start));
      for (const CouplingState& state : simulation.couplings()) {
        for (std::size_t row = 0; row < 6; ++row) (row < 3 ? shift : turn) = std::max(row < 3 ? shift : turn, std::abs(state.gaps[row]));
      }
    }
    CHECK(shift < 1e-12);
    // a pin of J = 1e-9 kg m^2 may be turned by what the tolerance in the energy norm lets pass: 1e-10 sqrt(2 T / J) h
    CHECK(turn < 1e-10 * std::sqrt(2 * kinetic / 1e-9) * step);
    return most / kinetic;
  };
  const double coarse = band(2e-4), fine = band(1e-4);
  INFO("band " << coarse);
  CHECK(coarse < 1e-4);
  CHECK(coarse / fine == Approx(4).epsilon(0.1));
}

TEST_CASE("plates and pins of a roller chain weigh what a bicycle chain does, and keep parallel while it swings") {
  Simulation simulation(roller_chain(20), {.step = 2e-4});
  const Model& model = simulation.model();
  CHECK(mass_of(model) == Approx(20 * 2.4e-3));
  REQUIRE(simulation.run(1000).ok());
  const Kinematics now(simulation);
  for (int i = 1; i <= 20; ++i) {
    CAPTURE(i);
    const auto pose = [&](const char* part) { return isometry(link_pose(now, place_of(model, part + std::to_string(i)))); };
    const Isometry left = pose("left"), right = pose("right"), pin = pose("pin");
    CHECK((left.linear() - right.linear()).norm() < 1e-11);
    CHECK((left.linear() - pin.linear()).norm() < 1e-9);  // as the tolerance lets so light a thing turn
    CHECK((left * Eigen::Vector3d(0, -0.005, 0) - right.translation()).norm() < 1e-12);
  }
  const double hanging = link_pose(now, place_of(model, "pin20")).shift[2];
  CHECK(hanging < -0.05);
}

TEST_CASE("loops of a size that there is not are refused by name") {
  using Catch::Contains;
  CHECK_THROWS_WITH(generate("ring:2"), Contains("model \"ring:2\": \"2\" is no number of bodies; expected 3 to ") && Contains("ring:100"));
  CHECK_THROWS_WITH(generate("fourbars:0"), Contains("\"0\" is no number of bodies; expected 1 to "));
  CHECK_THROWS_WITH(generate("ladder:two"), Contains("\"two\" is no number of bodies"));
  for (const char* size : {"", "4", "x", "4x", "x4", "1x4", "4x0", "4x4x4", "-2x3", "4X4", "99999999x99999999"}) {
    CAPTURE(size);
    CHECK_THROWS_WITH(generate(std::string("net:") + size), Contains("\" is no size of a net; expected ropes x knots of each") && Contains("net:4x6"));
  }
  CHECK_THROWS_WITH(generate("rings:4"),
                    Contains("expected chain, ball-chain, paper-chain, tree, random, humanoids, ring, fourbars, ladder, roller-chain, net, boxes, wall, pile, cards or dominoes"));
}

TEST_CASE("what loops take of memory grows with the square of the rows that are solved together") {
  CHECK(memory_of("fourbars:1000") == Approx(10 * memory_of("fourbars:100")));
  CHECK(memory_of("ladder:10000") < 2e9);
  CHECK(memory_of("roller-chain:1000") == Approx(10 * memory_of("roller-chain:100")));
  CHECK(memory_of("net:100x100") > 16.0 * 30000 * 30000);
  CHECK(memory_of("ring:1000") == memory_of("chain:1000"));
  CHECK(memory_of("ladder:nan") == 0);
  CHECK_THROWS_AS(check_memory("net:10000x1000"), MemoryError);
}

}  // namespace linden::generated_loops_test

// A million steps: what is kept, and what rounding may do to it.
//
// A step rounds the momentum of the whole at every joint by an epsilon or so, up or down. Over N steps that is a random walk of
// sqrt(N) such: nothing that rounds can do better without compensating, and a drift, however small a step's, would grow with N.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>

#include "engine/mass_distribution.hpp"
#include "models/build/generators.hpp"
#include "models/urdf/urdf.hpp"
#include "tests/gallery/scenario.hpp"

namespace linden {
namespace {

void long_chain(Report& report) {
  const auto steps = report.pick<std::int64_t>(10'000, 100'000, 1'000'000);
  Scenario falling = scenario(chain(10), {.step = 1e-3}, steps);
  falling.every = report.pick(1, 1, 5);
  const RunRecord record = run(falling);
  promise_conservation(report, record, steps, true);
  run_beside(report, falling, record.drift.scale());
}

void long_humanoid(Report& report) {
  const auto steps = report.pick<std::int64_t>(3000, 100'000, 1'000'000);
  Scenario tumbling = scenario(load_urdf(std::string(LINDEN_MODELS_DIR) + "/humanoid.urdf", Base::floating),
                               {.step = 1e-3, .gravity = {0, 0, 0}}, steps);
  tumbling.start = random_state(*tumbling.model, 2, 0.5);
  tumbling.every = report.pick(10, 10, 100);
  const RunRecord record = run(tumbling);
  promise_conservation(report, record, steps, report.form() != Form::quick);
  run_beside(report, tumbling, record.drift.scale());
  // the same staying where it is: an angular momentum about an origin half a kilometre away would count an epsilon of that
  // distance
  const Momentum momentum = simulation_of(tumbling).momentum();
  const Eigen::Quaterniond turn(Eigen::Vector4d(&tumbling.start.positions[3]));
  const double mass = mass_distribution(*tumbling.model, tumbling.start.positions).mass;
  const Eigen::Vector3d drift = turn.inverse() * Eigen::Vector3d(momentum.linear.data()) / mass;
  for (int k = 0; k < 3; ++k) tumbling.start.velocities[static_cast<std::size_t>(3 + k)] -= drift[k];
  const RunRecord in_place = run(tumbling);
  const double walk = static_cast<double>(tumbling.model->tree.bodies()) * kEpsilon * std::sqrt(static_cast<double>(steps));
  report.at_most("drift of linear momentum, relative", record.momentum->linear(), walk,
                 "an epsilon a body and step, as a random walk");
  report.at_most("drift of angular momentum, relative", in_place.momentum->angular(), walk, "the same, of a run in place");
}

}  // namespace

std::vector<Case> long_cases() {
  return {
      {"long-chain", "the ten-link chain for a million steps", long_chain, ""},
      {"long-humanoid", "a humanoid afloat for a million steps", long_humanoid,
       "Momenta grew by 2e-17 of themselves in every step, 2e-11 in a million: they were multiplied by h and then by 1 / h, "
       "whose product is not 1. They are "
       "divided by h now and walk at random to 1e-12."},
  };
}

}  // namespace linden

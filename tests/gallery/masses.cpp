// Masses and inertias of all sizes beside each other.
#include <cmath>

#include "models/generators.hpp"
#include "tests/gallery/models.hpp"
#include "tests/gallery/scenario.hpp"

namespace linden {
namespace {

/// Ten links, the first of 1 kg, each heavier than the one before by the same factor, the last by `ratio`.
void ratio_along_chain(Report& report, double ratio, double h) {
  const Index links = 10;
  const double factor = std::pow(ratio, 1.0 / (links - 1));
  const auto steps = report.pick<std::int64_t>(1000, 20'000, 200'000);
  Scenario swinging =
      scenario(hinged_chain("ratio", links, 0.1, [&](Index i) { return rod(std::pow(factor, i), 0.1); }), {.step = h}, steps);
  swinging.start = random_state(*swinging.model, 1, 0.3);
  swinging.every = report.pick(1, 1, 10);
  const RunRecord record = run(swinging);
  promise_conservation(report, record, steps, true);
  report.note(fmt::format("turns of up to {:.2g} rad a step", record.turn));
  run_beside(report, swinging, record.drift.scale());
}

/// Two links, the second `ratio` times as heavy as the first.
void ratio_of_two(Report& report, double ratio, double h) {
  const auto steps = report.pick<std::int64_t>(1000, 20'000, 200'000);
  Scenario swinging =
      scenario(hinged_chain("ratio", 2, 0.1, [&](Index i) { return rod(i == 0 ? 1 : ratio, 0.1); }), {.step = h}, steps);
  swinging.start = random_state(*swinging.model, 1, 0.3);
  swinging.every = report.pick(1, 1, 10);
  const RunRecord record = run(swinging);
  promise_conservation(report, record, steps, true);
  report.note(fmt::format("turns of up to {:.2g} rad a step", record.turn));
  run_beside(report, swinging, record.drift.scale());
}

/// Between every two links a body of no mass and no inertia, as robots' files have them at shoulders and hips.
void massless_between(Report& report) {
  const auto steps = report.pick<std::int64_t>(1000, 20'000, 200'000);
  Scenario swinging = scenario(hinged_chain("massless between", 10, 0.1, [&](Index i) { return i % 2 == 0 ? LinkInertia{} : rod(0.1, 0.1); }),
                               {.step = 1e-3}, steps);
  swinging.start = random_state(*swinging.model, 1, 0.3);
  swinging.every = report.pick(1, 1, 10);
  const RunRecord record = run(swinging);
  promise_conservation(report, record, steps, true);
  run_beside(report, swinging, record.drift.scale());
}

/// Chains of ball joints, whose links' principal moments obey I1 + I2 = I3 (1 - slack).
void moments_of(Report& report, const Eigen::Vector3d& principal, double h) {
  TreeBuilder builder("edge");
  for (Index i = 0; i < 5; ++i) {
    LinkSpec link;
    link.name = fmt::format("link{}", i + 1);
    link.joint = fmt::format("joint{}", i + 1);
    if (i > 0) link.parent = fmt::format("link{}", i);
    if (i > 0) link.placement.translation().x() = 0.1;
    link.type = JointType::ball;
    link.inertia = {0.1, {0.05, 0, 0}, 0.1 * principal.asDiagonal().toDenseMatrix()};
    builder.add(std::move(link));
  }
  const auto steps = report.pick<std::int64_t>(1000, 20'000, 200'000);
  Scenario swinging = scenario(builder.build(), {.step = h}, steps);
  swinging.start = random_state(*swinging.model, 1, 0.3);
  swinging.every = report.pick(1, 1, 10);
  const RunRecord record = run(swinging);
  promise_conservation(report, record, steps, true);
  report.note(fmt::format("turns of up to {:.2g} rad a step", record.turn));
  run_beside(report, swinging, record.drift.scale());
}

}  // namespace

std::vector<Case> mass_cases() {
  return {
      {"light-tip", "ten links, each lighter than the one before, the last by 1e-9", [](Report& r) { ratio_along_chain(r, 1e-9, 1e-3); }, ""},
      {"heavy-tip", "ten links, each heavier than the one before, the last by 1e9", [](Report& r) { ratio_along_chain(r, 1e9, 1e-3); }, ""},
      {"light-after-heavy", "two links, 1 kg and 1e-9 kg", [](Report& r) { ratio_of_two(r, 1e-9, 1e-3); }, ""},
      {"heavy-after-light", "two links, 1 kg and 1e9 kg", [](Report& r) { ratio_of_two(r, 1e9, 1e-3); }, ""},
      {"massless-between", "every other body has no mass and no inertia", massless_between, ""},
      {"flat-inertia", "I1 + I2 = I3: the edge of the triangle inequality",
       [](Report& r) { moments_of(r, {1e-4, 2e-4, 3e-4}, 1e-3); }, ""},
      {"needle", "links a hundred thousand times harder to turn across than along",
       [](Report& r) { moments_of(r, {1e-8, 1e-3, 1e-3}, 1e-3); }, ""},
      {"plate", "links as thin as paper", [](Report& r) { moments_of(r, {1e-3, 1e-8, 1e-3 + 1e-8}, 1e-3); }, ""},
  };
}

}  // namespace linden

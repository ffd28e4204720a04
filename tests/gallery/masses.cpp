// Masses and inertias of all sizes beside each other.
#include <cmath>

#include "models/build/builder.hpp"
#include "models/build/generators.hpp"
#include "tests/gallery/models.hpp"
#include "tests/gallery/scenario.hpp"

namespace linden {
namespace {

/// Swings from a random pose and holds the promises of a conservative scene.
Scenario swing(Report& report, Model model, double h, std::int64_t brief = 20'000) {
  const auto steps = report.pick<std::int64_t>(1000, brief, 500'000);
  Scenario swinging = scenario(std::move(model), {.step = h}, steps);
  swinging.start = random_state(*swinging.model, 1, 0.3);
  swinging.every = report.pick(1, 1, 10);
  const RunRecord record = run(swinging);
  promise_conservation(report, record, steps, report.form() != Form::quick);
  report.note(fmt::format("h = {:.0e} s, turns of up to {:.2g} rad a step", h, record.turn));
  run_beside(report, swinging, record.drift.scale());
  return swinging;
}

/// Ten links, the first of 1 kg, each heavier than the one before by the same factor, the last by `ratio`: at a step that
/// resolves how the light links move, and at one that does not.
void ratio_along_chain(Report& report, double ratio, double h, const std::string& why) {
  const Index links = 10;
  const double factor = std::pow(ratio, 1.0 / (links - 1));
  Scenario coarse =
      swing(report, hinged_chain("ratio", links, 0.1, [&](Index i) { return rod(std::pow(factor, i), 0.1); }), h, 200'000);
  coarse.options.step = 1e-3;
  coarse.steps = 20'000;
  const RunRecord unresolved = run(coarse);
  report.at_least("at 1 ms: steps refused or split", static_cast<double>(unresolved.split + (unresolved.failure.empty() ? 0 : 1)),
                  1, "a motion that a step cannot resolve must not pass in silence: " + why);
  if (!unresolved.failure.empty()) report.note("at 1 ms: " + unresolved.failure);
}

/// Two links, the second `ratio` times as heavy as the first.
void ratio_of_two(Report& report, double ratio) {
  swing(report, hinged_chain("ratio", 2, 0.1, [&](Index i) { return rod(i == 0 ? 1 : ratio, 0.1); }), 1e-3);
}

/// Between every two links a body of no mass and no inertia, as robots' files have them at shoulders and hips.
void massless_between(Report& report) {
  swing(report, hinged_chain("massless between", 10, 0.1, [&](Index i) { return i % 2 == 0 ? LinkInertia{} : rod(0.1, 0.1); }),
        1e-3);
}

/// A chain of five ball joints, links of 0.1 kg with these principal moments per kg.
void moments_of(Report& report, const Eigen::Vector3d& principal) {
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
  swing(report, builder.build(), 1e-3);
}

}  // namespace

std::vector<Case> mass_cases() {
  return {
      {"light-tip", "ten links, each lighter than the one before, the last by 1e-9",
       [](Report& r) {
         ratio_along_chain(r, 1e-9, 1e-5, "each link is whipped by one ten times as heavy, the last turns at 1e4 rad/s");
       },
       "Nothing is wrong: the motion is that fast, and the step has to follow it."},
      {"heavy-tip", "ten links, each heavier than the one before, the last by 1e9",
       [](Report& r) {
         ratio_along_chain(
             r, 1e9, 1e-6,
             "the first links are strings that hold 1e9 times their weight and ring at sqrt(g M / m l) = 3e5 rad/s");
       },
       "Nothing is wrong: weight acts at the ends of a step, as in the leapfrog, and must be resolved, h w < 2."},
      {"light-after-heavy", "two links, 1 kg and 1e-9 kg", [](Report& r) { ratio_of_two(r, 1e-9); }, ""},
      {"heavy-after-light", "two links, 1 kg and 1e9 kg", [](Report& r) { ratio_of_two(r, 1e9); }, ""},
      {"massless-between", "every other body has no mass and no inertia", massless_between, ""},
      {"flat-inertia", "I1 + I2 = I3: the edge of the triangle inequality",
       [](Report& r) {
         moments_of(r, {1e-4, 2e-4, 3e-4});
       },
       ""},
      {"needle", "links a hundred thousand times harder to turn across than along",
       [](Report& r) {
         moments_of(r, {1e-8, 1e-3, 1e-3});
       },
       ""},
      {"plate", "links as thin as paper",
       [](Report& r) {
         moments_of(r, {1e-3, 1e-8, 1e-3 + 1e-8});
       },
       ""},
  };
}

}  // namespace linden

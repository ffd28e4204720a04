#include "engine/step_report.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace linden {

void StepReport::add(const StepReport& more) {
  status = more.status;
  slot = more.slot;
  coupling = more.coupling;
  iterations += more.iterations;
  evaluations += more.evaluations;
  factorisations += more.factorisations;
  backtracks += more.backtracks;
  blows += more.blows;
  substeps += more.substeps - 1;
  at_rounding_floor |= more.at_rounding_floor;
  residual = more.ok() ? std::max(residual, more.residual) : more.residual;
}

void StepsReport::add(const StepReport& step) {
  StepsReport one{.last = step};
  if (step.ok()) {
    one.steps = 1;
    one.iterations = one.most_iterations = step.iterations;
    one.evaluations = step.evaluations;
    one.factorisations = step.factorisations;
    one.substeps = step.substeps;
    one.split_steps = one.splits_in_a_row = one.first_splits = one.last_splits = step.substeps > 1 ? 1 : 0;
    one.floor_steps = step.at_rounding_floor ? 1 : 0;
    one.largest_residual = step.residual;
  }
  add(one);
}

void StepsReport::add(const StepsReport& more) {
  splits_in_a_row = std::max({splits_in_a_row, more.splits_in_a_row, last_splits + more.first_splits});
  if (first_splits == steps) first_splits += more.first_splits;
  last_splits = more.last_splits == more.steps ? last_splits + more.last_splits : more.last_splits;
  steps += more.steps;
  iterations += more.iterations;
  evaluations += more.evaluations;
  factorisations += more.factorisations;
  substeps += more.substeps;
  most_iterations = std::max(most_iterations, more.most_iterations);
  split_steps += more.split_steps;
  floor_steps += more.floor_steps;
  largest_residual = std::max(largest_residual, more.largest_residual);
  last = more.last;
}

std::string describe(const StepsReport& report) {
  if (report.split_steps == 0) return {};
  const std::string in_a_row = report.splits_in_a_row > 1 ? fmt::format(", {} of them in a row", report.splits_in_a_row) : "";
  return fmt::format("{} of {} {} split{}, {} sub-steps in all: a smaller step keeps energy better", report.split_steps, report.steps,
                     report.split_steps == 1 ? "steps was" : "steps were", in_a_row, report.substeps);
}

std::string describe(const StepReport& report, const Model& model, double step) {
  if (report.ok()) return {};
  const auto slot = static_cast<std::size_t>(report.slot);
  const std::string where = fmt::format("body \"{}\" (joint \"{}\")", model.names.body[slot], model.names.joint[slot]);
  const std::string advice = fmt::format("try a step below {:.3g} s", step / 4);
  std::string coupling;  // that is farthest open
  if (rigid_row_count(model.couplings) > 0) coupling = model.couplings[static_cast<std::size_t>(report.coupling)].name;
  switch (report.status) {
    case StepStatus::past_pi:
      return fmt::format("{} turns by half a turn or more within a step of {:.3g} s, even split: {}", where, step, advice);
    case StepStatus::gains_energy:
      return fmt::format("a step of {:.3g} s is too large for this motion, even split: its solution gains energy that no force gives, "
                         "most of it at {}; {}",
                         step, where, advice);
    case StepStatus::not_finite:
      return fmt::format("the residual is not finite at {}, step {:.3g} s: look for a joint that moves no mass in this pose, for "
                         "speeds beyond reason, or {}",
                         where, step, advice);
    case StepStatus::opens:
      return fmt::format("coupling \"{}\" opens by {:.2g} of the size of its mechanism in a step of {:.3g} s, even split, and nothing can close it: its "
                         "bodies are moved, held or stopped where it cannot follow; look at given motions and at other couplings of the same bodies",
                         coupling, report.residual, step);
    default:
      if (!coupling.empty()) {
        return fmt::format("the step of {:.3g} s did not converge: relative residual {:.2e} after {} iterations, largest at {}; of couplings \"{}\" is "
                           "farthest open; see whether the mechanism can move where it stands (inspect tells), or {}",
                           step, report.residual, report.iterations, where, coupling, advice);
      }
      return fmt::format("the step of {:.3g} s did not converge: relative residual {:.2e} after {} iterations, largest at {}; {}",
                         step, report.residual, report.iterations, where, advice);
  }
}

}  // namespace linden

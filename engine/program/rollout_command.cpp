#include "engine/program/rollout_command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <vector>

#include "engine/files/output_file.hpp"
#include "engine/program/interrupt.hpp"
#include "engine/program/progress.hpp"
#include "engine/program/rollout_execution.hpp"
#include "engine/program/rollout_report.hpp"
#include "engine/program/run_report.hpp"
#include "engine/program/start_report.hpp"
#include "engine/scene/load_model.hpp"
#include "engine/standard_streams.hpp"
#include "engine/text.hpp"
#include "layout/support/input_error.hpp"

namespace linden {
namespace {

using Clock = Progress::Clock;

void check_checkpoints(const RolloutArguments& arguments) {
  if (arguments.checkpoint.empty()) return;
  if (!arguments.resume.empty() && !Destination::same(arguments.checkpoint, arguments.resume)) {
    throw InputError(fmt::format("--checkpoint {} and --resume {}: a rollout that goes on keeps its checkpoints where they were; leave "
                                 "--checkpoint out",
                                 arguments.checkpoint, arguments.resume));
  }
  if (arguments.record.ends_with(".npz")) {
    throw InputError(fmt::format("--record {}: with --checkpoint and --resume a recording grows part by part, which .npz cannot; expected a "
                                 "name that ends in .h5",
                                 arguments.record));
  }
  if (arguments.views.any()) {
    throw InputError("--checkpoint and --resume are for rollouts that may end in one process and go on in another, and pictures are made by "
                     "one that has seen the whole motion: leave --view, --gltf, --picture and --film out, --record the motion, and show it "
                     "with linden view");
  }
}

Outputs checked_outputs(const RolloutArguments& arguments) {
  if (arguments.every < 1) throw InputError(fmt::format("--every {}: expected 1 step or more between frames", arguments.every));
  if (arguments.every != 1 && arguments.record.empty()) throw InputError("--every thins what --record writes: give a --record file too");
  if (!arguments.what.empty() && arguments.record.empty()) throw InputError("--what says what --record takes: give a --record file too");
  if (!arguments.observe.empty() && arguments.record.empty()) {
    throw InputError("--observe says what --record takes beside --what: give a --record file too");
  }
  if (arguments.compress && !arguments.record.ends_with(".h5")) {
    throw InputError("--compress is about recordings in HDF5: give a --record file that ends in .h5 too");
  }
  check_checkpoints(arguments);
  require_available(arguments.what, {Quantity::positions, Quantity::velocities, Quantity::energies}, "a rollout");
  if (arguments.shown < 1) throw InputError(fmt::format("--shown {}: expected 1 instance or more", arguments.shown));
  std::vector<Output> files{{"--record", arguments.record, {".npz", ".h5"}}, {"--json", arguments.json, {".json"}}};
  for (const Output& file : outputs_of(arguments.views)) files.push_back(file);
  return Outputs(files);
}

/// What several ranks cannot do.
void check_shared(const Ranks& ranks, const RolloutArguments& arguments) {
  if (!ranks.several()) return;
  if (!arguments.record.empty() && !arguments.record.ends_with(".h5")) {
    throw InputError(fmt::format("--record {}: {} ranks write one recording in parts, which .h5 alone has; expected .h5", arguments.record,
                                 ranks.count()));
  }
  if (arguments.instances < ranks.count()) {
    throw InputError(fmt::format("--instances {}: there are {} ranks; expected an instance for each, or more; start fewer ranks",
                                 arguments.instances, ranks.count()));
  }
  if (const std::int64_t here = share_of(arguments.instances, 0, ranks.count()).count; arguments.views.any() && arguments.shown > here) {
    throw InputError(fmt::format("--shown {}: rank 0 shows those of its own instances, which are {}; expected no more", arguments.shown, here));
  }
}

/// Refuses more instances than this machine's memory holds, with what is computed of all of them at once. observed: numbers of each.
template <class Real>
void check_instances(const Ranks& ranks, const RolloutArguments& arguments, const Shape& shape, double observed) {
  const double nq = shape.positions, nv = shape.velocities;
  double numbers = nq + 3 * nv + 2 /* kept */ + nv + 2 /* Batch::observe */ + 1;
  if (!arguments.record.empty()) numbers += nq + nv + 2 * observed;
  if (!arguments.checkpoint.empty()) numbers += 3 * (nq + 3 * nv + 2);  // the bytes of a checkpoint, and parts of them
  if (arguments.randomization.masses) numbers += (arguments.record.empty() ? 11.0 : 13.0) * shape.slots;
  const double each = numbers * sizeof(Real) + sizeof(InstanceRecord) + 2 * sizeof(double) + 1;
  const std::int64_t here = share_of(arguments.instances, ranks.rank(), ranks.count()).count * ranks.neighbours();
  require_memory(fmt::format("{} instances of {}", grouped(here), arguments.model), static_cast<double>(here) * each);
}

template <class Real>
int execute(Ranks& ranks, const RolloutArguments& arguments, std::shared_ptr<const Model> model, std::int64_t steps, Clock::time_point begin,
            RolloutCheckpoints* checkpoints) {
  const Interrupt interrupt;
  std::optional<RolloutExecution<Real>> rollout;
  together(ranks, [&] {
    const std::optional<Observations> observations = observations_of(*model, arguments.effects(), arguments.observe);
    check_instances<Real>(ranks, arguments, model->tree.shape, observations ? static_cast<double>(observations->width()) : 0);
    rollout.emplace(ranks, arguments, model, steps, checkpoints);
  });
  together(ranks, [&] { rollout->begin(); });
  rollout->steps(interrupt);
  RolloutFigures& figures = rollout->figures();
  if (checkpoints) figures.checkpoint = checkpoints->text();
  figures.total_seconds = seconds(Clock::now() - begin);
  const bool written = rollout->write_files();
  say_text(rollout_summary(arguments, *model, figures));
  const std::string to_go_on = checkpoints && !checkpoints->command().empty() ? "; to go on: " + checkpoints->command() : "";
  if (figures.signal != 0) {
    tell("interrupted after {} of {} steps{}{}", grouped(figures.steps), grouped(figures.steps_planned),
         figures.frames > 0 ? fmt::format("; {} is valid up to there", arguments.record) : "", to_go_on);
    return 128 + figures.signal;
  }
  if (figures.account) {
    for (const std::string& warning : figures.account->warnings) {
      tell("warning: instance {} on its own: {}", grouped(figures.account->instance), warning);
    }
  }
  if (!figures.lost.empty()) {
    tell("{}; {}; the rollout ended after {} of {} steps{}", figures.lost,
         figures.frames > 0 ? fmt::format("it holds {}", counted(figures.frames, "frame")) : "no frame of it is kept", grouped(figures.steps),
         grouped(figures.steps_planned), to_go_on);
  }
  if (figures.summary.frozen > 0) {
    tell("{} of {} instances failed and were frozen at their last good state", grouped(figures.summary.frozen),
               grouped(arguments.instances));
  }
  return written && figures.kept && figures.summary.frozen == 0 ? 0 : 1;
}

/// Cores that the ranks of a machine share, and instructions that all have.
void share_processor(Ranks& ranks, RolloutArguments& arguments) {
  BatchOptions& computed = arguments.computed;
  if (computed.threads == 0) computed.threads = ranks.threads();
  const auto best = static_cast<std::int64_t>(best_instructions());
  std::int64_t least = best, most = best;
  ranks.least({&least, 1});
  ranks.most({&most, 1});
  if (computed.instructions) return;
  computed.instructions = static_cast<Instructions>(least);
  arguments.instructions_shared = least != most;
}

}  // namespace

int rollout_command(Ranks& ranks, RolloutArguments arguments) {
  const Clock::time_point begin = Clock::now();
  std::int64_t steps = 0;
  std::shared_ptr<const Model> model;
  if (!arguments.seed) arguments.seed = 1;  // instances that are all alike would be no rollout
  together(ranks, [&] {
    check(arguments.options);
    steps = step_count(arguments, arguments.options.step);
    // one looks at the files that are written
    const Outputs outputs = ranks.first() ? checked_outputs(arguments) : Outputs({});
    check_shared(ranks, arguments);
    model = arguments.loaded(outputs);
    print_warnings(*model);
    if (ranks.first()) check_views(arguments.views, *model, static_cast<double>(steps) * arguments.options.step);
    look_at_start(arguments, *model, arguments.options);
  });
  // one that goes on has the instructions that it began with, one that begins those that all ranks have
  std::optional<RolloutCheckpoints> kept;
  if (!arguments.resume.empty()) kept.emplace(arguments, *model, ranks);
  if (ranks.several()) share_processor(ranks, arguments);
  if (!arguments.checkpoint.empty() && !kept) kept.emplace(arguments, *model, ranks);
  RolloutCheckpoints* const checkpoints = kept ? &*kept : nullptr;
  const int own = arguments.single ? execute<float>(ranks, arguments, model, steps, begin, checkpoints)
                                   : execute<double>(ranks, arguments, model, steps, begin, checkpoints);
  std::int64_t exit_code = own;
  ranks.most({&exit_code, 1});
  return static_cast<int>(exit_code);
}

}  // namespace linden

#include "engine/program/option_texts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>
#include <system_error>
#include <type_traits>

#include "engine/files/recorded_arrays.hpp"
#include "engine/program/randomize.hpp"
#include "engine/scene/load_model.hpp"
#include "engine/scene/scene_file.hpp"
#include "engine/text.hpp"
#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"

namespace linden {
namespace {

std::array<double, 3> gravity_from(const std::string& text) {
  constexpr std::string_view expected = "three numbers x,y,z in m/s^2, such as 0,0,-9.81";
  std::array<double, 3> gravity{};
  std::size_t begin = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t end = k < 2 ? text.find(',', begin) : text.size();
    double value = 0;
    const auto [rest, error] = std::from_chars(text.data() + begin, text.data() + std::min(end, text.size()), value);
    if (end == text.npos || error != std::errc{} || rest != text.data() + end) {
      throw InputError(fmt::format("--gravity \"{}\": expected {}", text, expected));
    }
    gravity[k] = value;
    begin = end + 1;
  }
  return gravity;
}

std::optional<double> density_from(const std::string& text) {
  if (text.empty()) return std::nullopt;
  const double density = number_from("--density", text, "kg/m^3, such as 1000");
  if (!(density > 0) || !std::isfinite(density)) {
    throw InputError(fmt::format("--density {}: expected a finite number above zero [kg/m^3], such as 1000", text));
  }
  return density;
}

void read_model_options(const OptionTexts& texts, std::optional<Base>& base, Options& options) {
  if (!texts.base.empty()) base = base_from(texts.base);
  if (!texts.gravity.empty()) options.gravity = gravity_from(texts.gravity);
}

void read_motion_options(const OptionTexts& texts, MotionArguments& motion, Options& options) {
  read_model_options(texts, motion.base, options);
  motion.density = density_from(texts.density);
  motion.gravity_given = !texts.gravity.empty();
  if (!texts.start.empty() && texts.start != "as-given" && texts.start != "checked") {
    throw InputError(fmt::format("--start {}: expected checked or as-given", texts.start));
  }
  motion.start_as_given = texts.start == "as-given";
  if (!texts.duration.empty()) motion.duration = number_from("--duration", texts.duration, "seconds, such as 10");
  if (!texts.dt.empty()) options.step = number_from("--dt", texts.dt, "seconds, such as 1e-3");
  if (!texts.tolerance.empty()) {
    options.tolerance = number_from("--tolerance", texts.tolerance, "a number, such as 1e-10");
    options.reduction = 0;
  }
  if (!texts.seed.empty()) {
    const std::int64_t seed = integer_from("--seed", texts.seed, "a whole number, zero or more");
    if (seed < 0) throw InputError(fmt::format("--seed {}: expected a whole number, zero or more", seed));
    motion.seed = static_cast<std::uint64_t>(seed);
  }
  if (!texts.spread.empty()) motion.spread = number_from("--spread", texts.spread, "a number (rad, m, and per second), such as 0.1");
}

/// What `read` takes from the command line goes over the scene that the arguments name, if they name one.
template <class Arguments, class Read>
void read_over_scene(Arguments& arguments, Options& options, const Read& read) {
  read();
  if (!is_scene(arguments.model) && !is_generated_scene(arguments.model)) return;
  if (arguments.base) {
    throw InputError(fmt::format("--base is for URDF files; {} says itself what floats: leave --base out", arguments.model));
  }
  SceneStart start;
  start.density = arguments.density;
  if constexpr (std::is_base_of_v<MotionArguments, Arguments> && !std::is_same_v<Arguments, RolloutArguments>) {
    if (arguments.spread) check_spread(*arguments.spread);
    start.seed = arguments.seed;
    start.spread = arguments.spread;
  }
  arguments.scene = std::make_shared<const Scene>(load_scene(arguments.model, start));
  options = arguments.scene->options;
  if constexpr (std::is_base_of_v<MotionArguments, Arguments>) arguments.duration = arguments.scene->duration;
  read();
}

void read_order(const OptionTexts& texts, Options& options) {
  if (texts.order.empty()) return;
  const std::int64_t order = integer_from("--order", texts.order, "2, 4, 6 or 8");
  if (order < 2 || order > 8 || order % 2 != 0) throw InputError(fmt::format("--order {}: expected 2, 4, 6 or 8", order));
  // a tolerance that nobody chose goes with the order
  const bool chosen = !texts.tolerance.empty() || options.tolerance != default_tolerance(options.order);
  options.order = static_cast<int>(order);
  if (!chosen) use_default_tolerance(options);
}

/// A step that is given beside it is the length of all.
void read_accuracy(const OptionTexts& texts, Options& options) {
  if (!texts.accuracy.empty()) {
    options.accuracy = number_from("--accuracy", texts.accuracy, "how far energy may stray over the largest kinetic energy, such as 1e-6");
    options.vary = true;
  }
  if (!texts.dt.empty()) options.vary = false;
}

template <class Arguments>
void read_recording_options(const OptionTexts& texts, Arguments& arguments) {
  if (!texts.every.empty()) arguments.every = integer_from("--every", texts.every, "steps between frames, such as 10");
  if (!texts.what.empty()) arguments.what = quantities_from(texts.what);
  if (!texts.observe.empty()) arguments.observe = observation_names(texts.observe);
  read_view_options(texts.views, arguments.views);
}

void read_checkpoint_options(const OptionTexts& texts, RolloutArguments& rollout) {
  if (rollout.checkpoint.empty()) rollout.checkpoint = rollout.resume;
  for (const auto& [option, text] : {std::pair{"--checkpoint-every", texts.checkpoint_every}, {"--keep", texts.keep}}) {
    if (!text.empty() && rollout.checkpoint.empty()) {
      throw InputError(fmt::format("{} is about checkpoints: give --checkpoint, or --resume, a folder for them too", option));
    }
  }
  if (!texts.checkpoint_every.empty()) {
    rollout.checkpoint_every = number_from("--checkpoint-every", texts.checkpoint_every, "seconds by the clock, such as 600");
    if (!(rollout.checkpoint_every > 0)) {
      throw InputError(fmt::format("--checkpoint-every {}: expected seconds by the clock above zero, such as 600", texts.checkpoint_every));
    }
  }
  if (!texts.keep.empty()) rollout.checkpoints_kept = integer_from("--keep", texts.keep, "how many checkpoints, such as 2");
  if (rollout.checkpoints_kept < 1) throw InputError(fmt::format("--keep {}: expected 1 checkpoint or more", rollout.checkpoints_kept));
}

void read_randomize_option(const OptionTexts& texts, MotionArguments& motion) {
  if (motion.scene) motion.randomization = motion.scene->randomization;
  if (!texts.randomize.empty()) randomize_from(texts.randomize, motion.effects(), motion.randomization);
}

/// What goes with --live, and nothing else.
void read_live_options(const OptionTexts& texts, ViewCommandArguments& view) {
  if (!view.views.live) {
    if (texts.port.empty() && texts.bind.empty()) return;
    throw InputError(fmt::format("{} says where --live shows the simulation: give --live too", texts.port.empty() ? "--bind" : "--port"));
  }
  if (is_recording(view.model)) throw InputError(fmt::format("--live simulates, and {} is a recording: leave --live out", view.model));
  const ViewArguments& views = view.views;
  for (const auto& [option, text] : {std::pair{"--view", views.view}, {"--gltf", views.gltf}, {"--picture", views.picture}, {"--film", views.film},
                                     {"--moments", texts.views.moments}, {"--size", texts.views.size}, {"--look", texts.views.look},
                                     {"--duration", texts.duration}}) {
    if (!text.empty()) throw InputError(fmt::format("{}: --live shows the simulation until Ctrl-C and writes nothing; leave one of them out", option));
  }
  if (!texts.port.empty()) {
    const std::int64_t port = integer_from("--port", texts.port, "a whole number from 0 to 65535, such as 8470");
    if (port < 0 || port > 65535) throw InputError(fmt::format("--port {}: expected a whole number from 0 to 65535, such as 8470", port));
    view.address.port = static_cast<std::uint16_t>(port);
  }
  if (!texts.bind.empty()) view.address.bind = texts.bind;
}

}  // namespace

void read_run_options(const OptionTexts& texts, RunArguments& run) {
  read_over_scene(run, run.options, [&] { read_motion_options(texts, run, run.options); });
  read_accuracy(texts, run.options);
  read_randomize_option(texts, run);
  // with a seed a randomised run finds its masses again
  if (!run.load.empty() && (run.spread || (run.seed && !run.randomization.any()))) {
    throw InputError("--load continues a run, --seed and --spread start one at random: leave one of them out");
  }
  read_recording_options(texts, run);
  if (!texts.solver.empty()) run.options.solver = solver_from(texts.solver);
  if (!texts.guess.empty()) run.options.guess = guess_from(texts.guess);
  if (!texts.stop.empty()) run.options.stop = stop_from(texts.stop);
  read_order(texts, run.options);
}

void read_rollout_options(const OptionTexts& texts, RolloutArguments& rollout) {
  read_over_scene(rollout, rollout.options, [&] { read_motion_options(texts, rollout, rollout.options); });
  read_randomize_option(texts, rollout);
  if (!texts.instances.empty()) rollout.instances = integer_from("--instances", texts.instances, "how many, such as 4096");
  read_recording_options(texts, rollout);
  if (!texts.shown.empty()) {
    if (!rollout.views.any()) throw InputError("--shown says which instances --view, --gltf, --picture and --film show: give one of them too");
    rollout.shown = integer_from("--shown", texts.shown, "how many instances, such as 16");
  }
  read_order(texts, rollout.options);
  if (!texts.threads.empty()) {
    const std::int64_t threads = integer_from("--threads", texts.threads, "how many, such as 8; 0 for all there are");
    rollout.computed.threads = static_cast<int>(std::clamp<std::int64_t>(threads, -1, 1 << 20));
  }
  if (!texts.instructions.empty()) rollout.computed.instructions = instructions_from(texts.instructions);
  read_checkpoint_options(texts, rollout);
}

void read_scaling_options(const OptionTexts& texts, ScalingArguments& scaling) {
  MotionArguments motion;
  motion.seed = scaling.seed;
  motion.spread = scaling.spread;
  read_motion_options(texts, motion, scaling.options);
  scaling.seed = *motion.seed;
  scaling.spread = *motion.spread;
  if (!texts.shape.empty()) scaling.shape = scaling_shape_from(texts.shape);
  if (!texts.dofs.empty()) scaling.sizes = scaling_sizes_from(texts.dofs);
  if (!texts.solver.empty()) scaling.solvers = scaling_solvers_from(texts.solver);
  if (!texts.steps.empty()) scaling.steps = integer_from("--steps", texts.steps, "how many, such as 100");
  if (texts.duration.empty()) return;
  if (scaling.steps) throw InputError("--duration and --steps both say how long: leave one of them out");
  check(scaling.options);
  scaling.steps = step_count(motion, scaling.options.step);
}

void read_accuracy_options(const OptionTexts& texts, AccuracyArguments& accuracy) {
  read_over_scene(accuracy, accuracy.options, [&] { read_motion_options(texts, accuracy, accuracy.options); });
  accuracy.options.accuracy.reset();  // all orders and steps are tried
  if (!texts.budget.empty()) accuracy.budget = number_from("--budget", texts.budget, "seconds, such as 60");
}

void read_view_command_options(const OptionTexts& texts, ViewCommandArguments& view) {
  read_live_options(texts, view);
  if (!view.views.any() && !view.views.live) view.views.view = usual_view(view.model);
  if (is_recording(view.model)) {
    view.recording = view.model;
    if (texts.recorded.empty()) {
      throw InputError(fmt::format("{} is a recording: --model has to say what it was recorded of, such as --model models/humanoid.urdf "
                                   "--base floating, or a scene", view.model));
    }
    for (const auto& [option, text] : {std::pair{"--duration", texts.duration}, {"--dt", texts.dt}, {"--seed", texts.seed}, {"--spread", texts.spread}}) {
      if (!text.empty()) throw InputError(fmt::format("{} {}: {} is a recording, which moves as it was recorded; leave it out", option, text, view.model));
    }
    view.model = texts.recorded;
    if (!texts.shown.empty()) view.shown = integer_from("--shown", texts.shown, "how many instances, such as 16");
    if (view.shown < 1) throw InputError(fmt::format("--shown {}: expected 1 instance or more", view.shown));
  } else if (!texts.recorded.empty() || !texts.shown.empty()) {
    throw InputError(fmt::format("{} is about recordings, and {} is none (.npz, .h5, .csv): leave it out",
                                 texts.recorded.empty() ? "--shown" : "--model", view.model));
  }
  view.moves = !texts.duration.empty() || is_scene(view.model) || is_generated_scene(view.model);
  read_run_options(texts, view);
  view.options.vary = false;  // frames are steps apart
}

void read_inspect_options(const OptionTexts& texts, InspectArguments& inspect) {
  read_over_scene(inspect, inspect.options, [&] {
    read_model_options(texts, inspect.base, inspect.options);
    inspect.density = density_from(texts.density);
  });
  if (!texts.solver.empty()) inspect.options.solver = solver_from(texts.solver);
}

}  // namespace linden

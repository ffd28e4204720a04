// engine/program/main.cpp
// The program `linden`: commands, their options, and what becomes of mistakes.
//
//   exit codes  0 fine, 1 the run failed or an output was lost, 2 bad input, 128 + signal interrupted
//   messages    one line on stderr that begins with "linden: "; results on stdout
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <new>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "engine/distributed/ranks.hpp"
#include "engine/program/accuracy_command.hpp"
#include "engine/program/inspect.hpp"
#include "engine/program/option_texts.hpp"
#include "engine/program/rollout_checkpoint.hpp"
#include "engine/program/rollout_command.hpp"
#include "engine/program/run_command.hpp"
#include "engine/program/scaling_command.hpp"
#include "engine/program/view_command.hpp"
#include "engine/scene/load_model.hpp"
#include "engine/standard_streams.hpp"
#include "engine/text.hpp"
#include "engine/version.hpp"
#include "layout/support/words.hpp"

namespace linden {
namespace {

constexpr const char* kSceneHelp =
    "SCENE.yaml, FILE.urdf, or chain:N, ball-chain:N, paper-chain:N, tree:N, random:N, humanoids:N, ring:N, fourbars:N, ladder:N, "
    "roller-chain:N, net:AxB; loose solids boxes:N, wall:N, pile:N, cards:N, dominoes:N";
constexpr const char* kModelHelp =
    "FILE.urdf, or chain:N, ball-chain:N, paper-chain:N, tree:N, random:N, humanoids:N, ring:N, fourbars:N, ladder:N, roller-chain:N, net:AxB";

/// An empty text is how the code says that an option is absent; one that is written out is a slip, such as of a variable in a script.
std::string filled(const std::string& text) {
  return text.empty() ? "the value is empty; expected something; write it, or leave the option out" : "";
}

/// Options of one command, each a text until all have been read.
struct OptionAdder {
  CLI::App* command;

  void operator()(const char* group, const char* name, std::string& text, const char* value, const char* meaning) const {
    command->add_option(name, text, meaning)->option_text(value)->type_name("value")->group(group)->check(filled);
  }
  void model(std::string& name, const char* help = kModelHelp) const {
    command->add_option("MODEL", name, help)->required()->option_text(" ")->check(filled);
  }
  void base(const char* group, OptionTexts& texts) const {
    (*this)(group, "--base", texts.base, "fixed|floating", "root of a URDF file: fixed (default) or on a free joint");
  }
  void density(const char* group, OptionTexts& texts) const {
    (*this)(group, "--density", texts.density, "D", "[kg/m^3] give links of a URDF without inertia the mass of their shapes, such as 1000");
  }
  void strict(const char* group, bool& strict) const {
    command->add_flag("--strict", strict, "refuse a model or scene that gives warnings")->group(group);
  }
  void duration(OptionTexts& texts) const { (*this)("Motion", "--duration", texts.duration, "S", "simulated time [s], default 10"); }
  void step(OptionTexts& texts) const { (*this)("Motion", "--dt", texts.dt, "S", "step [s], default 1e-3"); }
  void gravity(const char* group, OptionTexts& texts) const {
    (*this)(group, "--gravity", texts.gravity, "X,Y,Z", "[m/s^2], default 0,0,-9.81; 0,0,0 for none");
  }
  void spread(const char* group, OptionTexts& texts) const {
    (*this)(group, "--spread", texts.spread, "R", "their range [rad, m, and per second], default 0.1");
  }
  void randomize(const char* group, OptionTexts& texts) const {
    (*this)(group, "--randomize", texts.randomize, "NAME=RANGE,...", "draw masses, friction, joint_friction or gains; see below");
  }
  void views(OptionTexts& texts, ViewArguments& views) const {
    (*this)("Pictures", "--view", views.view, "FILE.html", "the motion as a page that any browser opens");
    (*this)("Pictures", "--gltf", views.gltf, "FILE.glb", "the motion as binary glTF, for Blender and others");
    (*this)("Pictures", "--picture", views.picture, "FILE.png", "moments of it side by side (needs Chromium)");
    (*this)("Pictures", "--film", views.film, "FILE.mp4", "a film of it (needs Chromium and ffmpeg)");
    (*this)("Pictures", "--fps", texts.views.fps, "F", "frames kept of a second of the motion, default 60");
    (*this)("Pictures", "--moments", texts.views.moments, "T,T,...", "[s] that the picture shows, default four");
    (*this)("Pictures", "--size", texts.views.size, "WxH", "pixels of a moment and of the film, default 960x720");
    (*this)("Pictures", "--look", texts.views.look, "LIST", "azimuth=30,elevation=15,distance=3,follow=pelvis,theme=dark");
  }
  void start(const char* group, OptionTexts& texts) const {
    (*this)(group, "--start", texts.start, "RULE", "checked (default): a scene may not begin outside limits or in the ground; or as-given");
  }
};

CLI::App* add_run(CLI::App& program, OptionTexts& texts, RunArguments& run) {
  CLI::App* command = program.add_subcommand("run", "Simulate one model or scene.");
  const OptionAdder add{command};
  add.model(run.model, kSceneHelp);
  add.base("Motion", texts);
  add.density("Motion", texts);
  add.strict("Motion", run.strict);
  add.duration(texts);
  add.step(texts);
  add.gravity("Motion", texts);
  add("Start", "--seed", texts.seed, "K", "start from random positions and speeds, the same for the same K");
  add.spread("Start", texts);
  add.start("Start", texts);
  add.randomize("Start", texts);
  add("Start", "--load", run.load, "FILE", "continue from a checkpoint");
  add("Method", "--solver", texts.solver, "NAME", "newton (default) or riqn");
  add("Method", "--guess", texts.guess, "NAME", "extrapolation (default), ig1, ig2 or ig3");
  add("Method", "--stop", texts.stop, "NAME", "energy (default: relative) or absolute (|r| in N m s)");
  add("Method", "--tolerance", texts.tolerance, "T", "of the solver, default 1e-10, above order 2 less");
  add("Method", "--order", texts.order, "N", "of the integrator: 2 (default), 4, 6 or 8");
  add("Method", "--accuracy", texts.accuracy, "A", "energy band over the largest kinetic energy; order and steps follow from it");
  add("Output", "--record", run.record, "FILE.csv|npz|h5", "time, energy and what --what says, one row a step");
  add("Output", "--what", texts.what, "LIST", "what is recorded and plotted, with commas; see below");
  add("Output", "--observe", texts.observe, "LIST", "observations beside it: pose:hand,com,contact:foot; see below");
  add("Output", "--every", texts.every, "K", "record a row every K steps, default 1");
  add("Output", "--json", run.json, "FILE.json", "the figures of the summary, for scripts");
  add("Output", "--plot", run.plot, "FILE.svg|png", "drift of energy over time, or what --what says");
  add("Output", "--save", run.save, "FILE", "checkpoint of the last state");
  add.views(texts, run.views);
  command->footer(
      "Coordinates are named after their joints, a name that is taken with _2 behind it; quaternions are x y z w. Ctrl-C, SIGTERM and\n"
      "SIGHUP end a run early and keep its files; on a full disk it ends with what fits.\n"
      "What is given here goes over what a scene says.\n\n"
      "--what takes positions, velocities, servos (the force of each), forces (of all effects on each coordinate), energies (kinetic,\n"
      "potential, taken and given by each effect) and contacts (points and normal force of each body). Unless told otherwise a table has\n"
      "positions, npz and h5 have positions and velocities, and a plot has the drift of energy. Forces are means over the step before.\n\n"
      "--observe takes, of link L or joint J: pose:L, position:L, quaternion:L, twist:L, acceleration:L, imu:L, contact:L (points in the\n"
      "ground, normal force), q:J, v:J, a:J, p:J, target:J; and q, v, a, p, targets, time, energy, com, com_velocity, momentum.\n"
      "Columns are called NAME.NUMBER: pose:L.x.\n\n"
      "--randomize goes over what a scene says; the seed says what is drawn. See linden rollout --help.\n\n"
      "Examples:\n"
      "  linden run models/scenes/humanoid_drop.yaml --duration 2 --record drop.csv\n"
      "  linden run models/humanoid.urdf --base floating --gravity 0,0,0 --spread 0.5 --plot energy.png\n"
      "  linden run chain:100 --duration 5 --dt 1e-3 --record chain.csv --json chain.json\n"
      "  linden run models/scenes/humanoid_drop.yaml --record drop.h5 --what positions,servos,contacts --every 10");
  return command;
}

CLI::App* add_rollout(CLI::App& program, OptionTexts& texts, RolloutArguments& rollout) {
  CLI::App* command = program.add_subcommand("rollout", "Simulate many instances of one model or scene at once.");
  const OptionAdder add{command};
  add.model(rollout.model, kSceneHelp);
  add("Instances", "--instances", texts.instances, "N", "how many, default 1024");
  add("Instances", "--seed", texts.seed, "K", "instance i starts from random numbers K + i, default 1");
  add.spread("Instances", texts);
  add.randomize("Instances", texts);
  add.start("Instances", texts);
  add.base("Motion", texts);
  add.density("Motion", texts);
  add.strict("Motion", rollout.strict);
  add.duration(texts);
  add.step(texts);
  add.gravity("Motion", texts);
  add("Method", "--tolerance", texts.tolerance, "T", "of the solver, default 1e-10; single precision stops at 3e-6");
  add("Method", "--order", texts.order, "N", "of the integrator: 2 (default), 4, 6 or 8");
  command->add_flag("--float", rollout.single, "single precision: twice as fast, half the memory")->group("Method");
  add("Processor", "--threads", texts.threads, "T", "default: all there are; results do not depend on it");
  add("Processor", "--instructions", texts.instructions, "NAME",
      "scalar, avx2, avx512 or baseline (SSE2, NEON), if built with it; default: the best there is");
  add("Output", "--record", rollout.record, "FILE.npz|h5", "time, energy, status and what --what says, of all instances");
  add("Output", "--what", texts.what, "LIST", "of positions, velocities (default: both) and energies");
  add("Output", "--observe", texts.observe, "LIST", "observations beside it: pose:hand,com,imu:head; see linden run --help");
  add("Output", "--every", texts.every, "K", "a frame every K steps, default 1");
  command->add_flag("--compress", rollout.compress, "a --record FILE.h5 is compressed, without loss: smaller, and slower to write")->group("Output");
  add("Output", "--json", rollout.json, "FILE.json", "the figures of the summary, for scripts");
  add("Checkpoints", "--checkpoint", rollout.checkpoint, "DIR", "keep the state of all instances in this folder, to go on from");
  add("Checkpoints", "--checkpoint-every", texts.checkpoint_every, "S", "seconds by the clock between two, default 600");
  add("Checkpoints", "--keep", texts.keep, "N", "how many stay there, default the newest 2");
  add("Checkpoints", "--resume", rollout.resume, "DIR", "go on, to the bit, from the newest one there; the other options as they were");
  add.views(texts, rollout.views);
  add("Pictures", "--shown", texts.shown, "N", "instances that are shown, default the first 16");
  command->footer(
      "An instance that fails is frozen at its last good state, the others go on. Quaternions are x y z w. Ctrl-C, SIGTERM and SIGHUP end\n"
      "a rollout early and keep its files; on a full disk it ends with what fits. With --checkpoint it goes on from there, and from wherever it was\n"
      "killed, as if nothing had happened (--resume).\n\n"
      "--randomize masses=0.2,friction=0.4:1.0,gains=0.1 draws for each instance, by its seed: a factor from 0.8 to 1.2 for the mass of each\n"
      "body, the friction of the ground from 0.4 to 1.0, a factor for the gains of each servo; joint_friction likewise. It goes over what a\n"
      "scene says, and what was drawn is in the --record file.\n\n"
      "Examples:\n"
      "  linden rollout models/humanoid.urdf --base floating --instances 10000 --duration 1 --spread 0.5\n"
      "  linden rollout models/scenes/humanoid_drop.yaml --instances 1024 --spread 0.02\n"
      "  linden rollout models/arm.urdf --instances 4096 --duration 2 --record arms.npz --every 10\n"
      "  linden rollout models/arm.urdf --instances 4096 --duration 600 --record arms.h5 --every 100 --checkpoint state\n"
      "  linden rollout models/arm.urdf --instances 4096 --duration 600 --record arms.h5 --every 100 --resume state");
  return command;
}

CLI::App* add_scaling(CLI::App& program, OptionTexts& texts, ScalingArguments& scaling) {
  CLI::App* command = program.add_subcommand("scaling", "Measure how the time of a step grows with the size of the model.");
  const OptionAdder add{command};
  add("Models", "--shape", texts.shape, "NAME",
      "chain (default), ball-chain, paper-chain, binary, random, humanoids, fourbars, ladder or roller-chain");
  add("Models", "--dofs", texts.dofs, "A..B", "least and most degrees of freedom, default 10..100000");
  add("Models", "--seed", texts.seed, "K", "each starts from random positions and speeds, default 1");
  add.spread("Models", texts);
  add("Motion", "--steps", texts.steps, "K", "measured steps of each size, default: at least 5, as many as fit in 0.3 s");
  add("Motion", "--duration", texts.duration, "S", "or their simulated time [s]");
  add.step(texts);
  add.gravity("Motion", texts);
  add("Method", "--solver", texts.solver, "NAMES", "newton (default), riqn or newton,riqn");
  add("Output", "--json", scaling.json, "FILE.json", "rows and fits, for scripts");
  add("Output", "--plot", scaling.plot, "FILE.svg|png", "time per step over degrees of freedom");
  command->footer(
      "Each row is a size and a solver. Ctrl-C ends the measurement early and keeps the rows that are done.\n\n"
      "Examples:\n"
      "  linden scaling --dofs 10..10000 --solver newton,riqn --plot scaling.png\n"
      "  linden scaling --shape humanoids --dofs 36..36000 --steps 100 --json scaling.json");
  return command;
}

CLI::App* add_accuracy(CLI::App& program, OptionTexts& texts, AccuracyArguments& accuracy) {
  CLI::App* command =
      program.add_subcommand("accuracy", "Measure what accuracy costs on a model or scene, and say which method to use.");
  const OptionAdder add{command};
  add.model(accuracy.model, kSceneHelp);
  add.base("Motion", texts);
  add.density("Motion", texts);
  add.strict("Motion", accuracy.strict);
  add.duration(texts);
  add("Motion", "--dt", texts.dt, "S", "steps from 16 times to a quarter of this are tried, default 1e-3");
  add.gravity("Motion", texts);
  add("Start", "--seed", texts.seed, "K", "start from random positions and speeds, the same for the same K");
  add.spread("Start", texts);
  add.start("Start", texts);
  add("Study", "--budget", texts.budget, "S", "seconds that all of it may take, default 60");
  add("Output", "--json", accuracy.json, "FILE.json", "rows, fits and advice, for scripts");
  add("Output", "--plot", accuracy.plot, "FILE.svg|png", "error and energy over CPU time");
  command->footer(
      "Runs orders 2, 4, 6, 8, RK4 and semi-implicit Euler against a reference that two methods agree on. Ctrl-C ends it early and\n"
      "keeps the rows that are done.\n\n"
      "Examples:\n"
      "  linden accuracy chain:10 --duration 2 --plot accuracy.png\n"
      "  linden accuracy models/humanoid.urdf --base floating --spread 0.5 --budget 30 --json accuracy.json");
  return command;
}

CLI::App* add_view(CLI::App& program, OptionTexts& texts, ViewCommandArguments& view) {
  CLI::App* command = program.add_subcommand("view", "Show a model, the motion of a scene, or a recording.");
  const OptionAdder add{command};
  add.model(view.model, "FILE.urdf, SCENE.yaml, chain:N and the like, or a recording: FILE.npz, FILE.h5, FILE.csv");
  add("Recording", "--model", texts.recorded, "MODEL", "the model or scene that it was recorded of");
  add("Recording", "--shown", texts.shown, "N", "instances that are shown, default the first 16");
  add.base("Motion", texts);
  add.density("Motion", texts);
  add.strict("Motion", view.strict);
  add("Motion", "--duration", texts.duration, "S", "simulated time [s], default that of the scene; a model stands still without");
  add.step(texts);
  add.gravity("Motion", texts);
  add("Start", "--seed", texts.seed, "K", "start from random positions and speeds, the same for the same K");
  add.spread("Start", texts);
  add.start("Start", texts);
  add("Output", "--observe", texts.observe, "LIST", "curves beside those of joints and energy: pose:hand,com,contact:foot");
  add.views(texts, view.views);
  command->add_flag("--live", view.views.live, "simulate now, in a page that can pause, pull at bodies and move servos; Ctrl-C ends it")->group("Live");
  add("Live", "--port", texts.port, "P", "where the page is, default 8470; 0: any that is free");
  add("Live", "--bind", texts.bind, "ADDRESS", "default 127.0.0.1, which this machine alone reaches");
  command->footer(
      "Without one of --view, --gltf, --picture and --film the page is written as NAME.html in this folder. --live writes nothing:\n"
      "it prints the address of a page, begins when that is opened, and goes on until Ctrl-C. --fps is how often it is drawn.\n\n"
      "Examples:\n"
      "  linden view models/humanoid.urdf\n"
      "  linden view models/scenes/arm_servo.yaml --live\n"
      "  linden view models/scenes/humanoid_drop.yaml --picture drop.png --look azimuth=40,elevation=10\n"
      "  linden view motion.npz --model models/humanoid.urdf --base floating --gltf motion.glb");
  return command;
}

CLI::App* add_inspect(CLI::App& program, OptionTexts& texts, InspectArguments& inspect) {
  CLI::App* command =
      program.add_subcommand("inspect", "Print a model or scene: effects, bodies, coordinates, masses, sweeps of a step.");
  const OptionAdder add{command};
  add.model(inspect.model, kSceneHelp);
  add.base("Options", texts);
  add.density("Options", texts);
  add.strict("Options", inspect.strict);
  add.gravity("Options", texts);
  add("Options", "--solver", texts.solver, "NAME", "newton (default) or riqn");
  command->add_flag("--all", inspect.all, "long tables whole, not their first 20 rows");
  add("Options", "--json", inspect.json, "FILE.json", "the same for scripts");
  command->footer("Example:\n  linden inspect models/humanoid.urdf --base floating");
  return command;
}

/// At most one empty line in a row.
std::string with_single_gaps(std::string text) {
  for (std::size_t at = 0; (at = text.find("\n\n\n", at)) != text.npos;) text.erase(at, 1);
  return text;
}

/// What CLI11 could not place: most often a slip in an option's name.
void refuse_leftovers(const CLI::App& app, const std::string& command) {
  const std::vector<std::string> extras = app.remaining();
  if (extras.empty()) return;
  const auto option = std::ranges::find_if(extras, [](const std::string& text) { return text.starts_with('-'); });
  std::vector<std::string> known;
  if (option == extras.end()) {
    for (const CLI::App* sub : app.get_subcommands([](const CLI::App*) { return true; })) known.push_back(sub->get_name());
  } else {
    for (const CLI::Option* entry : app.get_options()) {
      for (const std::string& name : entry->get_lnames()) known.push_back("--" + name);
    }
  }
  const std::string word = option == extras.end() ? extras.front() : option->substr(0, option->find('='));
  const std::string guess = nearest(word, known);
  const char* what = option != extras.end() ? "unknown option" : known.empty() ? "unexpected argument" : "unknown command";
  throw InputError(fmt::format("{} {}; {}", what, word,
                               guess.empty() ? fmt::format("{} --help lists what there is", command)
                                             : fmt::format("did you mean {}?", guess)));
}

int report_error(std::string_view message, int exit_code) {
  speak(true);
  tell_text(message);
  return exit_code;
}

/// A command that all ranks work on; the first of them speaks for all.
int by_ranks(const std::function<int(Ranks& ranks)>& command) {
  const std::unique_ptr<Ranks> ranks = ranks_of_program();
  speak(ranks->first());
  // mpirun ends all when one ends with an error: none does before all is said
  int exit_code = 0;
  try {
    exit_code = command(*ranks);
  } catch (const ToldElsewhere& elsewhere) {
    exit_code = elsewhere.exit_code;
  } catch (const std::exception& error) {
    if (!ranks->several()) throw;
    exit_code = report_error(error.what(), exit_code_of(error));
    if (!ranks->ending()) ranks->abort(exit_code);
  }
  flush_standard_output();
  ranks->barrier();
  return exit_code;
}

int run_program(int argc, char** argv) {
  CLI::App program("Simulates trees of rigid bodies with a variational integrator, in time linear in their number.", "linden");
  program.set_version_flag("--version", fmt::format("linden {}", kVersion));
  program.footer("Examples:\n"
                 "  linden run chain:100 --duration 5 --plot energy.png\n"
                 "  linden rollout models/humanoid.urdf --base floating --instances 4096 --duration 1\n"
                 "  linden view models/scenes/humanoid_drop.yaml\n"
                 "  linden accuracy chain:10 --duration 2\n"
                 "  linden scaling --dofs 10..10000\n"
                 "  linden inspect models/humanoid.urdf --base floating\n\n"
                 "Outputs are ordinary files, and none is written over a file that the same command reads. One that is there is replaced when\n"
                 "all is written and keeps its mode and owner; of a symbolic link, what it leads to is replaced and the link stays.\n\n"
                 "linden COMMAND --help says more.");
  program.get_formatter()->column_width(30);
  OptionTexts texts;
  RunArguments run_arguments;
  RolloutArguments rollout_arguments;
  ScalingArguments scaling_arguments;
  AccuracyArguments accuracy_arguments;
  InspectArguments inspect_arguments;
  ViewCommandArguments view_arguments;
  const CLI::App* run = add_run(program, texts, run_arguments);
  const CLI::App* rollout = add_rollout(program, texts, rollout_arguments);
  const CLI::App* accuracy = add_accuracy(program, texts, accuracy_arguments);
  const CLI::App* scaling = add_scaling(program, texts, scaling_arguments);
  const CLI::App* inspection = add_inspect(program, texts, inspect_arguments);
  const CLI::App* view = add_view(program, texts, view_arguments);
  program.allow_extras();
  for (CLI::App* command : program.get_subcommands([](const CLI::App*) { return true; })) command->allow_extras();

  try {
    program.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    say_text(with_single_gaps(program.help()));
    return 0;
  } catch (const CLI::ParseError& error) {
    if (rollout->parsed() && told_rank() > 0) throw ToldElsewhere{2};
    if (error.get_exit_code() == 0) return program.exit(error);  // --version
    std::string help = "linden";
    for (const CLI::App* command : {run, rollout, view, accuracy, scaling, inspection}) {
      if (!command->parsed()) continue;
      help = "linden " + command->get_name();
      refuse_leftovers(*command, help);
    }
    throw InputError(fmt::format("{}; {} --help says more", error.what(), help));
  }
  refuse_leftovers(program, "linden");
  if (run->parsed()) {
    refuse_leftovers(*run, "linden run");
    read_run_options(texts, run_arguments);
    return run_command(run_arguments);
  }
  if (rollout->parsed()) {
    return by_ranks([&](Ranks& ranks) {
      together(ranks, [&] {
        refuse_leftovers(*rollout, "linden rollout");
        read_rollout_options(texts, rollout_arguments);
        const std::span<const char* const> words(argv, static_cast<std::size_t>(argc));
        rollout_arguments.command_to_resume = command_to_resume(words, rollout_arguments.checkpoint);
      });
      return rollout_command(ranks, rollout_arguments);
    });
  }
  if (view->parsed()) {
    refuse_leftovers(*view, "linden view");
    read_view_command_options(texts, view_arguments);
    return view_command(view_arguments);
  }
  if (accuracy->parsed()) {
    refuse_leftovers(*accuracy, "linden accuracy");
    read_accuracy_options(texts, accuracy_arguments);
    return accuracy_command(accuracy_arguments);
  }
  if (scaling->parsed()) {
    refuse_leftovers(*scaling, "linden scaling");
    read_scaling_options(texts, scaling_arguments);
    return scaling_command(scaling_arguments);
  }
  if (inspection->parsed()) {
    refuse_leftovers(*inspection, "linden inspect");
    read_inspect_options(texts, inspect_arguments);
    return inspect(inspect_arguments);
  }
  throw InputError("no command given; choose run, rollout, view, accuracy, scaling or inspect; linden --help says more");
}

constexpr const char* kNoMemory = "there is not enough memory for that; choose a smaller model or fewer instances, or allow more (ulimit -v)";

int guarded(int argc, char** argv) {
  try {
    return run_program(argc, argv);
  } catch (const ToldElsewhere& elsewhere) {
    return elsewhere.exit_code;
  } catch (const MemoryError& error) {
    return report_error(error.what(), 1);
  } catch (const InputError& error) {
    return report_error(error.what(), 2);
  } catch (const std::bad_alloc&) {
    return report_error(kNoMemory, 1);
  } catch (const std::length_error&) {
    return report_error(kNoMemory, 1);
  } catch (const std::exception& error) {
    return report_error(error.what(), 1);
  }
}

}  // namespace
}  // namespace linden

int main(int argc, char** argv) {
  linden::prepare_standard_streams();
  const int exit_code = linden::guarded(argc, argv);
  const int lost = linden::flush_standard_output();
  if (lost == 0) return exit_code;
  linden::tell("standard output cannot be written: {}", std::generic_category().message(lost));
  return exit_code != 0 ? exit_code : 1;
}

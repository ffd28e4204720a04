#include "engine/program/scaling_command.hpp"

#include <fmt/format.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>

#include "engine/files/output_file.hpp"
#include "engine/files/report_files.hpp"
#include "engine/initial_state.hpp"
#include "engine/program/interrupt.hpp"
#include "engine/program/motion_arguments.hpp"
#include "engine/program/progress.hpp"
#include "engine/program/scaling_report.hpp"
#include "engine/scene/load_model.hpp"
#include "engine/simulation.hpp"
#include "engine/standard_streams.hpp"
#include "engine/text.hpp"
#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"
#include "layout/workspace.hpp"
#include "models/build/generators.hpp"

namespace linden {
namespace {

using Clock = Progress::Clock;

constexpr std::array<ScalingShape, 9> kShapes{{
    {"chain", "chain", 1},
    {"ball-chain", "ball-chain", 3},
    {"paper-chain", "paper-chain", 1},
    {"binary", "tree", 1},
    {"random", "random", 2.4},  // mean over its five kinds of joints
    {"humanoids", "humanoids", kHumanoidFreedom},
    {"fourbars", "fourbars", 3},  // of its tree, as if loops were open
    {"ladder", "ladder", 3},
    {"roller-chain", "roller-chain", 3},
}};

constexpr Index kMostFreedom = 10'000'000;
constexpr std::int64_t kStretches = 5;
constexpr std::int64_t kTogether = 20;  // steps between two questions whether to go on
constexpr double kSeconds = 0.3;  // of the measured steps of a row

/// Names of the models, small to large.
std::vector<std::string> models_of(const ScalingShape& shape, const ScalingSizes& sizes) {
  std::vector<Index> freedom{sizes.least};
  for (std::int64_t decade = 1; decade <= sizes.most; decade *= 10) {
    for (const std::int64_t size : {decade, 2 * decade, 5 * decade}) {
      if (size > sizes.least && size < sizes.most) freedom.push_back(static_cast<Index>(size));
    }
  }
  freedom.push_back(sizes.most);
  std::vector<std::string> models;
  for (const Index size : freedom) {
    const std::int64_t units = std::max<std::int64_t>(1, std::llround(size / shape.degrees_of_freedom));
    std::string model = fmt::format("{}:{}", shape.model, units);
    if (models.empty() || models.back() != model) models.push_back(std::move(model));
  }
  return models;
}

void check_arguments(const ScalingArguments& arguments) {
  check(arguments.options);
  check_spread(arguments.spread);
  if (arguments.steps && *arguments.steps < 1) throw InputError(fmt::format("--steps {}: expected 1 step or more", *arguments.steps));
  const Outputs writable{{"--json", arguments.json, {".json"}}, {"--plot", arguments.plot, {".svg", ".png"}}};
}

/// The steps of one row.
class ScalingMeasurement {
 public:
  ScalingMeasurement(const ScalingArguments& arguments, std::shared_ptr<const Model> model, Solver solver, std::function<bool()> go_on)
      : simulation_(model, with_solver(arguments.options, solver)), go_on_(std::move(go_on)) {
    const Tree& tree = model->tree;
    row_.solver = solver;
    row_.bodies = tree.bodies();
    row_.dofs = model->degrees_of_freedom();
    row_.threads = std::min<int>(tree.most_threads(), oneapi::tbb::this_task_arena::max_concurrency());
    row_.bytes = bytes_for<State<double>>(tree.shape) + bytes_for<Workspace<double>>(tree.shape) +
                 (solver == Solver::newton ? bytes_for<MassFactor<double>>(tree.shape) : 0) + bytes_for<BodyConstants<double>>(tree.shape) + bytes_for<Tree>(tree.shape);
    const InitialState state = random_state(*model, arguments.seed, arguments.spread);
    simulation_.set_positions(state.positions);
    simulation_.set_velocities(state.velocities);
  }

  /// Nothing where it was told not to go on.
  std::optional<ScalingRow> row(std::optional<std::int64_t> given) && {
    const double time = warm_up();
    const std::int64_t steps = given.value_or(std::max(kStretches, static_cast<std::int64_t>(kSeconds / time)));
    look();
    row_.first_energy = row_.last_energy;
    for (std::int64_t k = 0; k < kStretches && going(); ++k) stretch(steps * (k + 1) / kStretches - steps * k / kStretches);
    if (interrupted_) return std::nullopt;
    return std::move(row_);
  }

 private:
  static Options with_solver(Options options, Solver solver) {
    options.solver = solver;
    return options;
  }

  bool going() {
    interrupted_ = interrupted_ || !go_on_();
    return !row_.failed() && !interrupted_;
  }

  /// Until the first guess has all of its history; the shortest of the steps [s].
  double warm_up() {
    double shortest = kSeconds;
    for (int k = 0; k <= kHistory && going(); ++k) {
      const Clock::time_point begin = Clock::now();
      take(1);
      shortest = std::min(shortest, seconds(Clock::now() - begin));
    }
    return std::max(shortest, 1e-8);
  }

  void stretch(std::int64_t steps) {
    const std::int64_t end = row_.run.steps + steps;
    const Clock::time_point begin = Clock::now();
    while (row_.run.steps < end && going()) row_.run.add(take(std::min(kTogether, end - row_.run.steps)));
    if (steps > 0) row_.seconds.push_back(seconds(Clock::now() - begin) / static_cast<double>(steps));
    if (!row_.failed()) look();
  }

  StepsReport take(std::int64_t steps) {
    const StepsReport report = simulation_.run(steps);
    if (!report.ok()) row_.failure = fmt::format("step {}: {}", grouped(simulation_.steps() + 1), simulation_.describe(report.last));
    return report;
  }

  void look() {
    const Energy energy = simulation_.energy();
    row_.last_energy = energy.total();
    row_.kinetic = std::max(row_.kinetic, energy.kinetic);
  }

  Simulation simulation_;
  std::function<bool()> go_on_;
  ScalingRow row_;
  bool interrupted_ = false;
};

ScalingFigures measure(const ScalingArguments& arguments, const std::vector<std::string>& models, const Interrupt& interrupt) {
  ScalingFigures figures;
  figures.rows_planned = models.size() * arguments.solvers.size();
  Progress progress(static_cast<std::int64_t>(figures.rows_planned), 1, "rows");
  const auto go_on = [&] {
    progress.update(static_cast<std::int64_t>(figures.rows.size()), Clock::now());
    return interrupt.signal() == 0;
  };
  for (const std::string& name : models) {
    const auto model = std::make_shared<const Model>(generate(name));
    for (const Solver solver : arguments.solvers) {
      if (!go_on()) break;
      std::optional<ScalingRow> row = ScalingMeasurement(arguments, model, solver, go_on).row(arguments.steps);
      if (!row) break;
      row->model = name;
      figures.rows.push_back(std::move(*row));
    }
    if (!go_on()) break;
  }
  if (figures.rows.size() < figures.rows_planned) figures.signal = interrupt.signal();
  return figures;
}

/// Complaints go to stderr; true where there were none.
bool write_files(const ScalingArguments& arguments, const ScalingFigures& figures) {
  const bool plotted =
      arguments.plot.empty() || attempt([&] { plot::draw(arguments.plot, scaling_chart(arguments, figures)); });
  const bool listed = arguments.json.empty() || attempt([&] { write_json(arguments.json, scaling_json(arguments, figures)); });
  return plotted && listed;
}

}  // namespace

const ScalingShape& scaling_shape_from(const std::string& name) {
  std::vector<std::string> known;
  for (const ScalingShape& shape : kShapes) {
    if (name == shape.name) return shape;
    known.emplace_back(shape.name);
  }
  const std::string guess = nearest(name, known);
  throw InputError(fmt::format("--shape \"{}\" is not known; {}", name,
                               guess.empty() ? fmt::format("choose one of: {}", fmt::join(known, ", "))
                                             : fmt::format("did you mean {}?", guess)));
}

ScalingSizes scaling_sizes_from(const std::string& text) {
  constexpr std::string_view expected = "the least and the most degrees of freedom, such as 10..10000";
  const std::size_t dots = text.find("..");
  if (dots == text.npos) throw InputError(fmt::format("--dofs \"{}\": expected {}", text, expected));
  std::array<std::int64_t, 2> ends{};
  for (std::size_t k = 0; k < 2; ++k) {
    try {
      ends[k] = integer_from("--dofs", k == 0 ? text.substr(0, dots) : text.substr(dots + 2), expected);
    } catch (const InputError&) {
      throw InputError(fmt::format("--dofs \"{}\": expected {}", text, expected));
    }
  }
  if (ends[0] < 1 || ends[1] < ends[0] || ends[1] > kMostFreedom) {
    throw InputError(fmt::format("--dofs {}: expected the smaller number first, both from 1 to {}", text, grouped(kMostFreedom)));
  }
  return {static_cast<Index>(ends[0]), static_cast<Index>(ends[1])};
}

std::vector<Solver> scaling_solvers_from(const std::string& text) {
  std::vector<Solver> solvers;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const Solver solver = solver_from(text.substr(begin, end - begin));
    if (std::ranges::count(solvers, solver) > 0) throw InputError(fmt::format("--solver {} names {} twice", text, name(solver)));
    solvers.push_back(solver);
    begin = end + 1;
  }
  return solvers;
}

int scaling_command(const ScalingArguments& arguments) {
  check_arguments(arguments);
  const std::vector<std::string> models = models_of(arguments.shape, arguments.sizes);
  check_memory(models.back());
  const Interrupt interrupt;
  const ScalingFigures figures = measure(arguments, models, interrupt);
  const bool written = write_files(arguments, figures);
  say_text(scaling_summary(arguments, figures));
  if (figures.signal != 0) {
    tell("interrupted after {} of {} rows", figures.rows.size(), figures.rows_planned);
    return 128 + figures.signal;
  }
  const auto lost = [&](Solver solver) {
    return std::ranges::all_of(figures.rows, [&](const ScalingRow& row) { return row.solver != solver || row.failed(); });
  };
  const auto failed = std::ranges::find_if(arguments.solvers, lost);
  if (failed == arguments.solvers.end()) return written ? 0 : 1;
  tell("{} failed at every size", name(*failed));
  return 1;
}

}  // namespace linden

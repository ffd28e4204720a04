// bench/accuracy.cpp
// What accuracy costs: the tables and figures of the documentation.
//
//   build/release/bench/bench_accuracy FOLDER [SECONDS]
//
// writes FOLDER/results/accuracy*-MACHINE.csv and FOLDER/figures/accuracy-*.svg, in some ten minutes at 20 s of budget a scene.
//
//   closed forms  error over h of every order and of RK4: pendulum, free body, Lagrange's top (tests/reference/closed_forms.hpp)
//   scenes        what `linden accuracy` measures, over 10 s: pendulum, heavy top, free body, ten-link chain, tumbling humanoid
//   long          energy and momentum over 1, 10 and 1,000 s, over CPU time per simulated second: ten-link chain, tumbling
//                 humanoid
//   tolerance     what a looser solver does to energy and momentum over 50 s, and what it saves
//
// All times of a table are from one run of this program on one thread, so that they can be compared with each other.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <fstream>
#include <iostream>
#include <stdexcept>

#include "engine/program/accuracy_report.hpp"
#include "engine/step/baseline.hpp"
#include "layout/urdf.hpp"
#include "models/generators.hpp"
#include "tests/reference/closed_forms.hpp"

namespace {

using namespace linden;
using Kind = AccuracyMethod::Kind;

constexpr const char* kMachine = "epyc-zen5-gcc12";
constexpr AccuracyMethod kOrders[] = {{Kind::composed, 2}, {Kind::composed, 4}, {Kind::composed, 6}, {Kind::composed, 8}};
constexpr AccuracyMethod kRk4{Kind::rk4, 4}, kEuler{Kind::semi_implicit_euler, 1};

struct Study {
  std::string file;  // part of file names
  Scene scene;
};

Study pendulum() {
  Study study{"pendulum", {}};
  study.scene.model = Pendulum::model();
  study.scene.options.step = 4e-3;
  study.scene.initial = {{2.8}, {0}};
  return study;
}

Study free_body() {
  Study study{"free-body", {}};
  study.scene.model = FreeBody::model();
  study.scene.options.step = 4e-3;
  study.scene.options.gravity = {0, 0, 0};
  const FreeBody body;
  for (const long double component : body.orientation(0)) study.scene.initial.positions.push_back(static_cast<double>(component));
  for (const long double component : body.velocity(0)) study.scene.initial.velocities.push_back(static_cast<double>(component));
  return study;
}

Study heavy_top() {
  Study study{"heavy-top", {}};
  study.scene.model = LagrangeTop::model();
  const auto q = LagrangeTop::start();
  const auto v = LagrangeTop().start_velocity();
  study.scene.initial = {{q.begin(), q.end()}, {v.begin(), v.end()}};
  return study;
}

Study ten_links() {
  Study study{"chain-10", {}};
  study.scene.model = chain(10);
  return study;
}

Study humanoid() {
  Study study{"humanoid", {}};
  study.scene.model = load_urdf(LINDEN_MODELS_DIR "/humanoid.urdf", Base::floating);
  study.scene.options.gravity = {0, 0, 0};
  study.scene.initial = random_state(study.scene.model, 1, 5);  // tumbling, arms and legs flung about
  return study;
}

AccuracySetup setup_of(const Study& study, double duration, double budget) {
  AccuracySetup setup;
  setup.model = std::make_shared<const Model>(study.scene.model);
  setup.options = study.scene.options;
  setup.start = study.scene.initial;
  setup.duration = duration;
  setup.budget = budget;
  return setup;
}

class Files {
 public:
  explicit Files(std::string folder) : folder_(std::move(folder)) {}

  void table(const std::string& name, const std::string& text) const {
    const std::string file = fmt::format("{}/results/{}-{}.csv", folder_, name, kMachine);
    if (!(std::ofstream(file) << text)) throw std::runtime_error(file + ": cannot be written");
    std::cout << file << "\n" << std::flush;
  }
  void figure(const std::string& name, const std::vector<plot::Chart>& charts) const {
    const std::string file = fmt::format("{}/figures/accuracy-{}.svg", folder_, name);
    plot::draw(file, charts);
    std::cout << file << "\n" << std::flush;
  }

 private:
  std::string folder_;
};

// closed forms

/// Largest of some looks at error(time, positions) of whoever moves the body; NaN where a step fails.
template <class Mover, class Exact>
double largest_error(Mover& mover, double step, double duration, const Exact& exact) {
  constexpr int looks = 10;
  const auto every = std::lround(duration / looks / step);
  double most = 0;
  for (int look = 1; look <= looks; ++look) {
    for (long k = 0; k < every; ++k) {
      if constexpr (std::is_same_v<Mover, Simulation>) {
        if (!mover.step().ok()) return std::nan("");
      } else {
        if (!mover.step()) return std::nan("");
      }
    }
    most = std::max(most, exact.error(static_cast<double>(look * every) * step, mover.positions()));
  }
  return most;
}

template <class Exact>
void closed_form(const Study& study, double duration, const Exact& exact, std::string& csv) {
  const auto model = std::make_shared<const Model>(study.scene.model);
  for (const int order : {2, 4, 6, 8, 0}) {  // 0: RK4
    for (const double step : {200e-3, 100e-3, 50e-3, 25e-3, 20e-3, 10e-3, 5e-3, 2.5e-3, 2e-3, 1e-3}) {
      Options options = study.scene.options;
      options.step = step;
      double error = 0;
      if (order == 0) {
        Baseline baseline(model, Scheme::rk4, options);
        baseline.set(study.scene.initial.positions, study.scene.initial.velocities);
        error = largest_error(baseline, step, duration, exact);
      } else {
        options.order = order;
        options.tolerance = 1e-14;
        Simulation simulation(model, options);
        simulation.set_positions(study.scene.initial.positions);
        simulation.set_velocities(study.scene.initial.velocities);
        error = largest_error(simulation, step, duration, exact);
      }
      csv += fmt::format("{},{:g},{},{:g},{:.2e}\n", study.file, duration, order == 0 ? "RK4" : fmt::format("order {}", order),
                         step, error);
    }
  }
}

void closed_forms(const Files& files) {
  std::string csv = "motion,duration_s,method,step_s,error\n";
  closed_form(pendulum(), 10, Pendulum(2.8), csv);
  closed_form(free_body(), 10, FreeBody(), csv);
  closed_form(heavy_top(), 2, LagrangeTop(), csv);
  files.table("accuracy-closed-forms", csv);
}

// scenes

std::string row_text(const AccuracyRow& row) {
  return fmt::format("{},{:g},{:g},{:.2e},{:.2e},{:.2e},{:.2e},{:.4g},{},{},{}", name(row.method), row.step, row.tolerance,
                     row.error, row.band, row.slope, row.momentum, row.seconds, row.evaluations, row.split_steps,
                     row.left_out          ? "left out"
                     : row.failure.empty() ? ""
                                           : "failed");
}

void scenes(const Files& files, double budget) {
  std::string csv =
      "scene,duration_s,judged_at_s,reference_gap,method,step_s,tolerance,error,energy_band,energy_slope_per_s,momentum_drift,"
      "cpu_s,evaluations,split_steps,note\n";
  std::string fits = "scene,method,nominal_order,order,steps,step_from_s,step_to_s\n", advice;
  for (const Study& study : {pendulum(), heavy_top(), free_body(), ten_links(), humanoid()}) {
    const AccuracySetup setup = setup_of(study, 10, budget);
    const AccuracyFigures figures = measure_accuracy(setup, [](double) { return true; });
    for (const AccuracyRow& row : figures.rows) {
      csv += fmt::format("{},{:g},{:g},{:.1e},{}\n", study.file, figures.duration, figures.reference.horizon,
                         figures.reference.gap, row_text(row));
    }
    for (const AccuracyFit& fit : accuracy_fits(figures)) {
      fits += fmt::format("{},{},{},{:.2f},{},{:g},{:g}\n", study.file, name(fit.method), fit.method.order, fit.order, fit.rows,
                          fit.from, fit.to);
    }
    advice += study.file + "\n";
    for (const std::string& line : accuracy_advice(figures)) advice += "  " + line + "\n";
    AccuracyArguments arguments;
    arguments.model = study.file;
    arguments.scene = std::make_shared<const Scene>(study.scene);
    files.figure(study.file, accuracy_charts(arguments, setup, figures));
  }
  files.table("accuracy", csv);
  files.table("accuracy-orders", fits);
  std::cout << advice << std::flush;
}

// long runs

/// The largest kinetic energy of the motion, by order 8.
double kinetic_scale(const Study& study) {
  const AccuracySetup setup = setup_of(study, 10, 1e4);
  Options options = setup.options;
  options.order = 8;
  options.step = 2e-3;
  Simulation simulation(setup.model, options);
  if (!setup.start.positions.empty()) simulation.set_positions(setup.start.positions);
  if (!setup.start.velocities.empty()) simulation.set_velocities(setup.start.velocities);
  double largest = 0;
  while (simulation.time() < 10 && simulation.step().ok()) largest = std::max(largest, simulation.energy().kinetic);
  return largest;
}

struct Ladder {
  AccuracyMethod method;
  std::vector<double> steps;
};

plot::Chart long_chart(const std::vector<AccuracyRow>& rows, double duration, double AccuracyRow::*value,
                       const std::string& label) {
  plot::Chart chart;
  chart.title = fmt::format("over {:g} s", duration);
  chart.x = {"CPU time per simulated second [ms]", true};
  chart.y = {label, true};
  for (const AccuracyRow& row : rows) {
    if (chart.series.empty() || chart.series.back().label != name(row.method)) {
      chart.series.push_back({name(row.method), {}, {}, plot::Mark::both});
    }
    if (!row.done() || !(row.*value > 0)) continue;
    chart.series.back().x.push_back(1e3 * row.seconds / duration);
    chart.series.back().y.push_back(row.*value);
  }
  std::erase_if(chart.series, [](const plot::Series& series) { return series.x.empty(); });
  return chart;
}

void long_runs(const Files& files) {
  std::string csv =
      "scene,duration_s,method,step_s,tolerance,error,energy_band,energy_slope_per_s,momentum_drift,cpu_s,evaluations,"
      "split_steps,note\n";
  for (const Study& study : {ten_links(), humanoid()}) {
    const double scale = kinetic_scale(study);
    const bool floats = study.file == "humanoid";
    const Ladder ladders[] = {{kOrders[0], {8e-3, 4e-3, 2e-3, 1e-3}},
                              {kOrders[1], floats ? std::vector{8e-3, 4e-3, 2e-3} : std::vector{4e-3, 2e-3, 1e-3}},
                              {kOrders[2], floats ? std::vector{8e-3, 4e-3, 2e-3} : std::vector{4e-3, 2e-3, 1e-3}},
                              {kOrders[3], floats ? std::vector{8e-3, 4e-3} : std::vector{4e-3, 2e-3}},
                              {kRk4, {8e-3, 4e-3, 2e-3, 1e-3, 0.5e-3}},
                              {kEuler, {2e-3, 1e-3}}};
    std::vector<plot::Chart> energies, momenta;
    for (const double duration : {1.0, 10.0, 1000.0}) {
      std::vector<AccuracyRow> rows;
      for (const Ladder& ladder : ladders) {
        for (const double step : ladder.steps) {
          rows.push_back(measure_energy(setup_of(study, duration, 1e4), ladder.method, step, 0, scale));
          csv += fmt::format("{},{:g},{}\n", study.file, duration, row_text(rows.back()));
        }
      }
      energies.push_back(long_chart(rows, duration, &AccuracyRow::band, "energy band, share of the largest kinetic energy"));
      if (floats)
        momenta.push_back(
            long_chart(rows, duration, &AccuracyRow::momentum, "drift of momentum, share of the most the energy allows"));
    }
    energies[0].title =
        fmt::format("Energy of {} over 1 s, 10 s and 1,000 s", floats ? "the tumbling humanoid" : "the ten-link chain");
    energies[0].subtitle = "step sizes fall from left to right along each curve; over 1 s";
    files.figure(study.file + "-long", energies);
    if (!floats) continue;
    momenta[0].title = "Momentum of the tumbling humanoid over 1 s, 10 s and 1,000 s";
    momenta[0].subtitle = energies[0].subtitle;
    files.figure(study.file + "-momentum", momenta);
  }
  files.table("accuracy-long", csv);
}

// tolerance

void tolerances(const Files& files) {
  std::string csv =
      "scene,order,step_s,tolerance,energy_band,energy_slope_per_s,energy_slope_error_per_s,momentum_drift,evaluations_per_step,"
      "cpu_s,note\n";
  constexpr double duration = 50;
  std::vector<plot::Chart> charts;
  for (const Study& study : {ten_links(), humanoid()}) {
    const double scale = kinetic_scale(study);
    plot::Chart chart;
    chart.title = fmt::format("What the solver's tolerance costs: {}", study.file);
    chart.subtitle = fmt::format("{:g} s at 1 ms", duration);
    chart.x = {"tolerance", true};
    chart.y = {"energy band, share of the largest kinetic energy", true};
    for (const int order : {2, 4, 6}) {
      plot::Series series{.label = fmt::format("order {}", order), .x = {}, .y = {}, .mark = plot::Mark::both};
      for (int digits = 1; digits <= 13; ++digits) {
        const double tolerance = std::pow(10.0, -digits);
        const AccuracyRow row = measure_energy(setup_of(study, duration, 1e4), {Kind::composed, order}, 1e-3, tolerance, scale);
        csv += fmt::format("{},{},0.001,{:.0e},{:.2e},{:.2e},{:.2e},{:.2e},{:.2f},{:.4g},{}\n", study.file, order, tolerance,
                           row.band, row.slope, row.slope_error, row.momentum,
                           static_cast<double>(row.evaluations) / static_cast<double>(std::max<std::int64_t>(1, row.steps)),
                           row.seconds, row.failure.empty() ? "" : "failed");
        if (!row.done()) continue;
        series.x.push_back(tolerance);
        series.y.push_back(row.band);
      }
      if (!series.x.empty()) chart.series.push_back(std::move(series));
    }
    charts.push_back(std::move(chart));
  }
  files.figure("tolerance", charts);
  files.table("accuracy-tolerance", csv);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2 || argc > 3) {
    std::cerr << "bench_accuracy FOLDER [SECONDS]: writes FOLDER/results/accuracy*.csv and FOLDER/figures/accuracy-*.svg\n";
    return 2;
  }
  try {
    const Files files(argv[1]);
    closed_forms(files);
    scenes(files, argc > 2 ? std::stod(argv[2]) : 20);
    long_runs(files);
    tolerances(files);
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
}

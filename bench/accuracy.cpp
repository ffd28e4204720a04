// bench/accuracy.cpp
// What accuracy costs: the tables and figures of the documentation.
//
//   build/release/bench/bench_accuracy FOLDER [SECONDS]
//
// writes FOLDER/results/accuracy*-MACHINE.csv and FOLDER/figures/accuracy-*.svg, in some fifteen minutes at 20 s of budget a scene.
//
//   closed forms  error over h of every order and of RK4: pendulum, free body, Lagrange's top (tests/reference/closed_forms.hpp)
//   scenes        what `linden accuracy` measures, over 10 s: pendulum, heavy top, free body, ten-link chain, tumbling humanoid
//   long          energy and momentum over 1, 10 and 1,000 s, over CPU time per simulated second: ten-link chain, tumbling
//                 humanoid
//   equal bands   CPU time over RK4's at the same energy band: ten-link chain over 10 s, geometric means of bands over eight starts that
//                 differ by 0.01 rad at most, since one chaotic path has bands by luck
//   tolerance     what a looser solver does to energy and momentum over 50 s, and what it saves
//
// All times of a table are from one run of this program on one thread, so that they can be compared with each other.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <iostream>
#include <random>
#include <stdexcept>

#include "engine/baseline/baseline.hpp"
#include "engine/program/accuracy_report.hpp"
#include "models/build/generators.hpp"
#include "models/urdf/urdf.hpp"
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
  for (auto first = rows.begin(); first != rows.end();) {
    const auto last = std::find_if(first, rows.end(), [&](const AccuracyRow& row) { return row.method != first->method; });
    chart.series.push_back(accuracy_curve({first, last}, value, 1e3 / duration));
    first = last;
  }
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
    energies[0].subtitle = "beside the points: step h [ms]; over 1 s";
    files.figure(study.file + "-long", energies);
    if (!floats) continue;
    momenta[0].title = "Momentum of the tumbling humanoid over 1 s, 10 s and 1,000 s";
    momenta[0].subtitle = energies[0].subtitle;
    files.figure(study.file + "-momentum", momenta);
  }
  files.table("accuracy-long", csv);
}

// equal bands

/// CPU time per simulated second at an energy band, between the runs on both sides of it along straight lines of their logarithms. NaN
/// outside.
double seconds_at(double band, std::vector<std::array<double, 2>> runs) {
  std::ranges::sort(runs);
  for (std::size_t k = 1; k < runs.size(); ++k) {
    const auto [band0, seconds0] = runs[k - 1];
    const auto [band1, seconds1] = runs[k];
    if (band < band0 || band > band1) continue;
    return seconds0 * std::pow(seconds1 / seconds0, std::log(band / band0) / std::log(band1 / band0));
  }
  return std::nan("");
}

void equal_bands(const Files& files) {
  constexpr int starts = 8;
  constexpr double duration = 10, swing = 0.01;  // [s], [rad]
  const Study links = ten_links();
  const double scale = kinetic_scale(links);
  const Ladder ladders[] = {{kOrders[0], {8, 16. / 3, 4, 8. / 3, 2, 4. / 3, 1, 2. / 3, 0.5}},
                            {kOrders[1], {8, 16. / 3, 4, 3.2, 8. / 3, 2, 4. / 3, 1, 2. / 3, 0.5}},
                            {kOrders[2], {8, 16. / 3, 4, 8. / 3, 2, 4. / 3, 1}},
                            {kOrders[3], {8, 16. / 3, 4, 8. / 3, 2, 4. / 3}},
                            {kRk4, {8, 16. / 3, 4, 8. / 3, 2, 4. / 3, 1, 2. / 3, 0.5, 1. / 3, 0.25, 1. / 6}}};  // [ms]
  std::string csv = "scene,duration_s,starts,method,step_s,energy_band,least_band,largest_band,cpu_s_per_s,failed\n";
  std::vector<std::vector<std::array<double, 2>>> runs;
  for (const Ladder& ladder : ladders) {
    runs.emplace_back();
    for (const double step : ladder.steps) {
      double sum = 0, seconds = 0, least = INFINITY, largest = 0;
      int failed = 0;
      std::mt19937 random(1);
      for (int k = 0; k < starts; ++k) {
        Study study = links;
        study.scene.initial = {study.scene.model.neutral(), std::vector<double>(10, 0.0)};
        std::uniform_real_distribution<double> off(-swing, swing);
        for (double& angle : study.scene.initial.positions) angle += k > 0 ? off(random) : 0;
        const AccuracyRow row = measure_energy(setup_of(study, duration, 1e4), ladder.method, 1e-3 * step, 0, scale);
        failed += row.done() ? 0 : 1;
        sum += std::log(row.band);
        least = std::min(least, row.band);
        largest = std::max(largest, row.band);
        seconds += row.seconds / (starts * duration);
      }
      const double band = std::exp(sum / starts);
      if (failed == 0) runs.back().push_back({band, seconds});
      csv += fmt::format("{},{:g},{},{},{:.4g},{:.2e},{:.2e},{:.2e},{:.4g},{}\n", links.file, duration, starts, name(ladder.method),
                         1e-3 * step, band, least, largest, seconds, failed);
    }
  }
  files.table("accuracy-starts", csv);

  std::string shares = "scene,duration_s,energy_band,rk4_cpu_s_per_s,order 2,order 4,order 6,order 8\n";
  for (const double band : {1e-2, 3e-3, 1e-3, 6e-4, 3e-4, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6, 3e-7, 1e-7, 3e-8}) {
    const double rk4 = seconds_at(band, runs.back());
    shares += fmt::format("{},{:g},{:g},{:.4g}", links.file, duration, band, rk4);
    for (std::size_t k = 0; k + 1 < runs.size(); ++k) shares += fmt::format(",{:.2f}", seconds_at(band, runs[k]) / rk4);
    shares += "\n";
  }
  files.table("accuracy-equal-bands", shares);
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
      std::vector<std::string> failed;
      for (int digits = 1; digits <= 13; ++digits) {
        const double tolerance = std::pow(10.0, -digits);
        const AccuracyRow row = measure_energy(setup_of(study, duration, 1e4), {Kind::composed, order}, 1e-3, tolerance, scale);
        csv += fmt::format("{},{},0.001,{:.0e},{:.2e},{:.2e},{:.2e},{:.2e},{:.2f},{:.4g},{}\n", study.file, order, tolerance,
                           row.band, row.slope, row.slope_error, row.momentum,
                           static_cast<double>(row.evaluations) / static_cast<double>(std::max<std::int64_t>(1, row.steps)),
                           row.seconds, row.failure.empty() ? "" : "failed");
        if (!row.done()) {
          failed.push_back(fmt::format("{:.0e}", tolerance));
          continue;
        }
        series.x.push_back(tolerance);
        series.y.push_back(row.band);
      }
      if (!failed.empty()) series.label += fmt::format(", failed at {}", fmt::join(failed, ", "));
      chart.series.push_back(std::move(series));
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
    equal_bands(files);
    tolerances(files);
  } catch (const std::exception& error) {
    std::cerr << error.what() << "\n";
    return 1;
  }
}

// bench/paper.cpp
// The experiments of the paper (Lee, Liu, Park, Srinivasa, WAFR 2016, section 4), with its comparators and linden's own solver.
//
//   bench_paper RESULTS FIGURES LABEL [BUDGET]       tables RESULTS/paper-*-LABEL.csv, figures FIGURES/paper-*.png
//
//   figure 2b  energy of a ten-link chain over time: RIQN, semi-implicit Euler, linden's default
//   figure 3   time of a frame over degrees of freedom, every evaluation with every root finder: 10,000 frames, or as many as
//              BUDGET seconds [120] of one core allow (bench/paper_times.cpp)
//   figure 4a  residual over corrections in one step, from q^k and from the zero configuration
//   figure 4b  corrections a frame takes, mean and deviation
//   ratios     the paper's headline figures beside those of figure 3
//
// The chain is that of the paper's published code: planar, links of 1.5 m and 1 kg, positions and velocities uniform in +-pi/2,
// h = 1 ms, |r| < 1e-9 n, first guess IG3, no gravity but in figure 2b. Times are processor time of the thread; contenders take
// turns of a hundredth of a second, so that whatever else the machine does hits them alike. Nothing is extrapolated, and who fails
// a step stops there.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <memory>
#include <numbers>
#include <numeric>
#include <stdexcept>

#include "bench/paper_contenders.hpp"
#include "bench/paper_times.hpp"
#include "engine/baseline/baseline.hpp"
#include "engine/program/plot.hpp"
#include "engine/simulation.hpp"
#include "models/build/generators.hpp"

namespace linden::paper {
namespace {

using comparators::Evaluation;
using comparators::Guess;
using comparators::Integrator;
using comparators::RootFinding;
using comparators::Settings;
using comparators::Solved;
using plot::Chart;
using plot::Mark;
using plot::Series;

void energy(const Place& place) {
  constexpr Index kLinks = 10;
  constexpr int kEnergyFrames = 30'000, kEvery = 20, kInTable = 100;
  const Vec3<double> g{0, 0, -9.81};
  const Model model = paper_chain(kLinks);
  const std::vector<double> zero(kLinks, 0.0);

  const Options options{.step = kStep, .gravity = {g.x, g.y, g.z}};
  Baseline euler(std::make_shared<const Model>(model), Scheme::semi_implicit_euler, options);
  Settings settings{.step = kStep, .gravity = g};
  settings.stop.tolerance = paper_tolerance(kLinks);
  Integrator riqn(model, settings);
  Simulation simulation(model, options);
  euler.set(zero, zero);
  riqn.set(zero, zero);

  std::vector<double> time;
  std::vector<double> of_euler, of_riqn, of_default;
  std::string csv = "time_s,semi_implicit_euler_J,riqn_J,linden_default_J\n";
  for (int frame = 0; frame <= kEnergyFrames; ++frame) {
    if (frame > 0) {
      if (!euler.step()) throw std::runtime_error(fmt::format("figure 2b: Euler is not finite in frame {}", frame));
      if (!riqn.step().converged) throw std::runtime_error(fmt::format("figure 2b: RIQN does not converge in frame {}", frame));
      if (const StepReport report = simulation.step(); !report.ok()) throw std::runtime_error(simulation.describe(report));
    }
    if (frame % kEvery != 0) continue;
    time.push_back(kStep * frame);
    of_euler.push_back(euler.energy().total());
    of_riqn.push_back(riqn.energy());
    of_default.push_back(simulation.energy().total());
    if (frame % kInTable != 0) continue;
    csv += fmt::format("{:g},{:.8g},{:.8g},{:.8g}\n", time.back(), of_euler.back(), of_riqn.back(), of_default.back());
  }
  place.table("energy", csv);

  // largest of each second, drawn at its middle
  constexpr int kSamples = 1000 / kEvery;
  const auto error = [&](const std::string& label, const std::vector<double>& energy) {
    Series series{label, {}, {}, Mark::both};
    for (std::size_t begin = 1; begin + kSamples <= energy.size(); begin += kSamples) {
      double most = 0;
      for (std::size_t k = begin; k < begin + kSamples; ++k) most = std::max(most, std::abs(energy[k] - energy.front()));
      series.x.push_back(time[begin + kSamples / 2 - 1]);
      series.y.push_back(most);
    }
    return series;
  };
  const Chart panels[] = {
      {"Energy of a ten-link chain",
       "links of 1.5 m and 1 kg let go from horizontal, 9.81 m/s\u00b2, h = 1 ms, 30,000 frames",
       {"time [s]"},
       {"total energy [J]"},
       {{"semi-implicit Euler", time, of_euler}, {"RIQN", time, of_riqn}, {"linden's default", time, of_default}}},
      {"Largest error of the energy in each second",
       "",
       {"time [s]"},
       {"|E \u2212 E(0)| [J]", true},
       {error("semi-implicit Euler", of_euler), error("RIQN", of_riqn), error("linden's default", of_default)}}};
  place.figure("energy", panels);
}

Chart convergence_of(const std::string& title, const std::string& subtitle, Index links, double positions, Guess guess,
                     std::string& csv) {
  const Model model = paper_chain(links);
  const Start start = random_start(model, positions, std::numbers::pi / 2);
  Chart chart{title, subtitle, {"corrections"}, {"|r| [N m s]", true}, {}};
  const auto trace = [&](RootFinding root_finding, Evaluation evaluation, bool drawn = true) {
    Settings settings{.evaluation = evaluation, .root_finding = root_finding, .guess = guess, .step = kStep};
    settings.stop = {.tolerance = paper_tolerance(links), .max_iterations = 60};
    Integrator integrator(model, settings);
    integrator.set(start.q, start.v);
    Series series{comparators::name(root_finding, evaluation), {}, {}, Mark::both};
    const Solved solved = integrator.step(&series.y);
    if (!solved.converged) series.label += ": fails";
    for (std::size_t k = 0; k < series.y.size(); ++k) {
      series.x.push_back(static_cast<double>(k));
      csv += fmt::format("{},{},\"{}\",{},{:.6g}\n", guess == Guess::zero ? "zero" : "current", links, series.label, k,
                         series.y[k]);
    }
    const bool newton = root_finding == RootFinding::newton_dense && evaluation == Evaluation::drnea;
    if (newton) series.label.replace(0, std::string_view("Newton").size(), "Newton, dense or O(n),");  // the iterates of both are the same
    if (drawn) chart.series.push_back(std::move(series));
  };
  for (const RootFinding root_finding : {RootFinding::riqn, RootFinding::broyden, RootFinding::newton_dense}) {
    trace(root_finding, Evaluation::drnea);
  }
  trace(RootFinding::newton_linear, Evaluation::drnea, false);
  for (const RootFinding root_finding : {RootFinding::riqn, RootFinding::broyden, RootFinding::newton_dense}) {
    trace(root_finding, Evaluation::svi, guess == Guess::zero);  // else on top of DRNEA
  }
  return chart;
}

void convergence(const Place& place) {
  std::string csv = "first_guess,dofs,contender,correction,residual_N_m_s\n";
  const Chart panels[] = {
      convergence_of("Convergence in one step, from the configuration before it",
                     "50 links, positions within \u00b1\u03c0/2, h = 1 ms", 50, std::numbers::pi / 2, Guess::ig1, csv),
      convergence_of("The same from the zero configuration", "10 links, positions within \u00b10.1 rad, h = 1 ms", 10, 0.1,
                     Guess::zero, csv)};
  place.table("convergence", csv);
  place.figure("convergence", panels);
}

void iterations(const Place& place) {
  constexpr Index kLinks = 50;
  constexpr int kShown = 1000;
  const Model model = paper_chain(kLinks);
  const Start start = random_start(model, std::numbers::pi / 2, std::numbers::pi / 2);
  std::string csv = "contender,frames,corrections_mean,corrections_deviation,corrections_least,corrections_most\n";
  Chart chart{"Corrections over frames",
              fmt::format("{} links, h = 1 ms, first guess IG3, |r| < {:g}", kLinks, paper_tolerance(kLinks)),
              {"frame"},
              {"corrections"},
              {}};
  const auto run = [&](Contender contender) {
    Series series{contender.name, {}, {}, Mark::line};
    int failed = 0;
    for (int frame = 1; frame <= kShown; ++frame) {
      const Frame found = contender.step();
      if (!found.ok) {
        failed = frame;
        break;
      }
      series.x.push_back(frame);
      series.y.push_back(found.corrections);
    }
    if (series.y.empty()) {
      csv += fmt::format("\"{}\",0,,,,\n", series.label);
      series.label += ", fails in frame 1";
      if (contender.drawn) chart.series.push_back(std::move(series));
      return;
    }
    const double count = static_cast<double>(series.y.size());
    const double mean = std::accumulate(series.y.begin(), series.y.end(), 0.0) / count;
    double squares = 0;
    for (const double y : series.y) squares += (y - mean) * (y - mean);
    const double deviation = std::sqrt(squares / count);
    csv += fmt::format("\"{}\",{},{:.3f},{:.3f},{},{}\n", series.label, series.y.size(), mean, deviation,
                       *std::ranges::min_element(series.y), *std::ranges::max_element(series.y));
    series.label += fmt::format(" {:.2f} \u00b1 {:.2f}", mean, deviation);
    if (failed > 0) series.label += fmt::format(", fails in frame {}", failed);
    if (contender.drawn) chart.series.push_back(std::move(series));
  };
  const double tolerance = paper_tolerance(kLinks);
  run(contender(model, start, RootFinding::riqn, Evaluation::drnea, tolerance));
  run(contender(model, start, RootFinding::newton_dense, Evaluation::drnea, tolerance));
  run(contender(model, start, RootFinding::broyden, Evaluation::drnea, tolerance, false));
  run(contender(model, start, RootFinding::newton_linear, Evaluation::drnea, tolerance, false));
  run(contender(model, start, RootFinding::riqn, Evaluation::svi, tolerance, false));
  run(contender(model, start, RootFinding::newton_dense, Evaluation::svi, tolerance, false));
  run(contender(model, start, RootFinding::broyden, Evaluation::svi, tolerance, false));
  run(engine(model, start));
  place.table("iterations", csv);
  place.figure("iterations", {&chart, 1});
  std::cout << "\n" << csv;
}

}  // namespace
}  // namespace linden::paper

int main(int argc, char** argv) {
  using namespace linden::paper;
  if (argc < 4 || argc > 5) {
    std::cerr << "expected: bench_paper RESULTS FIGURES LABEL [SECONDS]\n";
    return 2;
  }
  try {
    const Place place{argv[1], argv[2], argv[3]};
    const double budget = argc > 4 ? std::stod(argv[4]) : 120;
    energy(place);
    convergence(place);
    iterations(place);
    measure_times(place, budget);
  } catch (const std::exception& trouble) {
    std::cerr << trouble.what() << "\n";
    return 1;
  }
}

// bench/paper.cpp
// The experiments of the paper (Lee, Liu, Park, Srinivasa, WAFR 2016, section 4), with its comparators and linden's own solver.
//
//   bench_paper RESULTS FIGURES LABEL [BUDGET]       tables RESULTS/paper-*-LABEL.csv, figures FIGURES/paper-*.png
//
//   figure 2b  energy of a ten-link chain over time: RIQN, semi-implicit Euler, linden's default
//   figure 3   time of a frame over degrees of freedom, every evaluation with every root finder: 10,000 frames, or as many as
//              BUDGET seconds [120] of one core allow
//   figure 4a  residual over corrections in one step, from q^k and from the zero configuration
//   figure 4b  corrections a frame takes, mean and deviation
//   ratios     the paper's headline figures beside those of figure 3
//
// The chain is that of the paper's published code: planar, links of 1.5 m and 1 kg, positions and velocities uniform in +-pi/2,
// h = 1 ms, |r| < 1e-9 n, first guess IG3, no gravity but in figure 2b. Times are processor time of the thread; contenders take
// turns of a hundredth of a second, so that whatever else the machine does hits them alike. Nothing is extrapolated, and who fails
// a step stops there.
#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iostream>
#include <memory>
#include <numbers>
#include <numeric>
#include <stdexcept>

#include "bench/comparators/integrator.hpp"
#include "bench/machine.hpp"
#include "engine/baseline/baseline.hpp"
#include "engine/files/output_file.hpp"
#include "engine/program/plot.hpp"
#include "engine/simulation.hpp"
#include "models/build/generators.hpp"
#include "models/build/random.hpp"

namespace linden {
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

constexpr int kFrames = 10'000;
constexpr double kStep = 1e-3;  // [s]

struct Place {
  std::string results, figures, label;
  void table(const std::string& name, const std::string& csv) const {
    write_file(fmt::format("{}/paper-{}-{}.csv", results, name, label), csv);
  }
  void figure(const std::string& name, std::span<const Chart> panels) const {
    plot::draw(fmt::format("{}/paper-{}.png", figures, name), panels);
  }
};

std::string machine() { return fmt::format("{}, one core, g++ {}.{}", processor(), __GNUC__, __GNUC_MINOR__); }

/// Processor time of this thread [s].
double now() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

struct Start {
  std::vector<double> q, v;
};

Start random_start(const Model& model, double positions, double velocities) {
  Random random(2016);
  Start start;
  for (Index i = 0; i < model.tree.shape.velocities; ++i) {
    start.q.push_back(random.uniform(-positions, positions));
    start.v.push_back(random.uniform(-velocities, velocities));
  }
  return start;
}

struct Frame {
  bool ok;
  int corrections, evaluations;
};

/// An evaluation with a root finder, or the engine as it comes.
struct Contender {
  std::string name, evaluation, root_finding;
  bool drawn;  // in the figure; the others stand in the table only
  std::function<Frame()> step;
};

Contender contender(const Model& model, const Start& start, RootFinding root_finding, Evaluation evaluation, double tolerance,
                    bool drawn = true) {
  Settings settings{.evaluation = evaluation, .root_finding = root_finding, .step = kStep};
  settings.stop.tolerance = tolerance;
  const auto integrator = std::make_shared<Integrator>(model, settings);
  integrator->set(start.q, start.v);
  const std::string both = comparators::name(root_finding, evaluation);
  const std::size_t plus = both.find(" + ");
  return {both, both.substr(plus + 3), both.substr(0, plus), drawn, [integrator] {
            const Solved solved = integrator->step();
            return Frame{solved.converged, solved.iterations, solved.evaluations};
          }};
}

/// linden with its own first guess and its own test.
Contender engine(const Model& model, const Start& start) {
  const auto simulation = std::make_shared<Simulation>(model, Options{.step = kStep, .gravity = {0, 0, 0}});
  simulation->set_positions(start.q);
  simulation->set_velocities(start.v);
  return {"linden's default", "DRNEA", "linden's default", true, [simulation] {
            const StepReport report = simulation->step();
            return Frame{report.ok() && report.substeps == 1, report.iterations, report.evaluations};
          }};
}

double paper_tolerance(Index links) { return 1e-9 * links; }

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

struct Timed {
  Contender contender;
  double seconds = 0;
  std::int64_t corrections = 0, evaluations = 0;
  int frames = 0;
  bool failed = false;
  std::vector<std::pair<int, double>> so_far{};  // frames, seconds at every look at the clock

  bool done(double budget) const { return failed || frames == kFrames || seconds >= budget; }
  double per_frame() const { return seconds / frames; }
  /// Over as many of the first frames.
  double per_frame(int first) const {
    const auto past = std::ranges::upper_bound(so_far, first, {}, &std::pair<int, double>::first);
    const auto [count, time] = past == so_far.begin() ? so_far.front() : *(past - 1);
    return time / count;
  }

  void run_until(double until) {
    // a look at the clock costs a quarter of a microsecond
    const int between_clocks = frames > 0 && per_frame() < 2e-5 ? 50 : 5;
    while (seconds < until && frames < kFrames && !failed) {
      const double begin = now();
      for (int k = 0; k < between_clocks && frames < kFrames; ++k) {
        const Frame frame = contender.step();
        if (!frame.ok) {
          failed = true;
          break;
        }
        frames += 1;
        corrections += frame.corrections;
        evaluations += frame.evaluations;
      }
      seconds += now() - begin;
      if (frames > 0) so_far.emplace_back(frames, seconds);
    }
  }
};

struct Row {
  Index links;
  std::vector<Timed> timed;

  const Timed* find(const std::string& name) const {
    const auto it = std::ranges::find_if(timed, [&](const Timed& t) { return t.contender.name == name; });
    return it == timed.end() || it->frames == 0 || it->failed ? nullptr : &*it;
  }
};

Row time_all(Index links, double budget) {
  const Model model = paper_chain(links);
  const Start start = random_start(model, std::numbers::pi / 2, std::numbers::pi / 2);
  const double tolerance = paper_tolerance(links);
  Row row{links, {}};
  const auto add = [&](RootFinding root_finding, Evaluation evaluation, bool drawn) {
    row.timed.push_back({contender(model, start, root_finding, evaluation, tolerance, drawn)});
  };
  for (const Evaluation evaluation : {Evaluation::svi, Evaluation::drnea}) {
    for (const RootFinding root_finding : {RootFinding::newton_dense, RootFinding::broyden, RootFinding::riqn}) {
      add(root_finding, evaluation, true);
    }
  }
  add(RootFinding::newton_linear, Evaluation::drnea, true);
  row.timed.push_back({engine(model, start)});
  add(RootFinding::broyden_kept, Evaluation::drnea, false);
  add(RootFinding::broyden_kept, Evaluation::svi, false);
  for (const RootFinding root_finding : {RootFinding::newton_dense, RootFinding::riqn}) {
    add(root_finding, Evaluation::svi_log, false);
  }
  constexpr double kTurn = 0.01;  // [s]
  const auto done = [&](const Timed& timed) { return timed.done(budget); };
  for (double until = kTurn; !std::ranges::all_of(row.timed, done); until += kTurn) {
    for (Timed& timed : row.timed) {
      if (!timed.done(budget)) timed.run_until(until);
    }
  }
  return row;
}

std::vector<Row> times(const Place& place, double budget) {
  std::vector<Row> rows;
  std::string csv = "dofs,evaluation,root_finding,frames,seconds,microseconds_per_frame,corrections_per_frame,"
                    "evaluations_per_frame,failed_in_frame\n";
  bool all_frames = true;
  for (const Index links : {2, 5, 10, 20, 40, 70, 100}) {
    rows.push_back(time_all(links, budget));
    for (const Timed& t : rows.back().timed) {
      const double frames = t.frames;
      csv += fmt::format("{},{},\"{}\",{},{:.4f},{:.3f},{:.3f},{:.2f},{}\n", links, t.contender.evaluation,
                         t.contender.root_finding, t.frames, t.seconds, 1e6 * t.per_frame(),
                         static_cast<double>(t.corrections) / frames, static_cast<double>(t.evaluations) / frames,
                         t.failed ? std::to_string(t.frames + 1) : "");
      if (t.contender.drawn) all_frames = all_frames && t.frames == kFrames;
    }
    std::cerr << fmt::format("{} degrees of freedom timed\n", links);
  }
  place.table("times", csv);
  std::cout << csv;

  Chart chart{"Time of a frame over degrees of freedom",
              (all_frames ? "10,000 frames each; " : fmt::format("10,000 frames or {:g} s each; ", budget)) + machine(),
              {"degrees of freedom", true},
              {"time per frame [\u00b5s]", true},
              {}};
  for (std::size_t k = 0; k < rows.front().timed.size(); ++k) {
    const Contender& contender = rows.front().timed[k].contender;
    if (!contender.drawn) continue;
    Series series{contender.name, {}, {}, Mark::both};
    std::vector<Index> failed;
    for (const Row& row : rows) {
      const Timed& t = row.timed[k];
      if (t.failed || t.frames == 0) {
        failed.push_back(row.links);
        continue;
      }
      series.x.push_back(row.links);
      series.y.push_back(1e6 * t.per_frame());
    }
    if (!failed.empty()) series.label += fmt::format(", fails at {}", fmt::join(failed, ", "));
    chart.series.push_back(std::move(series));
  }
  place.figure("times", {&chart, 1});
  return rows;
}

void ratios(const Place& place, const std::vector<Row>& rows) {
  // chaotic motion grows harder to solve for with time: both are taken over the frames that both have run
  std::string csv = "what,dofs,paper,measured,frames\n";
  struct Claim {
    const char *what, *slower, *faster;
    double at_10, at_100;  // 0: the paper gives none
  };
  const Claim claims[] = {
      {"DRNEA over SVI, with RIQN", "RIQN + SVI", "RIQN + DRNEA", 15, 32},
      {"DRNEA over SVI, with Newton", "Newton + SVI", "Newton + DRNEA", 15, 32},
      {"DRNEA over SVI, with Broyden", "Broyden + SVI", "Broyden + DRNEA", 15, 32},
      {"DRNEA over sums of the same equation, with RIQN", "RIQN + SVI-log", "RIQN + DRNEA", 0, 0},
      {"RIQN over Newton, with DRNEA", "Newton + DRNEA", "RIQN + DRNEA", 3.8, 53},
      {"RIQN over Newton, with SVI", "Newton + SVI", "RIQN + SVI", 0, 0},
      {"RIQN over Broyden, with DRNEA", "Broyden + DRNEA", "RIQN + DRNEA", 0, 0},
      {"RIQN over Broyden with a kept Jacobian, with DRNEA", "Broyden, kept + DRNEA", "RIQN + DRNEA", 0, 0},
      {"Newton in O(n) over dense Newton, with DRNEA", "Newton + DRNEA", "Newton O(n) + DRNEA", 0, 0},
      {"Newton in O(n) over RIQN, with DRNEA", "RIQN + DRNEA", "Newton O(n) + DRNEA", 0, 0},
      {"linden's default over RIQN, with DRNEA", "RIQN + DRNEA", "linden's default", 0, 0},
  };
  for (const Claim& claim : claims) {
    for (const Row& row : rows) {
      if (row.links != 10 && row.links != 100) continue;
      const double paper = row.links == 10 ? claim.at_10 : claim.at_100;
      const Timed *slower = row.find(claim.slower), *faster = row.find(claim.faster);
      const int frames = slower && faster ? std::min(slower->frames, faster->frames) : 0;
      const auto ratio = [&] { return slower->per_frame(frames) / faster->per_frame(frames); };
      csv += fmt::format("\"{}\",{},{},{},{}\n", claim.what, row.links, paper > 0 ? fmt::format("{:g}", paper) : "",
                         frames > 0 ? fmt::format("{:.2f}", ratio()) : "failed", frames);
    }
  }
  place.table("ratios", csv);
  std::cout << "\n" << csv;
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
}  // namespace linden

int main(int argc, char** argv) {
  using namespace linden;
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
    ratios(place, times(place, budget));
  } catch (const std::exception& trouble) {
    std::cerr << trouble.what() << "\n";
    return 1;
  }
}

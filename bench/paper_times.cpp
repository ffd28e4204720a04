#include "bench/paper_times.hpp"

#include <time.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <numbers>

#include "bench/machine.hpp"
#include "models/build/generators.hpp"

namespace linden::paper {
namespace {

using comparators::Evaluation;
using comparators::RootFinding;
using plot::Chart;
using plot::Mark;
using plot::Series;

constexpr int kFrames = 10'000;

std::string machine() { return fmt::format("{}, one core, g++ {}.{}", processor(), __GNUC__, __GNUC_MINOR__); }

/// Processor time of this thread [s].
double now() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
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

void write_ratios(const Place& place, const std::vector<Row>& rows) {
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

}  // namespace

void measure_times(const Place& place, double budget) { write_ratios(place, times(place, budget)); }

}  // namespace linden::paper

// bench/paper_contenders.hpp
// Who takes part in the experiments of the paper (bench/paper.cpp): its evaluations with its root finders, and linden as it comes; where they
// start, and where results go.
#pragma once

#include <fmt/format.h>

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "bench/comparators/integrator.hpp"
#include "engine/files/output_file.hpp"
#include "engine/program/plot.hpp"
#include "engine/simulation.hpp"
#include "models/build/random.hpp"

namespace linden::paper {

inline constexpr double kStep = 1e-3;  // [s]

struct Place {
  std::string results, figures, label;
  void table(const std::string& name, const std::string& csv) const {
    write_file(fmt::format("{}/paper-{}-{}.csv", results, name, label), csv);
  }
  void figure(const std::string& name, std::span<const plot::Chart> panels) const {
    plot::draw(fmt::format("{}/paper-{}.png", figures, name), panels);
  }
};

struct Start {
  std::vector<double> q, v;
};

inline Start random_start(const Model& model, double positions, double velocities) {
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

inline Contender contender(const Model& model, const Start& start, comparators::RootFinding root_finding, comparators::Evaluation evaluation, double tolerance,
                    bool drawn = true) {
  comparators::Settings settings{.evaluation = evaluation, .root_finding = root_finding, .step = kStep};
  settings.stop.tolerance = tolerance;
  const auto integrator = std::make_shared<comparators::Integrator>(model, settings);
  integrator->set(start.q, start.v);
  const std::string both = comparators::name(root_finding, evaluation);
  const std::size_t plus = both.find(" + ");
  return {both, both.substr(plus + 3), both.substr(0, plus), drawn, [integrator] {
            const comparators::Solved solved = integrator->step();
            return Frame{solved.converged, solved.iterations, solved.evaluations};
          }};
}

/// linden with its own first guess and its own test.
inline Contender engine(const Model& model, const Start& start) {
  const auto simulation = std::make_shared<Simulation>(model, Options{.step = kStep, .gravity = {0, 0, 0}});
  simulation->set_positions(start.q);
  simulation->set_velocities(start.v);
  return {"linden's default", "DRNEA", "linden's default", true, [simulation] {
            const StepReport report = simulation->step();
            return Frame{report.ok() && report.substeps == 1, report.iterations, report.evaluations};
          }};
}

inline double paper_tolerance(Index links) { return 1e-9 * links; }

}  // namespace linden::paper

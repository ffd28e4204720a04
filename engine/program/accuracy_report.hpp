// engine/program/accuracy_report.hpp
// What accuracy costs on a scene: for people, for scripts, and as a picture.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "engine/program/accuracy.hpp"
#include "engine/program/accuracy_command.hpp"
#include "engine/program/plot.hpp"

namespace linden {

std::string accuracy_summary(const AccuracyArguments& arguments, const AccuracySetup& setup, const AccuracyFigures& figures);
nlohmann::ordered_json accuracy_json(const AccuracyArguments& arguments, const AccuracySetup& setup,
                                     const AccuracyFigures& figures);
/// A value over CPU time of the rows of one method, large steps first: the step [ms] beside each point. Steps that failed or were left out
/// are named in the label, behind `slope`.
plot::Series accuracy_curve(std::span<const AccuracyRow> rows, double AccuracyRow::*value, double units_per_second,
                            const std::string& slope = "");

/// Error and energy band over CPU time, a curve a method.
std::vector<plot::Chart> accuracy_charts(const AccuracyArguments& arguments, const AccuracySetup& setup,
                                         const AccuracyFigures& figures);

/// What to take for which accuracy: "for 1e-3 use order 2, h = 4 ms (0.8 s per simulated minute)".
std::vector<std::string> accuracy_advice(const AccuracyFigures& figures);

}  // namespace linden

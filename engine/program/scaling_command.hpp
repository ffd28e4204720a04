// engine/program/scaling_command.hpp
// `linden scaling`: how the time of a step grows with the size of the model.
//
//   sizes     1, 2 and 5 times the powers of ten from `least` to `most` degrees of freedom, and these two; each size is the model of the
//             shape that comes nearest, and a model that comes nearest twice is taken once
//   start     random_state(seed, spread)
//   row       a size and a solver: some steps to fill the history of the first guess, then the measured ones in five stretches;
//             time per step is the median of the stretches, which one disturbance of the machine does not move
//   fails     a row whose step fails says so and takes no part in the fit; the larger sizes are tried all the same
//   fit       time ~ DOFs^exponent for each solver, over the sizes from 100 degrees of freedom on
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "engine/options.hpp"
#include "layout/field.hpp"

namespace linden {

/// A family of models of any size.
struct ScalingShape {
  const char* name;          // on the command line
  const char* model;         // what is before the colon in the name of a generated model
  double degrees_of_freedom;  // of one unit, what the number behind the colon counts, couplings left out
};

/// Throws InputError for a name that is none of chain, ball-chain, paper-chain, binary, random, humanoids, fourbars, ladder,
/// roller-chain.
const ScalingShape& scaling_shape_from(const std::string& name);

struct ScalingSizes {
  Index least = 10, most = 100'000;  // [degrees of freedom]
};

/// "10..1000"; throws InputError for anything else.
ScalingSizes scaling_sizes_from(const std::string& text);

/// "newton,riqn"; throws InputError for anything else.
std::vector<Solver> scaling_solvers_from(const std::string& text);

struct ScalingArguments {
  ScalingShape shape = scaling_shape_from("chain");
  ScalingSizes sizes;
  std::vector<Solver> solvers{Solver::newton};
  Options options;                    // but for the solver
  std::optional<std::int64_t> steps;  // measured in a row; nothing: five, or as many as fit in 0.3 s
  std::uint64_t seed = 1;
  double spread = 0.1;
  std::string json, plot;  // files; empty = none
};

/// Returns the exit code: 0, 1 where a solver failed at every size or a file could not be written, 130 after Ctrl-C. Throws InputError for
/// bad input.
int scaling_command(const ScalingArguments& arguments);

}  // namespace linden

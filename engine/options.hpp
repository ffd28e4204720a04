// engine/options.hpp
// How a simulation steps: method, tolerance, gravity. Everything has a sensible default.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

namespace linden {

/// How the discrete Euler-Lagrange equation is solved.
enum class Solver {
  newton,  // exact Jacobian, O(n): about two iterations a step whatever the length of the tree
  riqn,    // the paper's quasi-Newton (25): h M(q^k)^-1 for the inverse Jacobian
};

/// What the solve starts from (paper, 3.3).
enum class FirstGuess {
  extrapolation,  // polynomial through the displacements of the last steps
  ig1,            // no displacement
  ig2,            // the displacement of the last step
  ig3,            // explicit acceleration, semi-implicit Euler
};

/// When the solve has converged.
enum class StopTest {
  energy,    // sqrt(1/2 r.M^-1 r) < tolerance sqrt(kinetic energy): the same meaning for a finger and for a crane
  absolute,  // |r| < tolerance [N m s, N s], the paper's
};

struct Options {
  double step = 1e-3;                           // h [s]
  int order = 2;                                // 2, 4, 6 or 8 (engine/compose/composition.hpp)
  std::array<double, 3> gravity{0, 0, -9.81};   // [m/s^2]; zero: the scene has none and nothing is computed for it
  Solver solver = Solver::newton;
  FirstGuess guess = FirstGuess::extrapolation;
  StopTest stop = StopTest::energy;
  double tolerance = 1e-10;
  double reduction = 0;    // share of the first guess's residual at which a solve has converged as well; 0: none
  int max_iterations = 0;  // corrections in one solve; 0: 50 for newton, 1,000 for riqn
  int max_splits = 8;      // a step that fails is split in two this many times over: down to h / 256

  /// How far energy may stray from where it began, over the largest kinetic energy, with effects that take or give some of H + taken - given. Then
  /// order, tolerance and every step follow from it (engine/solve/step_choice.hpp); unset: all steps are `step`.
  std::optional<double> accuracy{};
  /// With an accuracy: whether steps vary. `step` is then the first where nothing moves yet, and a hundredth of the longest. Where they do not
  /// all are `step`, and the accuracy chooses order and tolerance alone.
  bool vary = true;

  bool varies() const { return accuracy && vary; }
};

/// The least and the largest accuracy that can be asked for: rounding of energies; what is no motion any more.
inline constexpr double kLeastAccuracy = 1e-12, kMostAccuracy = 0.1;

/// Of single precision nothing better can be asked: rounding leaves about so much of the residual.
inline constexpr double kSingleTolerance = 3e-6;

/// What files and command lines that name none mean: 1e-10 for order 2, 1e-12 for order 4, 1e-13 for 6 and 8. Higher orders are worth their
/// price only where the solves are as exact as they: at 1e-10 the humanoid strays by 1e-8 in a second whatever the step, at 1e-13 by
/// 5e-12, for a tenth more evaluations at most.
double default_tolerance(int order);

/// Sets tolerance and reduction to them. Reduction is 1e-5 for order 4: where the guess is far off the step barely resolves the motion, and
/// an exact solve of it buys nothing. On the ten-link chain at 4 ms that is 13 % less time than the tolerance alone, at 1 ms 1 %, with the
/// same energy over 1,000 s. Orders 6 and 8 leave less of the first guess's residual themselves, and have none.
void use_default_tolerance(Options& options);

std::string_view name(Solver solver);
std::string_view name(FirstGuess guess);
std::string_view name(StopTest stop);

/// Throw InputError naming the choices where `text` is none of them.
Solver solver_from(const std::string& text);
FirstGuess guess_from(const std::string& text);
StopTest stop_from(const std::string& text);

/// Throws InputError for an accuracy that makes no sense.
void check_accuracy(const Options& options);

/// Throws InputError where a value makes no sense: a step that is not positive and finite, a tolerance below zero, ...
void check(const Options& options);

}  // namespace linden

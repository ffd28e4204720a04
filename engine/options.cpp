#include "engine/options.hpp"

#include <fmt/format.h>

#include <cmath>
#include <span>

#include "engine/compose/composition.hpp"
#include "layout/support/input_error.hpp"

namespace linden {
namespace {

template <class Choice>
struct Named {
  Choice choice;
  std::string_view name;
};

constexpr Named<Solver> kSolvers[] = {{Solver::newton, "newton"}, {Solver::riqn, "riqn"}};
constexpr Named<FirstGuess> kGuesses[] = {{FirstGuess::extrapolation, "extrapolation"},
                                          {FirstGuess::ig1, "ig1"},
                                          {FirstGuess::ig2, "ig2"},
                                          {FirstGuess::ig3, "ig3"}};
constexpr Named<StopTest> kStops[] = {{StopTest::energy, "energy"}, {StopTest::absolute, "absolute"}};

template <class Choice>
std::string_view name_in(std::span<const Named<Choice>> list, Choice choice) {
  for (const auto& entry : list) {
    if (entry.choice == choice) return entry.name;
  }
  return "?";
}

template <class Choice>
Choice choice_in(std::span<const Named<Choice>> list, const char* what, const std::string& text) {
  std::string known;
  for (const auto& entry : list) {
    if (entry.name == text) return entry.choice;
    known += (known.empty() ? "" : ", ") + std::string(entry.name);
  }
  throw InputError(fmt::format("{} \"{}\" is not known; choose one of: {}", what, text, known));
}

}  // namespace

double default_tolerance(int order) { return order > 4 ? 1e-13 : order > 2 ? 1e-12 : Options().tolerance; }

void use_default_tolerance(Options& options) {
  options.tolerance = default_tolerance(options.order);
  options.reduction = options.order == 4 ? 1e-5 : 0;
}

std::string_view name(Solver solver) { return name_in<Solver>(kSolvers, solver); }
std::string_view name(FirstGuess guess) { return name_in<FirstGuess>(kGuesses, guess); }
std::string_view name(StopTest stop) { return name_in<StopTest>(kStops, stop); }

Solver solver_from(const std::string& text) { return choice_in<Solver>(kSolvers, "solver", text); }
FirstGuess guess_from(const std::string& text) { return choice_in<FirstGuess>(kGuesses, "first guess", text); }
StopTest stop_from(const std::string& text) { return choice_in<StopTest>(kStops, "stop test", text); }

void check_accuracy(const Options& options) {
  if (!options.accuracy || (*options.accuracy >= kLeastAccuracy && *options.accuracy <= kMostAccuracy)) return;
  throw InputError(fmt::format("the accuracy is {:g}; expected how far energy may stray over the largest kinetic energy, {:g} to {:g}, such as 1e-6",
                               *options.accuracy, kLeastAccuracy, kMostAccuracy));
}

void check(const Options& options) {
  check_accuracy(options);
  if (!(options.step > 0) || !std::isfinite(options.step)) {
    throw InputError(fmt::format("the step is {} s; it must be positive and finite (1e-3 s suits most robots)", options.step));
  }
  composition(options.order);
  if (!(options.tolerance > 0) || !std::isfinite(options.tolerance)) {
    throw InputError(fmt::format("the solver's tolerance is {}; it must be positive (default 1e-10)", options.tolerance));
  }
  if (!(options.reduction >= 0) || !(options.reduction < 1)) {
    throw InputError(fmt::format("the solver's reduction is {}; it must be a share, zero for none", options.reduction));
  }
  for (const double g : options.gravity) {
    if (!std::isfinite(g)) throw InputError(fmt::format("gravity holds {}; it must be three finite numbers [m/s^2]", g));
  }
  if (options.max_iterations < 0 || options.max_splits < 0 || options.max_splits > 20) {
    throw InputError(fmt::format("at most {} iterations and {} splits of a step make no sense; expected 0 or more, and 20 splits at "
                                 "most",
                                 options.max_iterations, options.max_splits));
  }
}

}  // namespace linden

#include "engine/program/motion_arguments.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/initial_state.hpp"
#include "engine/scene/load_model.hpp"
#include "engine/text.hpp"
#include "layout/support/input_error.hpp"
#include "layout/support/text_file.hpp"

namespace linden {
namespace {

constexpr double kMostSteps = 1e12;

}  // namespace

std::shared_ptr<const Model> ModelArguments::loaded(const Outputs& outputs) const {
  const FilesRead files;
  std::shared_ptr<const Model> result;
  if (scene) {
    result = {scene, &scene->model};
  } else {
    result = std::make_shared<const Model>(load_model(model, base, density));
  }
  outputs.spare(scene ? scene->files : files.names());
  if (strict) refuse_warnings(*result);
  return result;
}

std::optional<Randomness> randomness(const MotionArguments& arguments) {
  if (!arguments.seed && !arguments.spread) return std::nullopt;
  return Randomness{arguments.seed.value_or(kDefaultSeed), arguments.spread.value_or(kDefaultSpread)};
}

std::uint64_t drawing_seed(const MotionArguments& arguments) {
  return arguments.seed.value_or(arguments.scene ? arguments.scene->seed : kDefaultSeed);
}

std::string start_text(const MotionArguments& arguments) {
  if (const auto random = randomness(arguments)) {
    return fmt::format("{}random positions and speeds, seed {}, spread {:g}", arguments.scene ? "as the scene says, from " : "",
                       random->seed, random->spread);
  }
  return arguments.scene ? "as the scene says" : "at rest in the zero configuration";
}

void check_spread(double spread) {
  if (!std::isfinite(spread) || spread < 0) throw InputError(fmt::format("--spread {}: expected a finite number, zero or more", spread));
}

std::int64_t step_count(const MotionArguments& arguments, double step) {
  if (arguments.spread) check_spread(*arguments.spread);
  const double duration = arguments.duration;
  // a duration that misses a whole number of steps by rounding is that whole number
  constexpr double kSlack = 1e-9;
  if (!std::isfinite(duration) || !(duration >= step * (1 - kSlack))) {
    throw InputError(fmt::format("--duration {}: expected a finite number of seconds, at least one step ({} s)", duration, step));
  }
  if (duration / step > kMostSteps) {
    throw InputError(fmt::format("--duration {} s in steps of {} s makes {:.3g} steps; at most {:.0e} can be taken", duration, step,
                                 duration / step, kMostSteps));
  }
  return std::llround(duration / step);
}

std::string model_text(const ModelArguments& arguments, const Model& model) {
  const std::string name = model.names.model.starts_with(arguments.model)
                               ? printable(model.names.model)
                               : printable(fmt::format("{} ({})", model.names.model, arguments.model));
  const std::ptrdiff_t soft = std::ranges::count_if(model.couplings, [](const Coupling& one) { return rigid_row_count({&one, 1}) == 0; });
  const std::ptrdiff_t rigid = std::ssize(model.couplings) - soft;
  std::string tied = rigid == 0 ? "" : fmt::format(" but for {}", counted(rigid, "coupling"));
  if (soft > 0) tied += fmt::format(" with {} that {} way", counted(soft, "coupling"), soft == 1 ? "gives" : "give");
  return fmt::format("{}: {}, {} of freedom{}, {:.5g} kg, {}", name, counted(model.tree.bodies(), "body"),
                     counted(model.degrees_of_freedom(), "degree"), tied, model.constants.subtree_mass(0), base_of(model));
}

std::string gravity_text(const Options& options) {
  const auto& g = options.gravity;
  if (g == std::array<double, 3>{0, 0, 0}) return "no gravity";
  return fmt::format("gravity {:g} {:g} {:g} m/s^2", g[0], g[1], g[2]);
}

IgnoredByScene::IgnoredByScene(const Model& model, const Effects& effects) {
  for (Index slot = 1; slot < model.tree.shape.slots; ++slot) {
    const Index row = model.tree.first_v(slot);
    damping += model.attributes.damping(row) > 0 ? 1 : 0;
    if (std::ranges::find(effects.motions, row, &JointMotion::row) != effects.motions.end()) continue;  // it feels none of the others
    limits += std::isfinite(model.attributes.lower(row)) || std::isfinite(model.attributes.upper(row)) ? 1 : 0;
    friction += model.attributes.friction(row) > 0 ? 1 : 0;
    velocity_limits += std::isfinite(model.attributes.max_velocity(row)) ? 1 : 0;
  }
  const bool held = std::ranges::any_of(effects.limits, [](const JointLimit& limit) { return std::isfinite(limit.velocity); });
  if (effects.limits.empty() || held) velocity_limits = 0;
  if (!effects.limits.empty()) limits = 0;
  if (!effects.damping.empty()) damping = 0;
  if (!effects.friction.empty()) friction = 0;
}

std::string IgnoredByScene::text() const {
  std::vector<std::string> parts;
  if (limits > 0) parts.push_back(fmt::format("limits of {}", counted(limits, "joint")));
  if (damping > 0) parts.push_back(fmt::format("damping of {}", damping));
  if (friction > 0) parts.push_back(fmt::format("friction of {}", friction));
  if (velocity_limits > 0) parts.push_back(fmt::format("velocity limits of {}", velocity_limits));
  return fmt::format("{}", fmt::join(parts, ", "));
}

}  // namespace linden

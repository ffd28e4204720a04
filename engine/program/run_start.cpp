#include "engine/program/run_start.hpp"

#include "engine/initial_state.hpp"

namespace linden {

DrawnNumbers randomize(RunArguments& arguments, std::shared_ptr<const Model>& model) {
  const Randomization& randomization = arguments.randomization;
  if (!randomization.any()) return {};
  const DrawnNumbers numbers = draw(randomization, *model, arguments.effects(), drawing_seed(arguments));
  if (arguments.scene) {
    const auto scene = std::make_shared<Scene>(*arguments.scene);
    apply(numbers, scene->model, scene->effects);
    arguments.scene = scene;
    model = {scene, &scene->model};
  } else {
    const auto own = std::make_shared<Model>(*model);
    Effects none;
    apply(numbers, *own, none);
    model = own;
  }
  return numbers;
}

void begin_run(const RunArguments& arguments, Simulation& simulation) {
  if (!arguments.load.empty()) return simulation.load(arguments.load);
  InitialState state;
  if (arguments.scene) {
    state = arguments.scene->initial;
  } else if (const auto random = randomness(arguments)) {
    state = random_state(simulation.model(), random->seed, random->spread);
  }
  if (!state.positions.empty()) simulation.set_positions(state.positions);
  if (!state.velocities.empty()) simulation.set_velocities(state.velocities);
}

}  // namespace linden

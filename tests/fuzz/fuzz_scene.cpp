// A scene becomes a sound model and a finite start that a simulation takes, or is refused.
// Its folder is tests/fuzz/files, where there are a robot, a mesh and tables to name.
#include <regex>

#include "engine/scene/scene_file.hpp"
#include "engine/simulation.hpp"
#include "tests/fuzz/sound_model.hpp"

namespace {

/// Generating a large model takes long, as it should, and tells nothing of the reader.
bool asks_for_much(const std::string& text) {
  static const std::regex large("(chain|tree|random):[0-9]{3}|(humanoids|ring|fourbars|ladder|roller-chain):[0-9]{2}|net:[0-9x]{4}");
  return std::regex_search(text, large);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  using namespace linden;
  const std::string text = text_of(data, size);
  if (asks_for_much(text)) return 0;
  read_or_refuse([&] {
    const Scene scene = parse_scene(text, LINDEN_FUZZ_FILES "/scene.yaml");
    require_sound(scene.model);
    for (const double q : scene.initial.positions) require(std::isfinite(q), "a position at the start");
    for (const double v : scene.initial.velocities) require(std::isfinite(v), "a velocity at the start");
    const Simulation simulation(scene);
  });
  return 0;
}

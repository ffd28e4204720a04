// The bytes of a scene are read or refused, whatever was done to them.
//
// The input is laid over those of a good scene: its first byte says how many bytes go off the end, its second and third where the others
// begin, which flip bits from there on. The checksum is made to agree, or nothing behind it would ever be reached.
#include <algorithm>

#include "engine/scene/scene_bytes.hpp"
#include "engine/simulation.hpp"
#include "layout/archive.hpp"
#include "models/urdf/urdf.hpp"
#include "tests/engine/busy_scene.hpp"
#include "tests/fuzz/input.hpp"
#include "tests/fuzz/sound_model.hpp"

namespace {

using namespace linden;

constexpr std::string_view kLine = "linden scene 5\n";

/// With effects of all kinds, and a joint that follows another; its steps end soon whatever is made of it.
std::string good_bytes() {
  Scene scene = busy_scene(load_urdf(LINDEN_FUZZ_FILES "/robot.urdf", Base::floating));
  scene.options.max_iterations = 8;
  scene.options.max_splits = 0;
  const std::string bytes = to_bytes(scene);
  return bytes.substr(kLine.size(), bytes.size() - kLine.size() - 8);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  static const std::string good = good_bytes();
  std::string bytes = good;
  if (size > 0) bytes.resize(bytes.size() - std::min<std::size_t>(data[0], bytes.size()));
  const std::size_t first = size > 2 ? (data[1] * 256u + data[2]) % good.size() : 0;
  for (std::size_t k = 3; k < size; ++k) {
    const std::size_t at = first + k - 3;
    if (at >= bytes.size()) bytes.resize(at + 1, '\0');
    bytes[at] = static_cast<char>(bytes[at] ^ data[k]);
  }
  read_or_refuse([&] {
    const Scene scene = scene_from_bytes(sealed(kLine, bytes));
    require_sound(scene.model);
    Simulation simulation(scene);
    for (int k = 0; k < 2; ++k) simulation.step();
  });
  return 0;
}

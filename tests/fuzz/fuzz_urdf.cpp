// URDF text becomes a sound model with either base, with a density or without, or is refused.
#include "models/urdf/urdf.hpp"
#include "tests/fuzz/sound_model.hpp"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  using namespace linden;
  const std::string xml(text_of(data, size));
  read_or_refuse([&] {
    for (const Base base : {Base::fixed, Base::floating}) require_sound(parse_urdf(xml, "robot.urdf", base));
  });
  read_or_refuse([&] { require_sound(parse_urdf(xml, "robot.urdf", Base::floating, Reading::lenient, 1000)); });
  return 0;
}

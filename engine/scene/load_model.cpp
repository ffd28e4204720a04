#include "engine/scene/load_model.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "engine/scene/scene_file.hpp"
#include "engine/standard_streams.hpp"
#include "engine/text.hpp"
#include "models/build/generators.hpp"

namespace linden {
namespace {

struct Roots {
  Index all = 0, free = 0;
};

Roots roots_of(const Model& model) {
  Roots roots;
  for (const Index root : model.tree.roots()) {
    roots.all += 1;
    roots.free += model.tree.kind(root) == JointKind::free ? 1 : 0;
  }
  return roots;
}

}  // namespace

void require_memory(const std::string& what, double bytes) {
  const double present = static_cast<double>(::sysconf(_SC_PHYS_PAGES)) * static_cast<double>(::sysconf(_SC_PAGE_SIZE));
  if (present <= 0 || bytes <= present) return;
  constexpr double kMost = 1e18;
  throw MemoryError(fmt::format("{} {} about {} of memory; expected no more than the {} of this machine; choose fewer or a smaller one", what,
                                what.find(' ') == what.npos ? "needs" : "need",
                                memory_text(static_cast<std::size_t>(std::min(bytes, kMost))),
                                memory_text(static_cast<std::size_t>(present))));
}

double memory_of(const std::string& name) {
  constexpr double kBytesPerBody = 2600;      // of building and simulating chain:1000000
  constexpr double kBytesPerRow = 1800;       // of couplings, likewise of ladder:30000
  constexpr double kBytesPerPairOfRows = 32;  // of those that are solved together: two matrices, of steps and of all else
  const GeneratedSize size = generated_size(name);
  return size.bodies * kBytesPerBody + size.rows * (kBytesPerRow + size.together * kBytesPerPairOfRows);
}

void check_memory(const std::string& name) { require_memory(name, memory_of(name)); }

Base base_from(const std::string& text) {
  if (text == "fixed") return Base::fixed;
  if (text == "floating") return Base::floating;
  throw InputError(fmt::format("--base \"{}\" is not known; choose one of: fixed, floating", text));
}

Model load_model(const std::string& name, std::optional<Base> base, std::optional<double> density) {
  if (is_scene(name)) {
    throw InputError(
        fmt::format("{}: scenes are for linden run, rollout, accuracy and inspect; expected a model here; give a URDF file or chain:3", name));
  }
  if (!is_generated(name)) return load_urdf(name, base.value_or(Base::fixed), Reading::lenient, density);
  if (density) throw InputError(fmt::format("--density is for URDF files; {} is generated, mass and all: leave --density out", name));
  if (base) throw InputError(fmt::format("--base is for URDF files; {} is generated, base and all: leave --base out", name));
  check_memory(name);
  return generate(name);
}

std::string base_of(const Model& model) {
  const Roots roots = roots_of(model);
  if (roots.free == 0) return "fixed base";
  if (roots.free == roots.all) return roots.all == 1 ? "floating base" : fmt::format("{} floating roots", roots.all);
  return fmt::format("{} of {} roots float", roots.free, roots.all);
}

void print_warnings(const Model& model) {
  constexpr std::size_t kShown = 5;
  for (std::size_t i = 0; i < std::min(kShown, model.warnings.size()); ++i) {
    tell("warning: {}", model.warnings[i]);
  }
  if (model.warnings.size() > kShown) {
    tell("warning: and {} more (linden inspect shows all)", model.warnings.size() - kShown);
  }
  for (const std::string& note : model.notes) tell("note: {}", note);
}

}  // namespace linden

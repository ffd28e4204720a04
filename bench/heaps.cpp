// bench/heaps.cpp
// What a step of bodies that touch each other takes: walls and blocks of boxes in brick bond on a floor, 10 to 3,000 of them.
//
//   build/release/bench/bench_heaps [most boxes]
//
// Boxes of 0.2 m and 1 kg, a hundredth of a metre apart aside, stand where they would lie without weight: contacts of a stiffness of 1e7 N/m then
// bear it within a few steps, which are printed apart since loads go up and down through all of the heap. Time is that of the processor, of one
// thread.
//
// Each heap is checked before it is timed: what the lowest boxes do to the floor, as their own sinking tells of it, is the weight of all; and a second
// run ends at the same bits.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <stdexcept>
#include <string>
#include <vector>

#include "engine/simulation.hpp"
#include "models/build/builder.hpp"
#include "models/shapes/pair_contact.hpp"

namespace {

using namespace linden;

constexpr double kSize = 0.2, kPitch = 0.21, kMass = 1, kGravity = 9.81, kStiffness = 1e7, kStep = 1e-3;
constexpr int kSettling = 60, kTimed = 20;

enum class Heap { wall, block };

struct Boxes {
  Model model;
  std::vector<double> positions;
  Effects effects;
  std::size_t lowest = 0;  // boxes that stand on the floor
};

/// As many side by side as above each other.
Boxes boxes_of(Heap heap, int count) {
  const Eigen::Vector3d size(kSize, kSize, kSize), floor(100, 100, 1);
  TreeBuilder builder("boxes");
  LinkSpec ground;
  ground.name = "floor";
  ground.joint = "floor_fixed";
  ground.type = JointType::fixed;
  ground.shapes = {box_shape(floor, Eigen::Vector3d(0, 0, -0.5))};
  builder.add(ground);
  Boxes boxes;
  const int wide = static_cast<int>(std::lround(heap == Heap::wall ? std::sqrt(count) : std::cbrt(count))), deep = heap == Heap::wall ? 1 : wide;
  for (int k = 0; k < count; ++k) {
    LinkSpec box;
    box.name = fmt::format("box_{}", k);
    box.joint = fmt::format("free_{}", k);
    box.type = JointType::free;
    box.inertia = box_inertia(kMass, size, Eigen::Vector3d::Zero());
    box.shapes = {box_shape(size, Eigen::Vector3d::Zero())};
    builder.add(box);
    const int row = k / (wide * deep), column = k % wide, rank = k / wide % deep;
    const double aside = row % 2 == 0 ? 0 : kPitch / 2;
    boxes.positions.insert(boxes.positions.end(), {kPitch * column + aside, heap == Heap::wall ? 0 : kPitch * rank + aside, kSize * (row + 0.5), 0, 0, 0, 1});
    boxes.lowest += row == 0;
  }
  boxes.model = builder.build();
  std::vector<std::string> notes;
  boxes.effects.contact = pair_contact_of(boxes.model, notes);
  boxes.effects.contact->materials[0].stiffness = kStiffness;
  boxes.effects.contact->materials[0].friction = 0.5;
  return boxes;
}

Simulation at_start(const Boxes& boxes) {
  Options options;
  options.step = kStep;
  options.gravity = {0, 0, -kGravity};
  Simulation simulation(boxes.model, options, boxes.effects);
  simulation.set_positions(boxes.positions);
  return simulation;
}

/// Milliseconds of one.
double time_of_steps(Simulation& simulation, int steps) {
  const std::clock_t start = std::clock();
  for (int k = 0; k < steps; ++k) {
    const StepReport report = simulation.step();
    if (!report.ok()) throw std::runtime_error(simulation.describe(report));
  }
  return 1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC / steps;
}

void check(const Boxes& boxes, const Simulation& simulation) {
  const auto count = static_cast<double>(boxes.positions.size() / 7);
  double borne = 0;
  for (std::size_t k = 0; k < boxes.lowest; ++k) borne += 4 * kStiffness * (kSize / 2 - simulation.positions()[7 * k + 2]);
  const double weight = count * kMass * kGravity;
  if (std::abs(borne - weight) > 0.01 * weight) throw std::runtime_error(fmt::format("{} boxes press with {:.1f} N on the floor; expected {:.1f} N", count, borne, weight));
}

void run(Heap heap, int most) {
  double last = 0;
  int last_count = 0;
  for (const int count : {10, 30, 100, 300, 1000, 3000}) {
    if (count > most) break;
    const Boxes boxes = boxes_of(heap, count);
    Simulation simulation = at_start(boxes);
    const double settling = time_of_steps(simulation, kSettling);
    if (count <= 100) {
      Simulation again = at_start(boxes);
      time_of_steps(again, kSettling);
      if (!std::ranges::equal(again.positions(), simulation.positions())) throw std::runtime_error("a second run ends elsewhere");
    }
    const double time = time_of_steps(simulation, kTimed);
    check(boxes, simulation);
    const std::string exponent = last_count > 0 ? fmt::format("{:.2f}", std::log(time / last) / std::log(static_cast<double>(count) / last_count)) : "";
    fmt::print("{:<6} {:>6} {:>14.3f} {:>14.3f} {:>16.2f} {:>9}\n", heap == Heap::wall ? "wall" : "block", count, settling, time, 1e3 * time / count, exponent);
    std::fflush(stdout);
    last = time;
    last_count = count;
  }
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const int most = argc > 1 ? std::stoi(argv[1]) : 3000;
    fmt::print("heap    boxes  settling [ms]      step [ms]  a box and step [us]  exponent\n");
    for (const Heap heap : {Heap::wall, Heap::block}) run(heap, most);
  } catch (const std::exception& error) {
    fmt::print(stderr, "bench_heaps: {}\n", error.what());
    return 1;
  }
}

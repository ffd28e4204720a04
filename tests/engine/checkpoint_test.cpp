// Checkpoints in memory: whatever was set or counted goes on to the bit.
#include <algorithm>
#include <cmath>
#include <functional>

#include "engine/batch.hpp"
#include "layout/support/input_error.hpp"
#include "tests/engine/busy_scene.hpp"
#include "tests/engine/folder.hpp"
#include "tests/engine/scenes.hpp"

namespace linden::checkpoint_test {
namespace {

struct Setting {
  const char* name;
  std::function<void(Simulation&)> set;
};

std::vector<double> numbers(std::size_t count, double value) { return std::vector<double>(count, value); }

/// Everything that can be set of a simulation from outside.
std::vector<Setting> settings() {
  return {{"nothing", [](Simulation&) {}},
          {"forces", [](Simulation& s) { s.set_forces(numbers(s.momenta().size(), 0.3)); }},
          {"servo targets", [](Simulation& s) { s.set_servo_targets(numbers(s.effects().servos.size(), -0.4)); }},
          {"gains", [](Simulation& s) { s.set_gains(numbers(s.effects().servos.size(), 1.7)); }},
          {"friction", [](Simulation& s) { s.set_friction(numbers(s.effects().friction.size(), 0.01)); }},
          {"ground friction", [](Simulation& s) { s.set_ground_friction(0.05); }},
          {"wrench", [](Simulation& s) { s.set_wrench(1, {5, 6, -7}, {0.2, 0.1, 0}); }}};
}

/// Stands on its terrain, so that the friction of the ground counts.
Scene scene_of_humanoid() {
  Scene scene = busy_scene(load_urdf(model_file("humanoid.urdf"), Base::floating));
  scene.randomization = {};
  scene.effects.ground->terrain = waves(0.9);
  return scene;
}

bool same_motion(Simulation& a, Simulation& b) {
  return std::ranges::equal(a.positions(), b.positions()) && std::ranges::equal(a.momenta(), b.momenta()) && a.velocities() == b.velocities();
}

TEST_CASE("whatever was set of a simulation goes on from a checkpoint to the bit") {
  const Scene scene = scene_of_humanoid();
  for (const Setting& setting : settings()) {
    CAPTURE(setting.name);
    Simulation straight(scene), unset(scene), continued(scene);
    for (Simulation* each : {&straight, &unset}) {
      each->set_velocities(numbers(each->momenta().size(), 0.5));
      run(*each, 10);
    }
    setting.set(straight);
    const std::string bytes = straight.checkpoint();
    for (const Setting& other : settings()) other.set(continued);  // of which nothing is left
    continued.restore(bytes);
    CHECK(continued.checkpoint() == bytes);
    run(straight, 40);
    run(continued, 40);
    run(unset, 40);
    CHECK(same_motion(straight, continued));
    CHECK(straight.checkpoint() == continued.checkpoint());
    if (setting.name != std::string("nothing")) CHECK_FALSE(same_motion(straight, unset));
  }
}

TEST_CASE("what effects gave and took goes on from a checkpoint, and the forces that are kept") {
  const Scene scene = scene_of_humanoid();
  Simulation straight(scene), continued(scene);
  straight.keep_forces();
  run(straight, 30);
  REQUIRE(straight.effect_work().magnitude() > 0);
  continued.restore(straight.checkpoint());
  CHECK(continued.effect_work().each == straight.effect_work().each);
  CHECK(continued.joint_forces() == straight.joint_forces());
  CHECK(continued.body_wrenches() == straight.body_wrenches());
  CHECK(continued.contact_points().size() == straight.contact_points().size());
  run(straight, 20);
  run(continued, 20);
  CHECK(continued.effect_work().each == straight.effect_work().each);
  CHECK(continued.joint_forces() == straight.joint_forces());

  // who keeps them and continues a run in which nobody did has none yet
  Simulation plain(scene);
  run(plain, 5);
  straight.restore(plain.checkpoint());
  CHECK(straight.joint_forces() == numbers(straight.momenta().size(), 0));
}

TEST_CASE("what was not set is as the effects of the simulation have it that continues") {
  const Scene scene = scene_of_humanoid();
  Scene changed = scene;
  for (Servo& servo : changed.effects.servos) servo.target = 0.9;
  for (JointFriction& friction : changed.effects.friction) friction.force = 0.5;
  Simulation one(scene), other(changed);
  run(one, 5);
  other.restore(one.checkpoint());
  std::vector<double> targets = other.servo_targets();
  for (std::size_t k = 0; k < targets.size(); ++k) {
    if (!changed.effects.servos[k].target_moves()) CHECK(targets[k] == 0.9);
  }

  // set, on the other hand, is set; and what is a number that the effects have is not
  targets = one.servo_targets();
  targets[0] = 0.123;
  one.set_servo_targets(targets);
  other.restore(one.checkpoint());
  CHECK(other.servo_targets()[0] == 0.123);
  CHECK(one.servo_names().size() == scene.effects.servos.size());
  CHECK(one.servo_names()[0] == scene.model.names.velocity[static_cast<std::size_t>(one.effects().servos[0].row)]);
  CHECK(one.friction_names().size() == scene.effects.friction.size());
}

TEST_CASE("a checkpoint in memory is the one of a file, and is refused by the name that is given") {
  const Folder folder;
  Simulation simulation(chain(5));
  run(simulation, 10);
  const std::string bytes = simulation.checkpoint();
  simulation.save(folder.file("state"));
  CHECK(text_of(folder / "state") == bytes);
  CHECK_THROWS_WITH(simulation.restore("hello", "pickle"), "pickle: this is no checkpoint of linden");
  CHECK_THROWS_WITH(simulation.restore("", "pickle"), "pickle: this is no checkpoint of linden");
  CHECK_THROWS_WITH(simulation.restore(bytes.substr(0, 60)), "checkpoint: the checkpoint is cut short");
  CHECK_THROWS_WITH(simulation.restore(Batch(chain(5), 3).checkpoint()),
                    "checkpoint: this checkpoint was saved by a batch; expected one of a simulation");
  CHECK_THROWS_WITH(Batch(chain(5), 3).restore(bytes), "checkpoint: this checkpoint was saved by a simulation; expected one of a batch");
}

TEST_CASE("a checkpoint that is damaged anywhere is refused and changes nothing") {
  Simulation simulation(scene_of_humanoid());
  for (const Setting& setting : settings()) setting.set(simulation);
  simulation.keep_forces();
  run(simulation, 10);
  const std::string good = simulation.checkpoint();
  run(simulation, 3);
  const std::string now = simulation.checkpoint();
  for (std::size_t at = 0; at < good.size(); at += 1 + good.size() / 499) {
    std::string flipped = good;
    flipped[at] = static_cast<char>(flipped[at] ^ 1 << at % 8);
    REQUIRE_THROWS_AS(simulation.restore(flipped), InputError);
    REQUIRE_THROWS_AS(simulation.restore(good.substr(0, at)), InputError);
  }
  CHECK(simulation.checkpoint() == now);
  simulation.restore(good);
  CHECK(simulation.checkpoint() == good);
}

}  // namespace
}  // namespace linden::checkpoint_test

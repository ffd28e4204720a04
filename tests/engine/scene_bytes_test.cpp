// Models and scenes taken to bytes and back: all of their members, the same hash and motion to the bit; damaged bytes are refused.
#include "engine/scene/scene_bytes.hpp"

#include <algorithm>
#include <cmath>

#include "engine/scene/scene_file.hpp"
#include "layout/archive.hpp"
#include "models/build/random.hpp"
#include "tests/engine/busy_scene.hpp"
#include "tests/engine/scenes.hpp"

namespace linden::scene_bytes_test {
namespace {

std::vector<Model> models() {
  std::vector<Model> models;
  for (const std::string& file : all_robots()) models.push_back(load_urdf(file, Base::floating));
  for (std::uint64_t seed = 1; seed <= 6; ++seed) models.push_back(random_tree({.bodies = 25, .seed = seed, .mass_decades = 2}));
  models.push_back(random_tree({.bodies = 3000, .seed = 9}));  // with branches
  models.push_back(chain(2000));
  return models;
}

template <class Read>
std::string message_of(const Read& read) {
  try {
    read();
  } catch (const InputError& error) {
    return error.what();
  }
  return "nothing was thrown";
}

TEST_CASE("a model taken to bytes is the same model in all of its members") {
  for (const Model& model : models()) {
    CAPTURE(model.names.model);
    const std::string bytes = to_bytes(model);
    const Model again = model_from_bytes(bytes);
    CHECK(again.hash() == model.hash());
    CHECK(to_bytes(again) == bytes);
    CHECK(again.names.model == model.names.model);
    CHECK(again.names.velocity == model.names.velocity);
    CHECK(again.names.link.size() == model.names.link.size());
    CHECK(again.tree.branches == model.tree.branches);
    CHECK(again.mimics.size() == model.mimics.size());
    CHECK(again.shapes.size() == model.shapes.size());
    CHECK(again.visuals.size() == model.visuals.size());
    CHECK(again.source == model.source);
    CHECK(again.warnings == model.warnings);
    CHECK(again.attributes.upper == model.attributes.upper);
  }
}

TEST_CASE("a scene taken to bytes moves the same to the bit, whatever acts in it") {
  std::vector<Scene> scenes{load_scene(model_file("scenes/humanoid_drop.yaml")), load_scene(model_file("scenes/crane.yaml"))};
  for (const char* robot : {"humanoid.urdf", "hand.urdf"}) scenes.push_back(busy_scene(load_urdf(model_file(robot), Base::floating)));
  scenes.push_back(busy_scene(random_tree({.bodies = 20, .seed = 4})));
  for (const Scene& scene : scenes) {
    CAPTURE(scene.model.names.model);
    const std::string bytes = to_bytes(scene);
    const Scene again = scene_from_bytes(bytes);
    CHECK(to_bytes(again) == bytes);
    CHECK(again.files == scene.files);
    CHECK(again.seed == scene.seed);
    CHECK(again.duration == scene.duration);
    CHECK(again.randomization.gains == scene.randomization.gains);
    Simulation one(scene), other(again);
    run(one, 60);
    run(other, 60);
    CHECK(std::ranges::equal(one.positions(), other.positions()));
    CHECK(std::ranges::equal(one.momenta(), other.momenta()));
    CHECK(one.effect_work().each == other.effect_work().each);
  }
}

TEST_CASE("options come back from bytes, each of its choices") {
  Scene scene{.model = chain(2), .options = {}, .initial = {{0.1, 0.2}, {1, 2}}, .effects = {}};
  scene.options = {.step = 2e-3,
                   .order = 4,
                   .gravity = {1, 2, 3},
                   .solver = Solver::riqn,
                   .guess = FirstGuess::ig3,
                   .stop = StopTest::absolute,
                   .tolerance = 1e-9,
                   .reduction = 0.5,
                   .max_iterations = 7,
                   .max_splits = 3};
  scene.gravity_named = false;
  const Scene again = scene_from_bytes(to_bytes(scene));
  CHECK(again.options.step == 2e-3);
  CHECK(again.options.order == 4);
  CHECK(again.options.gravity == scene.options.gravity);
  CHECK(again.options.solver == Solver::riqn);
  CHECK(again.options.guess == FirstGuess::ig3);
  CHECK(again.options.stop == StopTest::absolute);
  CHECK(again.options.tolerance == 1e-9);
  CHECK(again.options.reduction == 0.5);
  CHECK(again.options.max_iterations == 7);
  CHECK(again.options.max_splits == 3);
  CHECK_FALSE(again.gravity_named);
  CHECK(again.initial.positions == scene.initial.positions);
  CHECK(again.initial.velocities == scene.initial.velocities);
}

TEST_CASE("bytes that are no scene are refused, with what was found") {
  const Scene scene = busy_scene(random_tree({.bodies = 4, .seed = 2}));
  const std::string good = to_bytes(scene);
  const auto refused = [](const std::string& bytes) { return message_of([&] { scene_from_bytes(bytes, "pickle"); }); };
  CHECK_THAT(refused(""), Catch::Contains("pickle: this is no scene of linden"));
  CHECK_THAT(refused(to_bytes(scene.model)), Catch::Contains("pickle: this is no scene of linden"));
  CHECK_THAT(refused("linden scene 99\n" + good.substr(15)), Catch::Contains("another version of linden"));
  CHECK_THAT(message_of([&] { model_from_bytes(good); }), Catch::Contains("model: this is no model of linden"));
  for (std::size_t size = 15; size < good.size(); size += 1 + good.size() / 997) {
    REQUIRE_THAT(refused(good.substr(0, size)), Catch::Contains("the scene is damaged or cut short"));
  }
  REQUIRE_THAT(refused(good + '\0'), Catch::Contains("the scene is damaged or cut short"));
  for (std::size_t at = 15; at < good.size(); at += 1 + good.size() / 997) {
    std::string bytes = good;
    bytes[at] = static_cast<char>(bytes[at] ^ 1 << at % 8);
    REQUIRE_THAT(refused(bytes), Catch::Contains("the scene is damaged or cut short"));
  }
}

TEST_CASE("bytes whose checksum was made to agree are a scene that can be simulated, or refused") {
  constexpr std::string_view kLine = "linden scene 5\n";
  Model model = load_urdf(model_file("hand.urdf"), Base::fixed);
  const std::string good = to_bytes(busy_scene(model));
  const std::string body = good.substr(kLine.size(), good.size() - kLine.size() - 8);
  CHECK(sealed(kLine, body) == good);
  Random random(11);
  int taken = 0, refused = 0;
  const auto attempt = [&](const std::string& bytes) {
    try {
      Simulation simulation(scene_from_bytes(sealed(kLine, bytes)));
      taken += 1;
    } catch (const InputError&) {
      refused += 1;
    }
  };
  for (int k = 0; k < 1500; ++k) {
    std::string bytes = body;
    for (std::uint64_t flips = 1 + random.below(3); flips > 0; --flips) {
      char& byte = bytes[random.below(bytes.size())];
      byte = static_cast<char>(byte ^ 1 << random.below(8));
    }
    attempt(bytes);
  }
  CHECK(taken > 0);
  CHECK(refused > 0);
  const int before = taken;
  for (std::size_t size = 0; size < body.size(); size += 1 + body.size() / 500) attempt(body.substr(0, size));
  CHECK(taken == before);  // whatever is cut off was something
}

}  // namespace
}  // namespace linden::scene_bytes_test

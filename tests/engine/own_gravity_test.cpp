// Gravity of each instance of a batch: the same to the bit as that of the options, whatever acts, and seen by what is asked of the batch.
#include <algorithm>
#include <array>
#include <cmath>

#include "engine/batch.hpp"
#include "engine/queries/observations.hpp"
#include "models/build/builder.hpp"
#include "tests/engine/busy_scene.hpp"
#include "tests/engine/scenes.hpp"

namespace linden::own_gravity_test {
namespace {

using Gravity = std::array<double, 3>;

/// Numbers that single precision holds too.
constexpr std::array<Gravity, 5> kGravities{{{0, 0, -9.75}, {0, 0, 0}, {1.5, -2.25, -3.5}, {0, 0, -1.625}, {0.5, 0, 4}}};

template <class Batch>
void give(Batch& batch) {
  using Real = typename std::decay_t<decltype(batch.gravity())>::Real;
  for (std::int64_t i = 0; i < batch.size(); ++i) {
    const Gravity& g = kGravities[static_cast<std::size_t>(i) % kGravities.size()];
    for (std::size_t k = 0; k < 3; ++k) batch.gravity()(i, static_cast<Index>(k)) = static_cast<Real>(g[k]);
  }
}

template <class Batch>
void start(Batch& batch, double spread) {
  batch.reset_all([&](std::int64_t i, std::span<double> q, std::span<double> v) {
    const InitialState state = random_state(batch.model(), static_cast<std::uint64_t>(i) + 1, spread, {});
    std::ranges::copy(state.positions, q.begin());
    std::ranges::copy(state.velocities, v.begin());
  });
}

/// A ball that barely touches the ground, so that what its friction bears at least counts, which goes by gravity.
Scene light_touch() {
  LinkSpec ball;
  ball.name = "ball";
  ball.joint = "base";
  ball.type = JointType::free;
  ball.inertia = {1, Eigen::Vector3d::Zero(), 4e-3 * Eigen::Matrix3d::Identity()};
  Scene scene{.model = TreeBuilder("ball").add(ball).build(), .options = {}, .initial = {}, .effects = {}};
  scene.effects.ground = Ground{.height = -0.1 + 1e-7, .damping = 100};
  scene.effects.ground->contacts.spheres = {{.slot = 1, .center = {}, .radius = 0.1}};
  return scene;
}

struct Case {
  Scene scene;
  double spread = 0.05;  // of the starts
};

/// Free of effects, busy with all of them, stepped alone as it has ties, and light.
std::vector<Case> cases() {
  std::vector<Case> cases;
  cases.push_back({{.model = random_tree({.bodies = 12, .seed = 5, .floating = true}), .options = {}, .initial = {}, .effects = {}}});
  for (const char* robot : {"humanoid.urdf", "hand.urdf"}) cases.push_back({busy_scene(load_urdf(model_file(robot), Base::floating))});
  cases[1].scene.effects.ground->terrain = waves(0.95);  // it stands on it soon
  cases.push_back({light_touch(), 1e-5});
  return cases;
}

TEMPLATE_TEST_CASE("an instance with a gravity of its own is to the bit the one of a batch with that gravity", "[batch]", Batch, FloatBatch) {
  using Real = typename std::decay_t<decltype(std::declval<TestType>().gravity())>::Real;
  constexpr std::int64_t kInstances = 6;
  for (const auto& [scene, spread] : cases()) {
    for (const Instructions instructions : all_instructions()) {
      CAPTURE(scene.model.names.model, name(instructions));
      TestType own(scene.model, kInstances, scene.options, scene.effects, {.instructions = instructions});
      give(own);
      start(own, spread);
      own.step(20);
      const auto seen = own.observe();
      for (std::size_t k = 0; k < kGravities.size(); ++k) {
        CAPTURE(k);
        Options options = scene.options;
        options.gravity = kGravities[k];
        TestType all(scene.model, kInstances, options, scene.effects, {.instructions = instructions});
        start(all, spread);
        all.step(20);
        const auto expected = all.observe();
        const auto i = static_cast<std::int64_t>(k);
        CHECK(own.positions().instance(i) == all.positions().instance(i));
        CHECK(own.momenta().instance(i) == all.momenta().instance(i));
        CHECK(own.record(i) == all.record(i));
        CHECK(seen.velocities().instance(i) == expected.velocities().instance(i));
        CHECK(seen.energies().instance(i) == expected.energies().instance(i));
        CHECK((k == 1 || seen.energies()(i, 1) != Real(0)));
      }
      CHECK_FALSE(own.positions().instance(0) == own.positions().instance(5));  // they start elsewhere
    }
  }
}

TEST_CASE("what falls freely falls as the gravity of its instance has it, though the scene has none", "[batch]") {
  Batch batch(humanoids(1), 5, {.step = 1e-3, .gravity = {0, 0, 0}});
  give(batch);
  const std::vector<double> q = batch.model().neutral(), v(static_cast<std::size_t>(batch.momenta().rows()), 0.0);
  for (std::int64_t i = 0; i < batch.size(); ++i) batch.reset(i, q, v);
  batch.step(200);
  for (std::int64_t i = 0; i < batch.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      const double fallen = batch.positions()(i, static_cast<Index>(k)) - q[k];
      CHECK(fallen == Approx(0.5 * kGravities[static_cast<std::size_t>(i)][k] * 0.2 * 0.2).margin(1e-12));  // a constant force, exactly
    }
  }
  // and what stands still feels it in an accelerometer: -g
  const Observations imu(batch.model(), {}, {"imu:" + batch.model().names.body[1]});
  Batch still(humanoids(1), 5, {.step = 1e-3, .gravity = {0, 0, 0}});
  give(still);
  std::vector<double> rows(static_cast<std::size_t>(5 * imu.width()));
  still.observe(imu, rows);
  for (std::size_t i = 0; i < 5; ++i) {
    for (std::size_t k = 0; k < 3; ++k) CHECK(rows[i * 6 + 3 + k] == Approx(-kGravities[i][k]).margin(1e-12));
  }
}

TEST_CASE("gravity of instances is that of the options at first, and stays through a reset", "[batch]") {
  Batch batch(chain(3), 4, {.step = 1e-3, .gravity = {1, 2, 3}}), plain(chain(3), 4, {.step = 1e-3, .gravity = {1, 2, 3}});
  CHECK(batch.gravity().rows() == 3);
  for (Index k = 0; k < 3; ++k) CHECK(batch.gravity()(2, k) == k + 1.0);
  batch.step(50);
  plain.step(50);
  CHECK(batch.positions().instance(1) == plain.positions().instance(1));
  batch.gravity()(2, 0) = -7;
  batch.reset(2, std::vector<double>(3, 0.0), std::vector<double>(3, 0.0));
  CHECK(batch.gravity()(2, 0) == -7);
}

TEST_CASE("a mass is set with its inertia, its centre of mass stays", "[batch]") {
  Batch one(chain(3), 3), other(chain(3), 3);
  std::array<double, 10> inertia = one.inertia(1, 2);
  for (double& number : inertia) number *= 2;
  other.set_inertia(1, 2, inertia);
  one.set_mass(1, 2, inertia[0]);
  CHECK(one.inertia(1, 2) == other.inertia(1, 2));
  CHECK_THROWS_WITH(one.set_mass(1, 2, -1), Catch::Contains("instance 1, body \"" + one.model().names.body[2] + "\": a mass of -1 kg"));
  CHECK_THROWS_WITH(one.set_mass(1, 9, 1), Catch::Contains("there is no body 9"));
  CHECK_THROWS_WITH(one.set_mass(1, 2, 0), Catch::Contains("a mass of 0 kg is given; expected one above zero"));
  one.set_inertia(1, 2, {});
  CHECK_THROWS_WITH(one.set_mass(1, 2, 1), Catch::Contains("has no mass"));
}

TEST_CASE("rows of servos and of friction are called as their joints", "[batch]") {
  const Model model = chain(3);
  Effects effects;
  effects.servos = {{.row = 2, .stiffness = 1}, {.row = 0, .stiffness = 1}};
  effects.friction = {{1, 0.1}};
  const Batch batch(model, 2, {}, effects);
  CHECK(batch.servo_names() == std::vector<std::string>{model.names.velocity[2], model.names.velocity[0]});
  CHECK(batch.friction_names() == std::vector<std::string>{model.names.velocity[1]});
}

}  // namespace
}  // namespace linden::own_gravity_test

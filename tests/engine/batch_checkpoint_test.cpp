// Checkpoints of batches: all instances go on to the bit, whatever was set of them; the bytes are the same whatever the lanes are.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "engine/batch.hpp"
#include "engine/batch_instances.hpp"
#include "engine/simulation.hpp"
#include "layout/support/checksum.hpp"
#include "layout/support/input_error.hpp"
#include "tests/engine/busy_scene.hpp"
#include "tests/engine/folder.hpp"
#include "tests/engine/scenes.hpp"

namespace linden::batch_checkpoint_test {
namespace {

constexpr std::int64_t kInstances = 11;  // no multiple of any number of lanes

/// Something else in each row of each instance.
template <class Real>
void spread(const BatchView<Real>& rows, double low, double high) {
  for (std::int64_t i = 0; i < kInstances; ++i) {
    for (Index row = 0; row < rows.rows(); ++row) {
      const double share = 0.5 + 0.5 * std::sin(static_cast<double>(7 * i + 3 * row));
      rows(i, row) = static_cast<Real>(low + (high - low) * share);
    }
  }
}

/// Whatever can be set of an instance.
template <class Batch>
void set_everything(Batch& batch) {
  spread(batch.forces(), -0.2, 0.2);
  spread(batch.gravity(), -3, 3);
  spread(batch.servo_targets(), -0.3, 0.3);
  spread(batch.gains(), 0.5, 1.5);
  spread(batch.friction(), 0, 0.3);
  spread(batch.ground_friction(), 0.1, 1);
  for (std::int64_t i = 0; i < batch.size(); ++i) batch.set_mass(i, 1, batch.inertia(i, 1)[0] * (1 + 0.05 * static_cast<double>(i)));
}

template <class Batch>
void start(Batch& batch) {
  batch.reset_all([&](std::int64_t i, std::span<double> q, std::span<double> v) {
    const InitialState state = random_state(batch.model(), static_cast<std::uint64_t>(i) + 1, 0.05, {});
    std::ranges::copy(state.positions, q.begin());
    std::ranges::copy(state.velocities, v.begin());
  });
}

std::vector<Scene> scenes() {
  std::vector<Scene> scenes;
  for (const char* robot : {"humanoid.urdf", "hand.urdf"}) scenes.push_back(busy_scene(load_urdf(model_file(robot), Base::floating)));
  Scene free{.model = random_tree({.bodies = 12, .seed = 5}), .options = {.step = 1e-3}, .initial = {}, .effects = {}};
  scenes.push_back(free);
  return scenes;
}

template <class Batch>
Batch batch_of(const Scene& scene, const BatchOptions& computed = {}) {
  return Batch(scene.model, kInstances, scene.options, scene.effects, computed);
}

TEMPLATE_TEST_CASE("a batch goes on from a checkpoint to the bit, whatever was set of its instances", "[batch]", Batch, FloatBatch) {
  for (const Scene& scene : scenes()) {
    for (const Instructions instructions : all_instructions()) {
      for (const bool set : {false, true}) {
        CAPTURE(scene.model.names.model, name(instructions), set);
        TestType straight = batch_of<TestType>(scene, {.threads = 2, .instructions = instructions});
        if (set) set_everything(straight);
        start(straight);
        straight.step(15);
        const std::string bytes = straight.checkpoint();
        TestType continued = batch_of<TestType>(scene, {.threads = 1, .instructions = instructions});
        continued.restore(bytes);
        CHECK(continued.checkpoint() == bytes);
        straight.step(25);
        continued.step(25);
        CHECK(continued.checkpoint() == straight.checkpoint());
        CHECK(continued.record(3) == straight.record(3));
        CHECK(continued.inertia(2, 1) == straight.inertia(2, 1));
        // and it is the run that was never interrupted
        TestType whole = batch_of<TestType>(scene, {.instructions = instructions});
        if (set) set_everything(whole);
        start(whole);
        whole.step(40);
        CHECK(whole.checkpoint() == straight.checkpoint());
      }
    }
  }
}

TEMPLATE_TEST_CASE("a checkpoint is the same bytes for all lanes, and goes on in others but for rounding", "[batch]", Batch, FloatBatch) {
  constexpr double kRounding = std::is_same_v<TestType, Batch> ? 1e-9 : 1e-2;
  for (const Scene& scene : scenes()) {
    CAPTURE(scene.model.names.model);
    TestType here = batch_of<TestType>(scene);
    set_everything(here);
    start(here);
    here.step(10);
    const std::string bytes = here.checkpoint();
    here.step(10);
    for (const Instructions instructions : all_instructions()) {
      CAPTURE(name(instructions));
      TestType other = batch_of<TestType>(scene, {.instructions = instructions});
      other.restore(bytes);
      CHECK(other.checkpoint() == bytes);
      other.step(10);
      double apart = 0;
      for (std::int64_t i = 0; i < kInstances; ++i) {
        apart = std::max(apart, static_cast<double>((other.positions().instance(i) - here.positions().instance(i)).cwiseAbs().maxCoeff()));
      }
      CHECK(apart < kRounding);
    }
  }
}

TEMPLATE_TEST_CASE("instances cut from checkpoints and joined go on to the bit in as many batches as there are to be", "[batch]", Batch, FloatBatch) {
  for (const Scene& scene : scenes()) {
    CAPTURE(scene.model.names.model);
    TestType whole = batch_of<TestType>(scene);
    set_everything(whole);
    start(whole);
    whole.step(10);
    const std::string bytes = whole.checkpoint();
    const auto batch = [&](std::span<const InstancesOf> parts, std::int64_t size) {
      TestType some(scene.model, size, scene.options, scene.effects);
      some.restore(joined_instances(parts));
      return some;
    };
    // into batches of 4 and 7, on, and from these into one of 6 that takes of both
    TestType first = batch(std::array{InstancesOf{bytes, "all", 0, 4}}, 4), second = batch(std::array{InstancesOf{bytes, "all", 4, 11}}, 7);
    for (TestType* some : {&first, &second, &whole}) some->step(10);
    const std::string of_first = first.checkpoint(), of_second = second.checkpoint();
    const std::array both{InstancesOf{of_first, "first", 2, 4}, InstancesOf{of_second, "second", 0, 4}};
    TestType middle = batch(both, 6);
    middle.step(10);
    whole.step(10);
    const std::string all = whole.checkpoint();
    CHECK(middle.checkpoint() == joined_instances(std::array{InstancesOf{all, "all", 2, 8}}));
    CHECK(joined_instances(std::array{InstancesOf{all, "all", 0, 11}}) == all);
  }
}

TEST_CASE("what cannot be joined is refused by name", "[batch]") {
  Batch one(chain(2), 3), longer(chain(2), 3, {.step = 2e-3});
  const std::string bytes = one.checkpoint(), other = longer.checkpoint();
  const auto refused = [&](const std::vector<InstancesOf>& parts, const char* why) {
    CHECK_THROWS_WITH(joined_instances(parts), Catch::Contains(why));
  };
  refused({}, "there are none");
  refused({{bytes, "a", 1, 4}}, "a: instances 1 to 3 are asked of a checkpoint of 3");
  refused({{bytes, "a", 1, 1}}, "a: instances 1 to 0");
  refused({{bytes, "a", 0, 3}, {other, "b", 0, 3}}, "b: this checkpoint is one of other instances than a");
  refused({{std::string_view(bytes).substr(0, bytes.size() - 9), "a", 0, 3}}, "a: ");
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    std::string flipped = bytes;
    flipped[at] = static_cast<char>(flipped[at] ^ 1 << at % 8);
    REQUIRE_THROWS_AS(joined_instances(std::array{InstancesOf{flipped, "a", 0, 3}}), InputError);
  }
}

TEST_CASE("what was never asked for is as the batch has it that loads, and views stay what they are", "[batch]") {
  const Scene scene = scenes()[0];
  Batch plain = batch_of<Batch>(scene), busy = batch_of<Batch>(scene);
  start(plain);
  plain.step(5);
  const std::string bytes = plain.checkpoint();
  const BatchView<double> targets = busy.servo_targets(), gravity = busy.gravity(), forces = busy.forces();
  set_everything(busy);
  busy.restore(bytes);
  CHECK(gravity(3, 2) == scene.options.gravity[2]);
  CHECK(forces(3, 1) == 0);
  CHECK(&busy.servo_targets()(4, 0) == &targets(4, 0));
  CHECK(busy.inertia(3, 1) == plain.inertia(3, 1));
  for (Index k = 0; k < targets.rows(); ++k) {
    const Servo& servo = scene.effects.servos[static_cast<std::size_t>(k)];
    CHECK((servo.target_moves() ? std::isnan(targets(2, k)) : targets(2, k) == servo.target));
  }
  plain.step(20);
  busy.step(20);
  for (std::int64_t i = 0; i < kInstances; ++i) {
    CHECK(plain.positions().instance(i) == busy.positions().instance(i));
    CHECK(plain.momenta().instance(i) == busy.momenta().instance(i));
  }
}

TEST_CASE("an instance that is frozen stays so after a checkpoint, with its reason", "[batch]") {
  Batch batch(chain(3), 5, {.step = 1e-3, .max_splits = 0});
  start(batch);
  const std::vector<double> q(3, 0.0), v{1e5, -1e5, 1e5};
  batch.reset(2, q, v);
  batch.step(3);
  REQUIRE(batch.record(2).status != StepStatus::converged);
  Batch other(chain(3), 5, {.step = 1e-3, .max_splits = 0});
  other.restore(batch.checkpoint());
  CHECK(other.record(2) == batch.record(2));
  CHECK(other.describe(2) == batch.describe(2));
  other.step(4);
  CHECK(other.record(2) == batch.record(2));
  CHECK(other.record(1).steps == 7);
}

TEST_CASE("a checkpoint of a batch is written to a file and read from it", "[batch]") {
  const Folder folder;
  Batch one(chain(4), 6), other(chain(4), 6);
  one.step(20);
  one.save(folder.file("batch"));
  CHECK(text_of(folder / "batch") == one.checkpoint());
  other.load(folder.file("batch"));
  CHECK(other.checkpoint() == one.checkpoint());
  CHECK_THROWS_WITH(other.load(folder.file("nothing")), Catch::Contains("nothing: the checkpoint cannot be read"));
  CHECK_THROWS_WITH(other.load("/dev/zero"), Catch::Contains("/dev/zero: this is not an ordinary file"));
}

TEST_CASE("a checkpoint of another batch is refused, and nothing changes", "[batch]") {
  const Scene scene = scenes()[0];
  Batch batch = batch_of<Batch>(scene);
  start(batch);
  const std::string now = batch.checkpoint();
  const auto refused = [&](const std::string& bytes, const char* why) {
    CHECK_THROWS_WITH(batch.restore(bytes, "pickle"), Catch::Contains("pickle: ") && Catch::Contains(why));
    CHECK(batch.checkpoint() == now);
  };
  const auto with = [&](auto change) {
    Scene other = scene;
    change(other);
    return batch_of<Batch>(other).checkpoint();
  };
  refused(with([](Scene& s) { s.model = chain(3), s.effects = {}; }), "another model");
  refused(with([](Scene& s) { s.options.step = 2e-3; }), "made with a step of 0.002 s");
  refused(with([](Scene& s) { s.options.gravity = {0, 0, 1}; }), "gravity 0 0 1; the batch has 0.001 s and 0 0 -9.81");
  refused(with([](Scene& s) { s.effects.servos.pop_back(); }), "so it would not continue the same run");
  refused(Batch(scene.model, 3, scene.options, scene.effects).checkpoint(), "one of 3 instances; the batch has 11");
  refused(batch_of<FloatBatch>(scene).checkpoint(), "numbers of 4 bytes; the batch computes with 8");
  refused("linden batch 99\n" + now, "another version of linden");
  refused("hello", "this is no checkpoint of linden");
  refused(now.substr(0, 80), "cut short");
  refused(now.substr(0, now.size() - 1), "damaged: it holds");
  refused(now + "x", "damaged: it holds more bytes");
  for (std::size_t at = 20; at < now.size(); at += 1 + now.size() / 499) {
    std::string flipped = now;
    flipped[at] = static_cast<char>(flipped[at] ^ 1 << at % 8);
    REQUIRE_THROWS_AS(batch.restore(flipped), InputError);
  }
  CHECK(batch.checkpoint() == now);
}

TEST_CASE("instances that cannot be are refused though the checksum is right", "[batch]") {
  Batch batch(chain(2), 3);
  batch.step(4);
  const std::string good = batch.checkpoint();
  const std::size_t header = good.find('\n') + 1, first = header + 96, of_each = (good.size() - 8 - first) / 3;
  const std::size_t record = 4 + 1 + 4 + 4 + 4 + 4 + 8 + 8 + 8, factor = 4 * (2 * 12 + 2) + 8 * 4;
  REQUIRE(of_each == 8 * (2 + 2 + 2) + factor + record);
  const auto message_with = [&](std::size_t at, auto value) -> std::string {
    std::string bytes = good.substr(0, good.size() - 8);
    std::memcpy(bytes.data() + at, &value, sizeof(value));
    const std::uint64_t sum = checksum(bytes);
    bytes.append(reinterpret_cast<const char*>(&sum), sizeof(sum));
    try {
      batch.restore(bytes);
    } catch (const InputError& error) {
      return error.what();
    }
    return "nothing was thrown";
  };
  const std::size_t second = first + of_each, its_record = second + of_each - record;
  CHECK_THAT(message_with(second, std::nan("")), Catch::Contains("holds a number that is not finite of instance 1; expected what a batch saved"));
  CHECK_THAT(message_with(its_record, 99), Catch::Contains("the status 99 of instance 1"));
  CHECK_THAT(message_with(its_record + 4, std::int8_t{3}), Catch::Contains("the displacements of 3 steps of instance 1"));
  CHECK_THAT(message_with(its_record + 5, Index{-1}), Catch::Contains("the body -1 of instance 1"));
  CHECK_THAT(message_with(its_record + 9, Index{1}), Catch::Contains("the coupling 1 of instance 1"));
  CHECK_THAT(message_with(header + 88, std::int64_t{1} << 40), Catch::Contains("bytes about effects"));
  CHECK_THAT(message_with(header + 80, std::int64_t{0}), Catch::Contains("other rows than an instance has"));
  CHECK(batch.checkpoint() == good);
}

}  // namespace
}  // namespace linden::batch_checkpoint_test

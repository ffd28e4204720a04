// State in, state out, mimic joints, checkpoints.
#include <cmath>
#include <cstring>
#include <limits>

#include "models/build/builder.hpp"
#include "tests/engine/folder.hpp"
#include "tests/engine/scenes.hpp"

namespace linden::simulation_test {
namespace {

TEST_CASE("velocities come back as they were given") {
  for (const std::string& file : tree_robots()) {
    CAPTURE(file);
    Simulation simulation(load_urdf(file, Base::floating));
    random_start(simulation, 4, 0.5);
    std::vector<double> given = random_state(simulation.model(), 4, 0.5).velocities;
    for (const Mimic& mimic : simulation.model().mimics) {
      given[static_cast<std::size_t>(mimic.follower_v)] = mimic.multiplier * given[static_cast<std::size_t>(mimic.leader_v)];
    }
    CHECK(distance(simulation.velocities(), given) < 1e-8);
  }
}

TEST_CASE("mimic joints follow their leaders and the energy stays") {
  Simulation simulation(load_urdf(model_file("hand.urdf")), {.step = 1e-3});
  REQUIRE(simulation.model().mimics.size() >= 1);
  random_start(simulation, 1, 0.2);
  const double start = simulation.energy().total();
  double largest = 0, exchanged = 0;
  for (int k = 0; k < 2000; ++k) {
    run(simulation, 1);
    const Energy energy = simulation.energy();
    largest = std::max(largest, std::abs(energy.total() - start));
    exchanged = std::max(exchanged, energy.kinetic);
    for (const Mimic& mimic : simulation.model().mimics) {
      const auto q = simulation.positions();
      CHECK(q[static_cast<std::size_t>(mimic.follower_q)] ==
            mimic.multiplier * q[static_cast<std::size_t>(mimic.leader_q)] + mimic.offset);
    }
  }
  CHECK(largest < 1e-2 * exchanged);
}

TEST_CASE("two joints tied with ratio one swing like one pendulum of both masses") {
  TreeBuilder builder("tied");
  for (const char* side : {"left", "right"}) {
    LinkSpec link;
    link.name = side;
    link.joint = std::string(side) + "_hinge";
    link.axis = Eigen::Vector3d::UnitY();
    link.inertia = box_inertia(1, {0.1, 0.1, 1}, {0, 0, -0.5});
    if (link.name == "right") link.mimic = "left_hinge";
    builder.add(link);
  }
  Simulation tied(builder.build(), {.step = 1e-3});
  TreeBuilder single("single");
  LinkSpec link;
  link.name = "one";
  link.joint = "hinge";
  link.axis = Eigen::Vector3d::UnitY();
  link.inertia = box_inertia(1, {0.1, 0.1, 1}, {0, 0, -0.5});
  single.add(link);
  Simulation one(single.build(), {.step = 1e-3});
  tied.set_positions(std::vector<double>{1, 1});
  one.set_positions(std::vector<double>{1});
  run(tied, 1000);
  run(one, 1000);
  CHECK(tied.positions()[0] == Approx(one.positions()[0]).epsilon(1e-10));
  CHECK(tied.energy().kinetic == Approx(2 * one.energy().kinetic).epsilon(1e-9));
}

TEST_CASE("a run continued from a checkpoint is bit-identical") {
  const Folder folder;
  for (const Model& model : {random_tree({.bodies = 20, .seed = 3}), load_urdf(model_file("hand.urdf"), Base::floating)}) {
    CAPTURE(model.names.model);
    Simulation straight(model, {.step = 1e-3});
    random_start(straight, 8, 0.3);
    run(straight, 57);
    straight.save(folder.file("state"));
    run(straight, 100);

    Simulation continued(model, {.step = 1e-3});
    continued.load(folder.file("state"));
    CHECK(continued.steps() == 57);
    run(continued, 100);
    CHECK(std::ranges::equal(straight.positions(), continued.positions()));
    CHECK(std::ranges::equal(straight.momenta(), continued.momenta()));
    CHECK(straight.time() == continued.time());
  }
}

TEST_CASE("a checkpoint that does not fit is refused and changes nothing") {
  const Folder folder;
  Simulation simulation(chain(5), {.step = 1e-3});
  run(simulation, 10);
  simulation.save(folder.file("state"));
  const std::string bytes = text_of(folder / "state");
  const auto write = [&](const std::string& text) {
    folder.write("other", text);
    return folder.file("other");
  };

  Simulation longer(chain(6), {.step = 1e-3});
  CHECK_THROWS_WITH(longer.load(folder.file("state")), Catch::Contains("another model"));
  Simulation slower(chain(5), {.step = 2e-3});
  CHECK_THROWS_WITH(slower.load(folder.file("state")), Catch::Contains("0.001 s"));
  CHECK_THROWS_WITH(simulation.load(folder.file("nothing")), Catch::Contains("cannot be read"));
  CHECK_THROWS_WITH(simulation.load(write("hello")), Catch::Contains("no checkpoint"));
  CHECK_THROWS_WITH(simulation.load(write("linden checkpoint 3\n" + bytes.substr(20))), Catch::Contains("another version of linden"));
  CHECK_THROWS_WITH(simulation.load(write(bytes.substr(0, bytes.size() - 9))), Catch::Contains("damaged: it holds"));
  std::string flipped = bytes;
  flipped[bytes.size() / 2] = static_cast<char>(flipped[bytes.size() / 2] ^ 1);
  CHECK_THROWS_AS(simulation.load(write(flipped)), InputError);
  CHECK_THROWS_WITH(simulation.save(folder.file("no/such/folder")), Catch::Contains("cannot be written"));
  CHECK(simulation.steps() == 10);
  simulation.load(folder.file("state"));
}

TEST_CASE("a checkpoint that no simulation saved is refused though its checksum is right") {
  const Folder folder;
  Simulation simulation(chain(5), {.step = 1e-3, .order = 4});
  run(simulation, 10);
  simulation.save(folder.file("state"));
  const std::string good = text_of(folder / "state");
  const std::size_t header = good.find('\n') + 1, state = header + 112, past = state + 8 * (5 + 5 + 5 * 5 + 2);
  const auto message_with = [&](std::size_t at, auto value) {
    std::string bytes = good.substr(0, good.size() - 8);
    std::memcpy(bytes.data() + at, &value, sizeof(value));
    std::uint64_t sum = 14695981039346656037ull;  // FNV-1a
    for (const char byte : bytes) sum = (sum ^ static_cast<unsigned char>(byte)) * 1099511628211ull;
    bytes.append(reinterpret_cast<const char*>(&sum), sizeof(sum));
    folder.write("other", bytes);
    try {
      simulation.load(folder.file("other"));
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("nothing was thrown");
  };
  CHECK_THAT(message_with(header + 56, std::int64_t{-1}), Catch::Contains("other: the checkpoint holds -1 steps; expected "));
  CHECK_THAT(message_with(header + 56, std::numeric_limits<std::int64_t>::max()), Catch::Contains("steps; expected "));
  CHECK_THAT(message_with(header + 64, std::int64_t{6}), Catch::Contains("the displacements of 6 steps"));
  CHECK_THAT(message_with(state, std::nan("")), Catch::Contains("a number that is not finite"));
  CHECK_THAT(message_with(past, std::int64_t{1'000'000}), Catch::Contains("the displacements of 1000000 steps"));
  CHECK(message_with(header + 56, std::int64_t{7}) == "nothing was thrown");
  CHECK(simulation.steps() == 7);
}

TEST_CASE("of a file that is no checkpoint of this simulation only the first bytes are read") {
  const Folder folder;
  Simulation simulation(chain(5));
  simulation.save(folder.file("state"));
  const auto read_by_now = [] {  // bytes, by this process
    std::ifstream io("/proc/self/io");
    std::string name;
    std::int64_t count = -1;
    io >> name >> count;
    return count;
  };
  const auto costs = [&](const std::string& file, const char* message) {
    const std::int64_t before = read_by_now();
    CHECK_THROWS_WITH(simulation.load(file), Catch::Contains(message));
    return read_by_now() - before;
  };
  std::filesystem::resize_file(folder / "state", std::uintmax_t{1} << 28);
  folder.write("else", "else");
  std::filesystem::resize_file(folder / "else", std::uintmax_t{1} << 28);
  CHECK(costs(folder.file("state"), "it holds more bytes, expected ") < 1'000'000);
  CHECK(costs(folder.file("else"), "no checkpoint of linden") < 1'000'000);
  CHECK(costs("/dev/zero", "this is not an ordinary file; expected a checkpoint") < 1'000'000);
}

TEST_CASE("a simulation without a model is refused") {
  CHECK_THROWS_WITH(Simulation(std::shared_ptr<const Model>()), Catch::Contains("the pointer to the model is null"));
}

TEST_CASE("states of the wrong size or with bad numbers are refused by name") {
  Simulation simulation(chain(3));
  CHECK_THROWS_WITH(simulation.set_positions(std::vector<double>{1, 2}), Catch::Contains("2 numbers") && Catch::Contains("expected 3"));
  CHECK_THROWS_WITH(simulation.set_velocities(std::vector<double>{1, std::nan(""), 2}), Catch::Contains("joint2"));
  Simulation ball(ball_chain(1));
  CHECK_THROWS_WITH(ball.set_positions(std::vector<double>{0, 0, 0, 0}), Catch::Contains("quaternion"));
}

TEST_CASE("setting positions keeps the velocities") {
  Simulation simulation(chain(4));
  const std::vector<double> v{1, -2, 3, -4};
  simulation.set_velocities(v);
  simulation.set_positions(std::vector<double>{0.1, 0.2, 0.3, 0.4});
  CHECK(distance(simulation.velocities(), v) < 1e-12);
}

}  // namespace
}  // namespace linden::simulation_test

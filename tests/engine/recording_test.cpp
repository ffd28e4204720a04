// What effects apply, as a simulation tells it and as `run` and `rollout` record it.
#include <charconv>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "engine/scene/scene_file.hpp"
#include "tests/engine/array_reader.hpp"
#include "tests/engine/command_line.hpp"
#include "tests/engine/scenes.hpp"

namespace linden::recording_test {
namespace {

// ---- forces of a step

TEST_CASE("the impulse of a step is the change of momentum where nothing else acts", "[recording]") {
  Effects effects;
  effects.springs = {{.row = 0, .stiffness = 3, .rest = 0.2}};
  effects.damping = {{.row = 0, .coefficient = 0.05}};
  effects.friction = {{.row = 0, .force = 0.1}};
  effects.servos = {{.row = 0, .stiffness = 40, .damping = 2, .target = 0.5, .max_force = 0.5}};
  effects.torques = {{.row = 0, .force = {{0, 0.4}, {0.3, -0.2}}}};
  Simulation simulation(chain(1), {.step = 2e-3, .gravity = {0, 0, 0}}, effects);
  simulation.set_velocities(std::vector<double>{2});
  simulation.keep_forces();
  CHECK(simulation.joint_forces() == std::vector<double>{0});
  double largest = 0, at_limit = 0;
  for (int k = 0; k < 500; ++k) {
    const double before = simulation.momenta()[0];
    run(simulation, 1);
    const double force = simulation.joint_forces()[0], servo = simulation.servo_torques()[0];
    // a joint about an axis that stays has a constant inertia; what friction holds is left out of p on purpose, once it has come to rest
    if (simulation.velocities()[0] != 0) {
      CHECK(force * 2e-3 == Approx(simulation.momenta()[0] - before).margin(1e-11));
    }
    largest = std::max(largest, std::abs(force));
    CHECK(std::abs(servo) <= 0.5);
    at_limit = std::max(at_limit, std::abs(servo));
  }
  CHECK(largest > 0.5);
  CHECK(at_limit == 0.5);
}

TEST_CASE("a conservative impulse adds up over sub-steps and split steps", "[recording]") {
  Effects effects;
  effects.springs = {{.row = 0, .stiffness = 3, .rest = 0.2}};
  for (const int order : {2, 4, 6}) {
    Simulation simulation(chain(1), {.step = 0.01, .order = order, .gravity = {0, 0, 0}}, effects);
    simulation.set_velocities(std::vector<double>{2});
    simulation.keep_forces();
    for (int k = 0; k < 50; ++k) {
      const double before = simulation.momenta()[0];
      run(simulation, 1);
      CHECK(simulation.joint_forces()[0] * 0.01 == Approx(simulation.momenta()[0] - before).margin(1e-12));
    }
  }
}

TEST_CASE("the forces of a step that is split are the mean of those of its halves", "[recording]") {
  const Model model = chain(4);
  Effects effects;
  effects.springs = {{.row = 0, .stiffness = 1}, {.row = 2, .stiffness = 0.5}};
  int compared = 0;
  for (std::uint64_t seed = 1; seed < 2000 && compared < 3; ++seed) {
    Simulation whole(model, {.step = 0.08}, effects), halves(model, {.step = 0.04}, effects);
    for (Simulation* simulation : {&whole, &halves}) {
      random_start(*simulation, seed, 8);
      simulation->keep_forces();
    }
    const StepReport report = whole.step();
    if (!report.ok() || report.substeps != 2) continue;
    if (!halves.step().ok()) continue;
    const std::vector<double> first = halves.joint_forces();
    if (!halves.step().ok()) continue;
    const std::vector<double> second = halves.joint_forces(), mean = whole.joint_forces();
    if (distance(whole.positions(), halves.positions()) > 1e-8) continue;  // such long steps may have several solutions
    ++compared;
    for (std::size_t row = 0; row < 4; ++row) CHECK(mean[row] == Approx(0.5 * (first[row] + second[row])).epsilon(1e-6).margin(1e-9));
  }
  CHECK(compared == 3);
}

/// -dV/dq of gravity at the positions of a simulation, by central differences.
std::vector<double> gravity_forces(const Model& model, std::span<const double> q) {
  Simulation probe(model);
  std::vector<double> forces;
  for (std::size_t k = 0; k < q.size(); ++k) {
    double potential[2];
    for (const int side : {0, 1}) {
      std::vector<double> moved(q.begin(), q.end());
      moved[k] += side == 0 ? -1e-5 : 1e-5;
      probe.set_positions(moved);
      potential[side] = probe.energy().potential;
    }
    forces.push_back((potential[0] - potential[1]) / 2e-5);
  }
  return forces;
}

TEST_CASE("what holds a chain at rest carries its weight: springs, servos, friction, limits", "[recording]") {
  const Model model = chain(4);
  Effects effects;
  effects.servos = {{.row = 0, .stiffness = 500, .damping = 20}};
  effects.friction = {{.row = 1, .force = 50}};
  effects.springs = {{.row = 2, .stiffness = 100}};
  effects.damping = {{.row = 2, .coefficient = 5}};
  effects.limits = {{.row = 3, .lower = -0.1, .upper = 0.1}};
  Simulation simulation(model, {}, effects);
  simulation.keep_forces();
  run(simulation, 4000);
  const std::vector<double> weight = gravity_forces(model, simulation.positions()), forces = simulation.joint_forces();
  for (std::size_t row = 0; row < 4; ++row) {
    INFO("row " << row);
    CHECK(std::abs(weight[row]) > 1e-3);
    CHECK(forces[row] == Approx(-weight[row]).epsilon(1e-5));
  }
  // the sum over the effects of a joint and the law of one: the same, but for rounding
  REQUIRE(simulation.servo_torques().size() == 1);
  CHECK(simulation.servo_torques()[0] == Approx(forces[0]).epsilon(1e-13));
}

TEST_CASE("a wrench is told as what it does to the joint", "[recording]") {
  const Shell shell;
  shell.write("lever.urdf",
              "<robot name=\"lever\"><link name=\"wall\"/><link name=\"lever\"><inertial><mass value=\"1\"/>"
              "<inertia ixx=\"1\" iyy=\"1\" izz=\"1\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>"
              "<joint name=\"pivot\" type=\"continuous\"><parent link=\"wall\"/><child link=\"lever\"/><axis xyz=\"0 1 0\"/></joint></robot>\n");
  const std::string scene = "model: lever.urdf\neffects:\n  wrench: {lever: {force: [0, 0, 2], point: [0.5, 0, 0]}}\n";
  shell.write("free.yaml", scene);
  shell.write("held.yaml", scene + "  servo: {stiffness: 1e4, damping: 1e3}\n");
  // (0.5, 0, 0) x (0, 0, 2) = (0, -1, 0) about the axis y
  Simulation free(load_scene(shell.file("free.yaml"))), held(load_scene(shell.file("held.yaml")));
  free.keep_forces();
  run(free, 1);
  CHECK(free.joint_forces()[0] == Approx(-1).epsilon(1e-9));
  CHECK(free.momenta()[0] == Approx(free.joint_forces()[0] * 1e-3).epsilon(1e-9));
  held.keep_forces();
  run(held, 5000);
  CHECK(held.servo_torques()[0] == Approx(1).epsilon(1e-6));
  CHECK(held.joint_forces()[0] == Approx(0).margin(1e-6));
}

const std::string kBox =
    "<robot name=\"box\"><link name=\"box\"><inertial><mass value=\"3\"/>"
    "<inertia ixx=\"0.01\" iyy=\"0.01\" izz=\"0.01\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial>"
    "<collision><geometry><box size=\"0.2 0.2 0.2\"/></geometry></collision></link></robot>\n";
const std::string kStanding =
    "model: box.urdf\nbase: floating\nduration: 1\ninitial: {base: {position: [0, 0, 0.1]}}\n"
    "effects: {gravity: [0, 0, -9.81], ground: {stiffness: 1e4, damping: 100}}\n";

TEST_CASE("the ground carries what stands on it", "[recording]") {
  const Shell shell;
  shell.write("box.urdf", kBox);
  shell.write("standing.yaml", kStanding);
  Simulation simulation(load_scene(shell.file("standing.yaml")));
  simulation.keep_forces();
  REQUIRE(simulation.contacts().size() == 1);
  CHECK(simulation.contacts()[0].normal_force == 0);
  run(simulation, 3000);
  const BodyContact contact = simulation.contacts()[0];
  CHECK(contact.slot == 1);
  CHECK(contact.closed == 4);
  CHECK(contact.normal_force == Approx(3 * 9.81).epsilon(1e-6));
  const std::vector<double> forces = simulation.joint_forces();
  CHECK(forces[5] == Approx(3 * 9.81).epsilon(1e-6));  // base.vz
  for (const std::size_t row : {0u, 1u, 2u, 3u, 4u}) CHECK(forces[row] == Approx(0).margin(1e-6));
  // its share of the potential is that of a spring that carries the weight, four corners of 1e4 N/m
  const double depth = 3 * 9.81 / 4e4;
  CHECK(simulation.energy().ground == Approx(0.5 * 4e4 * depth * depth).epsilon(1e-3));
  CHECK(simulation.energy().gravity() == Approx(3 * 9.81 * simulation.positions()[2]).epsilon(1e-9));
}

TEST_CASE("keeping forces changes no bit of the motion, and who asks without it is told", "[recording]") {
  const Scene scene = load_scene(model_file("scenes/humanoid_drop.yaml"));
  Simulation plain(scene), watched(scene);
  watched.keep_forces();
  run(plain, 800);
  run(watched, 800);
  CHECK(std::ranges::equal(plain.positions(), watched.positions()));
  CHECK(std::ranges::equal(plain.momenta(), watched.momenta()));
  CHECK_THROWS_WITH(plain.joint_forces(), Contains("call keep_forces before"));
  CHECK_THROWS_WITH(plain.servo_torques(), Contains("call keep_forces before"));
  CHECK_THROWS_WITH(plain.contacts(), Contains("call keep_forces before"));
  Simulation without(chain(3));
  without.keep_forces();
  run(without, 2);
  CHECK(without.joint_forces() == std::vector<double>{0, 0, 0});
  CHECK(without.servo_torques().empty());
  CHECK(without.contacts().empty());
}

// ---- recordings

using Columns = std::map<std::string, std::vector<double>>;

Columns columns_of(const std::filesystem::path& file) {
  std::istringstream lines(text_of(file));
  std::vector<std::string> names;
  Columns columns;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream cells(line);
    std::size_t k = 0;
    const bool header = names.empty();
    for (std::string cell; std::getline(cells, cell, ','); ++k) {
      if (header) {
        names.push_back(cell);
        continue;
      }
      double value = 0;
      REQUIRE(std::from_chars(cell.data(), cell.data() + cell.size(), value).ptr == cell.data() + cell.size());
      columns[names.at(k)].push_back(value);
    }
    REQUIRE(k == names.size());
  }
  return columns;
}

std::vector<double> numbers_of(const Array& array) {
  REQUIRE(array.type == "<f8");
  std::vector<double> numbers(array.bytes.size() / sizeof(double));
  std::memcpy(numbers.data(), array.bytes.data(), array.bytes.size());
  return numbers;
}

const std::string kArmScene =
    "model: " LINDEN_MODELS_DIR "/arm.urdf\nduration: 0.1\n"
    "effects: {gravity: [0, 0, -9.81], damping: 0.3, servo: {stiffness: 300, damping: 20, max_force: none, joints: [elbow]}}\n";

TEST_CASE("a run records what it is asked for, in tables and arrays alike, and as the library has it", "[command line]") {
  const Shell shell;
  const Model arm = load_urdf(model_file("arm.urdf"));
  const std::string joint = arm.names.velocity.at(1);
  std::string scene = kArmScene;
  scene.replace(scene.find("elbow"), 5, joint);
  shell.write("arm.yaml", scene);
  const std::string what = " --what velocities,energies,servos,forces,positions";
  for (const std::string ending : {"csv", "npz", "h5"}) REQUIRE(shell.linden("run arm.yaml --record a." + ending + what).exit_code == 0);
  const Columns table = columns_of(shell / "a.csv");
  Simulation simulation(load_scene(shell.file("arm.yaml")));
  simulation.keep_forces();
  for (std::size_t k = 0; k <= 100; ++k) {
    if (k > 0) run(simulation, 1);
    CHECK(table.at("time").at(k) == simulation.time());
    CHECK(table.at("energy").at(k) == simulation.energy().total());
    CHECK(table.at("v." + joint).at(k) == simulation.velocities()[1]);
    CHECK(table.at(joint).at(k) == simulation.positions()[1]);
    CHECK(table.at("servo." + joint).at(k) == simulation.servo_torques()[0]);
    CHECK(table.at("force." + joint).at(k) == simulation.joint_forces()[1]);
    CHECK(table.at("energy.kinetic").at(k) == simulation.energy().kinetic);
    CHECK(table.at("energy.gravity").at(k) == simulation.energy().potential);
    CHECK(table.at("energy.damping_taken").at(k) == simulation.effect_work().of<JointDamping>());
    CHECK(table.at("energy.servo_given").at(k) == simulation.effect_work().of<Servo>());
  }
  const std::size_t nv = arm.names.velocity.size();
  CHECK(table.size() == 2 + 3 * nv + 1 + 4);
  for (const std::string ending : {"npz", "h5"}) {
    const Arrays arrays = read(shell.file("a." + ending));
    CHECK(arrays.size() == 2 + 5 + 1 + 4 + 1);  // time, energy; five arrays; status; their names, those of rows of v once; statuses
    CHECK(arrays.at("forces").shape == std::vector<std::int64_t>{101, 1, static_cast<std::int64_t>(nv)});
    CHECK(arrays.at("energies").shape == std::vector<std::int64_t>{101, 1, 4});
    CHECK(arrays.at("energy_names").words == std::vector<std::string>{"kinetic", "gravity", "damping_taken", "servo_given"});
    CHECK(arrays.at("servos").words == std::vector<std::string>{joint});
    CHECK(numbers_of(arrays.at("time")) == table.at("time"));
    CHECK(numbers_of(arrays.at("energy")) == table.at("energy"));
    CHECK(numbers_of(arrays.at("servo_forces")) == table.at("servo." + joint));
    const std::vector<double> v = numbers_of(arrays.at("v"));
    for (std::size_t k = 0; k <= 100; ++k) CHECK(v.at(k * nv + 1) == table.at("v." + joint).at(k));
  }
}

TEST_CASE("a run records contacts body by body", "[command line]") {
  const Shell shell;
  shell.write("box.urdf", kBox);
  shell.write("standing.yaml", kStanding);
  REQUIRE(shell.linden("run standing.yaml --record a.csv --what contacts,energies --every 500").exit_code == 0);
  const Columns table = columns_of(shell / "a.csv");
  CHECK(table.size() == 2 + 2 + 4);
  CHECK(table.at("time") == std::vector<double>{0, 0.5, 1});
  CHECK(table.at("contacts.box").back() == 4);
  CHECK(table.at("normal_force.box").back() == Approx(3 * 9.81).epsilon(1e-3));
  CHECK(table.at("energy.ground").back() > 0);
  CHECK(table.contains("energy.ground_taken"));
}

TEST_CASE("rows come every so many steps, and the last state has one", "[command line]") {
  const Shell shell;
  REQUIRE(shell.linden("run chain:3 --duration 0.025 --record all.csv").exit_code == 0);
  REQUIRE(shell.linden("run chain:3 --duration 0.025 --record some.csv --every 10 --json a.json").exit_code == 0);
  const Columns all = columns_of(shell / "all.csv"), some = columns_of(shell / "some.csv");
  REQUIRE(some.at("time").size() == 4);
  for (const auto& [row, step] : std::map<std::size_t, std::size_t>{{0, 0}, {1, 10}, {2, 20}, {3, 25}}) {
    for (const auto& [name, numbers] : all) CHECK(some.at(name).at(row) == numbers.at(step));
  }
  REQUIRE(shell.linden("run chain:3 --duration 0.025 --record b.npz --every 10").exit_code == 0);
  const Arrays arrays = read(shell.file("b.npz"));
  CHECK(numbers_of(arrays.at("time")) == some.at("time"));
  CHECK(arrays.at("q").shape == std::vector<std::int64_t>{4, 1, 3});
  CHECK(arrays.at("v").shape == std::vector<std::int64_t>{4, 1, 3});
}

TEST_CASE("a rollout of one instance and the run of its start are one file", "[command line]") {
  const Shell shell;
  const std::string motion = " chain:4 --duration 0.05 --seed 3 --spread 0.5 --every 7 --record ";
  REQUIRE(shell.linden("rollout" + motion + "rollout.npz --instances 1 --instructions scalar").exit_code == 0);
  REQUIRE(shell.linden("run" + motion + "run.npz").exit_code == 0);
  const Arrays rollout = read(shell.file("rollout.npz")), run = read(shell.file("run.npz"));
  REQUIRE(rollout.size() == run.size());
  for (const auto& [name, array] : rollout) {
    INFO(name);
    CHECK(run.at(name).type == array.type);
    CHECK(run.at(name).shape == array.shape);
    CHECK(run.at(name).words == array.words);
    if (array.type != "<f8") continue;
    const std::vector<double> a = numbers_of(array), b = numbers_of(run.at(name));
    for (std::size_t k = 0; k < a.size(); ++k) CHECK(a[k] == Approx(b[k]).epsilon(1e-6).margin(1e-8));
  }
}

TEST_CASE("a rollout records energies", "[command line]") {
  const Shell shell;
  REQUIRE(shell.linden("rollout chain:3 --instances 5 --duration 0.01 --record a.npz --what energies").exit_code == 0);
  const Arrays arrays = read(shell.file("a.npz"));
  CHECK_FALSE(arrays.contains("q"));
  CHECK(arrays.at("energies").shape == std::vector<std::int64_t>{11, 5, 2});
  CHECK(arrays.at("energy_names").words == std::vector<std::string>{"kinetic", "potential"});
  const std::vector<double> parts = numbers_of(arrays.at("energies")), sum = numbers_of(arrays.at("energy"));
  for (std::size_t k = 0; k < sum.size(); ++k) CHECK(sum[k] == parts[2 * k] + parts[2 * k + 1]);
}

TEST_CASE("what was asked for is plotted, a panel each", "[command line]") {
  const Shell shell;
  REQUIRE(shell.linden("run chain:3 --duration 0.1 --plot a.svg --what velocities,energies").exit_code == 0);
  const std::string picture = text_of(shell / "a.svg");
  CHECK_THAT(picture, Contains("velocities [rad/s, m/s]") && Contains("energies [J]"));
  CHECK_THAT(picture, !Contains("Energy drift"));
  REQUIRE(shell.linden("run chain:20 --duration 0.1 --plot c.svg --what velocities").exit_code == 0);
  CHECK_THAT(text_of(shell / "c.svg"), Contains("the 12 that vary most of 20"));
  REQUIRE(shell.linden("run chain:3 --duration 0.1 --plot b.svg").exit_code == 0);
  CHECK_THAT(text_of(shell / "b.svg"), Contains("Energy drift"));
}

TEST_CASE("what there is not is refused with what there is", "[command line]") {
  const Shell shell;
  check_refused(shell, "run chain:3 --record a.csv --what servos", "--what servos: the scene has none; expected some of positions, velocities, energies");
  check_refused(shell, "run chain:3 --record a.csv --what contacts", "--what contacts: the scene has none");
  check_refused(shell, "run chain:3 --record a.csv --what forces", "--what forces: the scene has none");
  check_refused(shell, "run chain:3 --record a.csv --what velocites", "did you mean velocities?");
  check_refused(shell, "run chain:3 --record a.csv --what positions,,energies", "\"\" is not known; expected some of positions, ");
  check_refused(shell, "run chain:3 --record a.csv --what energies,energies", "names energies twice");
  check_refused(shell, "run chain:3 --what energies", "--what says what --record and --plot take");
  check_refused(shell, "run chain:3 --every 5", "--every thins what --record writes");
  check_refused(shell, "run chain:3 --record a.csv --every 0", "--every 0: expected 1 step or more");
  check_refused(shell, "rollout chain:3 --record a.npz --what forces", "--what forces: a rollout has none; expected some of positions, velocities, energies");
  check_refused(shell, "rollout chain:3 --what energies", "give a --record file too");
  shell.write("four.yaml", "model: chain:2\norder: 4\nduration: 0.01\neffects: {damping: 0.1}\n");
  check_refused(shell, "rollout four.yaml --instances 2", "a step of order 4 goes back in time");
}

}  // namespace
}  // namespace linden::recording_test

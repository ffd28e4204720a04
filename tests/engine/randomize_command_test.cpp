// --randomize and scenes that randomise, as people and scripts meet them.
#include <cstring>
#include <nlohmann/json.hpp>

#include "engine/randomization.hpp"
#include "engine/scene/scene_file.hpp"
#include "engine/simulation.hpp"
#include "tests/engine/array_reader.hpp"
#include "tests/engine/command_line.hpp"

namespace linden::randomize_command_test {
namespace {

const std::string kScene =
    "model: " LINDEN_MODELS_DIR
    "/arm.urdf\nduration: 0.02\n"
    "effects: {gravity: [0, 0, -9.81], friction: 0.1, servo: {stiffness: 100, damping: 5}, ground: {height: -5, friction: 0.5}}\n";
const std::string kRandomize = "randomize: {masses: 0.2, friction: [0.4, 1.0], joint_friction: 0.3, gains: 0.1}\n";

nlohmann::json json_of(const std::filesystem::path& file) { return nlohmann::json::parse(text_of(file)); }

std::vector<double> doubles_of(const Array& array) {
  REQUIRE(array.type == "<f8");
  std::vector<double> numbers(array.bytes.size() / sizeof(double));
  std::memcpy(numbers.data(), array.bytes.data(), array.bytes.size());
  return numbers;
}

TEST_CASE("a rollout file holds what was drawn for each instance, and the starts are as without", "[command line][randomization]") {
  const Shell shell;
  shell.write("plain.yaml", kScene);
  shell.write("drawn.yaml", kScene + kRandomize);
  const Scene scene = load_scene(shell.file("drawn.yaml"));
  const std::size_t bodies = static_cast<std::size_t>(scene.model.tree.bodies()), servos = scene.effects.servos.size();
  REQUIRE(shell.linden("rollout plain.yaml --instances 11 --seed 4 --record plain.npz").exit_code == 0);
  const Arrays plain = read(shell.file("plain.npz"));
  CHECK(plain.count("mass_factors") == 0);
  for (const std::string ending : {".npz", ".h5"}) {
    const Outcome outcome = shell.linden("rollout drawn.yaml --instances 11 --seed 4 --json a.json --record a" + ending);
    REQUIRE(outcome.exit_code == 0);
    CHECK_THAT(outcome.out, Contains("randomize   masses \u00b120 %, ground friction 0.4 to 1, joint friction \u00b130 %, gains \u00b110 %, "
                                     "from seeds 4 to 14\n"));
    const Arrays arrays = read(shell.file("a" + ending));
    CHECK(arrays.at("mass_factors").shape == std::vector<std::int64_t>{11, static_cast<std::int64_t>(bodies)});
    CHECK(arrays.at("ground_friction").shape == std::vector<std::int64_t>{11});
    CHECK(arrays.at("joint_friction_factors").shape == std::vector<std::int64_t>{11, static_cast<std::int64_t>(servos)});
    CHECK(arrays.at("gain_factors").shape == std::vector<std::int64_t>{11, static_cast<std::int64_t>(servos)});
    CHECK(arrays.at("bodies").words == std::vector<std::string>(scene.model.names.body.begin() + 1, scene.model.names.body.end()));
    CHECK(arrays.at("servos").words.size() == servos);
    CHECK(arrays.at("friction_joints").words == arrays.at("servos").words);
    for (std::size_t i = 0; i < 11; ++i) {
      const DrawnNumbers expected = draw(scene.randomization, scene.model, scene.effects, 4 + i);
      const auto row = [&](const char* name, std::size_t columns) {
        const std::vector<double> all = doubles_of(arrays.at(name));
        const auto begin = all.begin() + static_cast<std::ptrdiff_t>(i * columns);
        return std::vector<double>(begin, begin + static_cast<std::ptrdiff_t>(columns));
      };
      CHECK(row("mass_factors", bodies) == expected.mass_factors);
      CHECK(row("ground_friction", 1)[0] == *expected.ground_friction);
      CHECK(row("joint_friction_factors", servos) == expected.joint_friction_factors);
      CHECK(row("gain_factors", servos) == expected.gain_factors);
    }
    // the first frame is the same to the bit, the last is not
    const std::string &q = arrays.at("q").bytes, &without = plain.at("q").bytes;
    REQUIRE(q.size() == without.size());
    const std::size_t frame = q.size() / 21;
    CHECK(q.substr(0, frame) == without.substr(0, frame));
    CHECK(q.substr(20 * frame) != without.substr(20 * frame));
  }
  const nlohmann::json randomize = json_of(shell / "a.json")["randomize"];
  CHECK(randomize["mass_factors"] == std::vector<double>{0.8, 1.2});
  CHECK(randomize["ground_friction"] == std::vector<double>{0.4, 1.0});
  CHECK(randomize["first_seed"] == 4);
  CHECK(randomize["last_seed"] == 14);
}

TEST_CASE("randomised rollouts are equal whatever their threads and size", "[command line][randomization]") {
  const Shell shell;
  shell.write("drawn.yaml", kScene + kRandomize);
  REQUIRE(shell.linden("rollout drawn.yaml --instances 21 --threads 1 --record a.npz").exit_code == 0);
  REQUIRE(shell.linden("rollout drawn.yaml --instances 21 --threads 3 --record b.npz").exit_code == 0);
  REQUIRE(shell.linden("rollout drawn.yaml --instances 5 --seed 8 --record c.npz").exit_code == 0);
  CHECK(text_of(shell / "a.npz") == text_of(shell / "b.npz"));
  const Arrays all = read(shell.file("a.npz")), part = read(shell.file("c.npz"));
  for (const char* name : {"mass_factors", "ground_friction", "gain_factors"}) {
    const std::size_t each = all.at(name).bytes.size() / 21;
    CHECK(part.at(name).bytes == all.at(name).bytes.substr(7 * each, 5 * each));
  }
  const std::size_t frame = all.at("q").bytes.size() / 21, each = frame / 21, last = 20 * frame;
  CHECK(part.at("q").bytes.substr(20 * 5 * each) == all.at("q").bytes.substr(last + 7 * each, 5 * each));
}

TEST_CASE("the command line goes over what a scene randomises, and a model alone has masses", "[command line][randomization]") {
  const Shell shell;
  shell.write("drawn.yaml", kScene + kRandomize);
  const Outcome over = shell.linden("rollout drawn.yaml --instances 3 --randomize masses=0.5,friction=0.2 --float");
  CHECK(over.exit_code == 0);
  CHECK_THAT(over.out, Contains("masses \u00b150 %, ground friction 0.4 to 0.6, joint friction \u00b130 %, gains \u00b110 %, from seeds 1 to 3"));
  const Outcome chain = shell.linden("rollout chain:4 --instances 3 --duration 0.01 --randomize masses=0.5:2 --record a.npz");
  CHECK(chain.exit_code == 0);
  CHECK_THAT(chain.out, Contains("randomize   masses times 0.5 to 2, from seeds 1 to 3"));
  CHECK(read(shell.file("a.npz")).count("gain_factors") == 0);
}

TEST_CASE("the account of energy that a rollout gives is of the instance as it was drawn", "[command line][randomization]") {
  const Shell shell;
  shell.write("ball.urdf",
              "<robot name='ball'><link name='ball'><inertial><mass value='2'/>"
              "<inertia ixx='0.01' iyy='0.01' izz='0.01' ixy='0' ixz='0' iyz='0'/></inertial></link></robot>");
  shell.write("fall.yaml",
              "model: ball.urdf\nbase: floating\nduration: 0.5\neffects: {gravity: [0, 0, -9.81], drag: {linear: 1e-9}}\n"
              "randomize: {masses: [0.2, 5]}\n");
  REQUIRE(shell.linden("rollout fall.yaml --instances 3 --spread 0 --seed 12 --json a.json --record a.npz").exit_code == 0);
  const double factor = doubles_of(read(shell.file("a.npz")).at("mass_factors"))[0], speed = 9.81 * 0.5;
  CHECK(std::abs(factor - 1) > 0.1);
  CHECK(json_of(shell / "a.json")["account"]["energy_scale"] == Approx(0.5 * factor * 2 * speed * speed).epsilon(1e-6));
}

TEST_CASE("a run is the instance that its seed draws, says so and records it", "[command line][randomization]") {
  const Shell shell;
  shell.write("drawn.yaml", kScene + kRandomize);
  const Scene scene = load_scene(shell.file("drawn.yaml"));
  const DrawnNumbers expected = draw(scene.randomization, scene.model, scene.effects, kDefaultSeed);
  const Outcome outcome = shell.linden("run drawn.yaml --json a.json --record a.npz --save state");
  REQUIRE(outcome.exit_code == 0);
  CHECK_THAT(outcome.out, Contains("gains \u00b110 %, from seed 1\n") && Contains("as the scene says"));
  const nlohmann::json figures = json_of(shell / "a.json");
  CHECK(figures["drawn"]["mass_factors"] == expected.mass_factors);
  CHECK(figures["drawn"]["ground_friction"] == *expected.ground_friction);
  CHECK(figures["mass"] != scene.model.constants.subtree_mass(0));
  CHECK(doubles_of(read(shell.file("a.npz")).at("gain_factors")) == expected.gain_factors);
  Simulation simulation(scene);
  CHECK(figures["mass"] == simulation.model().constants.subtree_mass(0));
  // a checkpoint finds its masses again, and is refused by those of another seed
  CHECK(shell.linden("run drawn.yaml --load state").exit_code == 0);
  CHECK(shell.linden("run drawn.yaml --load state --seed 1").exit_code == 0);
  const Outcome other = shell.linden("run drawn.yaml --load state --seed 2");
  CHECK(other.exit_code == 2);
  CHECK_THAT(other.err, Contains("other masses"));
  const Outcome chain = shell.linden("run chain:3 --duration 0.01 --randomize masses=0.5 --json b.json");
  CHECK(chain.exit_code == 0);
  CHECK(json_of(shell / "b.json")["mass"] != 0.3);
  CHECK(json_of(shell / "b.json")["seed"].is_null());
}

TEST_CASE("what cannot be randomised is refused in one line", "[command line][randomization]") {
  const Shell shell;
  check_refused(shell, "rollout chain:3 --randomize friction=0.2", "--randomize \"friction=0.2\": there is no ground");
  check_refused(shell, "rollout chain:3 --randomize mases=0.2", "did you mean masses?");
  check_refused(shell, "rollout chain:3 --randomize masses", "expected name=p or name=low:high");
  check_refused(shell, "rollout chain:3 --randomize masses=", "expected name=p or name=low:high");
  check_refused(shell, "rollout chain:3 --randomize masses=1:2:3", "3 numbers are no range");
  check_refused(shell, "rollout chain:3 --randomize masses=0.1,masses=0.2", "names masses twice");
  check_refused(shell, "rollout chain:3 --randomize masses=1.5", "expected p from 0 to below 1");
  check_refused(shell, "run chain:3 --randomize gains=0.1", "there is no servo");
  check_refused(shell, "run chain:3 --randomize ''", "the value is empty");
  check_refused(shell, "run chain:3 --randomise masses=0.1", "did you mean --randomize?");
}

}  // namespace
}  // namespace linden::randomize_command_test

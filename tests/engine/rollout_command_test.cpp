// `linden rollout` as people and scripts meet it.
#include <nlohmann/json.hpp>

#include "engine/batch.hpp"
#include "tests/engine/command_line.hpp"

namespace linden::rollout_command_test {
namespace {

const std::string kArm = LINDEN_MODELS_DIR "/arm.urdf";
const std::string kHand = LINDEN_MODELS_DIR "/hand.urdf";

nlohmann::json json_of(const std::filesystem::path& file) { return nlohmann::json::parse(text_of(file)); }

TEST_CASE("a rollout prints speed, energy over the instances and nothing else", "[command line]") {
  const Shell shell;
  const Outcome outcome = shell.linden("rollout '" + kArm + "' --instances 50 --duration 0.05 --threads 2");
  CHECK(outcome.exit_code == 0);
  CHECK(outcome.err.empty());
  CHECK_THAT(outcome.out, Contains("instances   50") && Contains("env-steps/s") && Contains("50 steps of every instance"));
  CHECK_THAT(outcome.out, Contains("2 threads") && Contains("in the median") && Contains("seeds 1 to 50"));
  CHECK(shell.files().empty());
}

TEST_CASE("the JSON of a rollout holds what its scripts need", "[command line]") {
  const Shell shell;
  REQUIRE(shell.linden("rollout chain:5 --instances 33 --duration 0.02 --seed 4 --spread 0.5 --json a.json").exit_code == 0);
  const nlohmann::json json = json_of(shell / "a.json");
  CHECK(json["instances"] == 33);
  CHECK(json["steps"] == 20);
  CHECK(json["env_steps"] == 33 * 20);
  CHECK(json["lanes"] == lanes_of<double>(best_instructions()));
  CHECK(json["env_steps_per_second"] > 0);
  CHECK(json["iterations_mean"] >= 1);
  CHECK(json["failures"] == 0);
  CHECK(json["dofs"] == 5);
  CHECK(json["energy_change_most"] < 1e-3);
}

TEST_CASE("equal rollouts write equal files, whatever the threads, and other seeds others", "[command line]") {
  const Shell shell;
  for (const std::string ending : {".npz", ".h5"}) {
    const std::string rollout = "rollout chain:4 --instances 21 --duration 0.03 --every 10 --spread 1 --record ";
    REQUIRE(shell.linden(rollout + "a" + ending + " --threads 1").exit_code == 0);
    REQUIRE(shell.linden(rollout + "b" + ending + " --threads 3").exit_code == 0);
    REQUIRE(shell.linden(rollout + "c" + ending + " --seed 5").exit_code == 0);
    CHECK(text_of(shell / ("a" + ending)) == text_of(shell / ("b" + ending)));
    CHECK(text_of(shell / ("a" + ending)) != text_of(shell / ("c" + ending)));
    CHECK(text_of(shell / ("a" + ending)).size() > 1000);
  }
}

TEST_CASE("a rollout of a scene takes its effects and its duration, and starts around its own start", "[command line]") {
  const Shell shell;
  shell.write("link.yaml", "model: chain:1\nduration: 0.5\ninitial: {positions: {joint1: 1}}\neffects: {damping: 1, servo: {stiffness: 4}}\n");
  REQUIRE(shell.linden("rollout link.yaml --instances 3 --every 500 --record a.npz --json a.json").exit_code == 0);
  const nlohmann::json figures = json_of(shell / "a.json");
  CHECK(figures["steps"] == 500);
  CHECK(figures["frames"] == 2);
  CHECK(figures["failures"] == 0);
  // without gravity and with a servo towards the start itself nothing moves but what was random
  CHECK(figures["energy_change_most"] > 0);
  REQUIRE(shell.linden("rollout link.yaml --instances 3 --spread 0 --json b.json").exit_code == 0);
  CHECK(json_of(shell / "b.json")["energy_change_most"] == 0);
}

TEST_CASE("a rollout of hundreds of short frames, or of nothing but frozen instances, ends", "[command line]") {
  const Shell shell;
  REQUIRE(shell.linden("rollout chain:2 --instances 2 --duration 0.3 --record a.npz --json a.json", "timeout 60").exit_code == 0);
  CHECK(json_of(shell / "a.json")["steps"] == 300);
  CHECK(json_of(shell / "a.json")["frames"] == 301);
  const Outcome frozen = shell.linden("rollout chain:3 --instances 3 --duration 100 --dt 0.5 --spread 500 --json b.json", "timeout 60");
  CHECK(frozen.exit_code == 1);
  CHECK(json_of(shell / "b.json")["failures"] == 3);
}

TEST_CASE("instances that fail are listed and end in exit code 1, with the file of the others", "[command line]") {
  const Shell shell;
  // steps far too long for links that spin this fast
  const Outcome outcome =
      shell.linden("rollout chain:3 --instances 12 --duration 2 --dt 0.5 --spread 500 --record a.npz --json a.json");
  CHECK(outcome.exit_code == 1);
  CHECK_THAT(outcome.err, Contains("instances failed and were frozen"));
  CHECK_THAT(outcome.out, Contains("frozen") && Contains("instance 0 at 0 s"));
  CHECK(json_of(shell / "a.json")["failures"] > 0);
  CHECK(shell.files() == std::set<std::string>{"a.json", "a.npz"});
}

TEST_CASE("an interrupted rollout says so, exits with 130 and leaves a valid file", "[command line]") {
  const Shell shell;
  const Outcome outcome = shell.interrupted("rollout chain:4 --instances 64 --duration 1000 --every 100000 --record a.h5 --json a.json");
  CHECK(outcome.exit_code == 130);
  CHECK_THAT(outcome.err, Contains("interrupted") && Contains("a.h5 is valid"));
  CHECK(json_of(shell / "a.json")["interrupted"] == true);
  CHECK(shell.files() == std::set<std::string>{"a.h5", "a.json"});
}

TEST_CASE("a rollout with ground ends with a verdict", "[command line]") {
  const Shell shell;
  shell.write("box.urdf",
              "<robot name=\"box\"><link name=\"box\"><inertial><mass value=\"3\"/>"
              "<inertia ixx=\"0.01\" iyy=\"0.01\" izz=\"0.01\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial>"
              "<collision><geometry><box size=\"0.2 0.2 0.2\"/></geometry></collision></link></robot>\n");
  shell.write("falling.yaml",
              "model: box.urdf\nbase: floating\nduration: 0.5\ninitial: {base: {position: [0, 0, 0.2]}}\n"
              "effects: {gravity: [0, 0, -9.81], ground: {stiffness: 1e4, damping: 100}}\n");
  const Outcome outcome = shell.linden("rollout falling.yaml --instances 20 --spread 0.01 --json a.json");
  CHECK(outcome.exit_code == 0);
  CHECK(outcome.err.empty());
  CHECK_THAT(outcome.out, Contains("energy      of instance 0 on its own, over 0.5 s: effects took "));
  CHECK_THAT(outcome.out, Contains("verdict     0 of 20 instances frozen, ") && Contains(" of 10,000 steps taken alone, the energy of that instance is accounted for"));
  const nlohmann::json account = json_of(shell / "a.json")["account"];
  CHECK(account["steps"] == 500);
  // it falls by 0.1 m at most and stays: what it had is what was taken
  CHECK(account["energy_taken"].get<double>() == Approx(3 * 9.81 * 0.1).epsilon(0.2));
  CHECK(account["energy_band"].get<double>() < 0.05 * account["energy_taken"].get<double>());
}

TEST_CASE("single precision says what it costs, and orders above 2 and mimic joints are rolled out like all others", "[command line]") {
  const Shell shell;
  const Outcome single = shell.linden("rollout chain:4 --instances 20 --duration 0.01 --float");
  CHECK_THAT(single.out, Contains("single precision") && Contains("tolerance 3e-06"));
  const Outcome hand = shell.linden("rollout '" + kHand + "' --instances 3 --duration 0.01");
  CHECK(hand.exit_code == 0);
  CHECK_THAT(hand.out, Contains(" instances (") && !Contains("taken alone"));
  const Outcome fourth = shell.linden("rollout chain:4 --instances 3 --duration 0.01 --order 4");
  CHECK(fourth.exit_code == 0);
  CHECK_THAT(fourth.out, Contains("newton, order 4, step 0.001 s, tolerance 1e-12"));
}

TEST_CASE("more instances than the machine has memory for end in one line before they are made", "[command line]") {
  const Shell shell;
  check_refused(shell, "rollout chain:1000 --instances 900000000", "900,000,000 instances of chain:1000 need about", 1);
}

TEST_CASE("what a rollout cannot be is refused in one line", "[command line]") {
  const Shell shell;
  check_refused(shell, "rollout chain:3 --instances 0", "0 instances");
  check_refused(shell, "rollout chain:3 --instances many", "--instances");
  check_refused(shell, "rollout chain:3 --threads -2", "threads");
  check_refused(shell, "rollout chain:3 --instructions sse9", "choose one of: scalar");
  check_refused(shell, "rollout chain:3 --record a.csv", ".npz or .h5");
  check_refused(shell, "rollout chain:3 --every 5", "--record");
  check_refused(shell, "rollout chain:3 --record a.npz --every 0", "--every");
  check_refused(shell, "rollout chain:3 --duration 0", "--duration");
  check_refused(shell, "rollout chain:3 --tolerance -1", "tolerance");
  check_refused(shell, "rollout nothing.urdf", "nothing.urdf");
  check_refused(shell, "rollout chain:3 --instance 4", "did you mean --instances");
}

}  // namespace
}  // namespace linden::rollout_command_test

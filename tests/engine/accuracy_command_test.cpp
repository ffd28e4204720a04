// `linden accuracy` as people and scripts meet it.
#include <nlohmann/json.hpp>
#include <vector>

#include "tests/engine/command_line.hpp"

namespace linden::accuracy_command_test {
namespace {

nlohmann::json json_of(const std::filesystem::path& file) { return nlohmann::json::parse(text_of(file)); }

std::vector<nlohmann::json> ladder(const nlohmann::json& json, const std::string& method) {
  std::vector<nlohmann::json> rows;
  for (const nlohmann::json& row : json["rows"]) {
    if (row["method"] == method && row["ladder"] == true) rows.push_back(row);
  }
  return rows;
}

TEST_CASE("accuracy measures every method on a ladder of steps, finds their orders and says what to take", "[command line]") {
  const Shell shell;
  const Outcome outcome = shell.linden("accuracy tree:7 --spread 1 --duration 0.32 --dt 2e-3 --budget 60 --json a.json");
  REQUIRE(outcome.exit_code == 0);
  CHECK(outcome.err.empty());
  CHECK_THAT(outcome.out,
             Contains("agree to") && Contains("over all 0.32 s") && Contains("energy band") && Contains("evaluations"));
  // which one is quicker is a matter of the machine
  for (const std::string goal : {"for an error of 1e-03 ", "for an energy band of 1e-06 "}) {
    CHECK_THAT(outcome.out, Contains(goal + "use order ") || (Contains(goal + "RK4 costs least (RK4, h = ") && Contains("of linden's own order ")));
  }
  CHECK_THAT(outcome.out, Contains("of CPU per simulated minute"));
  const nlohmann::json json = json_of(shell / "a.json");
  CHECK(json["chaotic"] == false);
  CHECK(json["reference"]["gap"] < 1e-8);
  for (const char* method : {"order 2", "order 4", "order 6", "order 8", "RK4", "semi-implicit Euler"}) {
    INFO(method);
    const std::vector<nlohmann::json> rows = ladder(json, method);
    REQUIRE(rows.size() == 7);
    CHECK(rows.front()["step"] == 0.032);
    CHECK(rows.back()["step"] == 0.0005);
    CHECK(rows.back()["error"] < rows.front()["error"]);
    CHECK(rows.back()["energy_band"] < rows.front()["energy_band"]);
    CHECK(rows.back()["cpu_seconds"] > rows.front()["cpu_seconds"]);
    CHECK(rows.back()["evaluations"] > rows.front()["evaluations"]);
    CHECK(rows.back()["momentum_drift"].is_null());  // the tree hangs on the world
  }
  for (const nlohmann::json& fit : json["fits"]) {
    INFO(fit);
    REQUIRE(fit["order"].is_number());
    CHECK(fit["order"].get<double>() == Approx(fit["nominal_order"].get<double>()).margin(0.3));
  }
  CHECK(ladder(json, "RK4")[0]["evaluations"] == 4 * 10);
  // tolerances, and single precision
  std::vector<std::string> others;
  for (const nlohmann::json& row : json["rows"]) {
    if (row["ladder"] == false) others.push_back(row["method"]);
  }
  CHECK(others == std::vector<std::string>{"order 2", "order 2", "order 2", "order 2", "order 6", "order 6", "order 6", "order 6",
                                           "order 2, single"});
  CHECK(json["rows"].back()["energy_band"] > ladder(json, "order 4")[6]["energy_band"]);
}

TEST_CASE("an energy band means the same in a study and in a run", "[command line]") {
  const Shell shell;
  REQUIRE(shell.linden("accuracy chain:10 --duration 1.6 --budget 120 --json a.json").exit_code == 0);
  const nlohmann::json json = json_of(shell / "a.json");
  int compared = 0;
  for (const nlohmann::json& row : ladder(json, "order 2")) {
    if (!row["failure"].is_null() || row["split_steps"] > 0) continue;
    INFO(row);
    REQUIRE(shell.linden("run chain:10 --duration 1.6 --dt " + row["step"].dump() + " --json r.json").exit_code == 0);
    const double joules = row["energy_band"].get<double>() * json["energy_scale"].get<double>();
    CHECK(json_of(shell / "r.json")["energy_band"].get<double>() == Approx(joules).epsilon(1e-6));
    ++compared;
  }
  CHECK(compared >= 4);
}

TEST_CASE("a chaotic motion is recognised, judged on a horizon and by its energy, and runs that fail are shown",
          "[command line]") {
  const Shell shell;
  const Outcome outcome = shell.linden("accuracy chain:10 --duration 4 --budget 60 --json a.json");
  REQUIRE(outcome.exit_code == 0);
  CHECK_THAT(outcome.out, Contains("as on a chaotic motion: errors are judged there"));
  CHECK_THAT(outcome.out, Contains("semi-implicit Euler, h = 4 ms: at 1.784 s: the result is not finite"));
  const nlohmann::json json = json_of(shell / "a.json");
  CHECK(json["chaotic"] == true);
  CHECK(json["reference"]["horizon"] > 1);
  CHECK(json["reference"]["horizon"] < 4);
  CHECK(json["reference"]["gap"] <= 1e-8);
  CHECK(json["reference"]["gap_at_end"] > 1e-6);
  const std::vector<nlohmann::json> euler = ladder(json, "semi-implicit Euler");
  CHECK(euler[2]["failure"].is_string());
  CHECK(euler[2]["error"].is_null());
  CHECK(json["failures"] > 2);
}

TEST_CASE("on a floating model momentum is compared too, and no method but Euler loses it", "[command line]") {
  const Shell shell;
  REQUIRE(shell
              .linden("accuracy " LINDEN_MODELS_DIR
                      "/humanoid.urdf --base floating --gravity 0,0,0 --spread 0.5 --duration 0.2 --budget 60 "
                      "--json a.json")
              .exit_code == 0);
  const nlohmann::json json = json_of(shell / "a.json");
  CHECK(json["seed"] == 1);
  for (const char* method : {"order 2", "order 4", "order 6", "order 8"})
    CHECK(ladder(json, method)[4]["momentum_drift"] < 1e-12);
  CHECK(ladder(json, "semi-implicit Euler")[4]["momentum_drift"] > 1e-9);
}

TEST_CASE("a budget is kept: what does not fit is left out or cut short, and said so", "[command line]") {
  const Shell shell;
  const Outcome outcome = shell.linden("accuracy chain:100 --duration 1000 --budget 1 --json a.json");
  CHECK(outcome.exit_code == 0);
  CHECK_THAT(outcome.out, Contains("instead of 1000 s, for the budget of 1 s"));
  const nlohmann::json json = json_of(shell / "a.json");
  CHECK(json["duration"] < 10);
  CHECK(json["duration_asked"] == 1000);
  CHECK(std::ranges::any_of(json["rows"], [](const nlohmann::json& row) { return row["left_out"] == true; }));
  CHECK_THAT(outcome.out, Contains("left out: no time"));
  CHECK_THAT(outcome.out, Contains("s of the 1000 s that were asked for: what grows with time, or happens later, is not in it"));
}

TEST_CASE("the pictures of an accuracy study name axes and methods", "[command line]") {
  const Shell shell;
  REQUIRE(shell.linden("accuracy chain:2 --duration 0.2 --budget 60 --plot a.svg").exit_code == 0);
  for (const char* word : {"What accuracy costs", "CPU time [s]", "error at 0.192 s [rad, m]", "energy band", "order 8", "RK4",
                           "semi-implicit Euler", "beside the points: step h [ms]", "(16, 8, 4, 2, 1, 0.5, 0.25);", "order 4, ~ h^"}) {
    CHECK_THAT(text_of(shell / "a.svg"), Contains(word));
  }
  CHECK(shell.files() == std::set<std::string>{"a.svg"});
}

TEST_CASE("the pictures of an accuracy study name the steps at which a method failed", "[command line]") {
  const Shell shell;
  // explicit steps of 16 ms blow up on a whipping chain within three seconds
  REQUIRE(shell.linden("accuracy chain:3 --duration 3 --budget 60 --plot a.svg").exit_code == 0);
  CHECK_THAT(text_of(shell / "a.svg"), Contains("semi-implicit Euler, failed at 16"));
}

TEST_CASE("a scene brings its start and its springs into the study", "[command line]") {
  const Shell shell;
  shell.write("s.yaml",
              "model: chain:2\nduration: 0.2\ninitial: {positions: {joint1: 0.5}}\n"
              "effects: {gravity: [0, 0, -9.81], spring: {joint1: {stiffness: 0.2}}, armature: 1e-4}\n");
  const Outcome outcome = shell.linden("accuracy s.yaml --budget 60 --json a.json");
  INFO(outcome.err);
  CHECK(outcome.exit_code == 0);
  const nlohmann::json json = json_of(shell / "a.json");
  CHECK(json["reference"]["gap"] < 1e-9);  // RK4 knows the same springs
  CHECK(ladder(json, "order 2")[4]["error"] < 1e-3);
}

TEST_CASE("a scene that loses energy smoothly is judged against RK4 and order 2 without its leading error", "[command line]") {
  const Shell shell;
  shell.write("s.yaml",
              "model: chain:3\nduration: 0.32\nstep: 2e-3\ninitial: {positions: {joint1: 0.5, joint2: -0.4}}\n"
              "effects:\n  gravity: [0, 0, -9.81]\n  damping: 0.002\n  servo: {stiffness: 0.5, damping: 0.01, joints: [joint2], targets: {joint2: 0.3}}\n"
              "  torque: {joint1: {times: [0, 0.4], values: [0.1, -0.1]}}\n"
              "  drag: {bodies: {link3: {linear: 0.01, quadratic: 0.05}}}\n"
              "  wrench: {link2: {force: [0.1, 0, 0.2], moment: [0, 0.01, 0]}}\n");
  const Outcome outcome = shell.linden("accuracy s.yaml --budget 60 --json a.json");
  INFO(outcome.err);
  REQUIRE(outcome.exit_code == 0);
  CHECK_THAT(outcome.out, Contains("order 2 at ") && Contains(" and RK4 at ") && Contains("agree to"));
  const nlohmann::json json = json_of(shell / "a.json");
  CHECK(json["reference"]["gap"] < 1e-8);
  CHECK(json["chaotic"] == false);
  CHECK(ladder(json, "order 4").empty());
  for (const nlohmann::json& fit : json["fits"]) {
    INFO(fit);
    REQUIRE(fit["order"].is_number());
    CHECK(fit["order"].get<double>() == Approx(fit["nominal_order"].get<double>()).margin(0.3));
  }
  const std::vector<nlohmann::json> ours = ladder(json, "order 2");
  CHECK(ours[6]["energy_band"] < 0.1 * ours[4]["energy_band"].get<double>());  // H + taken - given
  CHECK(ladder(json, "RK4")[6]["energy_band"].is_null());
}

TEST_CASE("a mechanism is judged by orders 8 and 6, since RK4 moves trees alone", "[command line]") {
  const Shell shell;
  const Outcome outcome = shell.linden("accuracy " LINDEN_MODELS_DIR "/scenes/four_bar.yaml --duration 0.64 --dt 4e-3 --budget 60 --json a.json");
  REQUIRE(outcome.exit_code == 0);
  CHECK_THAT(outcome.out, Contains("3 degrees of freedom but for 1 coupling") && Contains("order 8") && Contains("agree to") && Contains("over all 0.64 s"));
  const nlohmann::json json = json_of(shell / "a.json");
  CHECK(json["reference"]["gap"] < 1e-9);
  CHECK(ladder(json, "RK4").empty());
  for (const nlohmann::json& fit : json["fits"]) {
    if (fit["method"] != "order 2" && fit["method"] != "order 4") continue;
    INFO(fit);
    CHECK(fit["order"].get<double>() == Approx(fit["nominal_order"].get<double>()).margin(0.3));
  }
}

TEST_CASE("a scene with contacts is judged against itself at a smaller step, and says so", "[command line]") {
  const Shell shell;
  shell.write("s.yaml",
              "model: chain:2\nduration: 0.4\nstep: 2e-3\ninitial: {positions: {joint1: 0.5}}\n"
              "effects: {gravity: [0, 0, -9.81], friction: 0.02, limits: {joint1: {lower: -0.4, upper: 1}}}\n");
  const Outcome outcome = shell.linden("accuracy s.yaml --budget 60 --json a.json");
  INFO(outcome.err);
  REQUIRE(outcome.exit_code == 0);
  CHECK_THAT(outcome.out, Contains("no other method knows this scene's effects"));
  const nlohmann::json json = json_of(shell / "a.json");
  CHECK(json["reference"]["method"] == json["reference"]["other_method"]);
  CHECK(json["reference"]["step"].get<double>() < json["reference"]["other_step"].get<double>());
  const std::vector<nlohmann::json> ours = ladder(json, "order 2");
  CHECK(ours.size() == 7);
  CHECK(ours[6]["error"] < 0.2 * ours[1]["error"].get<double>());
  CHECK(json["rows"].back()["method"] == "order 2, single");
  CHECK_THAT(outcome.out, Contains("for an error of 1e-03"));
}

TEST_CASE("an interrupted study keeps the rows that are done", "[command line]") {
  const Shell shell;
  const Outcome outcome = shell.interrupted("accuracy chain:50 --duration 5 --budget 100 --json a.json");
  CHECK(outcome.exit_code == 130);
  CHECK_THAT(outcome.err, Contains("interrupted after"));
  CHECK(json_of(shell / "a.json")["interrupted"] == true);
}

TEST_CASE("what a study of accuracy cannot be is refused in one line", "[command line]") {
  const Shell shell;
  check_refused(shell, "accuracy", "MODEL");
  check_refused(shell, "accuracy chain:2 --budget 0", "--budget 0");
  check_refused(shell, "accuracy chain:2 --budget many", "--budget");
  check_refused(shell, "accuracy chain:2 --duration 0", "--duration");
  check_refused(shell, "accuracy chain:2 --dt 0", "the step is 0 s");
  check_refused(shell, "accuracy chain:2 --json a.txt", ".json");
  check_refused(shell, "accuracy chain:2 --plot no/a.png", "no folder");
  check_refused(shell, "accuracy chain:2 --budgt 3", "did you mean --budget");
}

}  // namespace
}  // namespace linden::accuracy_command_test

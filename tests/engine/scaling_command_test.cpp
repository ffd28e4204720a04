// `linden scaling` as people and scripts meet it.
#include <nlohmann/json.hpp>
#include <vector>

#include "tests/engine/command_line.hpp"

namespace linden::scaling_command_test {
namespace {

nlohmann::json json_of(const std::filesystem::path& file) { return nlohmann::json::parse(text_of(file)); }

template <class Value>
std::vector<Value> column(const nlohmann::json& rows, const std::string& name) {
  std::vector<Value> values;
  for (const nlohmann::json& row : rows) values.push_back(row[name].get<Value>());
  return values;
}

TEST_CASE("scaling prints a row for each size and solver, the exponents and nothing else", "[command line]") {
  const Shell shell;
  const Outcome outcome = shell.linden("scaling --dofs 10..50 --solver newton,riqn --steps 20");
  CHECK(outcome.exit_code == 0);
  CHECK(outcome.err.empty());
  CHECK_THAT(outcome.out, Contains("ns/body") && Contains("evaluations") && Contains("memory") && Contains("energy"));
  for (const char* row : {"\nnewton      10 ", "\nnewton      20 ", "\nnewton      50 ", "\nriqn        50 "}) {
    CHECK_THAT(outcome.out, Contains(row));
  }
  CHECK_THAT(outcome.out, Contains("newton: time ~ DOFs^") && Contains("riqn: time ~ DOFs^") && Contains("3 sizes from 10 DOFs on"));
  CHECK(shell.files().empty());
}

TEST_CASE("the JSON of a scaling holds rows and fits", "[command line]") {
  const Shell shell;
  REQUIRE(shell.linden("scaling --dofs 15..60 --solver riqn,newton --duration 0.013 --seed 3 --spread 0.2 --json a.json").exit_code == 0);
  const nlohmann::json json = json_of(shell / "a.json");
  CHECK(json["shape"] == "chain");
  CHECK(json["seed"] == 3);
  REQUIRE(json["rows"].size() == 8);
  CHECK(column<int>(json["rows"], "dofs") == std::vector{15, 15, 20, 20, 50, 50, 60, 60});
  for (const nlohmann::json& row : json["rows"]) {
    INFO(row);
    CHECK(row["bodies"] == row["dofs"]);
    CHECK(row["steps"] == 13);
    CHECK(row["seconds_per_step"] > 0);
    CHECK(row["seconds_per_step_least"] <= row["seconds_per_step"]);
    CHECK(row["seconds_per_step"] <= row["seconds_per_step_most"]);
    CHECK(row["evaluations_mean"] >= 1);
    CHECK(row["bytes"] > 1000 * row["bodies"].get<int>());
    CHECK(std::abs(row["energy_change"].get<double>()) < 1e-3);
    CHECK(row["failure"].is_null());
  }
  REQUIRE(json["fits"].size() == 2);
  CHECK(json["fits"][0]["solver"] == "riqn");
  CHECK(json["fits"][1]["points"] == 4);
  CHECK(json["fits"][1]["exponent"] > 0);
  CHECK(json["interrupted"] == false);
}

TEST_CASE("every shape comes near the degrees of freedom that were asked for, and no model twice", "[command line]") {
  const Shell shell;
  for (const std::string shape : {"chain", "ball-chain", "paper-chain", "binary", "random", "fourbars", "ladder", "roller-chain"}) {
    INFO(shape);
    REQUIRE(shell.linden("scaling --shape " + shape + " --dofs 10..30 --steps 5 --json a.json").exit_code == 0);
    const std::vector<int> dofs = column<int>(json_of(shell / "a.json")["rows"], "dofs");
    REQUIRE(dofs.size() == 3);
    for (std::size_t k = 0; k < 3; ++k) CHECK(dofs[k] == Approx(10 * static_cast<double>(k + 1)).epsilon(0.4));
  }
  REQUIRE(shell.linden("scaling --shape humanoids --dofs 10..110 --steps 5 --json a.json").exit_code == 0);
  CHECK(column<int>(json_of(shell / "a.json")["rows"], "dofs") == std::vector{36, 108});
}

TEST_CASE("without a number of steps, a row takes at least five", "[command line]") {
  const Shell shell;
  REQUIRE(shell.linden("scaling --dofs 2000..2000 --json a.json").exit_code == 0);
  CHECK(column<int>(json_of(shell / "a.json")["rows"], "steps").at(0) >= 5);
}

TEST_CASE("a row that fails says so, and a solver that fails at every size ends in exit code 1", "[command line]") {
  const Shell shell;
  // steps far too long for links that spin this fast
  const Outcome outcome = shell.linden("scaling --dofs 10..20 --dt 0.5 --spread 500 --json a.json");
  CHECK(outcome.exit_code == 1);
  CHECK_THAT(outcome.err, Contains("newton failed at every size"));
  CHECK_THAT(outcome.out, Contains("chain:10: step 1: ") && Contains("no size to fit"));
  const nlohmann::json json = json_of(shell / "a.json");
  CHECK(json["failures"] == 2);
  CHECK(json["rows"][0]["seconds_per_step"].is_null());
  CHECK(json["fits"][0]["exponent"].is_null());
}

TEST_CASE("the picture of a scaling names its axes and every solver", "[command line]") {
  const Shell shell;
  REQUIRE(shell.linden("scaling --dofs 10..50 --solver newton,riqn --steps 5 --plot a.svg").exit_code == 0);
  REQUIRE(shell.linden("scaling --dofs 10..10 --steps 5 --plot one.png").exit_code == 0);
  for (const char* word : {"degrees of freedom", "time per step [\u00b5s]", "newton, slope", "riqn, slope", "slope 1"}) {
    CHECK_THAT(text_of(shell / "a.svg"), Contains(word));
  }
  CHECK(shell.files() == std::set<std::string>{"a.svg", "one.png"});
}

TEST_CASE("the picture of a scaling names the sizes that failed, and its slope has an error", "[command line]") {
  const Shell shell;
  // a chain of 50 fails in its second step, shorter ones after the tenth at the earliest
  REQUIRE(shell.linden("scaling --dofs 1..50 --steps 4 --dt 0.4 --spread 4 --plot a.svg").exit_code == 0);
  CHECK_THAT(text_of(shell / "a.svg"), Contains("newton, slope ") && Contains(" \u00b1 ") && Contains(", failed at ") && Contains("50 DOFs;"));
}

TEST_CASE("an interrupted scaling says so and keeps the rows that are done", "[command line]") {
  const Shell shell;
  const Outcome outcome = shell.interrupted("scaling --dofs 1..100000 --json a.json");
  CHECK(outcome.exit_code == 130);
  CHECK_THAT(outcome.err, Contains("interrupted after"));
  const nlohmann::json json = json_of(shell / "a.json");
  CHECK(json["interrupted"] == true);
  CHECK(json["rows"].size() < json["rows_planned"].get<std::size_t>());
}

TEST_CASE("what a scaling cannot be is refused in one line", "[command line]") {
  const Shell shell;
  check_refused(shell, "scaling --shape chian", "did you mean chain?");
  check_refused(shell, "scaling --shape octopus", "choose one of: chain, ball-chain");
  check_refused(shell, "scaling --dofs 10", "such as 10..10000");
  check_refused(shell, "scaling --dofs 10..many", "such as 10..10000");
  check_refused(shell, "scaling --dofs 100..10", "the smaller number first");
  check_refused(shell, "scaling --dofs 0..10", "from 1 to");
  check_refused(shell, "scaling --dofs 1..999999999999", "from 1 to");
  check_refused(shell, "scaling --solver newtn", "choose one of: newton, riqn");
  check_refused(shell, "scaling --solver newton,", "choose one of: newton, riqn");
  check_refused(shell, "scaling --solver riqn,riqn", "names riqn twice");
  check_refused(shell, "scaling --steps 0", "--steps");
  check_refused(shell, "scaling --steps 5 --duration 1", "leave one of them out");
  check_refused(shell, "scaling --duration 0", "--duration");
  check_refused(shell, "scaling --dt 0", "the step is 0 s");
  check_refused(shell, "scaling --spread -1", "--spread");
  check_refused(shell, "scaling --json a.txt", ".json");
  check_refused(shell, "scaling --plot a.jpg", ".svg or .png");
  check_refused(shell, "scaling --plot no/a.png", "no folder");
  check_refused(shell, "scaling --dof 10..20", "did you mean --dofs");
  check_refused(shell, "scaling chain", "unexpected argument chain");
}

}  // namespace
}  // namespace linden::scaling_command_test

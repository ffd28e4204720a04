// `linden run --accuracy`: what it chooses, records and says.
#include <nlohmann/json.hpp>
#include <sstream>
#include <vector>

#include "tests/engine/command_line.hpp"

namespace linden::variable_run_test {
namespace {

/// Numbers of a table, but for its first line.
std::vector<std::vector<double>> rows_of(const Shell& shell, const std::string& file) {
  std::istringstream lines(text_of(shell / file));
  std::vector<std::vector<double>> rows;
  std::string line, cell;
  std::getline(lines, line);
  while (std::getline(lines, line)) {
    std::istringstream cells(line);
    rows.emplace_back();
    while (std::getline(cells, cell, ',')) rows.back().push_back(std::stod(cell));
  }
  return rows;
}

TEST_CASE("a run for an accuracy says what steps it took, whether it kept it, and records on the grid that it was asked for") {
  const Shell shell;
  const Outcome run = shell.linden("run chain:10 --duration 2 --accuracy 1e-5 --record a.csv --every 50 --json a.json --save a");
  CAPTURE(run.out, run.err);
  REQUIRE(run.exit_code == 0);
  CHECK_THAT(run.out, Contains("order 4 (5 sub-steps), variable steps") && Contains("steps       variable, ") && Contains("the mean step of a trial is") &&
                          Contains("1e-05 asked for, band ") && Contains(": kept"));
  const nlohmann::json figures = nlohmann::json::parse(text_of(shell / "a.json"));
  CHECK(figures["accuracy"]["kept"] == true);
  CHECK(figures["accuracy"]["varies"] == true);
  CHECK(figures["accuracy"]["longest"] > figures["accuracy"]["shortest"]);
  CHECK(figures["duration"] >= 2);

  // the same motion as that of small steps, row by row, while two can be told to be the same
  REQUIRE(shell.linden("run chain:10 --duration 1 --order 4 --dt 2e-4 --record fine.csv --every 250").exit_code == 0);
  const auto rows = rows_of(shell, "a.csv"), fine = rows_of(shell, "fine.csv");
  REQUIRE(rows.size() == 41);
  REQUIRE(fine.size() == 21);
  for (std::size_t k = 0; k < fine.size(); ++k) {
    CAPTURE(k);
    CHECK(rows[k][0] == Approx(0.05 * static_cast<double>(k)).margin(1e-12));
    for (std::size_t column = 2; column < fine[k].size(); ++column) CHECK(rows[k][column] == Approx(fine[k][column]).margin(2e-4));
  }

  const Outcome continued = shell.linden("run chain:10 --duration 1 --accuracy 1e-5 --load a");
  CHECK(continued.exit_code == 0);
  CHECK_THAT(continued.out, Contains("as in the run that is continued"));
}

TEST_CASE("where variable steps have nothing to win a run takes fixed ones, and one whose step is named always does") {
  const Shell shell;
  const Outcome free = shell.linden("run chain:1 --accuracy 1e-5 --duration 5 --save fixed");
  CAPTURE(free.out, free.err);
  CHECK(free.exit_code == 0);
  CHECK_THAT(free.out, Contains("steps       fixed: the mean step of a trial is but") && Contains("1e-05 asked for, band ") && Contains(": kept"));
  const Outcome continued = shell.linden("run chain:1 --accuracy 1e-5 --duration 1 --load fixed");
  CAPTURE(continued.err);
  CHECK(continued.exit_code == 0);
  CHECK_THAT(continued.out, Contains("steps       fixed: as in the run that is continued"));
  const Outcome named = shell.linden("run chain:10 --accuracy 1e-8 --dt 8e-3 --duration 2");
  CHECK_THAT(named.out, Contains("order 6") && Contains("step 0.008 s") && Contains("steps       fixed: the step is given") && Contains(": not kept"));
}

TEST_CASE("a run for an accuracy refuses in one sentence what it cannot do") {
  const Shell shell;
  for (const char* accuracy : {"0", "-1e-6", "1e-30", "nan", "7"}) check_refused(shell, fmt::format("run chain:3 --accuracy {}", accuracy), "such as 1e-6");
  check_refused(shell, "run chain:3 --accuracy much", "--accuracy \"much\"");
  check_refused(shell, "run chain:10 --accuracy 1e-3 --duration 1 --record a.npz --what velocities", "positions are recorded, between the steps, and nothing else");
  check_refused(shell, fmt::format("run {}/scenes/humanoid_drop.yaml --accuracy 1e-3", LINDEN_MODELS_DIR), "do not see impacts coming");
  shell.write("whip.yaml", "model: chain:3\naccuracy: 1e-3\neffects: {gravity: [0, 0, -9.81]}\n");
  check_refused(shell, "rollout whip.yaml --instances 4 --duration 0.1", "a batch takes steps of one length");
}

}  // namespace
}  // namespace linden::variable_run_test

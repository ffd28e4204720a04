#include "tests/engine/command_line.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "engine/simulation.hpp"
#include "models/build/generators.hpp"
#include "models/urdf/urdf.hpp"

#ifndef LINDEN_MODELS_DIR
#define LINDEN_MODELS_DIR "models"
#endif

namespace linden::command_line_test {
namespace {

const std::string kHumanoid = LINDEN_MODELS_DIR "/humanoid.urdf";
const std::string kArm = LINDEN_MODELS_DIR "/arm.urdf";
const std::string kHand = LINDEN_MODELS_DIR "/hand.urdf";

struct Csv {
  std::vector<std::string> columns;
  std::vector<std::vector<double>> rows;
  bool whole = false;  // the last line ends with a newline
};

Csv csv_of(const std::filesystem::path& file) {
  const std::string text = text_of(file);
  Csv csv;
  csv.whole = text.ends_with('\n');
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream cells(line);
    std::vector<double> row;
    for (std::string cell; std::getline(cells, cell, ',');) {
      if (csv.rows.empty() && cell.find_first_not_of("0123456789.e+-") != cell.npos) {
        csv.columns.push_back(cell);
        continue;
      }
      double value = 0;
      const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
      if (error != std::errc{} || end != cell.data() + cell.size()) FAIL(file << " holds \"" << cell << "\"");
      row.push_back(value);
    }
    if (!row.empty()) csv.rows.push_back(row);
  }
  return csv;
}

nlohmann::json json_of(const std::filesystem::path& file) { return nlohmann::json::parse(text_of(file)); }

std::string robot_xml(const std::string& inside) { return "<robot name=\"r\">\n" + inside + "\n</robot>\n"; }

std::string link_xml(const std::string& name, const std::string& mass = "1") {
  return fmt::format("<link name=\"{}\"><inertial><mass value=\"{}\"/>"
                     "<inertia ixx=\"1\" iyy=\"1\" izz=\"1\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>\n",
                     name, mass);
}

std::string joint_xml(const std::string& name, const std::string& parent, const std::string& child,
                      const std::string& type = "continuous") {
  return fmt::format("<joint name=\"{}\" type=\"{}\"><parent link=\"{}\"/><child link=\"{}\"/></joint>\n", name, type, parent, child);
}

}  // namespace

TEST_CASE("a run prints what it simulated and exits with 0", "[command line]") {
  const Shell shell;
  const Outcome outcome = shell.linden("run chain:10 --duration 0.1");
  CHECK(outcome.exit_code == 0);
  CHECK(outcome.err.empty());
  CHECK_THAT(outcome.out, Contains("chain:10") && Contains("10 bodies") && Contains("10 degrees of freedom") && Contains("1 kg"));
  CHECK_THAT(outcome.out, Contains("100 steps") && Contains("newton") && Contains("J/s") && Contains("times real time"));
  CHECK(shell.files().empty());
}

TEST_CASE("a recording has a column for every coordinate and a row for every step", "[command line]") {
  const Shell shell;
  REQUIRE(shell.linden("run chain:3 --duration 0.05 --record a.csv").exit_code == 0);
  const Csv chain = csv_of(shell / "a.csv");
  CHECK(chain.columns == std::vector<std::string>{"time", "energy", "joint1", "joint2", "joint3"});
  REQUIRE(chain.rows.size() == 51);
  CHECK(chain.rows[0][0] == 0);
  CHECK(chain.rows[50][0] == 50 * 1e-3);
  CHECK(std::ranges::all_of(chain.rows, [](const auto& row) { return row.size() == 5; }));

  REQUIRE(shell.linden("run '" + kHumanoid + "' --base floating --duration 0.002 --record b.csv").exit_code == 0);
  const Csv humanoid = csv_of(shell / "b.csv");
  const std::vector<std::string> begins(humanoid.columns.begin(), humanoid.columns.begin() + 9);
  CHECK(begins == std::vector<std::string>{"time", "energy", "base.x", "base.y", "base.z", "base.qx", "base.qy", "base.qz", "base.qw"});
  CHECK(humanoid.columns.size() == 2 + static_cast<std::size_t>(load_urdf(kHumanoid, Base::floating).tree.shape.positions));
  CHECK(humanoid.rows.size() == 3);
  CHECK(humanoid.rows[0][8] == 1);
  CHECK(shell.files() == std::set<std::string>{"a.csv", "b.csv"});
}

TEST_CASE("the numbers of a recording are those of the library, bit by bit", "[command line]") {
  const Shell shell;
  REQUIRE(shell.linden("run ball-chain:4 --duration 0.02 --dt 2e-3 --gravity 1,-2.5,3 --record a.csv").exit_code == 0);
  const Csv csv = csv_of(shell / "a.csv");
  Simulation simulation(ball_chain(4), {.step = 2e-3, .gravity = {1, -2.5, 3}});
  REQUIRE(csv.rows.size() == 11);
  for (const std::vector<double>& row : csv.rows) {
    CHECK(row[0] == simulation.time());
    CHECK(row[1] == simulation.energy().total());
    CHECK(std::ranges::equal(std::span(row).subspan(2), simulation.positions()));
    REQUIRE(simulation.step().ok());
  }
}

TEST_CASE("equal runs record equal bytes, other seeds others", "[command line]") {
  const Shell shell;
  const std::string run = "run '" + kHumanoid + "' --base floating --duration 0.05 --spread 0.3 ";
  REQUIRE(shell.linden(run + "--seed 7 --record a.csv").exit_code == 0);
  REQUIRE(shell.linden(run + "--seed 7 --record b.csv").exit_code == 0);
  REQUIRE(shell.linden(run + "--seed 8 --record c.csv").exit_code == 0);
  CHECK(text_of(shell / "a.csv") == text_of(shell / "b.csv"));
  CHECK(text_of(shell / "a.csv") != text_of(shell / "c.csv"));
}

TEST_CASE("recording and plotting do not change the motion", "[command line]") {
  const Shell shell;
  REQUIRE(shell.linden("run chain:3 --duration 21 --save a.checkpoint").exit_code == 0);
  REQUIRE(shell.linden("run chain:3 --duration 21 --save b.checkpoint --record b.csv --plot b.svg").exit_code == 0);
  CHECK(text_of(shell / "a.checkpoint") == text_of(shell / "b.checkpoint"));
  CHECK_THAT(text_of(shell / "b.svg"), Contains("<svg") && Contains("chain:3"));
}

TEST_CASE("a random start keeps to limits and mimic joints", "[command line]") {
  const Shell shell;
  REQUIRE(shell.linden("run '" + kHand + "' --duration 0.001 --seed 3 --spread 1.5 --record a.csv").exit_code == 0);
  const Csv csv = csv_of(shell / "a.csv");
  const Model model = load_urdf(kHand);
  const std::span<const double> q = std::span(csv.rows.at(0)).subspan(2);
  REQUIRE_FALSE(model.mimics.empty());
  std::set<Index> followers;
  for (const Mimic& mimic : model.mimics) {
    followers.insert(mimic.follower_v);
    CHECK(q[static_cast<std::size_t>(mimic.follower_q)] ==
          mimic.multiplier * q[static_cast<std::size_t>(mimic.leader_q)] + mimic.offset);
  }
  for (Index slot = 1; slot < model.tree.shape.slots; ++slot) {
    const Index v = model.tree.first_v(slot);
    const double position = q[static_cast<std::size_t>(model.tree.first_q(slot))];
    if (followers.contains(v)) continue;
    INFO(model.names.joint[static_cast<std::size_t>(slot)]);
    CHECK(position >= std::max(-1.5, model.attributes.lower(v)));
    CHECK(position <= std::min(1.5, model.attributes.upper(v)));
  }
  CHECK(std::ranges::any_of(q, [](double position) { return position != 0; }));
}

TEST_CASE("the figures of a run can be read by scripts", "[command line]") {
  const Shell shell;
  REQUIRE(shell.linden("run chain:5 --duration 0.5 --spread 0.2 --json a.json --record a.csv").exit_code == 0);
  const nlohmann::json figures = json_of(shell / "a.json");
  for (const char* key : {"steps", "wall_seconds", "ns_per_body_step", "iterations_mean", "iterations_max", "energy_initial",
                          "energy_band", "energy_slope", "failures", "bodies", "dofs"}) {
    INFO(key);
    CHECK(figures.at(key).is_number());
  }
  CHECK(figures.at("momentum_drift").is_null());
  CHECK(figures.at("steps") == 500);
  CHECK(figures.at("failures") == 0);
  CHECK(figures.at("bodies") == 5);
  CHECK(figures.at("dofs") == 5);
  CHECK(figures.at("seed") == 1);
  CHECK(figures.at("wall_seconds") > 0);
  CHECK(figures.at("ns_per_body_step").get<double>() ==
        Approx(1e9 * figures.at("wall_seconds").get<double>() / (500 * 5)));

  // energy: against the recording
  const Csv csv = csv_of(shell / "a.csv");
  double lowest = csv.rows[0][1], highest = lowest, mean_t = 0, mean_h = 0, tt = 0, th = 0;
  const auto n = static_cast<double>(csv.rows.size());
  for (const auto& row : csv.rows) {
    lowest = std::min(lowest, row[1]);
    highest = std::max(highest, row[1]);
    mean_t += row[0] / n;
    mean_h += (row[1] - csv.rows[0][1]) / n;
  }
  for (const auto& row : csv.rows) {
    tt += (row[0] - mean_t) * (row[0] - mean_t);
    th += (row[0] - mean_t) * (row[1] - csv.rows[0][1] - mean_h);
  }
  CHECK(figures.at("energy_initial") == csv.rows[0][1]);
  CHECK(figures.at("energy_band") == highest - lowest);
  CHECK(figures.at("energy_slope").get<double>() == Approx(th / tt).epsilon(1e-6));
  CHECK(figures.at("energy_slope_error") > 0);
  CHECK(figures.at("energy_samples") == csv.rows.size());
}

TEST_CASE("momentum is accounted for where nothing outside takes any", "[command line]") {
  const Shell shell;
  const std::string run = "run '" + kHumanoid + "' --base floating --duration 0.5 --spread 0.5 --json a.json ";
  const Outcome isolated = shell.linden(run + "--gravity 0,0,0");
  CHECK_THAT(isolated.out, Contains("\nmomentum"));
  CHECK(json_of(shell / "a.json").at("momentum_drift") < 1e-10);
  const Outcome falling = shell.linden(run);
  CHECK_THAT(falling.out, Contains("P - m g t"));
  CHECK(json_of(shell / "a.json").at("momentum_drift").is_null());
  CHECK(json_of(shell / "a.json").at("momentum_drift_linear") < 1e-10);
  CHECK(json_of(shell / "a.json").at("momentum_drift_angular") < 1e-10);
  CHECK_THAT(shell.linden("run '" + kHumanoid + "' --duration 0.5 --spread 0.5").out, !Contains("\nmomentum"));
}

TEST_CASE("long runs sample their energy", "[command line]") {
  const Shell shell;
  REQUIRE(shell.linden("run chain:1 --duration 45 --json a.json").exit_code == 0);
  const nlohmann::json figures = json_of(shell / "a.json");
  CHECK(figures.at("steps") == 45000);
  CHECK(figures.at("energy_sampled_every") == 3);
  CHECK(figures.at("energy_samples") == 15001);
}

TEST_CASE("a run continued from a checkpoint is the same run", "[command line]") {
  const Shell shell;
  const std::string run = "run '" + kHand + "' --base floating --dt 2e-3 ";
  REQUIRE(shell.linden(run + "--duration 0.4 --spread 0.4 --record whole.csv --save whole.checkpoint").exit_code == 0);
  REQUIRE(shell.linden(run + "--duration 0.2 --spread 0.4 --record first.csv --save half.checkpoint").exit_code == 0);
  REQUIRE(shell.linden(run + "--duration 0.2 --load half.checkpoint --record second.csv --save end.checkpoint").exit_code == 0);
  const Csv whole = csv_of(shell / "whole.csv"), first = csv_of(shell / "first.csv"), second = csv_of(shell / "second.csv");
  REQUIRE(whole.rows.size() == 201);
  REQUIRE(first.rows.size() == 101);
  REQUIRE(second.rows.size() == 101);
  CHECK(std::ranges::equal(std::span(whole.rows).first(101), first.rows));
  CHECK(std::ranges::equal(std::span(whole.rows).subspan(100), second.rows));
  CHECK(text_of(shell / "whole.checkpoint") == text_of(shell / "end.checkpoint"));

  check_refused(shell, "run chain:3 --load half.checkpoint", "another model");
  check_refused(shell, run + "--gravity 0,0,0 --load half.checkpoint", "gravity");
  check_refused(shell, run + "--load half.checkpoint --seed 3", "--load continues a run");
  check_refused(shell, run + "--load whole.csv", "no checkpoint");
  check_refused(shell, run + "--load nothing", "does the file exist");
  check_refused(shell, "run chain:3 --save whole.csv", "is no checkpoint");
}

TEST_CASE("a step that fails ends the run with 1, names a body and keeps what is good", "[command line]") {
  const Shell shell;
  const Outcome outcome = shell.linden("run chain:10 --dt 10 --duration 100 --spread 1000 --record a.csv --json a.json --plot a.png");
  CHECK(outcome.exit_code == 1);
  CHECK_THAT(outcome.err, StartsWith("linden: the run failed in step 1 of 10: ") && Contains("body \"link") && Contains("try a step"));
  CHECK_THAT(outcome.err, Contains("last good state is that at 0 s") && Contains("a.csv") && Contains("valid up to there"));
  const Csv csv = csv_of(shell / "a.csv");
  CHECK(csv.whole);
  CHECK(csv.rows.size() == 1);
  const nlohmann::json figures = json_of(shell / "a.json");
  CHECK(figures.at("failures") == 1);
  CHECK(figures.at("steps") == 0);
  CHECK_THAT(figures.at("failure").get<std::string>(), Contains("link"));
  CHECK(shell.files() == std::set<std::string>{"a.csv", "a.json", "a.png"});
}

TEST_CASE("the picture of a run that failed says so, whatever it shows", "[command line]") {
  const Shell shell;
  for (const char* what : {"", " --what positions"}) {
    INFO(what);
    CHECK(shell.linden("run chain:10 --dt 10 --duration 100 --spread 1000 --plot a.svg" + std::string(what)).exit_code == 1);
    CHECK_THAT(text_of(shell / "a.svg"), Contains("FAILED: ") && Contains("try a step"));
  }
}

TEST_CASE("an interrupted run keeps what is good", "[command line]") {
  const Shell shell;
  const Outcome outcome = shell.interrupted("run chain:5 --duration 1e6 --record a.csv --json a.json --save a.checkpoint");
  CHECK(outcome.exit_code == 130);
  CHECK_THAT(outcome.err, StartsWith("linden: interrupted at ") && Contains("valid up to there"));
  const Csv csv = csv_of(shell / "a.csv");
  CHECK(csv.whole);
  const nlohmann::json figures = json_of(shell / "a.json");
  CHECK(figures.at("interrupted") == true);
  CHECK(figures.at("steps") == csv.rows.size() - 1);
  CHECK(shell.files() == std::set<std::string>{"a.checkpoint", "a.csv", "a.json"});
  CHECK(shell.linden("run chain:5 --duration 0.1 --load a.checkpoint").exit_code == 0);
}

TEST_CASE("models that cannot be simulated are refused with the place of the mistake", "[command line]") {
  const Shell shell;
  shell.write("text.urdf", "this is no robot\n");
  shell.write("loop.urdf", robot_xml(link_xml("a") + link_xml("b") + link_xml("c") + joint_xml("j", "b", "c") + joint_xml("k", "c", "b")));
  shell.write("roots.urdf", robot_xml(link_xml("a") + link_xml("b") + link_xml("c") + joint_xml("j", "a", "b")));
  shell.write("mass.urdf", robot_xml(link_xml("a") + link_xml("b", "-2") + joint_xml("j", "a", "b")));
  shell.write("nan.urdf", robot_xml(link_xml("a") + link_xml("b", "nan") + joint_xml("j", "a", "b")));
  for (const char* command : {"run ", "inspect "}) {
    const std::string to(command);
    check_refused(shell, to + "missing.urdf", "missing.urdf: there is no such file");
    check_refused(shell, to + "text.urdf", "text.urdf:1");
    check_refused(shell, to + "loop.urdf", "loop");
    check_refused(shell, to + "roots.urdf", "two root links");
    check_refused(shell, to + "mass.urdf", "-2");
    check_refused(shell, to + "nan.urdf", "nan");
    check_refused(shell, to + ".", "folder");
    check_refused(shell, to + "chain:0", "no number of bodies");
    check_refused(shell, to + "chain:999999999999", "memory", 1);
    check_refused(shell, to + "chian:3", "cannot be generated");
  }
}

TEST_CASE("strict refuses a model that gives warnings, and no other", "[command line]") {
  const Shell shell;
  const std::string hinge = "<joint name=\"j\" type=\"continuous\"><parent link=\"a\"/><child link=\"b\"/><orgin xyz=\"0 0 1\"/></joint>";
  shell.write("slip.urdf", robot_xml(link_xml("a") + link_xml("b") + hinge));
  shell.write("slip.yaml", "model: slip.urdf\nduration: 0.01\n");
  for (const char* given : {"run slip.urdf --duration 0.01 ", "inspect slip.urdf ", "run slip.yaml ",
                            "rollout slip.urdf --instances 2 --duration 0.01 "}) {
    const std::string options(given);
    CAPTURE(options);
    CHECK(shell.linden(options).exit_code == 0);
    check_refused(shell, options + "--strict", "<orgin> is not known and not used; did you mean <origin>?");
  }
  CHECK(shell.linden("run '" + kArm + "' --duration 0.01 --strict").exit_code == 0);
}

TEST_CASE("a run of higher order says so, and its solves are as exact as it is", "[command line]") {
  const Shell shell;
  const Outcome outcome = shell.linden("run chain:5 --order 8 --dt 4e-3 --duration 1 --json a.json");
  CHECK(outcome.exit_code == 0);
  CHECK_THAT(outcome.out, Contains("order 8 (17 sub-steps)") && Contains("tolerance 1e-13"));
  const nlohmann::json json = nlohmann::json::parse(text_of(shell / "a.json"));
  CHECK(json["order"] == 8);
  CHECK(json["energy_band"].get<double>() < 1e-8 * json["energy_scale"].get<double>());
  CHECK_THAT(shell.linden("run chain:5 --order 8 --tolerance 1e-11 --duration 0.1").out, Contains("tolerance 1e-11"));
  CHECK_THAT(shell.linden("run chain:5 --order 4 --duration 0.1").out,
             Contains("order 4 (5 sub-steps)") && Contains("tolerance 1e-12 (energy) or 1e-05 of the first residual"));
  CHECK_THAT(shell.linden("run chain:5 --order 4 --tolerance 1e-12 --duration 0.1").out, !Contains("of the first residual"));
}

TEST_CASE("options that make no sense are refused before anything is computed", "[command line]") {
  const Shell shell;
  check_refused(shell, "", "no command");
  check_refused(shell, "rum chain:3", "did you mean run?");
  check_refused(shell, "run", "MODEL");
  check_refused(shell, "run chain:3 chain:4", "chain:4");
  check_refused(shell, "run chain:3 --durration 5", "unknown option --durration; did you mean --duration?");
  check_refused(shell, "run chain:3 --dt", "--dt");
  check_refused(shell, "run chain:3 --dt 0", "the step is 0 s");
  check_refused(shell, "run chain:3 --dt -1e-3", "must be positive");
  check_refused(shell, "run chain:3 --dt nan", "nan");
  check_refused(shell, "run chain:3 --dt 1ms", "--dt \"1ms\": expected seconds");
  check_refused(shell, "run chain:3 --duration inf", "--duration inf");
  check_refused(shell, "run chain:3 --duration 1e-4", "at least one step");
  check_refused(shell, "run chain:3 --duration 1e10", "steps; at most 1e+12");
  check_refused(shell, "run chain:3 --gravity 0,0", "three numbers");
  check_refused(shell, "run chain:3 --gravity 0,0,inf", "finite");
  check_refused(shell, "run chain:3 --solver newtn", "choose one of: newton, riqn");
  check_refused(shell, "run chain:3 --guess ig4", "choose one of: extrapolation");
  check_refused(shell, "run chain:3 --stop never", "choose one of: energy");
  check_refused(shell, "run chain:3 --tolerance 0", "tolerance");
  check_refused(shell, "run chain:3 --order 3", "expected 2, 4, 6 or 8");
  check_refused(shell, "run chain:3 --order 10", "expected 2, 4, 6 or 8");
  check_refused(shell, "run chain:3 --seed -1", "--seed");
  check_refused(shell, "run chain:3 --spread nan", "--spread");
  check_refused(shell, "run chain:3 --base floating", "leave --base out");
  check_refused(shell, "run '" + kArm + "' --base loose", "choose one of: fixed, floating");
  check_refused(shell, "inspect chain:3 --duration 3", "unknown option --duration");
}

TEST_CASE("outputs that cannot be written are refused before anything is computed", "[command line]") {
  const Shell shell;
  shell.write("model.json", robot_xml(link_xml("a") + link_xml("b") + joint_xml("j", "a", "b")));
  std::filesystem::create_directory(shell / "folder.csv");
  check_refused(shell, "run chain:3 --record a.txt", "expected .csv");
  check_refused(shell, "run chain:3 --json a", "expected .json");
  check_refused(shell, "run chain:3 --plot a.jpg", "expected .svg or .png");
  check_refused(shell, "run chain:3 --record nowhere/a.csv", "there is no folder nowhere");
  check_refused(shell, "run chain:3 --record folder.csv", "this is a folder");
  check_refused(shell, "run chain:3 --save folder.csv", "this is a folder");
  check_refused(shell, "run chain:3 --json /proc/a.json", "cannot be written");
  check_refused(shell, "run chain:3 --json a.json --save a.json", "name one file");
  check_refused(shell, "run model.json --json model.json", "would overwrite model.json");
  check_refused(shell, "inspect model.json --json model.json", "would overwrite model.json");
  check_refused(shell, "inspect chain:3 --json a.csv", "expected .json");
  // good outputs beside bad ones are not written either
  check_refused(shell, "run chain:3 --record a.csv --json nowhere/a.json", "nowhere");
  check_refused(shell, "run chain:0 --record a.csv --json a.json --plot a.svg --save a.checkpoint", "chain:0");
}

TEST_CASE("energy that strays is said aloud", "[command line]") {
  const Shell shell;
  const Outcome outcome = shell.linden("run chain:2 --dt 0.05 --duration 20 --spread 2 --json a.json");
  CHECK(outcome.exit_code == 0);
  CHECK_THAT(outcome.err, StartsWith("linden: warning: energy strays by") && Contains("try --dt 0.0125"));
  CHECK(json_of(shell / "a.json").at("advice").is_string());
}

TEST_CASE("energy is not said to stray where a body is set down on another, or strikes it in many steps", "[command line]") {
  const Shell shell;
  const std::string inertial = R"(<inertial><mass value="1"/><inertia ixx="0.0067" iyy="0.0067" izz="0.0067" ixy="0" ixz="0" iyz="0"/></inertial>)";
  const auto solid = [&](const std::string& name) {
    shell.write(name + ".urdf", "<robot name=\"" + name + "\"><link name=\"" + name + "\">" + inertial +
                                    R"(<collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision></link></robot>)");
  };
  solid("block");
  const std::string slab = R"(<robot name="slab"><link name="slab"><collision><origin xyz="0 0 -0.5"/><geometry><box size="9 9 1"/></geometry></collision></link>)";
  shell.write("slab.urdf", slab + "<link name=\"weight\">" + inertial + R"(</link><joint name="slider" type="prismatic"><parent link="slab"/>)" +
                               R"(<child link="weight"/><axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>)");
  const auto run = [&](double height, double step) {
    shell.write("scene.yaml", "models:\n  - {model: slab.urdf, name: slab}\n  - {model: block.urdf, name: block, base: floating, position: [0, 0, " +
                                  std::to_string(height) + "]}\neffects: {gravity: [0, 0, -9.81], contact: {}}\n");
    return shell.linden("run scene.yaml --duration 1 --dt " + std::to_string(step));
  };
  for (const double step : {1e-4, 1e-3, 1e-2}) {
    for (const double height : {0.1, 0.3}) {
      const Outcome outcome = run(height, step);
      CAPTURE(step, height, outcome.out);
      CHECK(outcome.exit_code == 0);
      CHECK(outcome.err.empty());
    }
  }
}

TEST_CASE("what a file says and no run obeys is said aloud", "[command line]") {
  const Shell shell;
  CHECK_THAT(shell.linden("run '" + kArm + "' --duration 0.01").out, Contains("\nignored"));
  CHECK_THAT(shell.linden("run chain:3 --duration 0.01").out, !Contains("ignored"));
}

TEST_CASE("a model's first five warnings are printed, inspect prints them all", "[command line]") {
  const Shell shell;
  std::string text = link_xml("a");
  for (int i = 0; i < 7; ++i) {
    const std::string child = fmt::format("b{}", i);
    text += link_xml(child) + joint_xml(fmt::format("j{}", i), "a", child, "revolute");
  }
  shell.write("unlimited.urdf", robot_xml(text));
  const Outcome run = shell.linden("run unlimited.urdf --duration 0.001");
  CHECK(run.exit_code == 0);
  CHECK(std::ranges::count(run.err, '\n') == 6);
  CHECK_THAT(run.err, StartsWith("linden: warning: unlimited.urdf:") && Contains("and 2 more (linden inspect shows all)"));
  CHECK_THAT(shell.linden("inspect unlimited.urdf").out, Contains("\"j0\" is revolute") && Contains("\"j6\" is revolute"));
}

TEST_CASE("inspect prints every body, the conventions and the sweeps", "[command line]") {
  const Shell shell;
  const Outcome outcome = shell.linden("inspect '" + kHand + "' --base floating --json a.json");
  CHECK(outcome.exit_code == 0);
  CHECK(outcome.err.empty());
  const Model model = load_urdf(kHand, Base::floating);
  for (const std::string& name : model.names.body) CHECK_THAT(outcome.out, Contains(name));
  for (const std::string& name : model.names.joint) CHECK_THAT(outcome.out, Contains(name));
  for (const auto& [name, place] : model.names.link) CHECK_THAT(outcome.out, Contains(name));
  CHECK_THAT(outcome.out, Contains("unit quaternion x y z w") && Contains("angular x y z, then linear x y z"));
  CHECK_THAT(outcome.out, Contains("mimic joints") && Contains("gravity_force_up") && Contains("newton_factor_up"));

  const nlohmann::json facts = json_of(shell / "a.json");
  CHECK(facts.at("table").size() == static_cast<std::size_t>(model.tree.bodies()));
  CHECK(facts.at("position_names") == model.names.position);
  CHECK(facts.at("mimics").size() == model.mimics.size());
  CHECK(facts.at("table")[1].at("body") == model.names.body[2]);
  CHECK(facts.at("mass").get<double>() == Approx(model.constants.subtree_mass(0)));
}

TEST_CASE("inspect lists only sweeps that run", "[command line]") {
  const Shell shell;
  const Outcome none = shell.linden("inspect chain:3 --gravity 0,0,0 --solver riqn");
  CHECK_THAT(none.out, !Contains("gravity_") && !Contains("newton_factor_up") && !Contains("fold_mimics"));
  CHECK_THAT(none.out, Contains("articulated_inertia_up") && Contains("displacement_down"));
}

TEST_CASE("inspect cuts long tables unless told otherwise", "[command line]") {
  const Shell shell;
  const std::string some = shell.linden("inspect chain:300").out, all = shell.linden("inspect chain:300 --all").out;
  CHECK_THAT(some, Contains("280 more; --all prints them") && !Contains("joint300"));
  CHECK_THAT(all, Contains("joint300") && !Contains("--all"));
}

TEST_CASE("help shows an example for every command", "[command line]") {
  const Shell shell;
  for (const char* arguments : {"--help", "run --help", "inspect --help"}) {
    INFO(arguments);
    const Outcome outcome = shell.linden(arguments);
    CHECK(outcome.exit_code == 0);
    CHECK_THAT(outcome.out, Contains("Example") && Contains("linden "));
    CHECK(outcome.err.empty());
  }
  const Outcome version = shell.linden("--version");
  CHECK(version.exit_code == 0);
  CHECK_THAT(version.out, StartsWith("linden ") && Contains("."));
}

TEST_CASE("no output goes where something is read from, however its path is spelled", "[command line]") {
  const Shell shell;
  shell.write("arm.urdf", robot_xml(link_xml("a") + link_xml("b") + joint_xml("j", "a", "b") +
                                    "<link name=\"c\"><collision><geometry><mesh filename=\"part.stl\"/></geometry></collision></link>" +
                                    joint_xml("k", "b", "c", "fixed")));
  shell.write("part.stl", "solid\nvertex 0 0 1\nvertex 0 1 1\nvertex 1 0 0\nendsolid\n");
  shell.write("push.csv", "0,0\n1,2\n");
  shell.write("hills.csv", "0,0\n0,0\n");
  shell.write("scene.yaml",
              "model: arm.urdf\nduration: 0.01\neffects:\n  torque: {j: push.csv}\n"
              "  ground: {terrain: {file: hills.csv, spacing: [1, 1]}, height: -9}\n");
  std::filesystem::create_directory(shell / "folder");
  std::filesystem::create_symlink("folder", shell / "way");
  std::filesystem::create_symlink("push.csv", shell / "link.csv");
  std::filesystem::create_hard_link(shell / "push.csv", shell / "hard.csv");
  REQUIRE(shell.linden("run scene.yaml").exit_code == 0);

  for (const char* name : {"push.csv", "./push.csv", "folder/../push.csv", "way/../push.csv", "link.csv", "hard.csv"}) {
    check_refused(shell, fmt::format("run scene.yaml --record {}", name),
                  fmt::format("--record {} would overwrite push.csv, which is read", name));
  }
  check_refused(shell, fmt::format("run scene.yaml --record '{}'", shell.file("hills.csv")), "would overwrite hills.csv");
  for (const char* input : {"scene.yaml", "arm.urdf", "part.stl", "push.csv", "hills.csv"}) {
    std::filesystem::create_symlink(input, shell / "out.json");
    for (const char* command : {"run", "rollout", "accuracy", "inspect"}) {
      check_refused(shell, fmt::format("{} scene.yaml --json out.json", command), fmt::format("{}, which is read", input));
    }
    std::filesystem::remove(shell / "out.json");
  }
  REQUIRE(shell.linden("run chain:3 --duration 0.01 --save state").exit_code == 0);
  check_refused(shell, "run chain:3 --load state --save ./state", "--save ./state would overwrite state");
}

TEST_CASE("no two outputs are one file, however their paths are spelled and before there is one", "[command line]") {
  const Shell shell;
  std::filesystem::create_directory(shell / "folder");
  std::filesystem::create_symlink("folder", shell / "way");
  std::filesystem::create_symlink("a.json", shell / "a.svg");
  for (const char* other : {"--save a.json", "--save ./a.json", "--save folder/../a.json", "--save way/../a.json", "--plot a.svg"}) {
    check_refused(shell, fmt::format("run chain:3 --json a.json {}", other), "name one file");
  }
  check_refused(shell, fmt::format("run chain:3 --json '{}' --save a.json", shell.file("a.json")), "name one file");
  check_refused(shell, "scaling --json a.json --plot a.svg", "name one file");
  CHECK(shell.linden("run chain:3 --duration 0.01 --json a.json --save folder/a.json").exit_code == 0);
}

TEST_CASE("outputs go to ordinary files alone", "[command line]") {
  const Shell shell;
  const std::string device = "/dev/null", run = "run chain:3 --duration 0.01 ";
  REQUIRE(::mkfifo((shell / "pipe.csv").c_str(), 0600) == 0);
  std::filesystem::create_directory(shell / "folder");
  std::filesystem::create_symlink("circle.csv", shell / "circle.csv");
  std::filesystem::create_symlink(device, shell / "device.csv");
  std::filesystem::create_symlink("folder", shell / "folder.csv");
  check_refused(shell, run + "--save " + device, "--save /dev/null: this is a device; expected an ordinary file");
  check_refused(shell, run + "--record device.csv", "--record device.csv: this is a device; expected an ordinary file");
  check_refused(shell, run + "--record pipe.csv", "--record pipe.csv: this is a pipe; expected an ordinary file");
  check_refused(shell, run + "--record circle.csv", "--record circle.csv: this is a symbolic link that leads in a circle");
  check_refused(shell, run + "--record folder.csv", "--record folder.csv: this is a folder; expected an ordinary file");
  check_refused(shell, run + "--save folder/", "--save folder/: this is a folder; expected an ordinary file");
  std::filesystem::create_symlink(device, shell / "device.npz");
  check_refused(shell, "rollout chain:3 --record device.npz", "this is a device");
  CHECK(std::filesystem::is_character_file(device));
  CHECK(std::filesystem::is_fifo(shell / "pipe.csv"));
  CHECK_THROWS_WITH(Simulation(chain(3)).save(shell.file("pipe.csv")), Contains("this is a pipe"));
}

TEST_CASE("a link to an ordinary file is followed, and stays", "[command line]") {
  const Shell shell;
  std::filesystem::create_directory(shell / "folder");
  shell.write("folder/old.csv", "old");
  for (const char* name : {"old", "new"}) {
    std::filesystem::create_symlink(fmt::format("folder/{}.csv", name), shell / fmt::format("{}.csv", name));
    std::filesystem::create_symlink(fmt::format("{}.csv", name), shell / fmt::format("{}_too.csv", name));
    CHECK(shell.linden(fmt::format("run chain:3 --duration 0.01 --record {}_too.csv", name)).exit_code == 0);
    CHECK(std::filesystem::is_symlink(shell / fmt::format("{}.csv", name)));
    CHECK(std::filesystem::is_symlink(shell / fmt::format("{}_too.csv", name)));
    CHECK(csv_of(shell / "folder" / fmt::format("{}.csv", name)).rows.size() == 11);
  }
  std::filesystem::create_symlink("folder/roll.npz", shell / "roll.npz");
  CHECK(shell.linden("rollout chain:3 --instances 2 --duration 0.01 --record roll.npz").exit_code == 0);
  CHECK(std::filesystem::is_symlink(shell / "roll.npz"));
  CHECK(std::filesystem::is_regular_file(shell / "folder" / "roll.npz"));
}

TEST_CASE("a file that is replaced keeps its mode", "[command line]") {
  const Shell shell;
  using std::filesystem::perms;
  const perms mode = perms::owner_read | perms::owner_write | perms::group_exec | perms::others_write;
  for (const char* name : {"a.csv", "a.json", "a.svg", "a.npz", "a.h5"}) {
    shell.write(name, "old");
    std::filesystem::permissions(shell / name, mode);
  }
  CHECK(shell.linden("run chain:3 --duration 0.01 --record a.csv --json a.json --plot a.svg").exit_code == 0);
  for (const char* name : {"a.npz", "a.h5"}) {
    CHECK(shell.linden(fmt::format("rollout chain:3 --instances 2 --duration 0.01 --record {}", name)).exit_code == 0);
  }
  for (const char* name : {"a.csv", "a.json", "a.svg", "a.npz", "a.h5"}) {
    INFO(name);
    CHECK(text_of(shell / name) != "old");
    CHECK(std::filesystem::status(shell / name).permissions() == mode);
  }
}

TEST_CASE("root, who may, leaves a file that is replaced to its owner", "[command line]") {
  if (::geteuid() != 0) return;
  const Shell shell;
  shell.write("a.csv", "old");
  REQUIRE(::chown((shell / "a.csv").c_str(), 12345, 23456) == 0);
  CHECK(shell.linden("run chain:3 --duration 0.01 --record a.csv").exit_code == 0);
  struct stat now {};
  REQUIRE(::stat((shell / "a.csv").c_str(), &now) == 0);
  CHECK(now.st_uid == 12345);
  CHECK(now.st_gid == 23456);
}

TEST_CASE("an option with an empty value is refused", "[command line]") {
  const Shell shell;
  for (const char* option : {"--record", "--json", "--plot", "--save", "--load", "--dt", "--base"}) {
    check_refused(shell, fmt::format("run chain:3 {} ''", option), fmt::format("{}: the value is empty", option));
    check_refused(shell, fmt::format("run chain:3 {}=", option), option);
  }
  check_refused(shell, "rollout chain:3 --record ''", "--record: the value is empty");
  check_refused(shell, "scaling --json ''", "--json: the value is empty");
  check_refused(shell, "run ''", "the value is empty");
}

TEST_CASE("no two columns of a recording bear one name", "[command line]") {
  const Shell shell;
  std::string links = link_xml("l0"), joints;
  const std::vector<std::string> names{"time", "energy", "time_2"};
  for (std::size_t i = 0; i < names.size(); ++i) {
    links += link_xml(fmt::format("l{}", i + 1));
    joints += joint_xml(names[i], fmt::format("l{}", i), fmt::format("l{}", i + 1));
  }
  shell.write("arm.urdf", robot_xml(links + joints));
  REQUIRE(shell.linden("run arm.urdf --base floating --duration 0.001 --record a.csv").exit_code == 0);
  const Csv csv = csv_of(shell / "a.csv");
  const std::set<std::string> different(csv.columns.begin(), csv.columns.end());
  CHECK(different.size() == 2 + 7 + 3);
  for (const char* name : {"time", "energy", "time_3", "energy_2", "time_2"}) CHECK(different.contains(name));
  CHECK(csv.columns.size() == different.size());
  CHECK(csv.rows.at(0).size() == different.size());
}

}  // namespace linden::command_line_test

// Tasks as a newcomer sets out to do them, by what the documentation says and nothing else.
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "engine/batch.hpp"
#include "engine/scene/scene_file.hpp"
#include "layout/effects.hpp"
#include "models/build/random.hpp"
#include "tests/engine/command_line.hpp"
#include "tests/engine/scenes.hpp"

namespace linden::tasks_test {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;

nlohmann::json json_of(const std::filesystem::path& file) { return nlohmann::json::parse(text_of(file)); }

/// Column of a CSV by its name.
std::vector<double> column(const std::filesystem::path& file, const std::string& name) {
  std::istringstream lines(text_of(file));
  std::string line, cell;
  std::getline(lines, line);
  std::istringstream header(line);
  std::ptrdiff_t at = -1, index = 0;
  for (; std::getline(header, cell, ','); ++index) at = cell == name ? index : at;
  INFO(name << " among " << line);
  REQUIRE(at >= 0);
  std::vector<double> values;
  while (std::getline(lines, line)) {
    std::istringstream row(line);
    for (std::ptrdiff_t k = 0; k <= at; ++k) std::getline(row, cell, ',');
    values.push_back(std::stod(cell));
  }
  return values;
}

/// time,value of a sine from a spreadsheet, 50 points a second, with velocities or without.
std::string sine(double size, double rate, double duration, bool velocities) {
  std::string text = velocities ? "time [s],angle [rad],[rad/s]\n" : "time [s],angle [rad]\n";
  for (int k = 0; k <= static_cast<int>(50 * duration); ++k) {
    text += fmt::format("{},{}", k / 50.0, size * std::sin(rate * k / 50.0));
    text += velocities ? fmt::format(",{}\n", size * rate * std::cos(rate * k / 50.0)) : "\n";
  }
  return text;
}

TEST_CASE("an arm follows a sine: exactly where its motion is given, closely by a servo, and the forces are recorded", "[task]") {
  const Shell shell;
  shell.write("sine.csv", sine(0.4, kTurn / 2, 2, false));
  shell.write("smooth.csv", sine(0.4, kTurn / 2, 2, true));
  const std::string head = "model: " + model_file("arm.urdf") + "\nduration: 1.5\neffects:\n  gravity: [0, 0, -9.81]\n";
  shell.write("given.yaml", head + "  servo: {stiffness: 2000, damping: 100, joints: [joint_2, joint_3, joint_4, joint_5, joint_6, joint_7]}\n"
                                   "  motion: {joint_1: smooth.csv}\n");
  shell.write("servo.yaml", head + "  servo: {stiffness: 2000, damping: 100, targets: {joint_1: sine.csv}}\n");
  for (const std::string how : {"given", "servo"}) {
    const Outcome outcome = shell.linden("run " + how + ".yaml --what positions,forces --record " + how + ".csv --json " + how + ".json");
    INFO(how << outcome.err);
    REQUIRE(outcome.exit_code == 0);
    CHECK(outcome.err.find("not to be trusted") == std::string::npos);
    const std::vector<double> time = column(shell / (how + ".csv"), "time"), angle = column(shell / (how + ".csv"), "joint_1"),
                              force = column(shell / (how + ".csv"), "force.joint_1");
    REQUIRE(time.size() == 1501);
    double off = 0, strongest = 0;
    for (std::size_t k = 200; k < time.size(); ++k) {
      off = std::max(off, std::abs(angle[k] - 0.4 * std::sin(kTurn / 2 * time[k])));
      strongest = std::max(strongest, std::abs(force[k]));
    }
    CHECK(off < (how == "given" ? 1e-5 : 0.1));
    CHECK(strongest > 0.1);
  }
  CHECK(json_of(shell / "given.json")["effects"].back()["name"] == "motion");
}

TEST_CASE("many robots get new targets every 20 ms", "[task]") {
  const auto model = std::make_shared<const Model>(load_urdf(model_file("humanoid.urdf"), Base::fixed));
  Effects effects;
  effects.servos = servo_everywhere(*model, 200, 10);
  effects.damping = damping_everywhere(*model, 0.1);
  constexpr std::int64_t kRobots = 64;
  Batch batch(model, kRobots, {}, effects);
  Random random(3);
  const BatchView<double> targets = batch.servo_targets();
  const auto servos = static_cast<Index>(effects.servos.size());
  for (int decision = 0; decision < 10; ++decision) {
    for (std::int64_t i = 0; i < kRobots; ++i) {
      for (Index k = 0; k < servos; ++k) targets(i, k) = random.uniform(-0.3, 0.3);
    }
    batch.step(20);
  }
  CHECK(batch.summary().frozen == 0);
  // held for a second they are met, but for what gravity bends them by
  batch.step(1000);
  for (const std::int64_t i : {0, 17, 63}) {
    const auto q = batch.positions().instance(i);
    double off = 0;
    for (Index k = 0; k < servos; ++k) off = std::max(off, std::abs(q[effects.servos[static_cast<std::size_t>(k)].row] - targets(i, k)));
    CHECK(off < 0.5);
  }
  CHECK(batch.positions().instance(0) != batch.positions().instance(1));
}

TEST_CASE("the largest step that keeps the energy of a chain to a thousandth is asked for, and a run confirms it", "[task]") {
  const Shell shell;
  REQUIRE(shell.linden("accuracy chain:20 --duration 1 --budget 120 --json a.json").exit_code == 0);
  const nlohmann::json json = json_of(shell / "a.json");
  double step = 0;
  for (const nlohmann::json& row : json["rows"]) {
    if (row["method"] != "order 2" || row["ladder"] == false || !row["energy_band"].is_number()) continue;
    if (row["energy_band"] <= 1e-3) step = std::max(step, row["step"].get<double>());
  }
  REQUIRE(step > 0);
  const auto band = [&](double h) {
    REQUIRE(shell.linden(fmt::format("run chain:20 --duration 1 --dt {} --json r.json", h)).exit_code == 0);
    return json_of(shell / "r.json")["energy_band"].get<double>() / json["energy_scale"].get<double>();
  };
  CHECK(band(step) <= 1e-3);
  CHECK(band(2 * step) > 1e-3);
}

TEST_CASE("a rope hangs from a point that moves", "[task]") {
  struct Ride {
    double rail = 0, swing = 0, kinetic = 0, given = 0;
    double moving = 0, standing = 0;  // how far the balance of energies strays while the trolley moves, and once it stands [J]
  };
  const auto ride = [](double h) {
    Scene scene = load_scene(model_file("scenes/crane.yaml"));
    scene.options.step = h;
    Simulation crane(scene);
    const std::vector<std::string>& names = crane.model().names.position;
    const auto row_named = [&](const char* name) { return static_cast<std::size_t>(std::ranges::find(names, name) - names.begin()); };
    const std::size_t rail = row_named("crane/rail"), top = row_named("rope/joint1");
    const double first = crane.energy().total();
    Ride seen;
    while (crane.time() < 8) {
      REQUIRE(crane.step().ok());
      const double balance = crane.energy().total() + crane.effect_work().taken() - crane.effect_work().given();
      double& stray = crane.time() < 4.1 ? seen.moving : seen.standing;
      stray = std::max(stray, std::abs(balance - first));
      seen.kinetic = std::max(seen.kinetic, crane.energy().kinetic);
      seen.swing = std::max(seen.swing, std::abs(crane.positions()[top]));
    }
    seen.rail = crane.positions()[rail];
    seen.given = crane.effect_work().of<JointMotion>();
    return seen;
  };
  const Ride coarse = ride(2e-3), fine = ride(1e-3);
  CHECK(fine.rail == 3);
  CHECK(fine.swing > 0.05);
  CHECK(fine.given > 0);
  // where the acceleration of the table jumps a step is half before and half after it: first order there, second in the end
  CHECK(coarse.moving / fine.moving > 1.8);
  CHECK(coarse.standing / fine.standing > 3.5);
  CHECK(fine.moving < 2e-3 * fine.kinetic);
  CHECK(fine.standing < 1e-4 * fine.kinetic);
}

}  // namespace
}  // namespace linden::tasks_test

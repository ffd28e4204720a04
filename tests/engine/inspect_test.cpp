// What `linden inspect` shows of a model, and what a density makes of one, as people meet both on the command line.
#include <algorithm>
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <string>

#include "engine/scene/scene_file.hpp"
#include "layout/support/input_error.hpp"
#include "tests/engine/command_line.hpp"

namespace linden::inspect_test {
namespace {

constexpr const char* kInertial =
    "<inertial><mass value=\"2\"/><inertia ixx=\"3\" iyy=\"4\" izz=\"5\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial>";

/// A base of 2 kg, a slide along x of a turned joint frame, a massless gimbal, and two fingers, one of which follows the other.
std::string gripper() {
  const std::string heavy = kInertial;
  const auto joint = [](const std::string& name, const std::string& type, const std::string& parent, const std::string& child,
                        const std::string& axis, const std::string& more) {
    return fmt::format("<joint name=\"{}\" type=\"{}\"><parent link=\"{}\"/><child link=\"{}\"/><axis xyz=\"{}\"/>{}"
                       "<limit lower=\"-1\" upper=\"1\" effort=\"1\" velocity=\"1\"/></joint>",
                       name, type, parent, child, axis, more);
  };
  return "<robot name=\"gripper\"><link name=\"base\">" + heavy + "</link><link name=\"slide\">" + heavy + "</link><link name=\"gimbal\"/>" +
         "<link name=\"left\">" + heavy + "</link><link name=\"right\">" + heavy + "</link>" +
         joint("along", "prismatic", "base", "slide", "1 0 0", "<origin rpy=\"0 0 1.5707963267948966\"/>") +
         joint("roll", "revolute", "slide", "gimbal", "0 0 -1", "") + joint("open", "revolute", "gimbal", "left", "0 1 0", "") +
         joint("close", "revolute", "slide", "right", "0 1 0", "<mimic joint=\"open\" multiplier=\"-0.5\" offset=\"0.25\"/>") + "</robot>";
}

TEST_CASE("inspect shows axes as directions, massless bodies, tied joints and what is fixed to the world", "[inspect]") {
  const Shell shell;
  shell.write("g.urdf", gripper());
  const Outcome outcome = shell.linden("inspect g.urdf --json g.json");
  REQUIRE(outcome.exit_code == 0);
  CHECK_THAT(outcome.out, Contains("prismatic 0 1 0") && Contains("revolute 0 0 -1") && Contains("revolute 0 1 0"));
  CHECK_THAT(outcome.out, Contains("1 massless") && Contains("screw, tied") && Contains("close = -0.5 x open +0.25"));
  CHECK_THAT(outcome.out, Contains("2 kg of links fixed to the world"));
  const nlohmann::json facts = nlohmann::json::parse(text_of(shell / "g.json"));
  CHECK(facts.at("welded_mass") == 2);
  CHECK(facts.at("mass") == 6);
  for (const nlohmann::json& body : facts.at("table")) {
    CAPTURE(body.dump());
    CHECK(body.at("massless") == (body.at("body") == "gimbal"));
    CHECK((body.at("follows") == "open") == (body.at("joint") == "close"));
    if (body.at("joint") == "along") CHECK(body.at("axis") == nlohmann::json{0, 1, 0});
    if (body.at("joint") == "roll") CHECK(body.at("axis") == nlohmann::json{0, 0, -1});
  }
  CHECK_THAT(shell.linden("inspect g.urdf --base floating").out, !Contains("fixed to the world"));
}

TEST_CASE("inspect counts what a factor takes where loops close, and notes the cut that is dear", "[inspect]") {
  const Shell shell;
  const Outcome ladder = shell.linden("inspect ladder:6 --json l.json");
  REQUIRE(ladder.exit_code == 0);
  CHECK_THAT(ladder.out, Contains("where loops close, the dearest first") && Contains("a factor takes") && !Contains("dear:"));
  const nlohmann::json closures = nlohmann::json::parse(text_of(shell / "l.json")).at("closures");
  REQUIRE(closures.size() == 6);
  double before = closures[0].at("operations");
  for (const nlohmann::json& closure : closures) {
    CHECK(closure.at("rows") == 5);
    CHECK(closure.at("couplings").size() == 1);
    CHECK(closure.at("operations") <= before);
    before = closure.at("operations");
  }
  CHECK(before > 1000);
  CHECK_THAT(shell.linden("inspect net:8x6").out, Contains("dear: 42 couplings that close at world take"));
  CHECK_THAT(shell.linden("inspect chain:3").out, !Contains("where loops close"));
}

TEST_CASE("inspect lists shapes of the world, and what contact costs by how much touches", "[inspect]") {
  const Shell shell;
  shell.write("s.yaml", "model: boxes:2\nduration: 0.05\nworld:\n  - {type: sphere, name: knob, radius: 0.1, position: [3, 0, 1]}\n"
                        "  - {type: plane, name: wall, normal: [-1, 0, 0], height: -9}\n  - {type: ellipsoid, name: egg, radii: [1, 2, 3], position: [9, 9, 9]}\n"
                        "effects: {gravity: [0, 0, -9.81], contact: {stiffness: 1e8, except: [[box2, world/knob]]}}\n");
  const Outcome outcome = shell.linden("inspect s.yaml --json s.json");
  REQUIRE(outcome.exit_code == 0);
  CHECK_THAT(outcome.out, Contains("world/knob: sphere, radius 0.1 m, at 3 0 1") && Contains("world/floor: box"));
  CHECK_THAT(outcome.out, Contains("world/wall: plane, normal -1 0 0, at 9 0 0") && Contains("world/egg: ellipsoid, semi-axes 1, 2 and 3 m, at 9 9 9"));
  CHECK_THAT(outcome.out, Contains("contact, beside these sweeps, over 50 steps") && Contains("which of 8 pairs of shapes are near") && Contains("5 to 8"));
  const nlohmann::json facts = nlohmann::json::parse(text_of(shell / "s.json"));
  CHECK(facts.at("merged_links").empty());
  REQUIRE(facts.at("world").size() == 4);
  CHECK(facts.at("world")[1].at("link") == "world/knob");
  CHECK(facts.at("world")[1].at("position") == nlohmann::json{3, 0, 1});
  const nlohmann::json& contact = facts.at("contact");
  CHECK(contact.at("pairs") == 8);
  CHECK(contact.at("places_near") == 8);
  CHECK(contact.at("find_us") > 0);
  // four corners of each box press from the first step on
  REQUIRE(contact.at("steps").size() == 1);
  CHECK(contact.at("steps")[0].at("least_places") == 5);
  CHECK(contact.at("steps")[0].at("most_places") == 8);
  CHECK(contact.at("steps")[0].at("steps") == 50);
  CHECK(contact.at("steps")[0].at("us_per_step") > 0);
  CHECK_THAT(shell.linden("inspect chain:2").out, !Contains("contact") && !Contains("in the world\n"));
}

TEST_CASE("one rigid body without a joint is refused with what lets it move", "[inspect]") {
  const Shell shell;
  shell.write("one.urdf", "<robot name=\"one\"><link name=\"a\">" + std::string(kInertial) + "</link></robot>");
  check_refused(shell, "inspect one.urdf", "--base floating");
  CHECK(shell.linden("inspect one.urdf --base floating").exit_code == 0);
}

/// An arm without any <inertial>: a can that turns, and a frame at its end.
std::string arm() {
  return "<robot name=\"arm\"><link name=\"base\"/><link name=\"can\"><collision><origin xyz=\"0 0 0.5\"/><geometry><cylinder radius=\"0.1\" "
         "length=\"1\"/></geometry></collision></link><link name=\"tool0\"/><joint name=\"j\" type=\"continuous\"><parent link=\"base\"/>"
         "<child link=\"can\"/><axis xyz=\"0 1 0\"/></joint><joint name=\"k\" type=\"fixed\"><parent link=\"can\"/><child link=\"tool0\"/></joint></robot>";
}

constexpr double kCan = 31.41592653589793;  // pi 0.1^2 m^3 of 1,000 kg/m^3

TEST_CASE("an arm without inertias runs with a density, and is refused without one by a message that names it", "[inspect]") {
  const Shell shell;
  shell.write("arm.urdf", arm());
  for (const std::string command : {"run ", "rollout ", "accuracy ", "inspect "}) check_refused(shell, command + "arm.urdf", "--density 1000");
  const Outcome run = shell.linden("run arm.urdf --density 1000 --duration 0.01 --json run.json");
  CHECK(run.exit_code == 0);
  CHECK_THAT(run.err, StartsWith("linden: note: 1 link without inertia: mass from a density of 1000 kg/m^3, 31.42 kg in all (largest: \"can\""));
  CHECK(std::ranges::count(run.err, '\n') == 1);
  CHECK(nlohmann::json::parse(text_of(shell / "run.json")).at("mass").get<double>() == Approx(kCan));
  CHECK(shell.linden("rollout arm.urdf --density 500 --instances 2 --duration 0.01").exit_code == 0);
  CHECK_THAT(shell.linden("inspect arm.urdf --density 1000").out, Contains("notes\n  1 link without inertia"));
  CHECK(shell.linden("run arm.urdf --density 1000 --strict --duration 0.01").exit_code == 0);
}

TEST_CASE("a scene asks for a density beside its model or models, and the command line goes over it", "[inspect]") {
  const Shell shell;
  shell.write("arm.urdf", arm());
  const auto mass = [&](const std::string& text, const SceneStart& given = {}) {
    return parse_scene(text, shell.file("s.yaml"), given).model.constants.subtree_mass(0);
  };
  CHECK(mass("model: arm.urdf\ninertia: {density: 1000}\n") == Approx(kCan));
  CHECK(mass("model: arm.urdf\ninertia: {density: 1000}\n", {.seed = {}, .spread = {}, .density = 500}) == Approx(kCan / 2));
  CHECK(mass("models:\n  - {model: arm.urdf, name: a, inertia: {density: 1000}}\n  - {model: arm.urdf, name: b, inertia: {density: 3000}}\n") ==
        Approx(4 * kCan));
  const Scene scene = parse_scene("models:\n  - {model: arm.urdf, name: a, inertia: {density: 1000}}\n  - {model: chain:2, name: b}\n", shell.file("s.yaml"));
  REQUIRE(scene.model.notes.size() == 1);
  CHECK_THAT(scene.model.notes.front(), StartsWith("a: 1 link without inertia"));
}

TEST_CASE("a density that is none, or where none belongs, is refused with its place", "[inspect]") {
  const Shell shell;
  shell.write("arm.urdf", arm());
  const auto refused = [&](const std::string& text) {
    try {
      parse_scene(text, shell.file("s.yaml"));
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  CHECK_THAT(refused("model: arm.urdf\ninertia: {density: -1}\n"), Contains("s.yaml:2: inertia.density"));
  CHECK_THAT(refused("model: arm.urdf\ninertia: {denstiy: 1}\n"), Contains("s.yaml:2") && Contains("did you mean density?"));
  CHECK_THAT(refused("model: arm.urdf\ninertia: {}\n"), Contains("s.yaml:2: inertia"));
  CHECK_THAT(refused("model: chain:2\ninertia: {density: 1}\n"), Contains("chain:2 is generated"));
  CHECK_THAT(refused("models: [{model: chain:2}]\ninertia: {density: 1}\n"), Contains("inertia stands beside models"));
  check_refused(shell, "run arm.urdf --density 0", "--density 0");
  check_refused(shell, "run arm.urdf --density heavy", "--density");
  check_refused(shell, "run chain:3 --density 1000", "--density is for URDF files");
}

}  // namespace
}  // namespace linden::inspect_test

// Closed loops of URDF files, in motion.
#include <catch2/catch.hpp>

#include "engine/assembly.hpp"
#include "engine/scene/scene_file.hpp"
#include "mechanisms.hpp"
#include "models/urdf/urdf.hpp"
#include "tests/scratch_folder.hpp"

namespace linden::urdf_loop_motion_test {
using Catch::Contains;

namespace {

std::string bar_text(const std::string& name, const std::string& parent, const std::string& origin, const std::string& center) {
  return "<link name=\"" + name + "\"><inertial><origin xyz=\"" + center +
         "\"/><mass value=\"1\"/><inertia ixx=\"0.1\" iyy=\"0.1\" izz=\"0.1\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>"
         "<joint name=\"" + name + "_joint\" type=\"continuous\"><origin " + origin + "/><parent link=\"" + parent + "\"/><child link=\"" + name +
         "\"/><axis xyz=\"0 1 0\"/></joint>\n";
}

/// The four-bar of mechanisms.hpp in a file; the coupler's frame is turned by a quarter about y, so that its z is along it.
std::string four_bar_text(const std::string& loop) {
  return "<robot name=\"four-bar\"><link name=\"ground\"/>\n" + bar_text("crank", "ground", "xyz=\"0 0 0\"", "0 0 0.5") +
         bar_text("coupler", "crank", "xyz=\"0 0 1\" rpy=\"0 1.5707963267948966 0\"", "-0.5 0 1") + bar_text("rocker", "ground", "xyz=\"3 0 0\"", "-0.5 0 1") +
         loop + "</robot>";
}

constexpr const char* kBothFrames =
    "<loop_joint name=\"pin\" type=\"revolute\"><link1 link=\"coupler\" xyz=\"-1 0 2\"/><link2 link=\"rocker\" xyz=\"-1 0 2\"/><axis xyz=\"0 1 0\"/>"
    "</loop_joint>";

}  // namespace

TEST_CASE("a four-bar moves the same in the words of every program") {
  const Model bare = parse_urdf(four_bar_text(""), "bare.urdf");
  const auto end = [](const Model& model) {
    Simulation simulation(model, {.step = 1e-3});
    simulation.set_velocities(std::vector{1.0, 0.0, 0.0});
    REQUIRE(simulation.run(1000).ok());
    if (!model.couplings.empty()) CHECK(worst_gap(simulation.couplings()) < 1e-13);
    return std::vector<double>(simulation.positions().begin(), simulation.positions().end());
  };
  const std::vector<double> expected =
      end(coupled(bare, {{.name = "pin", .kind = CouplingKind::hinge, .link_a = "coupler", .link_b = "rocker", .at = PointAndAxis{{2, 0, 2}, {0, 1, 0}}}}));
  CHECK(std::abs(end(bare)[0] - expected[0]) > 0.1);  // the loop tells
  for (const std::string& loop : {
           std::string(kBothFrames),
           std::string("<loop_joint name=\"pin\" type=\"spherical\"><link1 link=\"coupler\" xyz=\"-1 0 2\"/><link1 link=\"rocker\" xyz=\"-1 0 2\"/></loop_joint>"),
           std::string("<loop_joint name=\"pin\" type=\"revolute\"><parent link=\"coupler\"/><child link=\"rocker\"/><origin xyz=\"-1 0 2\"/>"
                       "<axis xyz=\"0 1 0\"/></loop_joint>"),
           std::string("<loop name=\"pin\" type=\"revolute\"><predecessor link=\"coupler\"><origin xyz=\"-1 0 2\"/></predecessor>"
                       "<successor link=\"rocker\"><origin xyz=\"-1 0 2\"/></successor><axis xyz=\"0 1 0\"/></loop>"),
           std::string("<drake:ball_constraint><drake:ball_constraint_body_A name=\"coupler\"/><drake:ball_constraint_body_B name=\"rocker\"/>"
                       "<drake:ball_constraint_p_AP value=\"-1 0 2\"/><drake:ball_constraint_p_BQ value=\"-1 0 2\"/></drake:ball_constraint>"),
           std::string("<gazebo><joint name=\"pin\" type=\"revolute\"><parent>coupler</parent><child>rocker</child><pose>-1 0 2 0 0 0</pose>"
                       "<axis><xyz>0 1 0</xyz></axis></joint></gazebo>"),
       }) {
    CAPTURE(loop);
    const Model model = parse_urdf(four_bar_text(loop), "loop.urdf", Base::fixed, Reading::strict);
    REQUIRE(model.couplings.size() == 1);
    const std::vector<double> found = end(model);
    for (std::size_t row = 0; row < 3; ++row) CHECK(found[row] == Approx(expected[row]).margin(1e-9));
  }
}

TEST_CASE("a loop that is open at zero loads, is refused at the first step, and can be assembled") {
  std::string open = kBothFrames;
  open.replace(open.find("rocker\" xyz=\"-1 0 2"), 19, "rocker\" xyz=\"-1 0 1.9");
  const Model model = parse_urdf(four_bar_text(open), "open.urdf", Base::fixed, Reading::strict);
  Simulation simulation(model, {.step = 1e-3});
  CHECK(simulation.openness().gap == Approx(0.1));
  CHECK_THROWS_WITH(simulation.step(), Contains("coupling \"pin\" is open by 0.1") && Contains("assemble: true"));
  CHECK(simulation.assemble().closed);
  CHECK(simulation.run(100).ok());
  CHECK(worst_gap(simulation.couplings()) < 1e-13);
}

TEST_CASE("a loop that is rounded by its file is closed by the start") {
  std::string rounded = kBothFrames;
  rounded.replace(rounded.find("rocker\" xyz=\"-1 0 2"), 19, "rocker\" xyz=\"-1 0 2.0001");
  Simulation simulation(parse_urdf(four_bar_text(rounded), "rounded.urdf"), {.step = 1e-3});
  CHECK(simulation.openness().closed);
  CHECK(simulation.run(10).ok());
}

TEST_CASE("a scene takes the loops of its files, of each model its own") {
  const ScratchFolder folder;
  folder.write("four_bar.urdf", four_bar_text(kBothFrames));
  const auto scene = [&](const std::string& text) { return parse_scene(text, folder.file("scene.yaml")); };
  const Scene two = scene("models: [{model: four_bar.urdf, name: left}, {model: four_bar.urdf, name: right, position: [0, 1, 0]}]\n");
  REQUIRE(two.model.couplings.size() == 2);
  CHECK(two.model.couplings[1].name == "right/pin");
  Simulation simulation(two);
  CHECK(simulation.run(100).ok());
  CHECK(worst_gap(simulation.couplings()) < 1e-13);
}

}  // namespace linden::urdf_loop_motion_test

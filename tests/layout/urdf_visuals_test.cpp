// What a URDF's <visual> elements become: shapes and materials in the model, and never a reason to refuse a file or to move otherwise.
#include "models/build/isometry.hpp"
#include "models/build/merged_models.hpp"
#include "tests/layout/robots.hpp"

namespace linden::urdf_visuals_test {
namespace {

using Rgba = std::array<double, 4>;

std::string visual(const std::string& shape, const std::string& more = "") {
  return "<visual>" + more + "<geometry>" + shape + "</geometry></visual>";
}

const std::string kBall = "<sphere radius=\"0.1\"/>";

/// Two links and a hinge; the second one has `visuals`.
std::string two_links(const std::string& visuals, const std::string& before = "") {
  return robot(before + link("a") + link("b", visuals) + joint("j", "continuous", "a", "b"));
}

Model model_of(const std::string& xml) { return parse_urdf(xml, "test.urdf"); }

TEST_CASE("every kind of visual is kept with its place, size and material") {
  const std::string visuals =
      visual("<box size=\"1 2 3\"/>",
             R"(<origin xyz="1 2 3" rpy="0 0 1.5707963267948966"/><material name="m"><color rgba="1 0 0.5 0.25"/></material>)") +
      visual("<cylinder radius=\"0.2\" length=\"2\"/>") + visual("<sphere radius=\"0.3\"/>") +
      visual("<capsule radius=\"0.4\" length=\"4\"/>") +
      visual(R"(<mesh filename="package://p/x.dae" scale="1 -1 2"/>)", R"(<material name="t"><texture filename="t.png"/></material>)");
  const Model model = model_of(two_links(visuals));
  CHECK(model.warnings.empty());
  CHECK(model.shapes.empty());
  REQUIRE(model.visuals.size() == 5);
  const BodyVisual& box = model.visuals[0];
  CHECK(box.shape.slot == 1);
  CHECK(box.shape.link == "b");
  CHECK(box.shape.shape.kind == ShapeKind::box);
  CHECK(box.shape.shape.size == std::array<double, 3>{1, 2, 3});
  // a vector along the link's x lies along y of the turned shape: the body's frame is the link's, as its axis is x turned to z
  const Isometry place = isometry(model.names.link.at("b").in_body) *
                         Isometry(Eigen::Translation3d(1, 2, 3) * Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ()));
  CHECK((isometry(box.shape.pose).matrix() - place.matrix()).norm() < 1e-12);
  CHECK(box.material.name == "m");
  CHECK(box.material.rgba == Rgba{1, 0, 0.5, 0.25});
  CHECK(model.visuals[1].shape.shape.kind == ShapeKind::cylinder);
  CHECK_FALSE(model.visuals[1].material.rgba);
  CHECK(model.visuals[2].shape.shape.kind == ShapeKind::sphere);
  CHECK(model.visuals[3].shape.shape.kind == ShapeKind::capsule);
  const BodyVisual& mesh = model.visuals[4];
  CHECK(mesh.shape.shape.mesh == "package://p/x.dae");
  CHECK(mesh.shape.shape.size == std::array<double, 3>{1, -1, 2});
  CHECK(mesh.material.texture == "t.png");
}

TEST_CASE("a material alone has the colour of the first of its name, of the robot's before those of links") {
  const auto colour_of = [](const std::string& name, const std::string& before, const std::string& more = "") {
    const Model model = model_of(two_links(visual(kBall, "<material name=\"" + name + "\"/>") + more, before));
    CHECK(model.warnings.empty());
    return model.visuals[0].material.rgba;
  };
  const auto defined = [](const std::string& name, const std::string& rgba) {
    return "<material name=\"" + name + "\"><color rgba=\"" + rgba + "\"/></material>";
  };
  CHECK(colour_of("m", defined("m", "0 1 0 1") + defined("m", "1 0 0 1")) == Rgba{0, 1, 0, 1});
  CHECK(colour_of("m", "<link name=\"w\">" + visual(kBall, defined("m", "0 0 1 1")) + "</link>" + joint("k", "fixed", "b", "w")) ==
        Rgba{0, 0, 1, 1});
  CHECK(colour_of("m", "", visual(kBall, defined("m", "0 0 1 1"))) == Rgba{0, 0, 1, 1});
  CHECK(colour_of("m", "", visual(kBall, defined("m", "0 0 1 1")) + visual(kBall, defined("m", "1 1 0 1"))) == Rgba{0, 0, 1, 1});
  CHECK(colour_of("other", defined("m", "0 1 0 1")) == std::nullopt);
}

TEST_CASE("a colour that stands in the visual counts, cut to 0 and 1, opaque where it has three numbers") {
  const auto colour_of = [](const std::string& rgba) {
    const std::string before = "<material name=\"m\"><color rgba=\"0 1 0 1\"/></material>";
    return model_of(two_links(visual(kBall, "<material name=\"m\"><color rgba=\"" + rgba + "\"/></material>"), before))
        .visuals[0]
        .material.rgba;
  };
  CHECK(colour_of("0.1 0.2 0.3 0.4") == Rgba{0.1, 0.2, 0.3, 0.4});
  CHECK(colour_of("0.1 0.2 0.3") == Rgba{0.1, 0.2, 0.3, 1});
  CHECK(colour_of("255 -1 0 2") == Rgba{1, 0, 0, 1});
  CHECK(colour_of("red") == Rgba{0, 1, 0, 1});
}

TEST_CASE("faults in visuals are kept for those who look, in one message, and refuse nothing") {
  const std::string good = visual(kBall);
  for (const std::string& wrong :
       {visual("<sphere radius=\"-1\"/>"), visual("<sphere/>"), visual("<box size=\"1 2\"/>"), visual("<mesh filename=\"\"/>"), visual(""),
        std::string("<visual/>"), visual(kBall, "<origin xyz=\"1 2 what\"/>"), visual("<cylinder radius=\"nan\" length=\"1\"/>")}) {
    CAPTURE(wrong);
    const Model one = model_of(two_links(good + wrong));
    CHECK(one.warnings.empty());
    CHECK(one.visual_faults.size() == 1);
    CHECK(one.visuals.size() == 1);
    const Model many = model_of(two_links(good + wrong + wrong + wrong));
    REQUIRE(many.visual_faults.size() == 1);
    CHECK_THAT(many.visual_faults[0], Catch::Contains("test.urdf:1: link \"b\"") && Catch::Contains("(the first of 3 faults in visuals)"));
  }
  const std::string bad_colour = visual(kBall, "<material name=\"m\"><color rgba=\"1 2\"/></material>");
  const Model model = model_of(two_links(bad_colour + bad_colour));
  REQUIRE(model.visual_faults.size() == 1);
  CHECK_THAT(model.visual_faults[0], Catch::Contains("rgba=\"1 2\""));
  CHECK(model.visuals.size() == 2);
}

TEST_CASE("a mass that is to come from visuals asks for right ones, as before") {
  const std::string wrong = visual("<sphere radius=\"-1\"/>");
  const std::string robot_of_visuals = robot(link("a") + "<link name=\"b\">" + wrong + "</link>" + joint("j", "continuous", "a", "b"));
  CHECK_THROWS_WITH(parse_urdf(robot_of_visuals, "t", Base::fixed, Reading::lenient, 1000.0), Catch::Contains("radius=\"-1\""));
  CHECK_NOTHROW(parse_urdf(two_links(wrong), "t", Base::fixed, Reading::lenient, 1000.0));
}

TEST_CASE("visuals move nothing: the same hash with and without") {
  const Model plain = model_of(two_links("")), seen = model_of(two_links(visual(kBall)));
  CHECK(plain.hash() == seen.hash());
  CHECK(seen.visuals.size() == 1);
}

TEST_CASE("visuals of merged links are carried by their bodies, those of links fixed to the world by slot 0") {
  const std::string offset = R"(<origin xyz="1 0 0"/>)";
  const Model model = model_of(robot(link("a", visual(kBall)) + link("b", visual(kBall)) + link("c", visual(kBall, offset)) +
                                     joint("j", "continuous", "a", "b", "<axis xyz=\"0 0 1\"/>") +
                                     joint("k", "fixed", "b", "c", R"(<origin xyz="0 2 0"/>)")));
  REQUIRE(model.welded.visuals.size() == 1);
  CHECK(model.welded.visuals[0].shape.slot == 0);
  CHECK(model.welded.visuals[0].shape.link == "a");
  REQUIRE(model.visuals.size() == 2);
  CHECK(model.visuals[1].shape.link == "c");
  CHECK(model.visuals[1].shape.slot == 1);
  CHECK(model.visuals[1].shape.pose.shift == std::array<double, 3>{1, 2, 0});

  const Pose shifted{.shift = {0, 0, 5}};
  const Model two = merged({{model, "left", Pose{}}, {model, "right", shifted}}, "both");
  CHECK(two.visuals.size() == 4);
  REQUIRE(two.welded.visuals.size() == 2);
  CHECK(two.welded.visuals[1].shape.link == "right/a");
  CHECK(two.welded.visuals[1].shape.pose.shift == std::array<double, 3>{0, 0, 5});
  CHECK(std::ranges::is_sorted(two.visuals, {}, [](const BodyVisual& visual) { return visual.shape.slot; }));
}

TEST_CASE("a visual too far away for numbers is left out and told") {
  const std::string far = R"(<origin xyz="1.7e308 1.7e308 1.7e308"/>)";
  const std::string further = joint("k", "fixed", "b", "c", R"(<origin xyz="0 0 0" rpy="0.5 0.5 0.5"/>)");
  const Model model = model_of(robot(link("a") + link("b") + "<link name=\"c\">" + visual(kBall, far) + "</link>" +
                                     joint("j", "continuous", "a", "b", "<axis xyz=\"0 0 1\"/>") + further));
  CHECK(model.visuals.empty());
  CHECK(model.warnings.empty());
  REQUIRE(model.visual_faults.size() == 1);
  CHECK_THAT(model.visual_faults[0], Catch::Contains("link \"c\": a visual lies too far away"));
}

}  // namespace
}  // namespace linden::urdf_visuals_test

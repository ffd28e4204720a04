// What URDF files say of closed loops, in the words of several programs.
#include "models/urdf/urdf_loops.hpp"

#include <catch2/catch.hpp>
#include <fstream>
#include <numbers>

#include "layout/couplings.hpp"
#include "tests/layout/robots.hpp"

namespace linden::urdf_loops_test {
using Catch::Matchers::Contains;
using Catch::Matchers::EndsWith;
using Catch::Matchers::StartsWith;
using Eigen::AngleAxisd;
using Eigen::Vector3d;
using Strings = std::vector<std::string>;

namespace {

/// Two links, both turned and shifted against the root; a is welded to the body that carries it. `loop` is in line 2.
std::string pair_and(const std::string& loop) {
  return robot(link("root") + link("bare") + link("a") + link("b") +
               joint("j", "continuous", "root", "bare", "<origin xyz=\"1 2 3\" rpy=\"0.1 0.2 0.3\"/>") +
               joint("weld", "fixed", "bare", "a", "<origin xyz=\"0 0 1\" rpy=\"0.5 0 0\"/>") +
               joint("k", "revolute", "root", "b", "<origin xyz=\"-1 0 1\" rpy=\"-0.4 0.6 0\"/><limit lower=\"-1\" upper=\"1\"/>") + "\n" + loop);
}

Isometry at(const Vector3d& shift, double roll, double pitch, double yaw) {
  Isometry pose = Isometry::Identity();
  pose.translation() = shift;
  pose.linear() = (AngleAxisd(yaw, Vector3d::UnitZ()) * AngleAxisd(pitch, Vector3d::UnitY()) * AngleAxisd(roll, Vector3d::UnitX())).toRotationMatrix();
  return pose;
}
const Isometry kA = at({1, 2, 3}, 0.1, 0.2, 0.3) * at({0, 0, 1}, 0.5, 0, 0), kB = at({-1, 0, 1}, -0.4, 0.6, 0);

/// Where both frames of a coupling are in the world.
struct Ends {
  Isometry a, b;
};
Ends ends_of(const Model& model, const Coupling& coupling) {
  const std::vector<Isometry> bodies = neutral_poses(model);
  return {bodies[static_cast<std::size_t>(coupling.slot_a)] * isometry(coupling.frame_a),
          bodies[static_cast<std::size_t>(coupling.slot_b)] * isometry(coupling.frame_b)};
}

struct Loop {
  const char* what;
  std::string xml;
  CouplingKind kind;
  Vector3d point_a, point_b, axis_a, axis_b;  // in the world at zero
};

void check(const Loop& loop) {
  CAPTURE(loop.what, loop.xml);
  const Model model = parse_urdf(pair_and(loop.xml), "test.urdf");
  CHECK(model.warnings == Strings{});
  REQUIRE(model.couplings.size() == 1);
  const Coupling& coupling = model.couplings[0];
  CHECK(coupling.kind == loop.kind);
  CHECK(coupling.slot_a == model.names.link.at("a").slot);
  CHECK(coupling.slot_b == model.names.link.at("b").slot);
  const Ends ends = ends_of(model, coupling);
  CHECK((ends.a.translation() - loop.point_a).norm() < 1e-13);
  CHECK((ends.b.translation() - loop.point_b).norm() < 1e-13);
  if (!has_axis(loop.kind)) return;
  CHECK((ends.a.linear().col(2) - loop.axis_a).norm() < 1e-13);
  CHECK((ends.b.linear().col(2) - loop.axis_b).norm() < 1e-13);
}

const Vector3d kX = Vector3d::UnitX(), kY = Vector3d::UnitY(), kZ = Vector3d::UnitZ();

std::string sdf(const std::string& type, const std::string& more) {
  return "<gazebo><joint name=\"l\" type=\"" + type + "\"><parent>a</parent><child>b</child>" + more + "</joint></gazebo>";
}

}  // namespace

TEST_CASE("loops with a frame for each end are where the file says, in both links") {
  using enum CouplingKind;
  const Isometry a = at({0.1, 0.2, 0.3}, 0.3, 0, 0), b = at({-0.1, 0, 0}, 0, 0, 0.7);
  const Vector3d at_a = kA * Vector3d(0.1, 0.2, 0.3), at_b = kB * Vector3d(-0.1, 0, 0);
  const auto turned = [](const Isometry& link, const Isometry& end, const Vector3d& axis) -> Vector3d { return link.linear() * (end.linear() * axis); };
  const std::string from_a = "link=\"a\" xyz=\"0.1 0.2 0.3\"", from_b = "link=\"b\" xyz=\"-0.1 0 0\"", roll = " rpy=\"0.3 0 0\"", yaw = " rpy=\"0 0 0.7\"";
  for (const Loop& loop : {
           Loop{"spherical", "<loop_joint name=\"l\" type=\"spherical\"><link1 " + from_a + roll + "/><link2 " + from_b + yaw + "/></loop_joint>", ball, at_a,
                at_b, kX, kX},
           Loop{"link1 twice", "<loop_joint name=\"l\" type=\"spherical\"><link1 " + from_a + roll + "/><link1 " + from_b + yaw + "/></loop_joint>", ball,
                at_a, at_b, kX, kX},
           Loop{"without a type", "<loop_joint name=\"l\"><link1 " + from_a + roll + "/><link2 " + from_b + yaw + "/><axis xyz=\"0 2 0\"/></loop_joint>", hinge,
                at_a, at_b, turned(kA, a, kY), turned(kB, b, kY)},
           Loop{"about x", "<loop_joint name=\"l\" type=\"continuous\"><link1 " + from_a + roll + "/><link2 " + from_b + yaw + "/></loop_joint>", hinge, at_a,
                at_b, turned(kA, a, kX), turned(kB, b, kX)},
           Loop{"frames of the links", "<loop_joint name=\"l\" type=\"prismatic\"><link1 link=\"a\"/><link2 link=\"b\"/></loop_joint>", slider,
                kA.translation(), kB.translation(), kA.linear() * kX, kB.linear() * kX},
           Loop{"URDF+",
                "<loop name=\"l\" type=\"revolute\"><predecessor link=\"a\"><origin xyz=\"0.1 0.2 0.3\" rpy=\"0.3 0 0\"/></predecessor>"
                "<successor link=\"b\"><origin xyz=\"-0.1 0 0\" rpy=\"0 0 0.7\"/></successor><axis xyz=\"0 0 1\"/></loop>",
                hinge, at_a, at_b, turned(kA, a, kZ), turned(kB, b, kZ)},
           Loop{"URDF+, origins beside",
                "<loop name=\"l\" type=\"fixed\"><predecessor link=\"a\"/><successor link=\"b\"/><predecessor_origin xyz=\"0.1 0.2 0.3\"/>"
                "<successor_origin xyz=\"-0.1 0 0\"/></loop>",
                weld, at_a, at_b, kX, kX},
           Loop{"points of both, axis of the parent",
                "<loop_joint name=\"l\" type=\"revolute\"><parent link=\"a\"/><child link=\"b\"/><parent_origin xyz=\"0.1 0.2 0.3\"/>"
                "<child_origin xyz=\"-0.1 0 0\"/><axis xyz=\"0 1 0\" frame=\"parent\"/></loop_joint>",
                hinge, at_a, at_b, kA.linear() * kY, kA.linear() * kY},
           Loop{"Drake",
                "<drake:ball_constraint><drake:ball_constraint_body_A name=\"a\"/><drake:ball_constraint_body_B name=\"b\"/>"
                "<drake:ball_constraint_p_AP value=\"0.1 0.2 0.3\"/><drake:ball_constraint_p_BQ value=\"-0.1 0 0\"/></drake:ball_constraint>",
                ball, at_a, at_b, kX, kX},
       }) {
    check(loop);
  }
}

TEST_CASE("loops with one frame meet where all coordinates are zero") {
  using enum CouplingKind;
  const Vector3d from_a = kA * Vector3d(0.1, 0.2, 0.3), from_b = kB * Vector3d(0.1, 0.2, 0.3);
  const Eigen::Matrix3d turn = at({0, 0, 0}, 0.3, 0, 0.5).linear();
  const std::string ends = "<parent link=\"a\"/><child link=\"b\"/>", pose = "<pose>0.1 0.2 0.3 0.3 0 0.5</pose>";
  const auto axis = [](const std::string& attributes, const std::string& more = "") { return "<axis><xyz" + attributes + ">0 1 0</xyz>" + more + "</axis>"; };
  const Vector3d of_b = kB.linear() * (turn * kY), of_a = kA.linear() * kY;
  for (const Loop& loop : {
           Loop{"origin", "<loop_joint name=\"l\" type=\"revolute\">" + ends + "<origin xyz=\"0.1 0.2 0.3\" rpy=\"0.3 0 0.5\"/><axis xyz=\"0 3 0\"/></loop_joint>",
                hinge, from_a, from_a, kA.linear() * (turn * kY), kA.linear() * (turn * kY)},
           Loop{"no origin", "<loop_joint name=\"l\" type=\"revolute\">" + ends + "</loop_joint>", hinge, kA.translation(), kA.translation(), kA.linear() * kX,
                kA.linear() * kX},
           Loop{"origin of the child alone", "<loop_joint name=\"l\" type=\"ball\">" + ends + "<child_origin xyz=\"0.1 0.2 0.3\"/></loop_joint>", ball, from_b,
                from_b, kX, kX},
           Loop{"axis of the child", "<loop_joint name=\"l\">" + ends + "<axis xyz=\"0 1 0\" frame=\"child\"/></loop_joint>", hinge, kA.translation(),
                kA.translation(), kB.linear() * kY, kB.linear() * kY},
           Loop{"SDF revolute", sdf("revolute", pose + axis("")), hinge, from_b, from_b, of_b, of_b},
           Loop{"SDF prismatic", sdf("prismatic", pose + axis(" expressed_in=\"a\"")), slider, from_b, from_b, of_a, of_a},
           Loop{"SDF axis of the model", sdf("continuous", pose + axis(" expressed_in=\"__model__\"")), hinge, from_b, from_b, kY, kY},
           Loop{"SDF axis of the model, as once", sdf("revolute", pose + axis("", "<use_parent_model_frame>1</use_parent_model_frame>")), hinge, from_b, from_b,
                kY, kY},
           Loop{"SDF ball", sdf("ball", pose), ball, from_b, from_b, kX, kX},
           Loop{"SDF fixed without pose", sdf("fixed", ""), weld, kB.translation(), kB.translation(), kX, kX},
           Loop{"SDF pose in the parent", sdf("ball", "<pose relative_to=\"a\">0.1 0.2 0.3 0 0 0</pose>"), ball, from_a, from_a, kX, kX},
           Loop{"SDF pose in the model", sdf("ball", "<pose relative_to=\"__model__\">5 6 7 0 0 0</pose>"), ball, {5, 6, 7}, {5, 6, 7}, kX, kX},
           Loop{"SDF degrees", sdf("revolute", "<pose degrees=\"true\">0 0 0 0 0 90</pose><axis><xyz>1 0 0</xyz></axis>"), hinge, kB.translation(),
                kB.translation(), kB.linear() * kY, kB.linear() * kY},
       }) {
    check(loop);
  }
  const Model model = parse_urdf(pair_and(sdf("universal", pose + axis("") + "<axis2><xyz>0 0 2</xyz></axis2>")), "test.urdf");
  REQUIRE(model.couplings.size() == 1);
  CHECK(model.couplings[0].kind == universal);
  const Ends both = ends_of(model, model.couplings[0]);
  CHECK((both.a.linear().col(0) - of_b).norm() < 1e-13);
  CHECK((both.b.linear().col(1) - kB.linear() * (turn * kZ)).norm() < 1e-13);
  CHECK((both.a.matrix() - both.b.matrix()).norm() < 1e-13);
}

TEST_CASE("loops close on the world, float with their robot, and keep the names of the file") {
  const Model held = parse_urdf(pair_and("<loop_joint name=\"l\"><parent link=\"world\"/><child link=\"b\"/><origin xyz=\"1 0 0\"/></loop_joint>"), "test.urdf");
  REQUIRE(held.couplings.size() == 1);
  CHECK(held.couplings[0].slot_a == 0);
  CHECK((ends_of(held, held.couplings[0]).b.translation() - kX).norm() < 1e-13);

  const std::string two = sdf("ball", ""), unnamed = "<loop_joint><link1 link=\"a\"/><link2 link=\"b\"/></loop_joint>";
  const Model model = parse_urdf(pair_and(two + "\n" + two + unnamed + unnamed), "test.urdf", Base::floating);
  REQUIRE(model.couplings.size() == 4);
  CHECK(model.couplings[0].name == "l");
  CHECK(model.couplings[1].name == "l_2");
  CHECK(model.couplings[2].name == "hinge of a and b");
  CHECK(model.couplings[3].name == "hinge of a and b_2");
  CHECK(model.warnings == Strings{"test.urdf:3: <joint> of <gazebo> \"l\": another loop has its name; called \"l_2\""});
}

TEST_CASE("loops that are not understood are told and left out, and the robot loads") {
  const std::string without = "the robot moves as if it were not there", ends = "<link1 link=\"a\"/><link2 link=\"b\"/>";
  const std::pair<std::string, std::string> wrong[] = {
      {"<loop_joint name=\"l\"><link1 link=\"a\"/></loop_joint>",
       "<loop_joint> \"l\": it names one link; expected <link1> and <link2>, <parent> and <child>, or <predecessor> and <successor>; name both links"},
      {"<loop_joint name=\"l\"/>",
       "<loop_joint> \"l\": it names no links; expected <link1> and <link2>, <parent> and <child>, or <predecessor> and <successor>; name both links"},
      {"<loop_joint name=\"l\"><link1 link=\"a\"/><link2 link=\"rooot\"/></loop_joint>",
       "<loop_joint> \"l\": link \"rooot\" does not exist; expected one of the file's 4 links, or world; did you mean \"root\"?"},
      {"<loop_joint name=\"l\"><link1 link=\"a\"/><link2/></loop_joint>",
       "<loop_joint> \"l\": <link2> names no link; expected a link of the file, or world; name it"},
      {"<loop_joint name=\"l\" type=\"gearbox\">" + ends + "</loop_joint>",
       "<loop_joint> \"l\": type \"gearbox\" is not simulated; expected revolute, continuous, prismatic, ball, spherical, fixed, universal or cylindrical; "
       "choose one of these"},
      {"<loop_joint name=\"l\" type=\"universal\">" + ends + "</loop_joint>",
       "<loop_joint> \"l\": type universal, which has two axes; expected a type with one axis; write it as a <joint> in <gazebo>, with <axis> and <axis2>"},
      {"<loop_joint name=\"l\"><link1 link=\"a\" xyz=\"0 0\"/><link2 link=\"b\"/></loop_joint>",
       "<loop_joint> \"l\": <link1> has xyz=\"0 0\"; expected three finite numbers, such as \"0 0 0.5\"; correct it"},
      {"<loop_joint name=\"l\">" + ends + "<axis xyz=\"0 0 0\"/></loop_joint>",
       "<loop_joint> \"l\": its axis has no length; expected a direction, such as 0 0 1; say about or along which axis it moves"},
      {"<loop_joint name=\"l\">" + ends + "<axis xyz=\"0 0 1\" frame=\"moon\"/></loop_joint>",
       "<loop_joint> \"l\": <axis> has frame=\"moon\"; expected parent, child or joint; choose one"},
      {"<loop_joint name=\"l\"><parent link=\"a\"/><child link=\"b\"/><origin/><child_origin xyz=\"0 0 1\"/></loop_joint>",
       "<loop_joint> \"l\": <origin> beside the origins of its ends; expected one or the other; delete one"},
      {"<loop_joint name=\"l\"><link1 link=\"a\"/><link2 link=\"bare\"/></loop_joint>", "<loop_joint> \"l\": both of its links are parts of one body"},
      {"<loop_joint name=\"l\"><link1 link=\"world\"/><link2 link=\"root\"/></loop_joint>", "<loop_joint> \"l\": both of its links are fixed to the world"},
      {"<drake:ball_constraint><drake:ball_constraint_body_A name=\"a\"/></drake:ball_constraint>",
       "<drake:ball_constraint>: no <drake:ball_constraint_p_AP>; expected <drake:ball_constraint_p_AP> within it; add it"},
      {sdf("revolute", ""), "<joint> of <gazebo> \"l\": no <axis>; expected <axis> within it; add it"},
      {sdf("revolute", "<axis/>"), "<joint> of <gazebo> \"l\": no <xyz>; expected <xyz> within it; add it"},
      {sdf("ball", "<pose>1 2 3</pose>"), "<joint> of <gazebo> \"l\": <pose> holds \"1 2 3\"; expected 6 finite numbers; correct it"},
      {sdf("revolute2", ""), "<joint> of <gazebo> \"l\": type \"revolute2\" is not simulated; expected revolute, continuous, prismatic, ball, spherical, fixed, "
                             "universal or cylindrical; choose one of these"},
      {sdf("universal", "<axis><xyz>0 0 1</xyz></axis><axis2><xyz>0 1 1</xyz></axis2>"),
       "<joint> of <gazebo> \"l\": its two axes are not at right angles; expected axes at right angles; correct one"},
  };
  for (const auto& [xml, told] : wrong) {
    CAPTURE(xml);
    CHECK(told_of(pair_and(xml)) == Strings{"test.urdf:2: " + told + "; " + without});
    CHECK(parse_urdf(pair_and(xml), "test.urdf").couplings.empty());
  }
  CHECK_THROWS_WITH(parse_urdf(pair_and(wrong[0].first), "test.urdf", Base::fixed, Reading::strict), StartsWith("test.urdf:2: <loop_joint> \"l\": it names one"));
}

TEST_CASE("a loop that turns and has limits, damping or friction gets a coordinate with them") {
  const std::string ends = "<link1 link=\"a\"/><link2 link=\"b\"/>";
  const std::string same[] = {
      "<loop_joint name=\"l\">" + ends + "<limit lower=\"-1\" upper=\"0.5\" effort=\"4\" velocity=\"2\"/><dynamics damping=\"0.1\" friction=\"0.2\"/></loop_joint>",
      sdf("revolute", "<axis><xyz>0 0 1</xyz><limit><lower>-1</lower><upper>0.5</upper><effort>4</effort><velocity>2</velocity></limit>"
                      "<dynamics><damping>0.1</damping><friction>0.2</friction></dynamics></axis>")};
  for (const std::string& xml : same) {
    CAPTURE(xml);
    const Model model = parse_urdf(pair_and(xml), "test.urdf");
    CHECK(told_of(pair_and(xml)).empty());
    REQUIRE(model.couplings.size() == 1);
    CHECK(model.couplings[0].kind == CouplingKind::weld);
    REQUIRE(model.names.slot_of_joint.contains("l"));
    const Index row = model.tree.first_v(model.names.slot_of_joint.at("l"));
    CHECK(model.attributes.lower(row) == -1);
    CHECK(model.attributes.upper(row) == 0.5);
    CHECK(model.attributes.max_effort(row) == 4);
    CHECK(model.attributes.max_velocity(row) == 2);
    CHECK(model.attributes.damping(row) == 0.1);
    CHECK(model.attributes.friction(row) == 0.2);
  }
  // nothing to tell, and nothing to keep
  const Model plain = parse_urdf(pair_and("<loop_joint name=\"l\">" + ends + "<limit effort=\"4\" velocity=\"2\"/></loop_joint>"), "test.urdf");
  CHECK(plain.couplings.at(0).kind == CouplingKind::hinge);
  // a name that a joint has already: closed without
  const std::string twice = "<loop_joint name=\"k\">" + ends + "<limit lower=\"-1\"/></loop_joint>";
  CHECK(parse_urdf(pair_and(twice), "test.urdf").couplings.at(0).kind == CouplingKind::hinge);
  REQUIRE(told_of(pair_and(twice)).size() == 1);
  CHECK_THAT(told_of(pair_and(twice))[0], EndsWith("its limits, damping and friction are not used"));
}

TEST_CASE("what a loop says beside its place is told") {
  const std::string ends = "<link1 link=\"a\"/><link2 link=\"b\"/>", l = "test.urdf:2: <loop_joint> \"l\": ", g = "test.urdf:2: <joint> of <gazebo> \"l\": ";
  const std::pair<std::string, Strings> told[] = {
      {"<loop_joint name=\"l\">" + ends + "<limit lower=\"-1\" soft=\"1\"/></loop_joint>", {l + "<limit> has soft=\"1\", which is not used"}},
      {"<loop_joint name=\"l\" type=\"ball\">" + ends + "<limit lower=\"0\"/></loop_joint>", {l + "limits, damping and friction are not used of a ball"}},
      {"<loop_joint name=\"l\" colour=\"red\">" + ends + "</loop_joint>", {l + "<loop_joint> has colour=\"red\", which is not used"}},
      {"<loop_joint name=\"l\">" + ends + "<axis xyz=\"0 0 1\"/><axis xyz=\"0 1 0\"/></loop_joint>",
       {l + "<axis> within <loop_joint> is there again; not used"}},
      {"<loop_joint name=\"l\">" + ends + "0 0 1</loop_joint>", {l + "the text \"0 0 1\" within <loop_joint> is not read"}},
      {"<loop_joint name=\"l\" type=\"ball\">" + ends + "<axis xyz=\"0 0 1\"/></loop_joint>", {l + "its <axis> is not used by a ball"}},
      {sdf("revolute", "<axis><xyz>0 0 1</xyz><limit><lower>-1e+16</lower><upper>1e+16</upper></limit>"
                       "<dynamics><spring_reference>0</spring_reference><spring_stiffness>0</spring_stiffness></dynamics></axis>"),
       {}},
      {sdf("revolute", "<axis><xyz>0 0 1</xyz><limit><lower>-1</lower></limit><dynamics><damping>0.1</damping></dynamics></axis><physics/>"),
       {g + "<physics> within <joint> is not used"}},
      {sdf("revolute", "<axis><xyz>0 0 1</xyz><dynamics><spring_stiffness>3</spring_stiffness></dynamics></axis>"),
       {g + "<spring_stiffness> within <dynamics> is not used"}},
      {"<gazebo><plugin/><joint name=\"l\" type=\"ball\"><parent>a</parent><child>b</child></joint></gazebo>",
       {"test.urdf:2: known but not simulated: 1 <gazebo>; other programs read them"}},
  };
  for (const auto& [xml, warnings] : told) {
    CAPTURE(xml);
    CHECK(told_of(pair_and(xml)) == warnings);
    CHECK(parse_urdf(pair_and(xml), "test.urdf").couplings.size() == 1);
  }
  CHECK(told_of(pair_and("<drake:tendon_constraint/>")) ==
        Strings{"test.urdf:2: known but not simulated: <drake:tendon_constraint>; the robot moves as if it were not there"});
  CHECK_THAT(told_of(pair_and("<loop_joint><xacro:x/></loop_joint>")).front(), Contains(" macro "));
}

TEST_CASE("nothing of a loop is misspelled, repeated or added in silence") {
  const std::string loops = R"(<loop_joint name="l" type="revolute">
    <link1 link="a" xyz="0 0 1" rpy="0 0 1"/><link2 link="b" xyz="0 0 1" rpy="0 0 1"/><axis xyz="0 0 1" frame="joint"/>
  </loop_joint>
  <loop_joint name="m" type="fixed">
    <parent link="a"/><child link="b"/><parent_origin xyz="0 0 1" rpy="0 0 1"/><child_origin xyz="0 0 1" rpy="0 0 1"/>
  </loop_joint>
  <loop_joint name="n" type="fixed"><parent link="a"/><child link="b"/><origin xyz="0 0 1" rpy="0 0 1"/></loop_joint>
  <loop name="o" type="ball">
    <predecessor link="a"><origin xyz="0 0 1" rpy="0 0 1"/></predecessor><successor link="b"/><successor_origin xyz="0 0 1" rpy="0 0 1"/>
  </loop>
  <drake:ball_constraint>
    <drake:ball_constraint_body_A name="a"/><drake:ball_constraint_body_B name="b"/>
    <drake:ball_constraint_p_AP value="0 0 1"/><drake:ball_constraint_p_BQ value="0 0 1"/>
  </drake:ball_constraint>
  <drake:linear_spring_damper>
    <drake:linear_spring_damper_body_A name="a"/><drake:linear_spring_damper_body_B name="b"/>
    <drake:linear_spring_damper_p_AP value="0 0 1"/><drake:linear_spring_damper_p_BQ value="0 0 1"/>
    <drake:linear_spring_damper_free_length value="2"/><drake:linear_spring_damper_stiffness value="3"/><drake:linear_spring_damper_damping value="0.5"/>
  </drake:linear_spring_damper>
  <frame name="f" link="b" xyz="0 0 1" rpy="0 0 1"/>
  <drake:linear_bushing_rpy>
    <drake:bushing_frameA name="a"/><drake:bushing_frameC name="f"/>
    <drake:bushing_torque_stiffness value="1 2 3"/><drake:bushing_torque_damping value="4 5 6"/>
    <drake:bushing_force_stiffness value="7 8 9"/><drake:bushing_force_damping value="10 11 12"/>
  </drake:linear_bushing_rpy>
  <gazebo>
    <joint name="p" type="universal">
      <parent>a</parent><child>b</child><pose relative_to="a" degrees="false">0 0 1 0 0 1</pose>
      <axis><xyz expressed_in="b">0 0 1</xyz><use_parent_model_frame>0</use_parent_model_frame></axis>
      <axis2><xyz expressed_in="b">0 1 0</xyz></axis2>
    </joint>
  </gazebo>)";
  REQUIRE(told_of(pair_and(loops)) == Strings{});
  REQUIRE(parse_urdf(pair_and(loops), "test.urdf").couplings.size() == 8);
  tinyxml2::XMLDocument document;
  REQUIRE(document.Parse(robot(loops).c_str()) == tinyxml2::XML_SUCCESS);
  std::vector<tinyxml2::XMLElement*> elements{document.RootElement()};
  for (std::size_t k = 0; k < elements.size(); ++k) {
    for (auto* child = elements[k]->FirstChildElement(); child; child = child->NextSiblingElement()) elements.push_back(child);
  }
  REQUIRE(elements.size() > 30);
  const auto told = [&] {
    std::string text;
    for (const auto* element = document.RootElement()->FirstChildElement(); element; element = element->NextSiblingElement()) {
      tinyxml2::XMLPrinter printer(nullptr, true);
      element->Accept(&printer);
      text += printer.CStr();
    }
    return !told_of(pair_and(text)).empty();
  };
  for (auto* element : elements) {
    if (element == document.RootElement()) continue;
    const std::string name = element->Name();
    CAPTURE(name);
    element->SetName((name + "x").c_str());
    CHECK(told());
    element->SetName(name.c_str());
    auto* added = document.NewElement("zzz");
    element->InsertEndChild(added);
    CHECK(told());
    element->DeleteChild(added);
    if (name == "gazebo") continue;
    element->SetAttribute("zzz", "1");
    CHECK(told());
    element->DeleteAttribute("zzz");
    auto* text = document.NewText(" 7 ");
    element->InsertEndChild(text);
    CHECK(told());
    element->DeleteChild(text);
    if (name == "drake:ball_constraint" || name == "drake:linear_spring_damper" || name == "drake:linear_bushing_rpy") continue;  // two of them are two
    auto* again = element->Parent()->InsertAfterChild(element, element->DeepClone(&document));
    CHECK(told());
    element->Parent()->DeleteChild(again);
  }
}

TEST_CASE("a spring and damper of Drake is one between two points") {
  const auto spring = [](const std::string& length, const std::string& stiffness, const std::string& damping) {
    const auto part = [](const char* name, const std::string& says) { return fmt::format("<drake:linear_spring_damper_{} {}/>", name, says); };
    return "<drake:linear_spring_damper>" + part("body_A", "name=\"a\"") + part("p_AP", "value=\"0.1 0.2 0.3\"") + part("body_B", "name=\"world\"") +
           part("p_BQ", "value=\"1 0 0\"") + part("free_length", "value=\"" + length + "\"") + part("stiffness", "value=\"" + stiffness + "\"") +
           part("damping", "value=\"" + damping + "\"") + "</drake:linear_spring_damper>";
  };
  const Model model = parse_urdf(pair_and(spring("2", "30", "0.5")), "test.urdf");
  REQUIRE(model.couplings.size() == 1);
  const Coupling& found = model.couplings[0];
  CHECK(model.warnings.empty());
  CHECK(found.name == "spring of a and world");
  CHECK(found.kind == CouplingKind::rod);
  CHECK(found.length == 2);
  CHECK(found.shift[0].stiffness == 30);
  CHECK(found.shift[0].damping == 0.5);
  CHECK(found.frame_b.shift[0] == 1);
  for (const std::string& wrong : {spring("0", "30", "1"), spring("2", "-1", "1"), spring("2", "0", "0"), spring("2", "x", "0")}) {
    CHECK(told_of(pair_and(wrong)).size() == 1);
    CHECK(parse_urdf(pair_and(wrong), "test.urdf").couplings.empty());
  }
}

TEST_CASE("a bushing of Drake is one between two frames, each of the robot's or of a link") {
  const auto bushing = [](const std::string& a, const std::string& c, const std::string& numbers) {
    return "<frame name=\"fa\" link=\"a\" xyz=\"0.1 0.2 0.3\" rpy=\"0.4 0.5 0.6\"/><frame name=\"unused\" link=\"b\"/><drake:linear_bushing_rpy><drake:bushing_frameA name=\"" + a +
           "\"/><drake:bushing_frameC name=\"" + c + "\"/>" + numbers + "</drake:linear_bushing_rpy>";
  };
  const auto number = [](const char* name, const char* value) { return fmt::format("<drake:bushing_{} value=\"{}\"/>", name, value); };
  const std::string some = number("torque_stiffness", "1 2 3") + number("torque_damping", "4 5 6") + number("force_stiffness", "7 8 0") + number("force_damping", "10 11 0");
  const Model model = parse_urdf(pair_and(bushing("fa", "b", some)), "test.urdf");
  CHECK(model.warnings == Strings{"test.urdf:2: known but not simulated: 1 <frame>; other programs read them"});
  REQUIRE(model.couplings.size() == 1);
  const Coupling& found = model.couplings[0];
  CHECK(found.name == "bushing of a and b");
  CHECK(found.kind == CouplingKind::bushing);
  CHECK(found.turn == Compliances{Compliance{1, 4}, {2, 5}, {3, 6}});
  CHECK(found.shift == Compliances{Compliance{7, 10}, {8, 11}, {0, 0}});
  CHECK(rows_of(found).size() == 5);
  const Ends ends = ends_of(model, found);
  CHECK(ends.a.isApprox(kA * at({0.1, 0.2, 0.3}, 0.4, 0.5, 0.6), 1e-14));
  CHECK(ends.b.isApprox(kB, 1e-14));
  CHECK(parse_urdf(pair_and(bushing("world", "fa", number("force_stiffness", "1 0 0"))), "test.urdf").couplings.at(0).slot_a == 0);
  const std::pair<std::string, std::string> wrong[] = {
      {bushing("fa", "fc", some), "link \"fc\" does not exist"},
      {bushing("fa", "b", number("torque_stiffness", "0 0 0")), "it neither pulls nor damps"},
      {bushing("fa", "b", number("torque_stiffness", "1 -1 0")), "<drake:bushing_torque_stiffness> has a number below zero"},
      {bushing("fa", "b", number("torque_stiffness", "1 2")), "<drake:bushing_torque_stiffness> has value=\"1 2\""},
  };
  for (const auto& [xml, told] : wrong) {
    CAPTURE(told);
    const Strings all = told_of(pair_and(xml));
    REQUIRE(all.size() == 2);
    CHECK_THAT(all[0] + all[1], Contains("<drake:linear_bushing_rpy>: " + told));
    CHECK(parse_urdf(pair_and(xml), "test.urdf").couplings.empty());
  }
}

TEST_CASE("a link under two joints is told how a loop is written") {
  CHECK_THAT(told_of(pair_and(joint("m", "continuous", "a", "b"))).front(), Contains("make it a <loop_joint>, which closes a loop"));
}

TEST_CASE("no robot at hand has loops that its file does not say") {
  for (const std::string& file : robot_files()) {
    CAPTURE(file);
    std::ifstream text(file);
    std::size_t said = 0;
    for (std::string line; std::getline(text, line);) said += line.find("<loop_joint name=") != line.npos ? 1 : 0;
    CHECK(load_urdf(file).couplings.size() == said);
  }
}

}  // namespace linden::urdf_loops_test

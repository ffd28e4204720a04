#include "models/urdf/urdf.hpp"

#include <console_bridge/console.h>
#include <fmt/format.h>
#include <pthread.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <clocale>
#include <filesystem>
#include <fstream>
#include <limits>
#include <locale>
#include <map>
#include <thread>

#include "models/build/builder.hpp"
#include "models/build/isometry.hpp"
#include "tests/layout/robots.hpp"
#include "tests/reference/urdf_plain.hpp"

namespace linden::urdf_test {
using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;
using reference::PlainLink;
using reference::PlainRobot;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

Eigen::Matrix3d cross(const Eigen::Vector3d& v) {
  Eigen::Matrix3d result;
  result << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return result;
}

/// Composite inertia of all moving bodies about the world's origin, by congruence with the adjoint of each pose.
Matrix6d composite_inertia(const Model& model) {
  Matrix6d sum = Matrix6d::Zero();
  for (Index i = 1; i < model.tree.shape.slots; ++i) {
    const auto g = [&](int k) { return model.constants.inertia(i, k); };
    Eigen::Matrix3d about_origin;
    about_origin << g(4), g(5), g(6), g(5), g(7), g(8), g(6), g(8), g(9);
    const Eigen::Matrix3d moment = cross({g(1), g(2), g(3)});
    Matrix6d body;
    body << about_origin, moment, moment.transpose(), g(0) * Eigen::Matrix3d::Identity();
    const Eigen::Matrix4d pose = body_pose(model, i);
    const Eigen::Matrix3d turn_back = pose.topLeftCorner<3, 3>().transpose();
    Matrix6d to_body;
    to_body << turn_back, Eigen::Matrix3d::Zero(), -turn_back * cross(pose.topRightCorner<3, 1>()), turn_back;
    sum += to_body.transpose() * body * to_body;
  }
  return sum;
}

void require_close(const Eigen::MatrixXd& found, const Eigen::MatrixXd& expected) {
  CAPTURE(found, expected);
  REQUIRE((found - expected).norm() <= 1e-12 * expected.norm());
}

std::string text(std::initializer_list<std::string> lines) {
  std::string result;
  for (const std::string& line : lines) result += line + "\n";
  return result;
}

const std::string kLimit = R"(<limit lower="-1" upper="2" velocity="3" effort="4"/>)";

/// Two links and the joint "j" between them.
std::string pair_with(const std::string& type, const std::string& more) {
  return robot(link("a") + link("b") + joint("j", type, "a", "b", more));
}

Model parse(const std::string& xml, Base base = Base::fixed) { return parse_urdf(xml, "test.urdf", base); }

std::string message_of(const std::string& xml) {
  try {
    parse(xml);
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

bool warns(const Model& model, const std::string& words) {
  return std::any_of(model.warnings.begin(), model.warnings.end(),
                     [&](const std::string& warning) { return warning.find(words) != std::string::npos; });
}

/// Row of a coordinate in arrays of velocities.
Index velocity_row(const Model& model, const std::string& name) {
  const auto& names = model.names.velocity;
  const auto found = std::find(names.begin(), names.end(), name);
  INFO("no coordinate " << name);
  REQUIRE(found != names.end());
  return static_cast<Index>(found - names.begin());
}

/// Hears all that console_bridge says while it lives, debugging messages too.
struct Ear : console_bridge::OutputHandler {
  Ear() { console_bridge::useOutputHandler(this); }
  ~Ear() override {
    console_bridge::useOutputHandler(before);
    console_bridge::setLogLevel(level);
  }
  Ear(const Ear&) = delete;
  Ear& operator=(const Ear&) = delete;
  void log(const std::string& text, console_bridge::LogLevel, const char*, int) override { heard.push_back(text); }

  console_bridge::OutputHandler* before = console_bridge::getOutputHandler();
  console_bridge::LogLevel level = [] {
    const console_bridge::LogLevel current = console_bridge::getLogLevel();
    console_bridge::setLogLevel(console_bridge::CONSOLE_BRIDGE_LOG_DEBUG);
    return current;
  }();
  std::vector<std::string> heard;
};

std::string chain_of(int links) {
  std::string xml = "<robot name=\"chain\">\n";
  const std::string inertial =
      "<inertial><origin xyz=\"0 0 0.1\"/><mass value=\"1\"/>"
      "<inertia ixx=\"0.1\" iyy=\"0.1\" izz=\"0.1\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial>";
  for (int i = 0; i <= links; ++i) xml += fmt::format("<link name=\"link_{}\">{}</link>\n", i, inertial);
  for (int i = 1; i <= links; ++i) {
    xml += joint(fmt::format("joint_{}", i), "continuous", fmt::format("link_{}", i - 1), fmt::format("link_{}", i),
                 "<origin xyz=\"0 0 0.2\"/><axis xyz=\"0 1 0\"/>") +
           "\n";
  }
  return xml + "</robot>\n";
}

}  // namespace

TEST_CASE("every robot loads with the mass, centre of mass, inertia and DOF count that its XML says") {
  for (const std::string& file : robot_files()) {
    const PlainRobot plain(file);
    for (const Base base : {Base::fixed, Base::floating}) {
      CAPTURE(file, static_cast<int>(base));
      const Model model = load_urdf(file, base);
      const Matrix6d expected = plain.composite_inertia(base == Base::fixed);
      require_close(composite_inertia(model), expected);
      const double mass = expected(5, 5);
      require_close(Eigen::VectorXd::Constant(1, model.constants.subtree_mass(0)), Eigen::VectorXd::Constant(1, mass));
      const Eigen::Matrix3d center = composite_inertia(model).topRightCorner<3, 3>() / model.constants.subtree_mass(0);
      require_close(center, expected.topRightCorner<3, 3>() / mass);
      REQUIRE(model.degrees_of_freedom() == plain.degrees_of_freedom() + (base == Base::floating ? 6 : 0));
    }
  }
}

TEST_CASE("every link of every robot stands where its XML places it, and every joint keeps its axis") {
  for (const std::string& file : robot_files()) {
    const PlainRobot plain(file);
    for (const Base base : {Base::fixed, Base::floating}) {
      const Model model = load_urdf(file, base);
      REQUIRE(model.names.link.size() == plain.links.size());
      for (const auto& [name, link] : plain.links) {
        CAPTURE(file, static_cast<int>(base), name);
        const LinkPlace& place = model.names.link.at(name);
        const Eigen::Matrix4d expected = plain.pose(name);
        REQUIRE((body_pose(model, place.slot) * isometry(place.in_body).matrix() - expected).norm() < 1e-12);
        if (link.type != "revolute" && link.type != "continuous" && link.type != "prismatic") continue;
        const Index slot = model.names.slot_of_joint.at(link.joint);
        REQUIRE(slot == place.slot);
        REQUIRE(model.constants.screw(slot, 0) == (link.type == "prismatic" ? 0 : 1));
        REQUIRE(model.constants.screw(slot, 1) == (link.type == "prismatic" ? 1 : 0));
        const Eigen::Vector3d axis = expected.topLeftCorner<3, 3>() * link.axis.normalized();
        REQUIRE((body_pose(model, slot).block<3, 1>(0, 2) - axis).norm() < 1e-12);
      }
    }
  }
}

TEST_CASE("every joint of every robot keeps its limits, damping and friction") {
  for (const std::string& file : robot_files()) {
    const PlainRobot plain(file);
    const Model model = load_urdf(file);
    for (const auto& [name, link] : plain.links) {
      if (link.type != "revolute" && link.type != "continuous" && link.type != "prismatic") continue;
      CAPTURE(file, link.joint);
      const auto value = [](const std::map<std::string, double>& values, const char* key, double otherwise) {
        return values.count(key) > 0 ? values.at(key) : otherwise;
      };
      const Index row = velocity_row(model, link.joint);
      const bool limited =
          link.type != "continuous" && (link.limit.count("lower") > 0 || link.limit.count("upper") > 0);
      REQUIRE(model.attributes.lower(row) == (limited ? value(link.limit, "lower", 0) : -kInfinity));
      REQUIRE(model.attributes.upper(row) == (limited ? value(link.limit, "upper", 0) : kInfinity));
      REQUIRE(model.attributes.max_effort(row) == value(link.limit, "effort", kInfinity));
      REQUIRE(model.attributes.max_velocity(row) == value(link.limit, "velocity", kInfinity));
      REQUIRE(model.attributes.damping(row) == value(link.dynamics, "damping", 0));
      REQUIRE(model.attributes.friction(row) == value(link.dynamics, "friction", 0));
    }
  }
}

TEST_CASE("the mimic joints of pr2, talos and panda follow their leaders") {
  for (const auto& [name, count] :
       {std::pair("pr2.urdf", 10), std::pair("talos.urdf", 12), std::pair("panda.urdf", 1)}) {
    const std::string file = real_robot(name);
    if (file.empty()) continue;
    CAPTURE(file);
    const Model model = load_urdf(file);
    REQUIRE(model.mimics.size() == static_cast<std::size_t>(count));
    std::map<std::string, Mimic> by_follower;
    for (const Mimic& mimic : model.mimics)
      by_follower[model.names.velocity[static_cast<std::size_t>(mimic.follower_v)]] = mimic;
    for (const auto& [link_name, link] : PlainRobot(file).links) {
      if (!link.mimics) continue;
      CAPTURE(link.joint);
      const Mimic& mimic = by_follower.at(link.joint);
      REQUIRE(model.names.joint[static_cast<std::size_t>(mimic.follower_slot)] == link.joint);
      REQUIRE(model.names.joint[static_cast<std::size_t>(mimic.leader_slot)] == link.leader);
      REQUIRE(model.names.velocity[static_cast<std::size_t>(mimic.leader_v)] == link.leader);
      REQUIRE(mimic.multiplier == link.multiplier);
      REQUIRE(mimic.offset == link.offset);
    }
  }
}

TEST_CASE("each joint type of URDF becomes the joint that it describes") {
  const auto velocities = [](const std::string& type) {
    return parse(pair_with(type, kLimit + "<axis xyz=\"0 0 2\"/>")).names.velocity;
  };
  using Strings = std::vector<std::string>;
  REQUIRE(velocities("revolute") == Strings{"j"});
  REQUIRE(velocities("continuous") == Strings{"j"});
  REQUIRE(velocities("prismatic") == Strings{"j"});
  REQUIRE(velocities("planar").size() == 3);
  REQUIRE(velocities("floating") == Strings{"j.wx", "j.wy", "j.wz", "j.vx", "j.vy", "j.vz"});
  REQUIRE_THAT(message_of(pair_with("fixed", "")), Contains("nothing moves"));
  const Model free = parse(pair_with("floating", kLimit));
  REQUIRE(free.attributes.upper(0) == kInfinity);
  const Model planar = parse(pair_with("planar", "<axis xyz=\"0 1 0\"/>"));
  REQUIRE((body_pose(planar, 3).block<3, 1>(0, 2) - Eigen::Vector3d::UnitY()).norm() < 1e-15);
}

TEST_CASE("a joint without an axis turns about x") {
  const Model model = parse(pair_with("continuous", ""));
  REQUIRE((body_pose(model, 1).block<3, 1>(0, 2) - Eigen::Vector3d::UnitX()).norm() < 1e-15);
}

TEST_CASE("an inertia given in turned axes is turned into the link's") {
  const std::string turned =
      R"(<link name="b"><inertial><origin xyz="1 0 0" rpy="0 0 1.5707963267948966"/><mass value="2"/>
    <inertia ixx="3" iyy="4" izz="5" ixy="0" ixz="0" iyz="0"/></inertial></link>)";
  const Model model = parse(robot(link("a") + turned + joint("j", "floating", "a", "b")));
  const double expected[10] = {2, 2, 0, 0, 4, 0, 0, 3 + 2, 0, 5 + 2};
  for (int k = 0; k < 10; ++k) REQUIRE(model.constants.inertia(1, k) == Approx(expected[k]).margin(1e-15));
}

TEST_CASE("the base is fixed, or floats on a free joint called base") {
  const std::string xml = pair_with("revolute", kLimit);
  const Model fixed = parse(xml);
  REQUIRE(fixed.names.joint == std::vector<std::string>{"", "j"});
  REQUIRE(fixed.names.link.at("a").slot == 0);
  const Model floating = parse(xml, Base::floating);
  REQUIRE(floating.names.joint == std::vector<std::string>{"", "base", "j"});
  REQUIRE(floating.tree.kind(1) == JointKind::free);
  REQUIRE(floating.names.link.at("a").slot == 1);
  REQUIRE(floating.names.position.front() == "base.x");
}

TEST_CASE("a base of floating makes a massless root move with what is fixed to it") {
  const Model model = parse(robot("<link name=\"base_link\"/>" + link("a") + link("b") +
                                  joint("weld", "fixed", "base_link", "a", "<origin xyz=\"0 0 1\"/>") +
                                  joint("j", "revolute", "a", "b", kLimit)),
                            Base::floating);
  REQUIRE(model.names.body[1] == "base_link");
  REQUIRE(model.constants.inertia(1, 0) == 2);
  REQUIRE(model.constants.inertia(1, 3) == 2);
  REQUIRE(model.degrees_of_freedom() == 7);
}

TEST_CASE("a floating joint that the file declares is the only free joint, with either base") {
  const std::string direct =
      robot("<link name=\"world\"/>" + link("a") + link("b") + joint("floating_base_joint", "floating", "world", "a") +
            joint("j", "revolute", "a", "b", kLimit));
  const std::string behind_welds =
      robot("<link name=\"world\"/><link name=\"stand\"/>" + link("a") + link("b") +
            joint("weld", "fixed", "world", "stand", "<origin xyz=\"0 0 3\"/>") +
            joint("floating_base_joint", "floating", "stand", "a") + joint("j", "revolute", "a", "b", kLimit));
  for (const std::string& xml : {direct, behind_welds}) {
    for (const Base base : {Base::fixed, Base::floating}) {
      const Model model = parse(xml, base);
      REQUIRE(model.names.joint == std::vector<std::string>{"", "floating_base_joint", "j"});
      REQUIRE(model.names.link.at("world").slot == 0);
    }
  }
}

TEST_CASE("several robots float side by side under a massless root") {
  const std::string xml = robot("<link name=\"world\"/>" + link("a") + link("b") +
                                joint("ja", "floating", "world", "a") + joint("jb", "floating", "world", "b"));
  REQUIRE(parse(xml, Base::floating).degrees_of_freedom() == 12);
}

TEST_CASE("a root with mass, or with another joint beside the floating one, floats by itself") {
  const std::string heavy = robot(link("ship") + link("a") + joint("leash", "floating", "ship", "a"));
  REQUIRE(parse(heavy, Base::floating).degrees_of_freedom() == 12);
  REQUIRE(parse(heavy, Base::fixed).degrees_of_freedom() == 6);
  const std::string mixed = robot("<link name=\"hub\"/>" + link("a") + link("b") +
                                  joint("leash", "floating", "hub", "a") + joint("arm", "fixed", "hub", "b"));
  REQUIRE(parse(mixed, Base::floating).degrees_of_freedom() == 12);
}

TEST_CASE("g1's floating joint, once uncommented, is honoured") {
  const std::string file = real_robot("g1_29dof.urdf");
  if (file.empty()) return;
  std::ifstream stream(file);
  std::string xml{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  const std::size_t begin = xml.find("<!-- <link name=\"world\">"), end = xml.find("</joint> -->");
  REQUIRE(begin < end);
  REQUIRE(end < xml.size());
  xml.replace(end, 12, "</joint>");
  xml.replace(begin, 5, "");
  const Model model = parse(xml, Base::floating);
  REQUIRE(model.names.joint[1] == "floating_base_joint");
  REQUIRE(model.degrees_of_freedom() == 35);
}

TEST_CASE("a joint of the file called base keeps its name, and the free joint gets another") {
  const Model model = parse(robot(link("a") + link("b") + joint("base", "revolute", "a", "b", kLimit)), Base::floating);
  REQUIRE(model.names.joint == std::vector<std::string>{"", "base_", "base"});
}

TEST_CASE("joints of one level keep the order of the file") {
  const Model model =
      parse(robot(link("root") + link("z") + link("a") + link("m") + joint("last", "continuous", "root", "z") +
                  joint("first", "continuous", "root", "a") + joint("middle", "continuous", "root", "m")));
  REQUIRE(model.names.velocity == std::vector<std::string>{"last", "first", "middle"});
}

TEST_CASE("limits that are missing are infinite") {
  const auto limits = [](const Model& model) {
    const Attributes& a = model.attributes;
    return std::array{a.lower(0), a.upper(0), a.max_velocity(0), a.max_effort(0)};
  };
  const std::array none{-kInfinity, kInfinity, kInfinity, kInfinity};
  for (const char* type : {"revolute", "prismatic"}) {
    CAPTURE(type);
    const Model without = parse(pair_with(type, ""));
    REQUIRE(limits(without) == none);
    REQUIRE(warns(without, fmt::format("test.urdf:1: joint \"j\" is {} and has no limits; read as unlimited", type)));
    const Model only_rates = parse(pair_with(type, R"(<limit velocity="3" effort="4"/>)"));
    REQUIRE(limits(only_rates) == std::array{-kInfinity, kInfinity, 3.0, 4.0});
    REQUIRE(only_rates.warnings.size() == 1);
    const Model no_rates = parse(pair_with(type, R"(<limit lower="-1" upper="2"/>)"));
    REQUIRE(limits(no_rates) == std::array{-1.0, 2.0, kInfinity, kInfinity});
    REQUIRE(no_rates.warnings.empty());
    const Model whole = parse(pair_with(type, kLimit));
    REQUIRE(limits(whole) == std::array{-1.0, 2.0, 3.0, 4.0});
    REQUIRE(whole.warnings.empty());
  }
  const Model continuous = parse(pair_with("continuous", kLimit));
  REQUIRE(limits(continuous) == std::array{-kInfinity, kInfinity, 3.0, 4.0});
  REQUIRE(warns(continuous, "test.urdf:1: joint \"j\" is continuous: its lower and upper limits are not used"));
  REQUIRE(warns(parse(pair_with("floating", kLimit)), "joint \"j\" is floating: its <limit> is not used"));
  REQUIRE(parse(pair_with("continuous", "")).warnings.empty());
}

TEST_CASE("limits that are half given or odd are read with a warning") {
  const Model upper_only = parse(pair_with("prismatic", R"(<limit upper="0.5"/>)"));
  REQUIRE(upper_only.attributes.lower(0) == 0);
  REQUIRE(upper_only.attributes.upper(0) == 0.5);
  REQUIRE(warns(upper_only, "no lower limit; read as 0"));
  REQUIRE(warns(parse(pair_with("revolute", R"(<limit lower="0" upper="0"/>)")), "lock it"));
  const Model negative = parse(pair_with("revolute", R"(<limit lower="0" upper="1" effort="-1" velocity="-2"/>)"));
  REQUIRE(negative.attributes.max_effort(0) == kInfinity);
  REQUIRE(negative.attributes.max_velocity(0) == kInfinity);
  REQUIRE(warns(negative, "its effort limit is -1; read as unlimited"));
  const Model infinite = parse(pair_with("revolute", R"(<limit lower="-inf" upper="+Infinity" effort="inf" velocity="2"/>)"));
  REQUIRE(infinite.attributes.lower(0) == -kInfinity);
  REQUIRE(infinite.attributes.upper(0) == kInfinity);
  REQUIRE(infinite.attributes.max_effort(0) == kInfinity);
  REQUIRE(infinite.attributes.max_velocity(0) == 2);
  REQUIRE(infinite.warnings ==
          std::vector<std::string>{"test.urdf:1: joint \"j\": its <limit> is infinite in lower, upper, effort; read as unlimited"});
  for (const char* limit : {R"(<limit lower="1" upper="-1"/>)", R"(<limit lower="1"/>)", R"(<limit lower="inf" upper="2"/>)"}) {
    CAPTURE(limit);
    const Model exchanged = parse(pair_with("revolute", limit));
    REQUIRE(exchanged.attributes.lower(0) == -kInfinity);
    REQUIRE(exchanged.attributes.upper(0) == kInfinity);
    REQUIRE(warns(exchanged, "test.urdf:1: joint \"j\": its lower limit "));
    REQUIRE(warns(exchanged, "; read as unlimited"));
  }
}

TEST_CASE("products of inertia that are missing are zero, with a warning") {
  const std::string bare =
      R"(<link name="b"><inertial><mass value="1"/><inertia ixx="1" iyy="2" izz="2"/></inertial></link>)";
  const Model model = parse(robot(link("a") + bare + joint("j", "floating", "a", "b")));
  REQUIRE(model.constants.inertia(1, 9) == 2);
  REQUIRE(model.constants.inertia(1, 5) == 0);
  REQUIRE(warns(model, "link \"b\": <inertia> has no ixy; read as 0"));
}

TEST_CASE("a mimic of a joint that is fixed is ignored with a warning") {
  const Model model = parse(robot(link("a") + link("b") + link("c") + joint("j", "continuous", "a", "b") +
                                  joint("k", "fixed", "b", "c", "<mimic joint=\"j\"/>")));
  REQUIRE(model.mimics.empty());
  REQUIRE(warns(model, "joint \"k\" is fixed and has a <mimic>"));
}

TEST_CASE("a mimic that follows a follower follows its leader") {
  const Model model =
      parse(robot(link("a") + link("b") + link("c") + link("d") + joint("j", "continuous", "a", "b") +
                  joint("k", "continuous", "b", "c", R"(<mimic joint="j" multiplier="2" offset="0.5"/>)") +
                  joint("l", "continuous", "c", "d", R"(<mimic joint="k" multiplier="-3" offset="0.25"/>)")));
  REQUIRE(model.mimics.size() == 2);
  const auto last =
      std::find_if(model.mimics.begin(), model.mimics.end(), [&](const Mimic& m) { return m.follower_slot == 3; });
  REQUIRE(last != model.mimics.end());
  REQUIRE(last->leader_slot == 1);
  REQUIRE(last->multiplier == -6);
  REQUIRE(last->offset == 0.25 - 1.5);
}

TEST_CASE("numbers may have plus signs, exponents, tabs, line ends and spaces about them") {
  const Model model =
      parse(pair_with("continuous", "<origin xyz=\" +1.5\t2e-1 \n -.5 \" rpy=\"0  0   0\"/><axis xyz=\"0\t0 1.\"/>"));
  const Eigen::Matrix4d pose = body_pose(model, 1);
  REQUIRE(pose(0, 3) == 1.5);
  REQUIRE(pose(1, 3) == 0.2);
  REQUIRE(pose(2, 3) == -0.5);
}

TEST_CASE("numbers are read with a decimal point in every locale") {
  struct Comma : std::numpunct<char> {
    char do_decimal_point() const override { return ','; }
    char do_thousands_sep() const override { return '.'; }
    std::string do_grouping() const override { return "\3"; }
  };
  const std::string xml = pair_with("continuous", "<origin xyz=\"1234.5 0.25 0\"/>");
  const std::string bad = pair_with("continuous", "<origin xyz=\"1,5 0 0\"/>");
  const std::string c_before = std::setlocale(LC_NUMERIC, nullptr);
  const std::locale before = std::locale::global(std::locale(std::locale::classic(), new Comma));
  for (const char* german : {"de_DE.UTF-8", "de_DE.utf8", "de_DE", "German"}) {
    if (std::setlocale(LC_NUMERIC, german)) break;
  }
  const Model model = parse(xml);
  const std::string message = message_of(bad);
  std::locale::global(before);
  std::setlocale(LC_NUMERIC, c_before.c_str());
  REQUIRE(body_pose(model, 1)(0, 3) == 1234.5);
  REQUIRE(body_pose(model, 1)(1, 3) == 0.25);
  REQUIRE_THAT(message, Contains("three finite numbers"));
}

TEST_CASE("visuals and what else of URDF moves nothing are neither errors nor noise") {
  const Ear ear;
  const std::string xml = robot(
      "<material name=\"m\"><color rgba=\"none\"/></material>"
      "<link name=\"a\"><visual><geometry><sphere/></geometry><material name=\"m\"/></visual></link>" +
      link("b") + joint("j", "revolute", "a", "b", kLimit + "<safety_controller/><calibration rising=\"x\"/><dynamics/>"));
  REQUIRE(parse(xml).warnings.empty());
  REQUIRE_THAT(message_of("<robot name=\"r\"><link/></robot>"), Contains("without a name"));
  REQUIRE(console_bridge::getOutputHandler() == &ear);
  REQUIRE(ear.heard.empty());
}

TEST_CASE("percent signs, quotes and foreign letters in names are letters like others") {
  const std::string percent = "%s%n%d", quote = "5\" &lt;pipe&gt; &amp;", foreign = "Gelenk_\xC3\xA4";
  const Model model = parse(robot("<link name='" + percent + "'/>" + "<link name='" + quote + "'>" + kInertial +
                                  "</link>" + "<joint name='" + foreign + "' type='continuous'><parent link='" +
                                  percent + "'/><child link='" + quote + "'/></joint>"));
  REQUIRE(model.names.joint[1] == foreign);
  REQUIRE(model.names.body[1] == "5\" <pipe> &");
  REQUIRE(model.names.link.count(percent) == 1);
}

TEST_CASE("threads read robots at the same time") {
  const std::string xml = chain_of(50);
  const Ear ear;  // urdfdom talks all the time: a handler that is not put back is used after its end
  std::vector<std::uint64_t> hashes(8, 0);
  std::vector<std::thread> threads;
  for (std::uint64_t& hash : hashes) threads.emplace_back([&hash, &xml] { hash = parse(xml).hash(); });
  for (std::thread& thread : threads) thread.join();
  const std::uint64_t expected = parse(xml).hash();
  for (const std::uint64_t hash : hashes) REQUIRE(hash == expected);
  REQUIRE(console_bridge::getOutputHandler() == &ear);
  REQUIRE(ear.heard.empty());
}

TEST_CASE("a chain of 100,000 links loads in a stack of 512 kB") {
  struct Job {
    std::string xml = chain_of(100'000);
    Index bodies = 0;
    std::string error;
  } job;
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  REQUIRE(pthread_attr_setstacksize(&attributes, 512 * 1024) == 0);
  const auto run = [](void* argument) -> void* {
    Job& it = *static_cast<Job*>(argument);
    try {
      it.bodies = parse(it.xml).tree.bodies();
    } catch (const std::exception& error) {
      it.error = error.what();
    }
    return nullptr;
  };
  pthread_t thread;
  REQUIRE(pthread_create(&thread, &attributes, run, &job) == 0);
  pthread_join(thread, nullptr);
  pthread_attr_destroy(&attributes);
  REQUIRE(job.error == "");
  REQUIRE(job.bodies == 100'000);
}

TEST_CASE("a file that cannot be read is named, with what it is") {
  const auto message = [](const std::string& file) -> std::string {
    try {
      load_urdf(file);
    } catch (const InputError& error) {
      return error.what();
    }
    return "no error";
  };
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / fmt::format("linden_urdf_test_{}", getpid());
  std::filesystem::create_directories(folder);
  const std::string missing = (folder / "missing.urdf").string(), empty = (folder / "empty.urdf").string();
  const std::string good = (folder / "good.urdf").string();
  std::ofstream(empty).close();
  std::ofstream(good) << pair_with("continuous", "");
  CHECK(message(missing) == missing + ": there is no such file; expected a URDF file; check the path");
  CHECK(message(folder.string()) == folder.string() + ": this is a folder; expected a URDF file; name a file in it");
  CHECK_THAT(message(empty), StartsWith(empty + ":1: the file is empty; expected "));
  CHECK(message(good) == "no error");
  std::filesystem::remove_all(folder);
}

TEST_CASE("a bad file gets one message with its name, the line, what was found, what was expected and what to do") {
  struct Bad {
    const char* what;
    int line;
    const char* words;
    std::string xml;
  };
  const std::string head = "<robot name=\"r\">";
  const auto inertial = [&](const std::string& content) {
    return text({head, link("a"), "<link name=\"b\">", "<inertial>", content, "</inertial>", "</link>",
                 joint("j", "continuous", "a", "b"), "</robot>"});
  };
  const auto with_joint = [&](const std::string& type, const std::string& content) {
    return text({head, link("a"), link("b"), "<joint name=\"j\" type=\"" + type + "\">", "<parent link=\"a\"/>",
                 "<child link=\"b\"/>", content, "</joint>", "</robot>"});
  };
  const auto mimics = [&](const std::string& of_j, const std::string& of_k, const std::string& type_k = "continuous") {
    return text({head, link("a"), link("b"), link("c"), joint("j", "continuous", "a", "b", of_j),
                 joint("k", type_k, "b", "c", of_k), "</robot>"});
  };
  const std::string moments = R"(<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>)";
  const std::vector<Bad> table = {
      {"blank", 1, "the file is empty", "  \n \n"},
      {"plain text", 1, "not XML", "solid cube\nfacet normal 0 0 1\n"},
      {"binary", 1, "not XML",
       std::string("\x7f"
                   "ELF\x01\x00\x00<",
                   8)},
      {"open tag", 2, "the text is not XML: the element here is not closed by its own tag",
       text({head, "<link name=\"a\">", "</robot>"})},
      {"cut off", 1, "the text is not XML: the element here is never closed", text({head, "<link name=\"a\"/>"})},
      {"attribute twice", 2, "or is there twice", text({head, "<link name=\"a\" name=\"b\"/>", "</robot>"})},
      {"unquoted", 2, "the text is not XML: an attribute is not name=", text({head, "<link name=a/>", "</robot>"})},
      {"deep markup", 1, "the text is not XML: elements are nested more than 100 deep",
       [] {
         std::string deep;
         for (int i = 0; i < 200'000; ++i) deep += "<a>";
         return deep;
       }()},
      {"attributes without end", 3, "the element here has more than 200 attributes; expected an element of URDF",
       [] {
         std::string crowded = "<robot name=\"r\">\n<!-- \" -->\n<link ";
         for (int i = 0; i < 300'000; ++i) crowded += fmt::format("a{}='' ", i);
         return crowded + "/></robot>";
       }()},
      {"only a comment", 1, "holds no element", "<!-- nothing -->"},
      {"SDF", 2, "the outermost element is <sdf>", text({"<?xml version=\"1.0\"?>", "<sdf version=\"1.6\"/>"})},
      {"macros", 2, "expand the macros first: xacro test.urdf > out.urdf", text({head, "<xacro:include filename=\"x\"/>", "</robot>"})},
      {"no links", 2, "the robot has no link", "\n<robot name=\"r\"/>"},
      {"nameless link", 2, "a <link> without a name", text({head, "<link/>", "</robot>"})},
      {"empty joint name", 3, "a <joint> without a name", text({head, link("a"), "<joint name=\"\"/>", "</robot>"})},
      {"two links of one name", 3, "a second link is called \"a\", like the one in line 2",
       text({head, link("a"), link("a"), "</robot>"})},
      {"two joints of one name", 6, "a second joint is called \"j\", like the one in line 5",
       text({head, link("a"), link("b"), link("c"), joint("j", "fixed", "a", "b"), joint("j", "fixed", "b", "c"),
             "</robot>"})},
      {"no joint type", 4, "joint \"j\" has no type",
       text(
           {head, link("a"), link("b"), R"(<joint name="j"><parent link="a"/><child link="b"/></joint>)", "</robot>"})},
      {"joint type misspelt", 4,
       "joint \"j\" has type \"revolut\"; expected revolute, continuous, prismatic, fixed, floating or "
       "planar; did you mean \"revolute\"?",
       with_joint("revolut", "")},
      {"joint type unknown", 4, "build other joints from these", with_joint("ball", "")},
      {"no parent", 4, "joint \"j\" names no parent link; expected <parent link=\"...\"/>",
       text({head, link("a"), link("b"), R"(<joint name="j" type="fixed"><child link="b"/></joint>)", "</robot>"})},
      {"child without link", 5, "joint \"j\" names no child link",
       text({head, link("a"), link("b"), R"(<joint name="j" type="fixed"><parent link="a"/>)",
             R"(<child name="b"/></joint>)", "</robot>"})},
      {"unknown parent", 4,
       "its parent link \"uper_arm\" does not exist; expected one of the file's 2 links; did you mean \"upper_arm\"?",
       text({head, link("upper_arm"), link("b"), joint("j", "fixed", "uper_arm", "b"), "</robot>"})},
      {"unknown child", 4,
       "its child link \"elsewhere\" does not exist; expected one of the file's 2 links; add <link "
       "name=\"elsewhere\"/>",
       text({head, link("a"), link("b"), joint("j", "fixed", "a", "elsewhere"), "</robot>"})},
      {"two parents", 6, "link \"c\" is the child of two joints, \"j\" in line 5 and \"k\"",
       text({head, link("a"), link("b"), link("c"), joint("j", "fixed", "a", "c"), joint("k", "fixed", "b", "c"),
             "</robot>"})},
      {"loop", 6, "the links \"b\", \"d\", \"c\" hang from each other in a loop",
       text({head, link("a"), link("b"), link("c"), link("d"), joint("j", "fixed", "d", "b"),
             joint("k", "fixed", "b", "c"), joint("l", "fixed", "c", "d"), "</robot>"})},
      {"own child", 3, "link \"a\" hangs from itself",
       text({head, link("a"), joint("j", "fixed", "a", "a"), "</robot>"})},
      {"two roots", 4, "two root links, \"a\" in line 2 and \"c\"",
       text({head, link("a"), link("b"), link("c"), joint("j", "fixed", "a", "b"), "</robot>"})},
      {"no mass", 4, "link \"b\": <inertial> has no <mass>", inertial(moments)},
      {"no inertia", 4, "link \"b\": <inertial> has no <inertia>", inertial("<mass value=\"1\"/>")},
      {"mass without value", 5, "link \"b\": <mass> has no value", inertial("<mass/>" + moments)},
      {"mass that is a word", 5, "link \"b\": <mass> has value=\"heavy\"; expected one finite number",
       inertial("<mass value=\"heavy\"/>" + moments)},
      {"number with a tail", 5, "value=\"1.0abc\"", inertial("<mass value=\"1.0abc\"/>" + moments)},
      {"NaN", 5, "value=\"nan\"", inertial("<mass value=\"nan\"/>" + moments)},
      {"infinity", 5, "value=\"-inf\"", inertial("<mass value=\"-inf\"/>" + moments)},
      {"too large", 5, "value=\"1e999\"", inertial("<mass value=\"1e999\"/>" + moments)},
      {"hexadecimal", 5, "value=\"0x10\"", inertial("<mass value=\"0x10\"/>" + moments)},
      {"empty number", 5, "value=\"\"", inertial("<mass value=\"\"/>" + moments)},
      {"two numbers", 5, "value=\"1 2\"", inertial("<mass value=\"1 2\"/>" + moments)},
      {"printf format", 5, "value=\"%s%n\"", inertial("<mass value=\"%s%n\"/>" + moments)},
      {"negative mass", 5, "link \"b\": its mass is -1 kg; expected zero or more",
       inertial("<mass value=\"-1\"/>" + moments)},
      {"missing moment", 5, "link \"b\": <inertia> has no iyy",
       inertial("<mass value=\"1\"/><inertia ixx=\"1\" izz=\"1\"/>")},
      {"attribute on its own line", 7, "iyy=\"x\"",
       inertial("<mass value=\"1\"/><inertia ixx=\"1\"\n\niyy=\"x\" izz=\"1\"/>")},
      {"two coordinates", 7, "joint \"j\": <origin> has xyz=\"1 2\"; expected three finite numbers",
       with_joint("continuous", "<origin xyz=\"1 2\"/>")},
      {"four coordinates", 7, "xyz=\"1 2 3 4\"", with_joint("continuous", "<origin xyz=\"1 2 3 4\"/>")},
      {"angle that is a word", 7, "rpy=\"0 pi 0\"", with_joint("fixed", "<origin rpy=\"0 pi 0\"/>")},
      {"quaternion", 7, "<origin> has quat_xyzw; expected rpy",
       with_joint("continuous", "<origin quat_xyzw=\"0 0 0 1\"/>")},
      {"zero axis", 7, "joint \"j\": <axis> has xyz=\"0 0 0\"; expected a direction",
       with_joint("continuous", "<axis xyz=\"0 0 0\"/>")},
      {"axis without xyz", 7, "joint \"j\": <axis> has no xyz", with_joint("planar", "<axis/>")},
      {"limit that is no number", 7, "joint \"j\": <limit> has lower=\"nan\"",
       with_joint("revolute", R"(<limit lower="nan" upper="1"/>)")},
      {"limit that is a word", 7, "joint \"j\": <limit> has effort=\"much\"",
       with_joint("revolute", R"(<limit lower="0" upper="1" effort="much"/>)")},
      {"negative damping", 7, "joint \"j\": its damping is -1; expected zero or more",
       with_joint("continuous", R"(<dynamics damping="-1"/>)")},
      {"friction that is a word", 7, "joint \"j\": <dynamics> has friction=\"x\"",
       with_joint("continuous", R"(<dynamics friction="x"/>)")},
      {"mimic of nothing", 6, "joint \"k\" mimics no joint", mimics("", "<mimic/>")},
      {"mimic of an unknown joint", 6,
       "joint \"k\" mimics \"jj\", which does not exist; expected one of the file's 2 joints; did you mean \"j\"?",
       mimics("", R"(<mimic joint="jj"/>)")},
      {"mimic of itself", 6, "joint \"k\" mimics itself", mimics("", R"(<mimic joint="k"/>)")},
      {"mimic in a circle", 5, "the joints \"j\", \"k\" mimic each other in a circle",
       mimics(R"(<mimic joint="k"/>)", R"(<mimic joint="j"/>)")},
      {"mimic of a fixed joint", 5, "joint \"j\" mimics \"k\", which is fixed",
       mimics(R"(<mimic joint="k"/>)", "", "fixed")},
      {"multiplier that is a word", 6, "joint \"k\": <mimic> has multiplier=\"x\"",
       mimics("", R"(<mimic joint="j" multiplier="x"/>)")},
  };
  for (const Bad& bad : table) {
    CAPTURE(bad.what);
    const std::string message = message_of(bad.xml);
    CHECK_THAT(message, StartsWith(fmt::format("test.urdf:{}: ", bad.line)));
    CHECK_THAT(message, Contains(bad.words));
    CHECK_THAT(message, Contains("; expected "));
    CHECK(message.find('\n') == std::string::npos);
    CHECK(message.size() < 300);
  }
}

TEST_CASE("what only the builder can judge names the file too") {
  const std::string light = R"(<link name="b"/>)";
  REQUIRE_THAT(message_of(robot(link("a") + light + joint("j", "continuous", "a", "b"))),
               StartsWith("test.urdf: joint \"j\" moves nothing that resists"));
}

TEST_CASE("numbers that are too large together are refused for what they are") {
  const auto heavy = [](const std::string& mass, const std::string& moment) {
    return fmt::format(R"(<link name="b"><inertial><origin xyz="1 0 0"/><mass value="{0}"/>)"
                       R"(<inertia ixx="{1}" iyy="{1}" izz="{1}"/></inertial></link>)",
                       mass, moment);
  };
  const auto message_with = [&](const std::string& links, const std::string& joints) {
    return message_of(robot(link("a") + links + joints));
  };
  const std::string turns = joint("j", "continuous", "a", "b");
  const std::string far = R"(<origin xyz="1.5e308 0 0"/>)";
  const std::string shape = "<collision>" + far + R"(<geometry><sphere radius="1"/></geometry></collision>)";
  CHECK_THAT(message_with(heavy("1", "1e308"), turns),
             StartsWith("test.urdf: joint \"j\": link \"b\" and all below it are too heavy or too large for numbers; expected "));
  CHECK_THAT(message_with(heavy("1e308", "1") + link("c"), turns + joint("k", "prismatic", "b", "c", far)),
             Contains("too heavy or too large"));
  CHECK_THAT(message_with(link("b") + link("c"), joint("j", "fixed", "a", "b", far) + joint("k", "continuous", "b", "c", far)),
             StartsWith("test.urdf: joint \"k\": it lies too far from the world for numbers; expected metres; "));
  CHECK_THAT(message_with(link("b") + link("c", shape), turns + joint("k", "fixed", "b", "c", far)),
             StartsWith("test.urdf: link \"c\": a collision shape lies too far away for numbers; expected metres; "));
  CHECK_THAT(message_with(link("b") + link("c") + link("d"),
                          turns + joint("k", "continuous", "b", "c", R"(<mimic joint="j" multiplier="1e200"/>)") +
                              joint("l", "continuous", "c", "d", R"(<mimic joint="k" multiplier="1e200"/>)")),
             StartsWith("test.urdf: joint \"l\" follows \"j\" by a multiplier of inf and an offset of 0"));
}

TEST_CASE("a row of 20,000 followers is resolved link by link, from either end") {
  constexpr int kJoints = 20'000;
  std::string xml = "<robot name=\"r\">" + link("l0");
  for (int i = 1; i <= kJoints; ++i) {
    const std::string mimic = i < kJoints ? fmt::format(R"(<mimic joint="j{}" multiplier="-1" offset="1"/>)", i + 1) : "";
    const std::string name = fmt::format("l{}", i);
    xml += link(name) + joint(fmt::format("j{}", i), "continuous", fmt::format("l{}", i - 1), name, mimic);
  }
  const Model model = parse(xml + "</robot>");
  REQUIRE(model.mimics.size() == kJoints - 1);
  // each turns its leader's sign about
  for (const Mimic& mimic : model.mimics) {
    const bool odd = (mimic.leader_slot - mimic.follower_slot) % 2 == 1;
    REQUIRE(mimic.leader_slot == kJoints);
    REQUIRE(mimic.multiplier == (odd ? -1 : 1));
    REQUIRE(mimic.offset == (odd ? 1 : 0));
  }
}

TEST_CASE("names of any length and kind are cut and kept on one line in messages") {
  const std::string name = "a&#10;" + std::string(5'000, 'b');
  const std::string massless = R"(<link name=")" + name + R"("/>)";
  const std::string message = message_of(robot(link("r") + massless + joint(name, "continuous", "r", name)));
  CHECK_THAT(message, Contains("joint \"a b") && Contains("bbb...\" moves nothing"));
  CHECK(message.find('\n') == message.npos);
  CHECK(message.size() < 500);
  // umlauts stay whole where a name is cut
  std::string umlauts = "x";
  for (int i = 0; i < 50; ++i) umlauts += "ü";
  CHECK_THAT(message_of(robot(link("r") + link("c") + joint(umlauts, "continuos", "r", "c"))), Contains("üü...\""));
}

TEST_CASE("a file without end is refused") {
  if (!std::filesystem::exists("/dev/zero")) return;
  REQUIRE_THROWS_WITH(load_urdf("/dev/zero"), StartsWith("/dev/zero: it is longer than ") && Contains("; expected a URDF"));
}

TEST_CASE("joints that move the same in the same way, with nothing between them, are refused by name") {
  const std::string empty = R"(<link name="b"/>)", end = link("c");
  const auto xml = [&](const std::string& first, const std::string& second, const std::string& more = "") {
    return robot(link("a") + empty + end + joint("j", first, "a", "b") + joint("k", second, "b", "c", more));
  };
  const std::string same = "test.urdf: joint \"j\" moves nothing that joints below it do not move in the same way";
  REQUIRE_THAT(message_of(xml("continuous", "continuous")), StartsWith(same));
  // crossed axes, and hinges side by side
  REQUIRE_NOTHROW(parse_urdf(xml("continuous", "continuous", R"(<axis xyz="0 1 0"/>)"), "test.urdf"));
  REQUIRE_NOTHROW(parse_urdf(xml("continuous", "continuous", R"(<origin xyz="0 0.3 0"/>)"), "test.urdf"));
}

TEST_CASE("a massless wrist that is singular at zero alone is a wrist") {
  TreeBuilder builder("wrist");
  const Eigen::Vector3d axes[] = {Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitZ()};
  for (int k = 0; k < 3; ++k) {
    LinkSpec one;
    one.name = fmt::format("link{}", k);
    one.joint = fmt::format("joint{}", k);
    if (k > 0) one.parent = fmt::format("link{}", k - 1);
    one.axis = axes[k];
    if (k == 2) one.inertia = box_inertia(1, {0.1, 0.2, 0.3}, {0, 0, 0.1});
    builder.add(one);
  }
  CHECK_NOTHROW(builder.build());
  // a fourth axis through the same point is one too many
  LinkSpec before;
  before.name = "link3";
  before.joint = "joint3";
  before.parent = "link2";
  before.axis = Eigen::Vector3d::UnitX();
  before.inertia = box_inertia(1, {0.1, 0.2, 0.3}, {0, 0, 0.1});
  CHECK_NOTHROW(TreeBuilder(builder).add(before).build());
}

TEST_CASE("a loop of many links is named in a few words") {
  std::string xml = "<robot name=\"r\">";
  for (int i = 0; i < 1000; ++i)
    xml += link(fmt::format("l{}", i)) +
           joint(fmt::format("j{}", i), "fixed", fmt::format("l{}", (i + 1) % 1000), fmt::format("l{}", i));
  const std::string message = message_of(xml + "</robot>");
  REQUIRE_THAT(message, Contains(", ... hang from each other in a loop"));
  REQUIRE(message.size() < 300);
}

}  // namespace linden::urdf_test

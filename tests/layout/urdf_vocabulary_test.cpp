#include "models/urdf/urdf_vocabulary.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"
#include "models/urdf/urdf.hpp"
#include "tests/layout/robots.hpp"

namespace linden::urdf_vocabulary_test {
using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;
using Strings = std::vector<std::string>;

namespace {

/// A hinge in lines 2 to 4; `of_link` is in line 3, `of_joint` in line 4, `of_robot` in line 5.
std::string hinge(const std::string& of_joint, const std::string& of_link = "", const std::string& of_robot = "") {
  return "<robot name=\"r\">\n" + link("a") + "\n" + link("b", of_link) + "\n" + joint("j", "continuous", "a", "b", of_joint) + "\n" +
         of_robot + "</robot>";
}

/// All that a file can say and linden takes up, or that belongs to URDF and moves nothing.
const std::string kFull = R"(<robot name="r" version="1.0">
  <material name="grey"><color rgba="1 1 1 1"/><texture filename="grey.png"/></material>
  <link name="a"/>
  <link name="b">
    <inertial><origin xyz="0 0 1" rpy="0 0 1"/><mass value="2"/><inertia ixx="3" iyy="4" izz="5" ixy="0" ixz="0" iyz="0"/></inertial>
    <visual name="v">
      <origin xyz="0 0 1" rpy="0 0 1"/><geometry><mesh filename="x.stl" scale="1 1 1"/></geometry><material name="grey"/>
    </visual>
    <collision name="s"><origin xyz="0 0 1" rpy="0 0 1"/><geometry><sphere radius="1"/></geometry></collision>
    <collision name="c"><geometry><cylinder radius="1" length="2"/></geometry><verbose value="x"/></collision>
    <collision name="d"><geometry><capsule radius="1" length="2"/></geometry></collision>
    <collision name="e"><geometry><box size="1 2 3"/></geometry></collision>
  </link>
  <link name="c">
    <inertial><mass value="2"/><inertia ixx="3" iyy="4" izz="5" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <joint name="j" type="revolute">
    <origin xyz="0 0 1" rpy="0 0 1"/><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>
    <limit lower="-1" upper="1" effort="2" velocity="3"/><dynamics damping="1" friction="2"/>
    <safety_controller soft_lower_limit="-1" soft_upper_limit="1" k_position="1" k_velocity="1"/>
    <calibration rising="1" falling="2"/>
  </joint>
  <joint name="k" type="revolute">
    <parent link="b"/><child link="c"/><axis xyz="0 1 0"/><limit lower="-1" upper="1"/><mimic joint="j" multiplier="2" offset="1"/>
  </joint>
</robot>
)";

using Document = tinyxml2::XMLDocument;
using Element = tinyxml2::XMLElement;

/// Every element of a document, outermost first.
std::vector<Element*> elements_of(Document& document) {
  std::vector<Element*> all{document.RootElement()};
  for (std::size_t k = 0; k < all.size(); ++k) {
    for (Element* child = all[k]->FirstChildElement(); child; child = child->NextSiblingElement()) all.push_back(child);
  }
  return all;
}

std::string text_of(const Document& document) {
  tinyxml2::XMLPrinter printer(nullptr, true);
  document.Print(&printer);
  return printer.CStr();
}

/// The full robot with one change; `change` takes the document and its elements.
template <class Change>
std::string changed(const Change& change) {
  Document document;
  REQUIRE(document.Parse(kFull.c_str()) == tinyxml2::XML_SUCCESS);
  const std::vector<Element*> elements = elements_of(document);
  change(document, elements);
  return text_of(document);
}

std::size_t count_of_elements() {
  Document document;
  REQUIRE(document.Parse(kFull.c_str()) == tinyxml2::XML_SUCCESS);
  return elements_of(document).size();
}

/// Slips of the finger: a letter lost, doubled, exchanged with the next; another word altogether.
Strings misspelled(const std::string& word) {
  Strings slips = {word.substr(0, word.size() - 1) + "_", word + word.back(), "zzz"};
  for (std::size_t k = 0; k + 1 < word.size(); ++k) {
    std::string exchanged = word;
    std::swap(exchanged[k], exchanged[k + 1]);
    if (exchanged != word) slips.push_back(exchanged);
  }
  return slips;
}

bool is_silent(const std::string& xml) { return told_of(xml).empty(); }

}  // namespace

TEST_CASE("what is wrong in a word is told with its line, once, and the nearest word") {
  struct Slip {
    const char* what;
    std::string xml;
    std::string told;
  };
  const std::vector<Slip> slips = {
      {"element misspelled", hinge("", "<inertail><mass value=\"5\"/></inertail>"),
       "test.urdf:3: link \"b\": <inertail> is not known and not used; did you mean <inertial>?"},
      {"origin misspelled", hinge("<orgin xyz=\"0 0 1\"/>"),
       "test.urdf:4: joint \"j\": <orgin> is not known and not used; did you mean <origin>?"},
      {"large letters", hinge("<ORIGIN xyz=\"0 0 1\"/>"),
       "test.urdf:4: joint \"j\": <ORIGIN> is not known and not used; did you mean <origin>?"},
      {"another word for it", hinge("<origin pos=\"0 0 1\"/>"),
       "test.urdf:4: joint \"j\": <origin> has pos=\"0 0 1\", which is not known and not used; did you mean xyz?"},
      {"attribute misspelled", hinge("<dynamics dampng=\"1\"/>"),
       "test.urdf:4: joint \"j\": <dynamics> has dampng=\"1\", which is not known and not used; did you mean damping?"},
      {"attribute without a neighbour", hinge("<dynamics colour=\"1\"/>"),
       "test.urdf:4: joint \"j\": <dynamics> has colour=\"1\", which is not known and not used; <dynamics> has damping or friction"},
      {"element for an attribute", hinge("<dynamics><damping>1</damping></dynamics>"),
       "test.urdf:4: joint \"j\": <damping> is not known and not used; did you mean <dynamics damping=\"...\">?"},
      {"attribute for an element", hinge("", "", "<link name=\"c\" inertial=\"1\"/><joint name=\"k\" type=\"fixed\">"
                                                 "<parent link=\"b\"/><child link=\"c\"/></joint>"),
       "test.urdf:5: link \"c\": <link> has inertial=\"1\", which is not known and not used; did you mean <inertial> within it?"},
      {"origin within child", hinge("", "", "<link name=\"c\"/><joint name=\"k\" type=\"fixed\"><parent link=\"b\"/><child link=\"c\">"
                                            "<origin xyz=\"0 0 1\"/></child></joint>"),
       "test.urdf:5: joint \"k\": <origin> is not used within <child>; it belongs in <joint>, <inertial>, <collision> or <visual>"},
      {"inertial beside the links", hinge("", "", kInertial), "test.urdf:5: <inertial> is not used within <robot>; it belongs in <link>"},
      {"inertial twice", hinge("", kInertial), "test.urdf:3: link \"b\": a second <inertial> within <link>; the first, in line 3, is used"},
      {"two shapes", hinge("", "<collision><geometry><sphere radius=\"1\"/><box size=\"1 1 1\"/></geometry></collision>"),
       "test.urdf:3: link \"b\": <box> beside <sphere> within <geometry>; the first, in line 3, is used"},
      {"text", hinge("<origin>0 0 1</origin>"),
       "test.urdf:4: joint \"j\": the text \"0 0 1\" within <origin> is not read; URDF has its numbers and names in attributes"},
      {"cable", hinge("", "", "<cable name=\"l\"><link1 link=\"a\"/></cable>"),
       "test.urdf:5: known but not simulated: <cable>; the robot moves as if it were not there"},
      {"armature", hinge("<dynamics armature=\"0.1\" damping=\"1\" spring_stiffness=\"2\"/>"),
       "test.urdf:4: joint \"j\": known but not simulated: armature, spring_stiffness of <dynamics>; "
       "the robot moves as if it were not there"},
      {"extensions", hinge("<gazebo/>", "<sensor name=\"s\"/>", "<gazebo><plugin/></gazebo><transmission/><drake:x/>\n<ros2_control/>"),
       "test.urdf:3: known but not simulated: 1 <drake:x>, 2 <gazebo>, 1 <ros2_control>, 1 <sensor>, 1 <transmission>; "
       "other programs read them"},
  };
  for (const Slip& slip : slips) {
    CAPTURE(slip.what);
    CHECK(told_of(slip.xml) == Strings{slip.told});
  }
}

TEST_CASE("a misspelled mimic is told") {
  const std::string xml = robot(link("a") + link("b") + link("c") + joint("j", "continuous", "a", "b") +
                                joint("k", "continuous", "a", "c", "<mimic joint=\"j\" multipler=\"-1\"/>"));
  CHECK(told_of(xml) ==
        Strings{"test.urdf:1: joint \"k\": <mimic> has multipler=\"-1\", which is not known and not used; did you mean multiplier?"});
}

TEST_CASE("equal findings are one warning with their number and the last line") {
  std::string xml = "<robot name=\"r\">" + link("l0");
  for (int k = 1; k <= 1000; ++k) {
    xml += "\n" + link(fmt::format("l{}", k), "<visul/>") + joint(fmt::format("j{}", k), "continuous", "l0", fmt::format("l{}", k));
  }
  CHECK(told_of(xml + "</robot>") ==
        Strings{"test.urdf:2: link \"l1\": <visul> is not known and not used (1000 times, the last in line 1001); did you mean <visual>?"});
}

TEST_CASE("a file of a hundred thousand unknown words is told in a thousand warnings and one") {
  std::string xml = hinge("");
  std::string words;
  for (int k = 0; k < 100'000; ++k) words += fmt::format("<w{}/>\n", k);
  xml.insert(xml.find("</robot>"), words);
  const Strings told = told_of(xml);
  REQUIRE(told.size() == 1001);
  CHECK(told.back() == "test.urdf:1005: something else that is not used (99000 times, the last in line 100004); correct the others first");
}

TEST_CASE("an error that a slip in a word leads to names the slip") {
  // the mass is lost, and the joint moves nothing
  const std::string massless = robot("<link name=\"a\"/>\n<link name=\"b\"><inertail/></link>" + joint("j", "continuous", "a", "b"));
  CHECK_THAT(told_of(massless).front(), StartsWith("error: test.urdf: joint \"j\" moves nothing that resists") &&
                                            Contains("(and see line 2: link \"b\": <inertail> is not known") &&
                                            Contains("did you mean <inertial>?"));
  const std::string jointless =
      robot(link("a") + link("b") + "\n<jiont name=\"j\" type=\"fixed\"><parent link=\"a\"/><child link=\"b\"/></jiont>");
  CHECK_THAT(told_of(jointless).front(), Contains("two root links") && Contains("line 2: <jiont> is not known") && Contains("<joint>"));
}

TEST_CASE("macros of xacro are refused wherever they are, with the command that expands them") {
  for (const std::string& xml :
       {hinge("", "<xacro:inertia mass=\"3\"/>"), hinge("<origin xyz=\"${x} 0 0\"/>"), hinge("", "", "<gazebo><xacro:if/></gazebo>"),
        hinge("<unknown><deep><xacro:x/></deep></unknown>"), hinge("", "<visual><xacro:grey/></visual>")}) {
    CAPTURE(xml);
    CHECK_THAT(told_of(xml).front(), StartsWith("error: test.urdf:") && Contains(" macro ") &&
                                         Contains("expand the macros first: xacro test.urdf > out.urdf"));
  }
  // the name alone is no macro
  std::string declared = hinge("");
  declared.insert(declared.find(" name="), " xmlns:xacro=\"http://www.ros.org/wiki/xacro\"");
  CHECK(is_silent(declared));
}

TEST_CASE("a robot without a name is called robot, with a warning") {
  const std::string xml = "<robot>" + link("a") + link("b") + joint("j", "continuous", "a", "b") + "</robot>";
  CHECK(told_of(xml) == Strings{"test.urdf:1: <robot> has no name; called \"robot\""});
  CHECK(parse_urdf(xml, "test.urdf").names.model == "robot");
}

TEST_CASE("UTF-16 is refused for what it is, and Latin-1 is read") {
  using namespace std::string_literals;
  std::string little = "\xff\xfe", big = "\xfe\xff", bare;
  for (const char letter : hinge("")) {
    little += letter + "\0"s;
    big += "\0"s + letter;
    bare += letter + "\0"s;
  }
  for (const std::string& text : {little, big, bare}) {
    CHECK(told_of(text) == Strings{"error: test.urdf:1: the text is UTF-16; expected UTF-8; "
                                   "convert it: iconv -f UTF-16 -t UTF-8 test.urdf > out.urdf"});
  }
  const auto named = [](const std::string& name) { return robot(link("a") + "\n" + link("b") + joint(name, "continuous", "a", "b")); };
  const Model latin = parse_urdf(named("Gr\xf6\xdf"s + "e"), "test.urdf");
  CHECK(latin.names.joint[1] == "Gr\xc3\xb6\xc3\x9f"s + "e");
  CHECK(latin.warnings == Strings{"test.urdf:2: the text is not UTF-8; read as Latin-1 (iconv -f ISO-8859-1 -t UTF-8 converts it)"});
  const Model foreign = parse_urdf(named("\xc3\xb6\xe2\x82\xac\xf0\x9f\xa4\x96"), "test.urdf");
  CHECK(foreign.names.joint[1] == "\xc3\xb6\xe2\x82\xac\xf0\x9f\xa4\x96");
  CHECK(foreign.warnings.empty());
}

TEST_CASE("one rigid body is told to float") {
  for (const std::string& xml : {robot(link("a")), robot(link("a") + link("b") + joint("j", "fixed", "a", "b"))}) {
    CHECK_THAT(told_of(xml).front(), Contains("nothing moves") && Contains("--base floating"));
    CHECK(parse_urdf(xml, "test.urdf", Base::floating).tree.bodies() == 1);
  }
}

TEST_CASE("strict reading refuses what lenient reading warns of, and nothing else") {
  CHECK_NOTHROW(parse_urdf(kFull, "test.urdf", Base::fixed, Reading::strict));
  const std::string slips = hinge("<orgin/><gazebo/>", "<inertail/>");
  CHECK(parse_urdf(slips, "test.urdf").warnings.size() == 3);
  CHECK_THROWS_AS(parse_urdf(slips, "test.urdf", Base::fixed, Reading::strict), InputError);
  CHECK_THROWS_WITH(parse_urdf(slips, "test.urdf", Base::fixed, Reading::strict),
                    StartsWith("test.urdf:3: link \"b\": <inertail> is not known") && Contains("and 2 more; strict reading refuses them"));
}

TEST_CASE("a robot that says all that linden takes up gives no warning") { CHECK(told_of(kFull) == Strings{}); }

TEST_CASE("no element of a full robot is misspelled in silence") {
  const std::size_t count = count_of_elements();
  REQUIRE(count > 40);
  for (std::size_t k = 0; k < count; ++k) {
    std::string name;
    changed([&](Document&, const std::vector<Element*>& elements) { name = elements[k]->Name(); });
    for (const std::string& slip : misspelled(name)) {
      CAPTURE(k, name, slip);
      CHECK_FALSE(is_silent(changed([&](Document&, const std::vector<Element*>& elements) { elements[k]->SetName(slip.c_str()); })));
    }
  }
}

TEST_CASE("no element of a full robot is moved in silence") {
  // where an element may stand as well, and is read there or moves nothing there
  const auto belongs = [](const std::string& name, const Element& parent) {
    const std::string place = parent.Name();
    if (name == "material") return place == "robot" || place == "visual" || place == "collision";
    if (name == "color" || name == "texture") return place == "material" && !parent.FirstChildElement(name.c_str());
    if (name == "visual" || name == "collision") return place == "link";
    if (parent.FirstChildElement(name.c_str())) return false;
    if (name == "origin") return place == "joint" || place == "inertial" || place == "collision" || place == "visual";
    if (name == "geometry") return place == "collision" || place == "visual";
    if (name == "inertial") return place == "link";
    if (name == "verbose") return place == "collision";
    return place == "joint" && (name == "safety_controller" || name == "calibration" || name == "dynamics");
  };
  const std::size_t count = count_of_elements();
  for (std::size_t k = 1; k < count; ++k) {
    for (std::size_t to = 0; to < count; ++to) {
      bool sense = true;
      std::string name, place;
      const std::string xml = changed([&](Document&, const std::vector<Element*>& elements) {
        name = elements[k]->Name();
        place = elements[to]->Name();
        // not into itself or what it holds, nor where it is
        for (const tinyxml2::XMLNode* up = elements[to]; up; up = up->Parent()) sense = sense && up != elements[k];
        sense = sense && elements[k]->Parent() != elements[to] && !belongs(name, *elements[to]);
        if (sense) elements[to]->InsertEndChild(elements[k]);
      });
      if (!sense) continue;
      CAPTURE(k, to, name, place);
      CHECK_FALSE(is_silent(xml));
    }
  }
}

TEST_CASE("no element of a full robot is repeated in silence, but for those of which there may be many") {
  const std::set<std::string> many = {"visual", "collision", "material"};
  const std::size_t count = count_of_elements();
  for (std::size_t k = 1; k < count; ++k) {
    std::string name;
    const std::string xml = changed([&](Document& document, const std::vector<Element*>& elements) {
      name = elements[k]->Name();
      elements[k]->Parent()->InsertAfterChild(elements[k], elements[k]->DeepClone(&document));
    });
    CAPTURE(k, name);
    CHECK(is_silent(xml) == many.contains(name));
  }
}

TEST_CASE("no attribute of a full robot is misspelled or moved in silence") {
  using Attributes = std::vector<std::pair<std::string, std::string>>;
  const std::size_t count = count_of_elements();
  // what each kind of element may say: the words of the full robot, which is silent, and of that kind alone
  std::map<std::string, std::set<std::string>> said;
  std::vector<Attributes> of(count);
  changed([&](Document&, const std::vector<Element*>& elements) {
    for (std::size_t k = 0; k < count; ++k) {
      for (const tinyxml2::XMLAttribute* a = elements[k]->FirstAttribute(); a; a = a->Next()) {
        of[k].emplace_back(a->Name(), a->Value());
        said[elements[k]->Name()].insert(a->Name());
      }
    }
  });
  for (std::size_t k = 0; k < count; ++k) {
    for (const auto& attribute : of[k]) {
      const std::string &name = attribute.first, &value = attribute.second;
      for (const std::string& slip : misspelled(name)) {
        const std::string xml = changed([&](Document&, const std::vector<Element*>& elements) {
          elements[k]->DeleteAttribute(name.c_str());
          elements[k]->SetAttribute(slip.c_str(), value.c_str());
        });
        CAPTURE(k, name, slip);
        CHECK_FALSE(is_silent(xml));
      }
      for (std::size_t to = 0; to < count; ++to) {
        bool sense = true;
        std::string place;
        const std::string xml = changed([&](Document&, const std::vector<Element*>& elements) {
          place = elements[to]->Name();
          // a link may have a type and a geometry a name: words without effect
          const bool idle = (place == "link" && name == "type") || (place == "geometry" && name == "name");
          sense = to != k && !said[place].contains(name) && !idle;
          elements[k]->DeleteAttribute(name.c_str());
          elements[to]->SetAttribute(name.c_str(), value.c_str());
        });
        if (!sense) continue;
        CAPTURE(k, to, name, place);
        CHECK_FALSE(is_silent(xml));
      }
    }
  }
}

TEST_CASE("the vocabulary names each element once, and parents that it knows") {
  std::set<std::string_view> names;
  for (const UrdfElement& element : urdf_vocabulary()) CHECK(names.insert(element.name).second);
  for (const UrdfElement& element : urdf_vocabulary()) {
    CAPTURE(element.name);
    for (const std::string_view parent : words_of(element.parents)) CHECK((parent == "*" || names.contains(parent)));
    const std::vector<std::string_view> attributes = words_of(element.attributes), lost = words_of(element.lost);
    for (const std::string_view word : lost) CHECK(std::ranges::find(attributes, word) == attributes.end());
  }
}

TEST_CASE("linden's own models give no warning") {
  for (const char* name : {"arm", "hand", "humanoid"}) {
    CAPTURE(name);
    for (const Base base : {Base::fixed, Base::floating}) {
      CHECK(load_urdf(fmt::format("{}/{}.urdf", LINDEN_MODELS_DIR, name), base, Reading::strict).warnings.empty());
    }
  }
}

TEST_CASE("of every robot what is not taken up is told, each thing once") {
  for (const std::string& file : robot_files()) {
    CAPTURE(file);
    const Strings warnings = load_urdf(file).warnings;
    CHECK(std::set<std::string>(warnings.begin(), warnings.end()).size() == warnings.size());
    for (const std::string& warning : warnings) CHECK(warning.find("<xacro") == warning.npos);
  }
}

}  // namespace linden::urdf_vocabulary_test

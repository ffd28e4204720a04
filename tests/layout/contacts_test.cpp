#include "layout/contacts.hpp"

#include <fmt/format.h>
#include <stdlib.h>
#include <tinyxml2.h>

#include <algorithm>
#include <bit>
#include <catch2/catch.hpp>
#include <cstdint>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <set>

#include "models/build/builder.hpp"
#include "models/build/generators.hpp"
#include "models/shapes/contacts_of.hpp"
#include "models/shapes/mesh_box.hpp"
#include "models/shapes/mesh_path.hpp"
#include "models/urdf/urdf.hpp"
#include "tests/engine/folder.hpp"
#include "tests/layout/robots.hpp"

namespace linden::contacts_test {
using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;
using Eigen::Vector3d;

namespace {

Vector3d vector_of(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

std::string collision(const std::string& shape, const std::string& origin = "") {
  return "<collision>" + origin + "<geometry>" + shape + "</geometry></collision>";
}

/// A link fixed to the world and a turning one with these collision shapes; the frame of its body is its own.
std::string turning(const std::string& collisions) {
  return robot(link("a") + link("b", collisions) + joint("j", "continuous", "a", "b", "<axis xyz=\"0 0 1\"/>"));
}

Model parse(const std::string& xml, Base base = Base::fixed) { return parse_urdf(xml, "test.urdf", base); }

/// Contacts of a model that gives no cause for notes.
Contacts quiet_contacts(const Model& model) {
  std::vector<std::string> notes;
  Contacts contacts = contacts_of(model, notes);
  CAPTURE(notes);
  REQUIRE(notes.empty());
  return contacts;
}

using Points = std::set<std::array<double, 3>>;

Points centers(const Contacts& contacts) {
  Points points;
  for (const ContactSphere& sphere : contacts.spheres) points.insert(sphere.center);
  return points;
}

Points corners(const Vector3d& least, const Vector3d& most) {
  Points points;
  for (const double x : {least.x(), most.x()}) {
    for (const double y : {least.y(), most.y()}) {
      for (const double z : {least.z(), most.z()}) points.insert({x, y, z});
    }
  }
  return points;
}

std::string message_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

void append(std::string& bytes, float number) {
  const auto word = std::bit_cast<std::uint32_t>(number);
  for (int shift = 0; shift < 32; shift += 8) bytes += static_cast<char>(word >> shift & 255);
}

using Triangles = std::vector<std::array<float, 9>>;

/// Their box reaches from -1 -2 -3 to 4 5 6; all numbers are small sums of powers of two.
const Triangles kTriangles = {{-1, 0, 0, 4, 0.5f, 0, 0, 5, 0.25f}, {0, -2, 0, 1, 1, -3, 2, 2, 6}};

std::string binary_stl(const Triangles& triangles, const std::string& header = "made by a test") {
  std::string bytes = header;
  bytes.resize(80, ' ');
  append(bytes, std::bit_cast<float>(static_cast<std::uint32_t>(triangles.size())));
  for (const auto& triangle : triangles) {
    for (int k = 0; k < 3; ++k) append(bytes, 99);  // a normal is no point
    for (const float number : triangle) append(bytes, number);
    bytes += "xx";
  }
  return bytes;
}

std::string text_stl(const Triangles& triangles) {
  std::string text = "solid part\n";
  for (const auto& t : triangles) {
    text += "  facet normal 99 99 99\n    outer loop\n";
    for (std::size_t k = 0; k < 9; k += 3) text += fmt::format("      vertex {} {:e} {}\r\n", t[k], t[k + 1], t[k + 2]);
    text += "    endloop\n  endfacet\n";
  }
  return text + "endsolid part\n";
}

std::string obj(const Triangles& triangles) {
  std::string text = "# a comment with v 99 99 99\nmtllib none.mtl\n";
  for (const auto& t : triangles) {
    for (std::size_t k = 0; k < 9; k += 3) text += fmt::format("v {} {} {} 1.0\n", t[k], t[k + 1], t[k + 2]);
  }
  return text + "vn 99 99 99\nvt 99 99\nf 1 2 3\nf 4 5 6";
}

std::string dae_geometry(const std::string& id, const Triangles& triangles) {
  std::string numbers;
  for (const auto& t : triangles) {
    for (const float number : t) numbers += fmt::format("{} ", number);
  }
  return fmt::format(
      R"(<geometry id="{0}"><mesh>
<source id="{0}-normals"><float_array id="{0}-n" count="3">99 99 99</float_array></source>
<source id="{0}-places"><float_array id="{0}-p" count="{1}">{2}</float_array>
<technique_common><accessor source="#{0}-p" count="{3}" stride="3"/></technique_common></source>
<vertices id="{0}-v"><input semantic="NORMAL" source="#{0}-normals"/><input semantic="POSITION" source="#{0}-places"/></vertices>
</mesh></geometry>)",
      id, 9 * triangles.size(), numbers, 3 * triangles.size());
}

std::string dae(const std::string& asset, const std::string& more, const Triangles& triangles = kTriangles) {
  return "<?xml version=\"1.0\"?>\n<COLLADA version=\"1.4.1\"><asset>" + asset + "</asset><library_geometries>" +
         dae_geometry("part", triangles) + "</library_geometries>" + more + "</COLLADA>";
}

std::string dae_scene(const std::string& nodes) {
  return "<library_visual_scenes><visual_scene id=\"other\"><node><instance_geometry url=\"#lost\"/></node></visual_scene>"
         "<visual_scene id=\"shown\">" +
         nodes + "</visual_scene></library_visual_scenes><scene><instance_visual_scene url=\"#shown\"/></scene>";
}

const std::string kShowPart = "<instance_geometry url=\"#part\"/>";

MeshBox box_of_text(const std::string& name, const std::string& text) {
  const Folder folder;
  folder.write(name, text);
  return mesh_box(folder.file(name));
}

void require_box(const MeshBox& box, const Vector3d& least, const Vector3d& most) {
  CAPTURE(box.min().transpose(), box.max().transpose());
  REQUIRE((box.min() - least).norm() < 1e-12);
  REQUIRE((box.max() - most).norm() < 1e-12);
}

/// Sets a variable of the environment while it lives.
class Variable {
 public:
  Variable(const char* name, const std::string& value) : name_(name) {
    if (const char* before = ::getenv(name)) before_ = before;
    ::setenv(name, value.c_str(), 1);
  }
  ~Variable() {
    if (before_) {
      ::setenv(name_, before_->c_str(), 1);
    } else {
      ::unsetenv(name_);
    }
  }
  Variable(const Variable&) = delete;
  Variable& operator=(const Variable&) = delete;

 private:
  const char* name_;
  std::optional<std::string> before_;
};

}  // namespace

TEST_CASE("a shape behind a fixed joint and a turned axis lies where the joints put it") {
  // b turns about its x axis, a quarter turn about z and a metre from a; c stands on b, tipped a quarter turn about y
  const std::string quarter = "1.5707963267948966";
  const Model model = parse(
      robot(link("a") + link("b") +
            link("c", collision("<sphere radius=\"0.05\"/>", "<origin xyz=\"0.1 0.2 0.3\"/>") +
                          collision("<cylinder radius=\"0.2\" length=\"2\"/>", "<origin rpy=\"" + quarter + " 0 0\"/>")) +
            joint("k", "fixed", "b", "c", "<origin xyz=\"0 0 0.5\" rpy=\"0 " + quarter + " 0\"/>") +
            joint("j", "continuous", "a", "b", "<origin xyz=\"1 0 0\" rpy=\"0 0 " + quarter + "\"/><axis xyz=\"1 0 0\"/>")));
  REQUIRE(model.shapes.size() == 2);
  REQUIRE(model.shapes[0].link == "c");
  const Contacts contacts = quiet_contacts(model);
  REQUIRE(contacts.spheres.size() == 1);
  REQUIRE(contacts.spheres[0].slot == model.names.slot_of_joint.at("j"));
  REQUIRE(contacts.spheres[0].radius == 0.05);
  const Vector3d center = vector_of(contacts.spheres[0].center);
  REQUIRE(center.z() == Approx(0.3));  // along the axis of the joint: what c calls z, tipped to b's x
  const Eigen::Isometry3d body(body_pose(model, 1));
  // in b 0.3 0.2 -0.1 + 0.5, in the world turned to -0.2 0.3 0.4 and shifted
  REQUIRE((body * center - Vector3d(0.8, 0.3, 0.4)).norm() < 1e-12);
  REQUIRE(contacts.rims.size() == 2);
  Vector3d ends[2];
  for (std::size_t k = 0; k < 2; ++k) {
    const ContactRim& rim = contacts.rims[k];
    REQUIRE(rim.slot == 1);
    REQUIRE(rim.radius == 0.2);
    REQUIRE(std::abs((body.linear() * vector_of(rim.axis)).x()) == Approx(1));
    ends[k] = body * vector_of(rim.center);
  }
  if (ends[0].x() > ends[1].x()) std::swap(ends[0], ends[1]);
  REQUIRE((ends[0] - Vector3d(0, 0, 0.5)).norm() < 1e-12);
  REQUIRE((ends[1] - Vector3d(2, 0, 0.5)).norm() < 1e-12);
}

TEST_CASE("a shape is turned by roll about x, pitch about y and yaw about z, in this order") {
  const Model model =
      parse(turning(collision("<capsule radius=\"0.1\" length=\"2\"/>", "<origin xyz=\"1 2 3\" rpy=\"0.3 0.4 0.5\"/>")));
  const Contacts contacts = quiet_contacts(model);
  REQUIRE(contacts.spheres.size() == 2);
  // the third column of Rz(0.5) Ry(0.4) Rx(0.3), written out
  const double r = 0.3, p = 0.4, y = 0.5;
  const Vector3d axis(std::cos(y) * std::sin(p) * std::cos(r) + std::sin(y) * std::sin(r),
                      std::sin(y) * std::sin(p) * std::cos(r) - std::cos(y) * std::sin(r), std::cos(p) * std::cos(r));
  REQUIRE((vector_of(contacts.spheres[0].center) - (Vector3d(1, 2, 3) - axis)).norm() < 1e-12);
  REQUIRE((vector_of(contacts.spheres[1].center) - (Vector3d(1, 2, 3) + axis)).norm() < 1e-12);
}

TEST_CASE("a sphere touches as itself, a box with its corners, a capsule with its ends, a cylinder with its rims") {
  const std::string origin = "<origin xyz=\"1 2 3\"/>";
  const Contacts sphere = quiet_contacts(parse(turning(collision("<sphere radius=\"0.25\"/>", origin))));
  REQUIRE(centers(sphere) == Points{{1, 2, 3}});
  REQUIRE(sphere.spheres[0].radius == 0.25);
  REQUIRE(sphere.rims.empty());

  const Contacts box = quiet_contacts(parse(turning(collision("<box size=\"1 2 4\"/>", origin))));
  REQUIRE(box.spheres.size() == 8);
  REQUIRE(centers(box) == corners({0.5, 1, 1}, {1.5, 3, 5}));
  for (const ContactSphere& corner : box.spheres) REQUIRE(corner.radius == 0);

  const Contacts capsule = quiet_contacts(parse(turning(collision("<capsule radius=\"0.5\" length=\"3\"/>", origin))));
  REQUIRE(capsule.spheres.size() == 2);
  REQUIRE(centers(capsule) == Points{{1, 2, 1.5}, {1, 2, 4.5}});
  REQUIRE(capsule.spheres[1].radius == 0.5);

  const Contacts cylinder = quiet_contacts(parse(turning(collision("<cylinder radius=\"0.5\" length=\"3\"/>", origin))));
  REQUIRE(cylinder.spheres.empty());
  REQUIRE(cylinder.rims.size() == 2);
  REQUIRE(cylinder.rims[0].center == std::array{1.0, 2.0, 1.5});
  REQUIRE(cylinder.rims[1].center == std::array{1.0, 2.0, 4.5});
  REQUIRE(cylinder.rims[0].axis == std::array{0.0, 0.0, 1.0});
  REQUIRE(cylinder.rims[0].radius == 0.5);

  // what lies between them, for ridges and peaks
  REQUIRE(sphere.blocks.empty());
  REQUIRE(box.blocks.size() == 1);
  REQUIRE(box.blocks[0].center == std::array{1.0, 2.0, 3.0});
  REQUIRE(box.blocks[0].half == std::array{0.5, 1.0, 2.0});
  REQUIRE(box.blocks[0].radius == 0);
  REQUIRE(capsule.blocks.size() == 1);
  REQUIRE(capsule.blocks[0].half == std::array{0.0, 0.0, 1.5});
  REQUIRE(capsule.blocks[0].axes[2] == std::array{0.0, 0.0, 1.0});
  REQUIRE(capsule.blocks[0].radius == 0.5);
  REQUIRE(cylinder.blocks.empty());
  REQUIRE(capsule.spheres[0].outward == std::array{0.0, 0.0, -1.0});
  REQUIRE(capsule.spheres[1].outward == std::array{0.0, 0.0, 1.0});
}

TEST_CASE("what coincides where a size is zero touches once") {
  REQUIRE(quiet_contacts(parse(turning(collision("<box size=\"1 1 0\"/>")))).spheres.size() == 4);
  REQUIRE(quiet_contacts(parse(turning(collision("<box size=\"0 0 0\"/>")))).spheres.size() == 1);
  REQUIRE(quiet_contacts(parse(turning(collision("<capsule radius=\"1\" length=\"0\"/>")))).spheres.size() == 1);
  REQUIRE(quiet_contacts(parse(turning(collision("<cylinder radius=\"1\" length=\"0\"/>")))).rims.size() == 1);
  REQUIRE(quiet_contacts(parse(turning(collision("<capsule radius=\"1\" length=\"0\"/>")))).blocks.empty());
}

TEST_CASE("what is fixed to the world touches nothing, and contacts are sorted by slot") {
  const std::string ball = collision("<sphere radius=\"0.1\"/>"), tin = collision("<cylinder radius=\"0.1\" length=\"1\"/>");
  // the file names the links from the tip to the root
  const std::string xml = robot(link("d", tin + ball) + link("c", ball) + link("b", tin + ball) + link("a", ball) +
                                joint("cd", "continuous", "c", "d") + joint("bc", "continuous", "b", "c") +
                                joint("ab", "continuous", "a", "b"));
  const auto slots = [](const auto& list) {
    std::vector<Index> result;
    for (const auto& contact : list) result.push_back(contact.slot);
    return result;
  };
  const Contacts fixed = quiet_contacts(parse(xml));
  REQUIRE(slots(fixed.spheres) == std::vector<Index>{1, 2, 3});
  REQUIRE(slots(fixed.rims) == std::vector<Index>{1, 1, 3, 3});
  const Contacts floating = quiet_contacts(parse(xml, Base::floating));
  REQUIRE(slots(floating.spheres) == std::vector<Index>{1, 2, 3, 4});
}

TEST_CASE("shapes change neither the hash of a model nor its motion's constants") {
  const Model bare = parse(turning("")), shaped = parse(turning(collision("<box size=\"1 1 1\"/>")));
  REQUIRE(bare.shapes.empty());
  REQUIRE(shaped.shapes.size() == 1);
  REQUIRE(shaped.hash() == bare.hash());
  REQUIRE(quiet_contacts(bare).empty());
  REQUIRE_FALSE(quiet_contacts(shaped).empty());
}

TEST_CASE("a bad collision shape is refused with its file, its line, what was found and what was expected") {
  const auto refusal = [](const std::string& content) {
    const std::string xml = "<robot name=\"r\">\n" + link("a") + "\n<link name=\"b\">" + kInertial + "<collision>\n" + content +
                            "\n</collision></link>\n" + joint("j", "continuous", "a", "b") + "</robot>";
    return message_of([&] { parse(xml); });
  };
  const auto shape = [&](const std::string& element) { return refusal("<geometry>" + element + "</geometry>"); };
  const std::string here = "test.urdf:4: link \"b\": ";
  CHECK(shape("<sphere/>") == here + "<sphere> has no radius; expected radius=\"...\"; add it");
  CHECK(shape("<sphere radius=\"big\"/>") ==
        here + "<sphere> has radius=\"big\"; expected one finite number, such as 0.5; correct it");
  CHECK(shape("<sphere radius=\"-1\"/>") == here + "<sphere> has radius=\"-1\"; expected zero or more; correct it");
  CHECK(shape("<sphere radius=\"nan\"/>") ==
        here + "<sphere> has radius=\"nan\"; expected one finite number, such as 0.5; correct it");
  CHECK(shape("<box/>") == here + "<box> has no size; expected size=\"...\"; add it");
  CHECK_THAT(shape("<box size=\"1 2\"/>"), StartsWith(here + "<box> has size=\"1 2\"; expected three finite numbers"));
  CHECK_THAT(shape("<box size=\"1 2 3 4\"/>"), StartsWith(here + "<box> has size=\"1 2 3 4\"; expected three"));
  CHECK(shape("<box size=\"1 -2 3\"/>") == here + "<box> has size=\"1 -2 3\"; expected zero or more; correct it");
  CHECK_THAT(shape("<cylinder radius=\"1\"/>"), StartsWith(here + "<cylinder> has no length"));
  CHECK_THAT(shape("<cylinder length=\"1\"/>"), StartsWith(here + "<cylinder> has no radius"));
  CHECK_THAT(shape("<cylinder radius=\"1\" length=\"-3\"/>"), StartsWith(here + "<cylinder> has length=\"-3\""));
  CHECK_THAT(shape("<capsule radius=\"1\" length=\"1e999\"/>"), StartsWith(here + "<capsule> has length=\"1e999\""));
  CHECK(shape("<mesh/>") == here + "<mesh> has no filename; expected filename=\"...\"; add it");
  CHECK_THAT(shape("<mesh filename=\" \"/>"), StartsWith(here + "<mesh> has an empty filename"));
  CHECK_THAT(shape("<mesh filename=\"x.stl\" scale=\"2\"/>"), StartsWith(here + "<mesh> has scale=\"2\"; expected three"));
  CHECK_THAT(refusal("<geometry><sphere radius=\"1\"/></geometry><origin xyz=\"1 2\"/>"),
             StartsWith(here + "<origin> has xyz=\"1 2\"; expected three finite numbers"));
  CHECK_THAT(refusal("<origin quat_xyzw=\"0 0 0 1\"/><geometry><sphere radius=\"1\"/></geometry>"), Contains("convert"));
  CHECK(shape("<sphere radius=\" 1 \"/>") == "no error");
}

TEST_CASE("an unknown collision shape is left out with a warning, and its neighbours stay") {
  const Model model = parse("<robot name=\"r\">" + link("a") + "\n" +
                            link("b", collision("<torus radius=\"x\"/>") + "\n<collision/>\n" +
                                          collision("<sphere radius=\"1\"/>")) +
                            joint("j", "continuous", "a", "b") + "</robot>");
  REQUIRE(model.shapes.size() == 1);
  REQUIRE(model.warnings ==
          std::vector<std::string>{"test.urdf:2: link \"b\": <torus> is not known and not used; <geometry> may hold <sphere>, <box>, "
                                   "<cylinder>, <capsule> or <mesh>",
                                   "test.urdf:3: link \"b\": a <collision> holds no shape; left out"});
}

TEST_CASE("the builder refuses shapes whose sizes are negative or no numbers") {
  const auto refusal = [](const LinkShape& shape) {
    LinkSpec link;
    link.name = "b", link.joint = "j";
    link.inertia = box_inertia(1, {1, 1, 1}, {0, 0, 0});
    link.shapes = {shape};
    return message_of([&] { TreeBuilder("code").add(link).build(); });
  };
  CHECK(refusal(box_shape({1, 2, 3}, {0, 0, 0})) == "no error");
  CHECK_THAT(refusal(box_shape({1, -2, 3}, {0, 0, 0})), Contains("code: link \"b\": a collision shape has a negative size"));
  CHECK_THAT(refusal(box_shape({1, 2, 3}, {0, std::numeric_limits<double>::quiet_NaN(), 0})), Contains("not finite"));
  CHECK(refusal({Pose{}, {ShapeKind::mesh, {1, -1, 1}, "x.stl"}}) == "no error");
}

TEST_CASE("STL, binary and text, OBJ and COLLADA files of the same points have the same box") {
  const Vector3d least(-1, -2, -3), most(4, 5, 6);
  require_box(box_of_text("x.stl", binary_stl(kTriangles)), least, most);
  require_box(box_of_text("x.STL", binary_stl(kTriangles, "solid, says the header of this binary file")), least, most);
  require_box(box_of_text("x.stl", binary_stl(kTriangles) + "bytes behind the last triangle"), least, most);
  require_box(box_of_text("x.stl", text_stl(kTriangles)), least, most);
  require_box(box_of_text("x.obj", obj(kTriangles)), least, most);
  require_box(box_of_text("x.dae", dae("", dae_scene("<node>" + kShowPart + "</node>"))), least, most);
  require_box(box_of_text("x.dae", dae("", "")), least, most);
}

TEST_CASE("the nodes of a COLLADA scene place what they show, in metres") {
  const auto box = [](const std::string& nodes, const std::string& asset = "", const std::string& more = "") {
    return box_of_text("x.dae", dae(asset, more + dae_scene(nodes)));
  };
  require_box(box("<node><translate>10 20 30</translate>" + kShowPart + "</node>"), {9, 18, 27}, {14, 25, 36});
  // shift, then turn x to y within the shifted frame, then stretch within the turned one
  require_box(box("<node><translate>10 0 0</translate><rotate>0 0 1 90</rotate><scale>2 1 1</scale>" + kShowPart + "</node>"),
              {5, -2, -3}, {12, 8, 6});
  require_box(box("<node><matrix>0 -1 0 10 1 0 0 0 0 0 1 0 0 0 0 1</matrix>" + kShowPart + "</node>"), {5, -1, -3}, {12, 4, 6});
  require_box(box("<node><translate>100 0 0</translate><node><translate>10 0 0</translate>" + kShowPart + "</node></node>"),
              {109, -2, -3}, {114, 5, 6});
  require_box(box("<node>" + kShowPart + "</node><node><translate>10 0 0</translate>" + kShowPart + "</node>"), {-1, -2, -3},
              {14, 5, 6});
  require_box(box("<node><translate>10 0 0</translate><instance_node url=\"#kept\"/></node>", "",
                  "<library_nodes><node id=\"kept\"><translate>1 0 0</translate>" + kShowPart + "</node></library_nodes>"),
              {10, -2, -3}, {15, 5, 6});
  require_box(box("<node>" + kShowPart + "</node>", "<unit name=\"millimeter\" meter=\"0.001\"/>"), {-0.001, -0.002, -0.003},
              {0.004, 0.005, 0.006});
}

TEST_CASE("the up axis that a COLLADA file claims does not turn it") {
  for (const char* axis : {"X_UP", "Y_UP", "Z_UP"}) {
    require_box(box_of_text("x.dae", dae(fmt::format("<up_axis>{}</up_axis>", axis), "")), {-1, -2, -3}, {4, 5, 6});
  }
}

TEST_CASE("a mesh touches with the corners of its box, scaled or mirrored in the link's frame") {
  const Folder folder;
  folder.write("part.stl", binary_stl(kTriangles));
  const auto contacts = [&](const std::string& scale) {
    folder.write("robot.urdf", turning(collision("<mesh filename=\"part.stl\"" + scale + "/>", "<origin xyz=\"10 20 30\"/>")));
    const Model model = load_urdf(folder.file("robot.urdf"));
    std::vector<std::string> notes;
    const Contacts result = contacts_of(model, notes);
    REQUIRE(notes == std::vector<std::string>{"1 mesh stands as the corners of its bounding box"});
    REQUIRE(result.spheres.size() == 8);
    REQUIRE(result.spheres[3].radius == 0);
    return centers(result);
  };
  CHECK(contacts("") == corners({9, 18, 27}, {14, 25, 36}));
  CHECK(contacts(" scale=\"2 0.5 4\"") == corners({8, 19, 18}, {18, 22.5, 54}));
  CHECK(contacts(" scale=\"1 -1 1\"") == corners({9, 15, 27}, {14, 22, 36}));
}

TEST_CASE("many meshes get one note, and one file that many links name is one box") {
  const Folder folder;
  folder.write("part.obj", obj(kTriangles));
  const std::string mesh = collision("<mesh filename=\"part.obj\"/>");
  folder.write("robot.urdf", turning(mesh + mesh + mesh));
  std::vector<std::string> notes{"an older note"};
  const Contacts contacts = contacts_of(load_urdf(folder.file("robot.urdf")), notes);
  REQUIRE(contacts.spheres.size() == 24);
  REQUIRE(notes == std::vector<std::string>{"an older note", "3 meshes stand as the corners of their bounding boxes"});
}

TEST_CASE("a mesh that is missing or broken is noted and touches nothing, and the robot loads all the same") {
  const Folder folder;
  folder.write("broken.stl", binary_stl(kTriangles).substr(0, 100));
  folder.write("huge.obj", "v 1e308 0 0\nv -1e308 1 1\n");
  folder.write("large.obj", "v 1e200 0 0\nv 2e200 1 1\n");
  folder.write("robot.urdf", turning(collision("<mesh filename=\"package://nowhere/x.stl\"/>") +
                                     collision("<mesh filename=\"broken.stl\"/>") + collision("<mesh filename=\"huge.obj\"/>") +
                                     collision("<mesh filename=\"large.obj\" scale=\"1e200 1 1\"/>") +
                                     collision("<sphere radius=\"1\"/>")));
  const Model model = load_urdf(folder.file("robot.urdf"));
  REQUIRE(model.warnings.empty());
  REQUIRE(model.shapes.size() == 5);
  std::vector<std::string> notes;
  const Contacts contacts = contacts_of(model, notes);
  REQUIRE(contacts.spheres.size() == 1);
  REQUIRE(notes.size() == 4);
  CHECK(notes[0] == "link \"b\": mesh \"package://nowhere/x.stl\" not found; it touches nothing");
  CHECK(notes[1] == "link \"b\": mesh " + folder.file("broken.stl") +
                        ": it holds 100 bytes; expected 184 for the 2 triangles it announces; it touches nothing");
  CHECK(notes[2] == "link \"b\": mesh " + folder.file("huge.obj") +
                        ": its points lie too far apart for numbers; expected the mesh of a robot's part; it touches nothing");
  CHECK(notes[3] == "link \"b\": mesh \"large.obj\" is too large for numbers; it touches nothing");
}

TEST_CASE("a mesh is found by its path, beside the robot's file, in a folder above, and where ROS looks") {
  const Folder folder;
  std::filesystem::create_directories(folder / "my_robot/urdf");
  std::filesystem::create_directories(folder / "my_robot/meshes");
  std::filesystem::create_directories(folder / "ros/tools/meshes");
  std::filesystem::create_directories(folder / "ament/share/grip/meshes");
  const std::string source = folder.file("my_robot/urdf/robot.urdf");
  for (const char* name : {"my_robot/urdf/near.stl", "my_robot/meshes/arm.stl", "ros/tools/meshes/saw.stl",
                           "ament/share/grip/meshes/jaw.stl"}) {
    folder.write(name, "");
  }
  const auto find = [&](const std::string& name) { return find_mesh(name, source).value_or("nothing"); };
  CHECK(find("near.stl") == folder.file("my_robot/urdf/near.stl"));
  CHECK(find("../meshes/arm.stl") == folder.file("my_robot/meshes/arm.stl"));
  CHECK(find(folder.file("my_robot/meshes/arm.stl")) == folder.file("my_robot/meshes/arm.stl"));
  CHECK(find("file://" + folder.file("my_robot/meshes/arm.stl")) == folder.file("my_robot/meshes/arm.stl"));
  CHECK(find("package://my_robot/meshes/arm.stl") == folder.file("my_robot/meshes/arm.stl"));
  CHECK(find("package:///my_robot/meshes/arm.stl") == folder.file("my_robot/meshes/arm.stl"));
  CHECK(find("package://tools/meshes/saw.stl") == "nothing");
  {
    const Variable path("ROS_PACKAGE_PATH", "/nowhere::" + folder.file("ros"));
    CHECK(find("package://tools/meshes/saw.stl") == folder.file("ros/tools/meshes/saw.stl"));
  }
  {
    const Variable path("ROS_PACKAGE_PATH", folder.file("ros/tools"));
    CHECK(find("package://tools/meshes/saw.stl") == folder.file("ros/tools/meshes/saw.stl"));
  }
  {
    const Variable path("AMENT_PREFIX_PATH", "/nowhere:" + folder.file("ament"));
    CHECK(find("package://grip/meshes/jaw.stl") == folder.file("ament/share/grip/meshes/jaw.stl"));
  }
  for (const char* name :
       {"", "package://", "package://my_robot", "package://my_robot/", "file://", "../meshes", "http://x/y.stl"}) {
    CAPTURE(name);
    CHECK(find(name) == "nothing");
  }
}

TEST_CASE("a malformed mesh is refused for what it is") {
  const auto refusal = [](const std::string& name, const std::string& text) {
    return message_of([&] { box_of_text(name, text); });
  };
  std::string absurd = binary_stl(kTriangles);
  absurd.replace(80, 4, "\xff\xff\xff\xff");
  CHECK_THAT(refusal("x.stl", absurd), Contains("it holds 184 bytes; expected 214748364834 for the 4294967295 triangles"));
  CHECK_THAT(refusal("x.stl", binary_stl({})), Contains("it holds no points"));
  const float infinity = std::numeric_limits<float>::infinity();
  CHECK_THAT(refusal("x.stl", binary_stl({{0, infinity, 0, 0, 0, 0, 0, 0, 0}})), Contains("not finite"));
  CHECK_THAT(refusal("x.stl", ""), Contains("it holds 0 bytes; expected an STL file"));
  CHECK_THAT(refusal("x.stl", text_stl(kTriangles).substr(0, text_stl(kTriangles).find("endfacet"))), Contains("it breaks off; expected a text STL"));
  CHECK_THAT(refusal("x.stl", "solid x\nvertex 1 2\nendsolid"), Contains("a point reads \"vertex 1 2\""));
  CHECK_THAT(refusal("x.stl", "solid x\nendsolid"), Contains("it holds no points"));
  CHECK_THAT(refusal("x.obj", "v 1 2 three\n"), Contains("a point reads \"v 1 2 three\""));
  CHECK_THAT(refusal("x.obj", "f 1 2 3\n"), Contains("it holds no points"));
  CHECK_THAT(refusal("x.dae", "solid"), Contains("is no XML; expected a COLLADA file"));
  CHECK_THAT(refusal("x.dae", "<robot/>"), Contains("its outermost element is not <COLLADA>"));
  CHECK_THAT(refusal("x.dae", "<COLLADA/>"), Contains("it holds no points"));
  CHECK_THAT(refusal("x.dae", dae("<unit meter=\"0\"/>", "")), Contains("its unit is \"0\" m"));
  const auto scene_refusal = [&](const std::string& node) {
    return refusal("x.dae", dae("", dae_scene("<node>" + node + "</node>")));
  };
  CHECK_THAT(scene_refusal("<instance_geometry url=\"#lost\"/>"), Contains("shows \"#lost\""));
  CHECK_THAT(scene_refusal("<skew>1</skew>" + kShowPart), Contains("<skew>, which is not read"));
  CHECK_THAT(scene_refusal("<scale>1 2</scale>"), Contains("a bad <scale>; expected 3"));
  std::string crowded = "<COLLADA>\n<node ";
  for (int i = 0; i < 300'000; ++i) crowded += fmt::format("a{}='' ", i);
  CHECK_THAT(refusal("x.dae", crowded + "/></COLLADA>"), Contains("the element in line 2 has more than 200 attributes"));
  CHECK_THAT(refusal("x.obj", "v -1e308 0 0\nv 1e308 0 0\n"), Contains("its points lie too far apart for numbers"));
  CHECK_THAT(scene_refusal("<scale>1e200 1 1</scale><scale>1e200 1 1</scale>" + kShowPart), Contains("too far apart"));
  CHECK_THAT(refusal("x.ply", "ply"), Contains("expected a name that ends in .stl, .obj or .dae"));
}

TEST_CASE("a COLLADA scene that shows itself, or one geometry without end, is refused soon") {
  const std::string self = "<node id=\"n\"><instance_node url=\"#n\"/><instance_node url=\"#n\"/></node>";
  CHECK_THAT(message_of([&] { box_of_text("x.dae", dae("", dae_scene(self))); }), Contains("shows itself"));
  // each level shows the one below ten times
  const auto refusal = [](const Triangles& triangles, int most) {
    std::string levels = "<node id=\"n0\">" + kShowPart + "</node>";
    for (int level = 1; level <= most; ++level) {
      levels += fmt::format("<node id=\"n{}\">", level);
      for (int k = 0; k < 10; ++k) levels += fmt::format("<instance_node url=\"#n{}\"/>", level - 1);
      levels += "</node>";
    }
    return message_of([&] { box_of_text("x.dae", dae("", dae_scene(levels), triangles)); });
  };
  CHECK_THAT(refusal(kTriangles, 11), Contains("elements or shows itself"));
  CHECK_THAT(refusal(Triangles(1000, kTriangles[0]), 5), Contains("points; expected a smaller scene"));
}

TEST_CASE("a mesh cut off anywhere, or with any byte changed, is read or refused and nothing else") {
  const Folder folder;
  const std::pair<const char*, std::string> files[] = {{"binary.stl", binary_stl(kTriangles)},
                                                       {"text.stl", text_stl(kTriangles)},
                                                       {"part.obj", obj(kTriangles)},
                                                       {"part.dae", dae("", dae_scene("<node>" + kShowPart + "</node>"))}};
  for (const auto& [name, whole] : files) {
    const auto read = [&, file = folder.file(name)](const std::string& text) {
      folder.write(file.substr(file.rfind('/') + 1), text);
      bool empty = false;
      message_of([&] { empty = mesh_box(file).isEmpty(); });
      REQUIRE_FALSE(empty);
    };
    for (std::size_t length = 0; length < whole.size(); length += 7) read(whole.substr(0, length));
    for (std::size_t at = 0; at < whole.size(); at += 7) {
      std::string changed = whole;
      changed[at] = static_cast<char>(changed[at] ^ static_cast<char>(0x15 << at % 3));
      read(changed);
    }
  }
}

TEST_CASE("lines of any length, and bytes that are no text, do not hinder an OBJ") {
  const std::string long_face = "f " + std::string(100'000, '1') + "\n", zeros(10, '\0');
  require_box(box_of_text("x.obj", "v -1 -2 -3\n" + long_face + zeros + "\n\n" + long_face + "v 4 5 6"), {-1, -2, -3}, {4, 5, 6});
  require_box(box_of_text("x.obj", "v -1 -2 -3\nv 4 5 6\n" + std::string(4095, ' ')), {-1, -2, -3}, {4, 5, 6});
}

TEST_CASE("every collision shape of every robot reaches the model, or hangs on what is fixed to the world") {
  for (const std::string& file : robot_files()) {
    tinyxml2::XMLDocument document;
    REQUIRE(document.LoadFile(file.c_str()) == tinyxml2::XML_SUCCESS);
    for (const Base base : {Base::fixed, Base::floating}) {
      CAPTURE(file, static_cast<int>(base));
      const Model model = load_urdf(file, base);
      std::map<std::string, std::size_t> expected, found;
      std::size_t meshes = 0, spheres = 0, rims = 0;
      const auto* first = document.FirstChildElement("robot")->FirstChildElement("link");
      for (const auto* link = first; link; link = link->NextSiblingElement("link")) {
        if (model.names.link.at(link->Attribute("name")).slot == 0) continue;
        const auto* collision = link->FirstChildElement("collision");
        for (; collision; collision = collision->NextSiblingElement("collision")) {
          ++expected[link->Attribute("name")];
          const std::string kind = collision->FirstChildElement("geometry")->FirstChildElement()->Name();
          meshes += kind == "mesh" ? 1 : 0;
          spheres += kind == "box" ? 8 : kind == "capsule" ? 2 : kind == "sphere" ? 1 : 0;
          rims += kind == "cylinder" ? 2 : 0;
        }
      }
      for (const BodyShape& shape : model.shapes) {
        ++found[shape.link];
        REQUIRE(shape.slot == model.names.link.at(shape.link).slot);
        REQUIRE(shape.slot > 0);
      }
      REQUIRE(found == expected);
      std::vector<std::string> notes;
      const Contacts contacts = contacts_of(model, notes);
      REQUIRE(notes.size() == meshes);  // the robots come without their meshes
      REQUIRE(contacts.spheres.size() == spheres);
      REQUIRE(contacts.rims.size() == rims);
      const auto by_slot = [](const auto& a, const auto& b) { return a.slot < b.slot; };
      REQUIRE(std::is_sorted(contacts.spheres.begin(), contacts.spheres.end(), by_slot));
      REQUIRE(std::is_sorted(contacts.rims.begin(), contacts.rims.end(), by_slot));
    }
  }
}

TEST_CASE("the collision geometry of talos that is mirrored keeps its negative scale") {
  const std::string file = real_robot("talos.urdf");
  if (file.empty()) return;
  const Model model = load_urdf(file, Base::floating);
  const auto mirrored = std::count_if(model.shapes.begin(), model.shapes.end(), [](const BodyShape& shape) {
    return shape.shape.size == std::array{1.0, -1.0, 1.0};
  });
  REQUIRE(mirrored == 13);
}

TEST_CASE("the humanoids stand on the four lowest corners of each foot") {
  struct Standing {
    Model model;
    double height;  // of the soles below the pelvis [m]
    std::string left, right;
  };
  const Standing table[] = {
      {load_urdf(std::string(LINDEN_MODELS_DIR) + "/humanoid.urdf", Base::floating), 0.927, "left_foot", "right_foot"},
      {humanoids(1), 0.91, "left_foot1", "right_foot1"}};
  for (const Standing& standing : table) {
    const Model& model = standing.model;
    const Contacts contacts = quiet_contacts(model);
    double lowest = std::numeric_limits<double>::infinity();
    const auto height = [&](const auto& contact) {
      return (Eigen::Isometry3d(body_pose(model, contact.slot)) * vector_of(contact.center)).z();
    };
    for (const ContactSphere& sphere : contacts.spheres) lowest = std::min(lowest, height(sphere) - sphere.radius);
    for (const ContactRim& rim : contacts.rims) lowest = std::min(lowest, height(rim) - rim.radius);
    CHECK(lowest == Approx(-standing.height).margin(1e-12));
    for (const std::string& foot : {standing.left, standing.right}) {
      const Index slot = model.names.link.at(foot).slot;
      const auto touches = std::count_if(contacts.spheres.begin(), contacts.spheres.end(), [&](const ContactSphere& sphere) {
        return sphere.slot == slot && std::abs(height(sphere) - sphere.radius - lowest) < 1e-9;
      });
      CHECK(touches == 4);
    }
  }
}

TEST_CASE("generated humanoids have shapes, the other generated models none") {
  REQUIRE(humanoids(2).shapes.size() == 2 * 15);
  for (const char* name : {"chain:10", "ball-chain:10", "tree:10", "paper-chain:10", "random:10", "ring:10", "fourbars:3", "ladder:3",
                           "roller-chain:3", "net:3x3"}) {
    REQUIRE(generate(name).shapes.empty());
  }
}

}  // namespace linden::contacts_test

// Mass and inertia from shapes and a density: closed forms, solids of meshes, and who gets them.
#include "models/shapes/shape_mass.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <numbers>

#include "tests/engine/folder.hpp"
#include "tests/layout/robots.hpp"

namespace linden::shape_mass_test {
using Catch::Matchers::Contains;
using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

constexpr double kPi = std::numbers::pi;

LinkShape shape(ShapeKind kind, const std::array<double, 3>& size, const Pose& pose = {}, const std::string& mesh = "") {
  return {pose, {kind, size, mesh}};
}

void require_inertia(const LinkInertia& found, double mass, const Vector3d& center, const Matrix3d& about_center, double tolerance = 1e-12) {
  CAPTURE(found.mass, found.center.transpose(), found.about_center);
  REQUIRE(std::abs(found.mass - mass) <= tolerance * mass);
  REQUIRE((found.center - center).norm() <= tolerance * (1 + center.norm()));
  REQUIRE((found.about_center - about_center).norm() <= tolerance * about_center.norm());
}

/// Mass, moments along and across the axis of a body of revolution of radius r(z), |z| <= half: disc by disc, Simpson's rule.
std::array<double, 3> stacked(double density, double half, const std::function<double(double)>& radius_squared) {
  constexpr int kDiscs = 200'000;
  std::array<double, 3> sum{};
  const double step = 2 * half / kDiscs;
  for (int k = 0; k <= kDiscs; ++k) {
    const double z = -half + k * step, weight = (k == 0 || k == kDiscs ? 1 : k % 2 == 1 ? 4 : 2) * step / 3;
    const double s = radius_squared(z), m = density * kPi * s * weight;
    sum[0] += m;
    sum[1] += m * s / 2;
    sum[2] += m * (s / 4 + z * z);
  }
  return sum;
}

using Corners = std::vector<Vector3d>;
using Faces = std::vector<std::vector<int>>;

/// The tetrahedron between the origin and a, b, c on the axes, faces seen from outside.
const Corners kTetrahedron{{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 4}};
const Faces kTetrahedronFaces{{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};

/// A box from -1 -2 -3 to 1 2 3 of four-sided faces.
const Corners kBox{{-1, -2, -3}, {1, -2, -3}, {1, 2, -3}, {-1, 2, -3}, {-1, -2, 3}, {1, -2, 3}, {1, 2, 3}, {-1, 2, 3}};
const Faces kBoxFaces{{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};

/// Three corners at a time.
std::vector<std::array<Vector3d, 3>> triangles_of(const Corners& corners, const Faces& faces) {
  std::vector<std::array<Vector3d, 3>> result;
  for (const std::vector<int>& face : faces) {
    for (std::size_t k = 2; k < face.size(); ++k) {
      const auto at = [&](std::size_t i) { return corners[static_cast<std::size_t>(face[i])]; };
      result.push_back({at(0), at(k - 1), at(k)});
    }
  }
  return result;
}

std::string text_stl(const Corners& corners, const Faces& faces) {
  std::string text = "solid s\n";
  for (const auto& triangle : triangles_of(corners, faces)) {
    text += "facet normal 0 0 0\nouter loop\n";
    for (const Vector3d& p : triangle) text += fmt::format("vertex {} {} {}\n", p.x(), p.y(), p.z());
    text += "endloop\nendfacet\n";
  }
  return text + "endsolid s\n";
}

std::string binary_stl(const Corners& corners, const Faces& faces) {
  std::string bytes(80, ' ');
  const auto append = [&](std::uint32_t word) {
    for (int shift = 0; shift < 32; shift += 8) bytes += static_cast<char>(word >> shift & 255);
  };
  const auto triangles = triangles_of(corners, faces);
  append(static_cast<std::uint32_t>(triangles.size()));
  for (const auto& triangle : triangles) {
    bytes.append(12, '\0');
    for (const Vector3d& p : triangle) {
      for (const double number : p) append(std::bit_cast<std::uint32_t>(static_cast<float>(number)));
    }
    bytes.append(2, '\0');
  }
  return bytes;
}

/// Faces as they are, corners counted from the last one backwards.
std::string obj(const Corners& corners, const Faces& faces) {
  std::string text;
  for (const Vector3d& p : corners) text += fmt::format("v {} {} {}\n", p.x(), p.y(), p.z());
  for (const std::vector<int>& face : faces) {
    text += "f";
    for (const int corner : face) text += fmt::format(" {}//7", corner - static_cast<int>(corners.size()));
    text += "\n";
  }
  return text;
}

/// In units of `meter`; normals stand beside the corners.
std::string dae(const Corners& corners, const Faces& faces, double meter, const std::string& place) {
  std::string numbers, counts, list;
  for (const Vector3d& p : corners) numbers += fmt::format("{} {} {} ", p.x() / meter, p.y() / meter, p.z() / meter);
  for (const std::vector<int>& face : faces) {
    counts += fmt::format("{} ", face.size());
    for (const int corner : face) list += fmt::format("9 {} ", corner);
  }
  return fmt::format(R"(<COLLADA version="1.4.1"><asset><unit meter="{}"/></asset><library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="a" count="{}">{}</float_array><technique_common><accessor source="#a" stride="3"/></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<polylist count="{}"><input semantic="NORMAL" source="#n" offset="0"/><input semantic="VERTEX" source="#v" offset="1"/>
<vcount>{}</vcount><p>{}</p></polylist></mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node>{}<instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>)",
                     meter, 3 * corners.size(), numbers, faces.size(), counts, list, place);
}

MeshSolid solid_of(const std::string& name, const std::string& text, const Vector3d& scale = {1, 1, 1}) {
  const Folder folder;
  folder.write(name, text);
  return mesh_solid(folder.file(name), scale);
}

/// The tetrahedron's with edges a, b, c along the axes: V = a b c / 6, C_xx = 3 V a^2 / 80, C_xy = -V a b / 80 about its centre.
void require_tetrahedron(const MeshSolid& solid, const Vector3d& edges, double tolerance = 1e-12) {
  const double volume = edges.cwiseAbs().prod() / 6;
  Matrix3d second = -volume / 80 * edges * edges.transpose();
  second.diagonal() = 3 * volume / 80 * edges.cwiseProduct(edges);
  REQUIRE(solid.closed);
  require_inertia({solid.volume, solid.center, solid.about_center}, volume, edges / 4, second.trace() * Matrix3d::Identity() - second, tolerance);
}

}  // namespace

TEST_CASE("a box, a ball and a can have the mass and the moments of their closed forms") {
  require_inertia(shape_inertia(shape(ShapeKind::box, {2, 3, 4}), 100), 2400, {0, 0, 0}, Vector3d(5000, 4000, 2600).asDiagonal());
  const double ball = 1000 * 4 / 3.0 * kPi * 0.001;
  require_inertia(shape_inertia(shape(ShapeKind::sphere, {0.1}), 1000), ball, {0, 0, 0}, ball * 0.004 * Matrix3d::Identity());
  const auto can = stacked(500, 1, [](double) { return 0.09; });
  require_inertia(shape_inertia(shape(ShapeKind::cylinder, {0.3, 2}), 500), can[0], {0, 0, 0}, Vector3d(can[2], can[2], can[1]).asDiagonal());
}

TEST_CASE("a capsule has the mass and the moments of its discs") {
  const double r = 0.3, half = 0.5;
  const auto discs = stacked(700, half + r, [&](double z) {
    const double beyond = std::max(std::abs(z) - half, 0.0);
    return std::max(r * r - beyond * beyond, 0.0);
  });
  require_inertia(shape_inertia(shape(ShapeKind::capsule, {r, 2 * half}), 700), discs[0], {0, 0, 0},
                  Vector3d(discs[2], discs[2], discs[1]).asDiagonal(), 1e-9);
}

TEST_CASE("a shape that is turned and moved keeps its moments, turned with it") {
  Isometry pose = Isometry::Identity();
  pose.linear() = Eigen::AngleAxisd(kPi / 2, Vector3d::UnitX()).toRotationMatrix();  // y to z, z to -y
  pose.translation() = Vector3d(1, 2, 3);
  require_inertia(shape_inertia(shape(ShapeKind::box, {2, 3, 4}, pose_of(pose)), 100), 2400, {1, 2, 3}, Vector3d(5000, 2600, 4000).asDiagonal());
}

TEST_CASE("the solid that a mesh encloses has the moments of its closed form, in every kind of file") {
  require_tetrahedron(solid_of("t.stl", text_stl(kTetrahedron, kTetrahedronFaces)), {1, 2, 4});
  require_tetrahedron(solid_of("t.stl", binary_stl(kTetrahedron, kTetrahedronFaces)), {1, 2, 4});
  require_tetrahedron(solid_of("t.obj", obj(kTetrahedron, kTetrahedronFaces)), {1, 2, 4});
  require_tetrahedron(solid_of("t.dae", dae(kTetrahedron, kTetrahedronFaces, 0.01, "")), {1, 2, 4});
  const Matrix3d box = Vector3d(208, 160, 80).asDiagonal();  // 48 m^3 of 2 x 4 x 6 m
  for (const MeshSolid& solid : {solid_of("b.stl", text_stl(kBox, kBoxFaces)), solid_of("b.obj", obj(kBox, kBoxFaces)),
                                 solid_of("b.dae", dae(kBox, kBoxFaces, 1, ""))}) {
    REQUIRE(solid.closed);
    require_inertia({solid.volume, solid.center, solid.about_center}, 48, {0, 0, 0}, box);
  }
}

TEST_CASE("scales, mirrors and files turned inside out give the same solid") {
  require_tetrahedron(solid_of("t.stl", text_stl(kTetrahedron, kTetrahedronFaces), {0.001, 0.001, 0.001}), {0.001, 0.002, 0.004});
  require_tetrahedron(solid_of("t.obj", obj(kTetrahedron, kTetrahedronFaces), {1, -1, 1}), {1, -2, 4});
  require_tetrahedron(solid_of("t.dae", dae(kTetrahedron, kTetrahedronFaces, 1, "<scale>-1 1 1</scale>")), {-1, 2, 4});
  Faces inside_out = kTetrahedronFaces;
  for (std::vector<int>& face : inside_out) std::ranges::reverse(face);
  require_tetrahedron(solid_of("t.stl", text_stl(kTetrahedron, inside_out)), {1, 2, 4});
}

TEST_CASE("a solid far from its file's origin loses nothing to that") {
  Corners far = kTetrahedron;
  for (Vector3d& p : far) p += Vector3d(1000, -2000, 500);
  const MeshSolid solid = solid_of("t.obj", obj(far, kTetrahedronFaces));
  REQUIRE(solid.closed);
  const MeshSolid near = solid_of("t.obj", obj(kTetrahedron, kTetrahedronFaces));
  require_inertia({solid.volume, solid.center - Vector3d(1000, -2000, 500), solid.about_center}, near.volume, near.center, near.about_center, 1e-9);
}

TEST_CASE("a mesh with a hole, or one face turned, encloses nothing") {
  Faces open = kBoxFaces;
  open.pop_back();
  REQUIRE_FALSE(solid_of("b.obj", obj(kBox, open)).closed);
  Faces turned = kBoxFaces;
  std::ranges::reverse(turned.back());
  const MeshSolid solid = solid_of("b.stl", text_stl(kBox, turned));
  REQUIRE_FALSE(solid.closed);
  REQUIRE(solid.box.sizes() == Vector3d(2, 4, 6));
}

TEST_CASE("faces that name no points are refused, and boxes of the same file are none the worse") {
  const Folder folder;
  folder.write("bad.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n");
  REQUIRE_THROWS_WITH(mesh_solid(folder.file("bad.obj"), {1, 1, 1}), Contains("bad.obj: a face reads \"f 1 2 4\""));
  REQUIRE(mesh_box(folder.file("bad.obj")).sizes() == Vector3d(1, 1, 0));
}

namespace {

std::string massless(const std::string& name, const std::string& shapes) { return "<link name=\"" + name + "\">" + shapes + "</link>"; }

std::string turned_box(const char* tag) {
  return fmt::format("<{0}><origin xyz=\"0.1 0.2 0.3\" rpy=\"0.4 0.5 0.6\"/><geometry><box size=\"0.2 0.3 0.4\"/></geometry></{0}>", tag);
}

std::string arm_of(const std::string& moving) {
  return robot(massless("a", "") + moving + massless("tool0", "") + joint("j", "continuous", "a", "b", "<axis xyz=\"0 1 0\"/>") +
               joint("k", "fixed", "b", "tool0"));
}

Model dense(const std::string& xml, const std::string& source = "test.urdf", Base base = Base::fixed) {
  return parse_urdf(xml, source, base, Reading::lenient, 1000);
}

}  // namespace

TEST_CASE("a link with shapes and no inertia moves as one whose inertia is written out, frames stay massless") {
  const std::string shapes = turned_box("collision") + "<collision><geometry><sphere radius=\"0.1\"/></geometry></collision>";
  const Model model = dense(arm_of(massless("b", shapes)));
  const double box = 24, ball = 1000 * 4 / 3.0 * kPi * 0.001, mass = box + ball;
  // roll, pitch, yaw about fixed axes: x first, z last
  const Matrix3d turn = (Eigen::AngleAxisd(0.6, Vector3d::UnitZ()) * Eigen::AngleAxisd(0.5, Vector3d::UnitY()) *
                         Eigen::AngleAxisd(0.4, Vector3d::UnitX())).toRotationMatrix();
  const Vector3d at(0.1, 0.2, 0.3), center = box * at / mass;
  const Matrix3d own = turn * Vector3d(2 * (0.09 + 0.16), 2 * (0.04 + 0.16), 2 * (0.04 + 0.09)).asDiagonal() * turn.transpose();
  const auto shifted = [](double m, const Vector3d& r) -> Matrix3d { return m * (r.squaredNorm() * Matrix3d::Identity() - r * r.transpose()); };
  const Matrix3d I = own + shifted(box, at - center) + ball * 0.004 * Matrix3d::Identity() + shifted(ball, center);
  const Model written = parse_urdf(
      arm_of(massless("b", fmt::format(R"(<inertial><origin xyz="{} {} {}"/><mass value="{}"/><inertia ixx="{}" iyy="{}" izz="{}" ixy="{}" ixz="{}" iyz="{}"/></inertial>)",
                                       center.x(), center.y(), center.z(), mass, I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2)))),
      "test.urdf");
  for (int k = 0; k < 10; ++k) {
    CAPTURE(k);
    REQUIRE(model.constants.inertia(1, k) == Approx(written.constants.inertia(1, k)).epsilon(1e-12).margin(1e-12));
  }
  REQUIRE(model.warnings.empty());
  REQUIRE(model.notes.size() == 1);
  REQUIRE_THAT(model.notes.front(), Contains("1 link without inertia: mass from a density of 1000 kg/m^3, 28.19 kg in all (largest: \"b\", 28.19 kg)"));
}

TEST_CASE("visual shapes give the mass where collision shapes give none, and are told") {
  const Model visual = dense(arm_of(massless("b", turned_box("visual"))));
  REQUIRE(visual.constants.inertia(1, 0) == Approx(24));
  REQUIRE_THAT(visual.notes.front(), Contains("1 of them by visual shapes"));
  const Model both = dense(arm_of(massless("b", "<collision><geometry><box size=\"0.1 0.1 0.1\"/></geometry></collision>" + turned_box("visual"))));
  REQUIRE(both.constants.inertia(1, 0) == Approx(1));
}

TEST_CASE("links that have an inertia keep it, and without a density nothing is made up") {
  const std::string inertial = arm_of("<link name=\"b\">" + kInertial + turned_box("collision") + "</link>");
  REQUIRE(dense(inertial).hash() == parse_urdf(inertial, "test.urdf").hash());
  const auto refused = [&] { parse_urdf(arm_of(massless("b", turned_box("collision"))), "test.urdf"); };
  REQUIRE_THROWS_WITH(refused(), Contains("joint \"j\" moves nothing that resists") && Contains("--density 1000") &&
                                     Contains("inertia: {density: 1000}"));
}

TEST_CASE("a density that is none is refused") {
  for (const double density : {0.0, -1.0, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
    REQUIRE_THROWS_WITH(parse_urdf(arm_of(""), "test.urdf", Base::fixed, Reading::lenient, density), Contains("expected a finite number above zero"));
  }
}

TEST_CASE("meshes count as the solids they enclose, open ones as their boxes, and what is missing is told") {
  const Folder folder;
  folder.write("t.stl", text_stl(kTetrahedron, kTetrahedronFaces));
  Faces open = kBoxFaces;
  open.pop_back();
  folder.write("open.obj", obj(kBox, open));
  const auto mesh = [](const std::string& file) {
    return "<collision><geometry><mesh filename=\"" + file + "\" scale=\"0.1 0.1 0.1\"/></geometry></collision>";
  };
  const std::string source = folder.file("r.urdf");
  const Model closed = dense(arm_of(massless("b", mesh("t.stl"))), source);
  REQUIRE(closed.constants.inertia(1, 0) == Approx(1000 * 8 / 6.0 * 1e-3));
  const Model boxed = dense(arm_of(massless("b", mesh("open.obj"))), source);
  REQUIRE(boxed.constants.inertia(1, 0) == Approx(48));
  REQUIRE_THAT(boxed.notes.front(), Contains("1 mesh is not closed and counts as the box about it (first: \"open.obj\")"));
  const Model missing = dense(arm_of(massless("b", mesh("t.stl") + mesh("none.stl"))), source);
  REQUIRE(missing.warnings == std::vector<std::string>{"link \"b\": mesh \"none.stl\" not found; it gives no mass"});
  REQUIRE_THROWS_WITH(dense(arm_of(massless("b", mesh("none.stl"))), source), Contains("moves nothing") && Contains("\"none.stl\" not found"));
}

TEST_CASE("a floating base without inertia gets the mass of its shapes too, a fixed one is welded to the world") {
  const std::string xml = robot(massless("a", turned_box("collision")) + link("b") + joint("j", "continuous", "a", "b"));
  const Model floating = dense(xml, "test.urdf", Base::floating), fixed = dense(xml);
  REQUIRE(floating.constants.subtree_mass(0) == Approx(26));
  REQUIRE(floating.welded.mass() == 0);
  REQUIRE(fixed.constants.subtree_mass(0) == Approx(2));
  REQUIRE(fixed.welded.mass() == Approx(24));
}

}  // namespace linden::shape_mass_test

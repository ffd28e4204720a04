// Triangle meshes: solids of the right size and turned outwards, normals where there were none, files with their colours.
#include "engine/view/file_mesh.hpp"

#include <fmt/format.h>

#include <map>

#include "engine/view/corner_normals.hpp"
#include "engine/view/solid_meshes.hpp"
#include "tests/engine/drawn.hpp"
#include "tests/scratch_folder.hpp"

namespace linden::file_mesh_test {
namespace {

using Eigen::Vector3d;

TEST_CASE("solids of size one have their volume and area, and normals outwards") {
  for (const int n : {8, 24, 32}) {
    CAPTURE(n);
    const TriangleMesh cylinder = unit_cylinder(n);
    require_sound(cylinder);
    const double polygon = n / 2.0 * std::sin(2 * kPi / n);  // area of that on a circle of radius 1
    CHECK(measured(cylinder).volume == Approx(polygon).epsilon(1e-6));
    CHECK(measured(cylinder).area == Approx(2 * polygon + n * 2 * std::sin(kPi / n)).epsilon(1e-6));
    CHECK(least_agreement(cylinder) > std::cos(1.01 * kPi / n));

    const int rings = n / 2;
    const TriangleMesh sphere = unit_sphere(n, rings);
    require_sound(sphere);
    double volume = 0;  // of pyramids cut off between two parallels
    for (int ring = 0; ring < rings; ++ring) {
      const double below = kPi * (static_cast<double>(ring) / rings - 0.5), above = kPi * (ring + 1.0) / rings - kPi / 2;
      const double one = polygon * std::pow(std::cos(below), 2), other = polygon * std::pow(std::cos(above), 2);
      volume += (std::sin(above) - std::sin(below)) / 3 * (one + other + std::sqrt(one * other));
    }
    CHECK(measured(sphere).volume == Approx(volume).epsilon(1e-6));
    CHECK(measured(sphere).volume < 4 * kPi / 3);
    CHECK(least_agreement(sphere) > std::cos(3 * kPi / n));
    for (std::uint32_t k = 0; k < sphere.positions.size() / 3; ++k) {
      REQUIRE((vector_at(sphere.positions, k) - vector_at(sphere.normals, k)).norm() < 1e-6);
    }
  }
  const TriangleMesh box = unit_box();
  require_sound(box);
  CHECK(measured(box).volume == Approx(1));
  CHECK(measured(box).area == Approx(6));
  CHECK(least_agreement(box) == Approx(1));
}

/// Points of a mesh once each, whatever normals it has there.
std::pair<std::vector<Vector3d>, std::vector<std::array<std::uint32_t, 3>>> without_normals(const TriangleMesh& mesh) {
  std::vector<Vector3d> points;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::uint32_t> number;
  for (std::uint32_t k = 0; k < mesh.positions.size() / 3; ++k) {
    const Vector3d place = vector_at(mesh.positions, k);
    const auto found = std::ranges::find_if(points, [&](const Vector3d& p) { return (p - place).norm() < 1e-6; });
    number.push_back(static_cast<std::uint32_t>(found - points.begin()));
    if (found == points.end()) points.push_back(place);
  }
  for (std::size_t t = 0; t < mesh.indices.size(); t += 3) {
    triangles.push_back({number[mesh.indices[t]], number[mesh.indices[t + 1]], number[mesh.indices[t + 2]]});
  }
  return {points, triangles};
}

TEST_CASE("normals that were taken away come back: smooth on a sphere, sharp at the edges of a box and a cylinder") {
  const auto [ball, on_ball] = without_normals(unit_sphere(24, 12));
  const TriangleMesh sphere = mesh_of(shaded(ball, on_ball));
  CHECK(sphere.positions.size() == 3 * ball.size());
  for (std::uint32_t k = 0; k < ball.size(); ++k) {
    REQUIRE(vector_at(sphere.positions, k).dot(vector_at(sphere.normals, k)) > std::cos(0.02));
  }
  const auto [corners, on_box] = without_normals(unit_box());
  REQUIRE(corners.size() == 8);
  const TriangleMesh box = mesh_of(shaded(corners, on_box));
  CHECK(box.positions.size() == 3 * 24);
  CHECK(least_agreement(box) == Approx(1));
  const auto [rims, on_cylinder] = without_normals(unit_cylinder(16));
  const TriangleMesh cylinder = mesh_of(shaded(rims, on_cylinder));
  CHECK(cylinder.positions.size() == 3 * (2 * 32 + 2));
  for (std::uint32_t k = 0; k < cylinder.positions.size() / 3; ++k) {
    const Vector3d place = vector_at(cylinder.positions, k), normal = vector_at(cylinder.normals, k);
    const Vector3d outward(place.x(), place.y(), 0);
    CHECK(std::max(std::abs(normal.z()), normal.dot(outward)) == Approx(1).epsilon(1e-5));
  }
}

TEST_CASE("a closed mesh that was turned inside out is turned back, an open one stays") {
  auto [points, triangles] = without_normals(unit_box());
  for (auto& triangle : triangles) std::swap(triangle[0], triangle[1]);
  const TriangleMesh closed = mesh_of(shaded(points, triangles));
  CHECK(measured(closed).volume == Approx(1));
  CHECK(least_agreement(closed) == Approx(1));
  triangles.pop_back();
  const TriangleMesh open = mesh_of(shaded(points, triangles));
  CHECK(measured(open).volume < 0);
  CHECK(least_agreement(open) == Approx(1));
}

TEST_CASE("triangles without area are left out, and those seen from both sides have a normal to each") {
  const std::vector<Vector3d> points{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.5, 0, 0}, {1, 1, 0}};
  const TriangleMesh mesh = mesh_of(shaded(points, {{0, 1, 2}, {0, 3, 1}, {1, 1, 2}, {2, 1, 0}, {1, 4, 2}, {2, 4, 1}}));
  CHECK(mesh.indices.size() == 12);
  CHECK(mesh.positions.size() == 3 * 8);
  CHECK(least_agreement(mesh) == Approx(1));
}

TEST_CASE("an OBJ file is drawn with the colours of its materials") {
  const ScratchFolder folder;
  folder.write("all.mtl", "newmtl red part\nKd 1 0 0\nnewmtl glass\nKd 0 0.5 2\nd 0.25\nnewmtl picture\nmap_Kd x.png\nKd 9 what\n");
  folder.write(
      "part.obj",
      fmt::format("mtllib all.mtl\n{}usemtl red part\nf 1 3 2\nusemtl glass\nf 1 2 4\nusemtl none\nf 1 4 3\nusemtl red part\nf 2 3 4\n",
                  kTetrahedronObj));
  const FileMesh mesh = file_mesh(folder.file("part.obj"));
  REQUIRE(mesh.surfaces.size() == 3);
  CHECK(mesh.triangles == 4);
  CHECK_FALSE(mesh.textured);
  Measure all;
  for (const FileSurface& surface : mesh.surfaces) {
    require_sound(surface.mesh);
    add_to(all, surface.mesh);
  }
  CHECK(all.volume == Approx(1.0 / 6));
  CHECK(all.area == Approx(1.5 + std::sqrt(3.0) / 2));
  CHECK_FALSE(mesh.surfaces[0].colour);
  CHECK(mesh.surfaces[1].colour == Colour{1, 0, 0, 1});
  CHECK(mesh.surfaces[1].mesh.indices.size() == 6);
  CHECK(mesh.surfaces[2].colour == Colour{0, 0.5, 1, 0.25});
}

TEST_CASE("an OBJ file opens no materials but those beside it") {
  const ScratchFolder folder;
  std::filesystem::create_directory(folder.path() / "in");
  folder.write("out.mtl", "newmtl m\nKd 1 0 0\n");
  for (const std::string& name : {std::string("../out.mtl"), folder.file("out.mtl"), std::string("in/../../out.mtl"), std::string(".")}) {
    folder.write("in/part.obj", fmt::format("mtllib {}\nusemtl m\n{}{}", name, kTetrahedronObj, kFaces));
    const FileMesh mesh = file_mesh(folder.file("in/part.obj"));
    REQUIRE(mesh.surfaces.size() == 1);
    CHECK_FALSE(mesh.surfaces[0].colour);
  }
  folder.write("in/here.mtl", "newmtl m\nKd 0 1 0\n");
  folder.write("in/part.obj", fmt::format("mtllib ./here.mtl\nusemtl m\n{}{}", kTetrahedronObj, kFaces));
  CHECK(file_mesh(folder.file("in/part.obj")).surfaces[0].colour == Colour{0, 1, 0, 1});
}

/// Two triangles of a square, one of each material; nodes place it.
std::string collada(const std::string& nodes, const std::string& effects) {
  return R"(<COLLADA><asset><unit meter="0.01"/><up_axis>Y_UP</up_axis></asset>)" + effects + R"(<library_geometries><geometry id="g"><mesh>
<source id="s"><float_array id="f">0 0 0 100 0 0 100 100 0 0 100 0</float_array><technique_common><accessor stride="3"/></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#s"/></vertices>
<triangles material="one"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles>
<polylist material="other"><input semantic="VERTEX" source="#v" offset="0"/><vcount>3</vcount><p>0 2 3</p></polylist>
</mesh></geometry></library_geometries><library_visual_scenes><visual_scene id="c">)" +
         nodes + R"(</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#c"/></scene></COLLADA>)";
}

std::string effect(const std::string& name, const std::string& law) {
  return "<library_effects><effect id=\"" + name + "-fx\"><profile_COMMON><technique sid=\"t\">" + law +
         "</technique></profile_COMMON></effect></library_effects><library_materials><material id=\"" + name +
         "\"><instance_effect url=\"#" + name + "-fx\"/></material></library_materials>";
}

TEST_CASE("a COLLADA file is drawn with the colours that its instances bind, in metres and along its own axes") {
  const ScratchFolder folder;
  const std::string effects =
      effect("red", "<phong><diffuse><color>1 0 0 0.5</color></diffuse><transparency><float>0</float></transparency></phong>") +
      effect("glow", "<constant><emission><color>0 1 0</color></emission></constant>") +
      effect("picture", "<lambert><diffuse><texture texture=\"x\"/></diffuse></lambert>");
  const auto bound = [](const std::string& one, const std::string& other) {
    return "<instance_geometry url=\"#g\"><bind_material><technique_common><instance_material symbol=\"one\" target=\"#" + one +
           "\"/><instance_material symbol=\"other\" target=\"#" + other + "\"/></technique_common></bind_material></instance_geometry>";
  };
  folder.write("part.dae", collada("<node>" + bound("red", "glow") + "</node><node><translate>0 0 500</translate><scale>-1 1 1</scale>" +
                                       bound("glow", "picture") + "</node>",
                                   effects));
  const FileMesh mesh = file_mesh(folder.file("part.dae"));
  CHECK(mesh.textured);
  CHECK(mesh.triangles == 4);
  REQUIRE(mesh.surfaces.size() == 3);
  CHECK_FALSE(mesh.surfaces[0].colour);  // the picture
  std::map<Colour, Measure> by_colour;
  for (const FileSurface& surface : mesh.surfaces) {
    require_sound(surface.mesh);
    CHECK(least_agreement(surface.mesh) == Approx(1));
    // the mirrored node is turned over, not inside out
    for (std::uint32_t k = 0; k < surface.mesh.normals.size() / 3; ++k) CHECK(vector_at(surface.mesh.normals, k).z() == Approx(1));
    if (surface.colour) by_colour[*surface.colour] = measured(surface.mesh);
  }
  REQUIRE(by_colour.contains(Colour{1, 0, 0, 1}));
  REQUIRE(by_colour.contains(Colour{0, 1, 0, 1}));
  const Measure red = by_colour[Colour{1, 0, 0, 1}], green = by_colour[Colour{0, 1, 0, 1}];
  CHECK(red.area == Approx(0.5));
  CHECK(red.most.isApprox(Vector3d(1, 1, 0)));
  CHECK(green.area == Approx(1));
  CHECK(green.least.isApprox(Vector3d(-1, 0, 0)));
  CHECK(green.most.isApprox(Vector3d(1, 1, 5)));
}

TEST_CASE("what a COLLADA file gets wrong about colours is no colour") {
  const ScratchFolder folder;
  const std::string node = "<node><instance_geometry url=\"#g\"/></node>";
  const std::string bound =
      R"(<node><instance_geometry url="#g"><bind_material><technique_common><instance_material symbol="one" target="#m"/>
<instance_material/></technique_common></bind_material></instance_geometry></node>)";
  for (const std::string& effects :
       {std::string(), effect("one", "<phong/>"), effect("one", "<phong><diffuse><color>1 x 0</color></diffuse></phong>"),
        std::string("<library_materials><material id=\"one\"/></library_materials>"),
        std::string("<library_materials><material id=\"m\"><instance_effect url=\"#m\"/></material></library_materials>")}) {
    for (const std::string& nodes : {node, bound}) {
      folder.write("part.dae", collada(nodes, effects));
      const FileMesh mesh = file_mesh(folder.file("part.dae"));
      REQUIRE(mesh.surfaces.size() == 1);
      CHECK_FALSE(mesh.surfaces[0].colour);
      CHECK(mesh.triangles == 2);
    }
  }
  // a symbol that is not bound is the material of that name
  folder.write("part.dae", collada(node, effect("one", "<phong><diffuse><color>0 0 1 1</color></diffuse></phong>")));
  CHECK(file_mesh(folder.file("part.dae")).surfaces.size() == 2);
}

}  // namespace
}  // namespace linden::file_mesh_test

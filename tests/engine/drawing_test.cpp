// What a model looks like: every shape in its place, and something to see whatever is missing.
#include "engine/view/drawing.hpp"

#include "engine/view/inertia_box.hpp"
#include "kernels/effects/terrain_height.hpp"
#include "models/build/generators.hpp"
#include "models/build/merged_models.hpp"
#include "models/build/origin_inertia.hpp"
#include "tests/engine/drawn.hpp"
#include "tests/layout/robots.hpp"
#include "tests/scratch_folder.hpp"

namespace linden::drawing_test {
namespace {

using Eigen::Vector3d;

std::string visual(const std::string& shape, const std::string& more = "") {
  return "<visual>" + more + "<geometry>" + shape + "</geometry></visual>";
}
std::string collision(const std::string& shape, const std::string& more = "") {
  return "<collision>" + more + "<geometry>" + shape + "</geometry></collision>";
}
std::string coloured(const std::string& rgba) { return "<material name=\"\"><color rgba=\"" + rgba + "\"/></material>"; }

/// A hinge and what hangs on it.
std::string robot_with(const std::string& shapes, const std::string& fixed_shapes = "") {
  return robot(link("base", fixed_shapes) + link("arm", shapes) + joint("hinge", "continuous", "base", "arm", "<axis xyz=\"0 0 1\"/>"));
}

TEST_CASE("a scale mirrors and stretches a file, and its triangles still look outwards") {
  const ScratchFolder folder;
  folder.write("part.obj", std::string(kTetrahedronObj) + std::string(kFaces));
  folder.write("r.urdf", robot_with(visual("<mesh filename=\"part.obj\" scale=\"2 3 4\"/>") +
                                    visual("<mesh filename=\"part.obj\" scale=\"-2 3 4\"/>") +
                                    visual("<mesh filename=\"part.obj\" scale=\"-2 -3 4\"/>") + visual("<mesh filename=\"part.obj\"/>")));
  const Model model = load_urdf(folder.file("r.urdf"));
  const Drawing drawing = drawing_of(model);
  require_sound(drawing, model);
  CHECK(drawing.warnings.empty());
  CHECK(count(drawing, Layer::visual) == 4);
  const Measure all = measured(drawing, Layer::visual, 1);
  CHECK(all.volume == Approx((3 * 24 + 1) / 6.0));
  CHECK(all.least.isApprox(Vector3d(-2, -3, 0)));
  CHECK(all.most.isApprox(Vector3d(2, 3, 4)));
  CHECK(drawing.parts[0].mesh == drawing.parts[3].mesh);
  CHECK(drawing.parts[0].mesh != drawing.parts[1].mesh);
  for (const TriangleMesh& mesh : drawing.meshes) CHECK(least_agreement(mesh) == Approx(1));
}

TEST_CASE("every kind of shape is drawn in its place, with its size and colour") {
  const std::string place = R"(<origin xyz="1 2 3" rpy="1.5707963267948966 0 0"/>)";  // z points to -y
  const auto alone = [&](const std::string& shape) {
    const Model model = parse_urdf(robot_with(visual(shape, place + coloured("0.25 0.5 0.75 1"))), "test.urdf");
    const Drawing drawing = drawing_of(model);
    require_sound(drawing, model);
    for (const DrawnPart& part : drawing.parts) {
      if (part.layer == Layer::visual) CHECK(part.colour == Colour{0.25, 0.5, 0.75, 1});
      if (part.layer == Layer::visual) CHECK(part.link == "arm");
    }
    return measured(drawing, Layer::visual, 1);
  };
  const auto spans = [](const Measure& measure, const Vector3d& half, double error) {
    const Vector3d middle(1, 2, 3);
    return ((measure.least - (middle - half)).cwiseAbs().maxCoeff() < error) &&
           ((measure.most - (middle + half)).cwiseAbs().maxCoeff() < error);
  };
  CHECK(spans(alone("<box size=\"1 2 4\"/>"), {0.5, 2, 1}, 1e-6));
  CHECK(alone("<box size=\"1 2 4\"/>").volume == Approx(8));
  CHECK(spans(alone("<sphere radius=\"0.5\"/>"), {0.5, 0.5, 0.5}, 0.01));
  CHECK(alone("<sphere radius=\"0.5\"/>").volume == Approx(4 * kPi / 3 / 8).epsilon(0.04));
  CHECK(spans(alone("<cylinder radius=\"0.5\" length=\"3\"/>"), {0.5, 1.5, 0.5}, 0.01));
  CHECK(alone("<cylinder radius=\"0.5\" length=\"3\"/>").volume == Approx(0.75 * kPi).epsilon(0.01));
  CHECK(spans(alone("<capsule radius=\"0.5\" length=\"3\"/>"), {0.5, 2, 0.5}, 0.01));
  CHECK(spans(alone("<capsule radius=\"0.5\" length=\"0\"/>"), {0.5, 0.5, 0.5}, 0.01));
  CHECK(spans(alone("<box size=\"1 0 4\"/>"), {0.5, 2, 0}, 1e-5));  // a plate has two sides
}

TEST_CASE("shapes without extent and shapes out of reach are not drawn") {
  const Model model =
      parse_urdf(robot_with(visual("<sphere radius=\"0\"/>") + visual("<box size=\"0 0 0\"/>") + visual("<sphere radius=\"1e300\"/>") +
                            visual("<sphere radius=\"1\"/>", "<origin xyz=\"1e200 0 0\"/>") + visual("<box size=\"1 1 1\"/>")),
                 "test.urdf");
  const Drawing drawing = drawing_of(model);
  require_sound(drawing, model);
  CHECK(count(drawing, Layer::visual) == 1);
  REQUIRE(drawing.warnings.size() == 1);
  CHECK_THAT(drawing.warnings[0], Catch::Contains("link \"arm\": a shape is too large or too far away"));
}

TEST_CASE("a file that is missing is told once, and what stands in for it") {
  const std::string mesh = "<mesh filename=\"package://p/body.stl\"/>", other = "<mesh filename=\"other.dae\"/>";
  const auto drawn = [](const std::string& shapes) {
    const Model model = parse_urdf(robot_with(shapes), "test.urdf");
    CHECK(model.warnings.empty());
    const Drawing drawing = drawing_of(model);
    require_sound(drawing, model);
    return drawing;
  };
  const Drawing shape = drawn(visual(mesh, coloured("1 0 0 1")) + visual(mesh) + collision("<box size=\"1 2 3\"/>"));
  CHECK(shape.warnings ==
        std::vector<std::string>{"link \"arm\": mesh \"package://p/body.stl\" not found; its collision shapes are drawn in its place"});
  CHECK(count(shape, Layer::visual) == 1);
  CHECK(measured(shape, Layer::visual, 1).volume == Approx(6));
  CHECK(shape.parts[0].colour == Colour{1, 0, 0, 1});

  const Drawing box = drawn(visual(mesh) + collision(other));
  REQUIRE(box.warnings.size() == 2);
  CHECK_THAT(box.warnings[0], Catch::Contains("body.stl") && Catch::Contains("the box of its body's inertia is drawn in its place"));
  CHECK_THAT(box.warnings[1], Catch::Contains("other.dae") && Catch::Contains("this collision shape is not drawn"));
  CHECK(count(box, Layer::visual) == 1);
  CHECK(measured(box, Layer::visual, 1).volume == Approx(measured(box, Layer::inertia, 1).volume));

  const Drawing beside = drawn(visual(mesh) + visual("<sphere radius=\"1\"/>"));
  CHECK(count(beside, Layer::visual) == 1);
  CHECK_THAT(beside.warnings.at(0), Catch::Contains("nothing is drawn in its place"));
}

TEST_CASE("files that are no meshes, or of a kind that is not read, are told as they are") {
  const ScratchFolder folder;
  folder.write("broken.stl", "solid x\n");
  folder.write("part.glb", "glTF");
  folder.write("points.obj", "v 0 0 0\nv 1 0 0\n");
  folder.write("far.obj", "v 0 0 0\nv 1e30 0 0\nv 0 1e30 0\nf 1 2 3\n");
  std::filesystem::create_directory(folder.path() / "folder.stl");
  std::string visuals;
  for (const char* name : {"broken.stl", "part.glb", "points.obj", "far.obj", "folder.stl", "/dev/zero"}) {
    visuals += visual(fmt::format("<mesh filename=\"{}\"/>", name));
  }
  folder.write("r.urdf", robot_with(visuals));
  const Model model = load_urdf(folder.file("r.urdf"));
  const Drawing drawing = drawing_of(model);
  require_sound(drawing, model);
  CHECK(drawing.warnings.size() == 6);
  const auto told = [&](const std::string& text) {
    return std::ranges::any_of(drawing.warnings, [&](const std::string& warning) { return warning.find(text) != warning.npos; });
  };
  CHECK(told("broken.stl: it breaks off"));
  CHECK(told("part.glb: this kind of mesh is not read"));
  CHECK(told("points.obj: it holds no triangles"));
  CHECK(told("far.obj: its points lie over 1e+09 m away"));
  CHECK(told("\"folder.stl\" not found"));
  CHECK(count(drawing, Layer::visual) == 1);
}

TEST_CASE("what a source gets wrong about visuals is told where they are looked at") {
  const Model model = parse_urdf(robot_with(visual("<sphere/>") + visual("<sphere radius=\"1\"/>")), "test.urdf");
  CHECK(model.warnings.empty());
  const Drawing drawing = drawing_of(model);
  CHECK(drawing.warnings == model.visual_faults);
  REQUIRE(drawing.warnings.size() == 1);
  CHECK_THAT(drawing.warnings[0], Catch::Contains("test.urdf:1: link \"arm\"") && Catch::Contains("radius"));
  CHECK(count(drawing, Layer::visual) == 1);
}

TEST_CASE("textures and materials that nobody defines are told once") {
  const std::string picture = R"(<material name="wood"><texture filename="wood.png"/></material>)", nobody = R"(<material name="nobody"/>)";
  const std::string ball = "<sphere radius=\"1\"/>";
  const Model model =
      parse_urdf(robot_with(visual(ball, picture) + visual(ball, picture) + visual(ball, nobody) + visual(ball, nobody)), "test.urdf");
  const Drawing drawing = drawing_of(model);
  REQUIRE(drawing.warnings.size() == 2);
  CHECK_THAT(drawing.warnings[0], Catch::Contains("texture \"wood.png\" is not drawn"));
  CHECK_THAT(drawing.warnings[1], Catch::Contains("material \"nobody\" has no colour"));
}

TEST_CASE("names may hold anything: they stay as they are in parts, and on one line in warnings") {
  const std::string name = "&lt;script&gt;alert(1)&lt;/script&gt;&#10;x";
  const Model model = parse_urdf(robot(link("base") + link(name, visual("<mesh filename=\"&lt;b&gt;&#10;.stl\"/>")) +
                                       joint("hinge", "continuous", "base", name, "<axis xyz=\"0 0 1\"/>")),
                                 "test.urdf");
  const Drawing drawing = drawing_of(model);
  require_sound(drawing, model);
  CHECK(drawing.parts.at(0).link == "<script>alert(1)</script>\nx");
  REQUIRE(drawing.warnings.size() == 1);
  CHECK(drawing.warnings[0].find('\n') == std::string::npos);
}

TEST_CASE("a tree without visuals shows its collision shapes, one without these its joints and rods") {
  const Model shapes = parse_urdf(robot_with(collision("<box size=\"1 2 3\"/>"), collision("<sphere radius=\"1\"/>")), "test.urdf");
  const Drawing of_shapes = drawing_of(shapes);
  require_sound(of_shapes, shapes);
  CHECK(count(of_shapes, Layer::visual) == 2);
  CHECK(count(of_shapes, Layer::collision) == 2);
  CHECK(measured(of_shapes, Layer::visual, 1).volume == Approx(6));
  CHECK(measured(of_shapes, Layer::visual, 0).volume == Approx(4 * kPi / 3).epsilon(0.04));

  const Model links = chain(3);
  const Drawing of_links = drawing_of(links);
  require_sound(of_links, links);
  for (Index slot = 1; slot <= 3; ++slot) {
    // a rod of 0.1 m along an axis of the body, a ball at the joint, at the last one's end too
    const Measure rod = measured(of_links, Layer::visual, slot);
    Vector3d extent = rod.most - rod.least;
    std::ranges::sort(extent);
    CHECK(extent[2] > 0.1);
    CHECK(extent[2] < 0.13);
    CHECK(extent[1] < 0.03);
    CHECK(rod.least.maxCoeff() < 0);
  }
}

TEST_CASE("each of several models in one tree looks as it does alone") {
  const Model crane = load_urdf(std::string(LINDEN_MODELS_DIR) + "/crane.urdf");
  const Model both = merged({{crane, "crane"}, {chain(4), "rope", Pose{}, "crane/hook"}}, "crane and rope");
  const Drawing alone = drawing_of(crane), rope = drawing_of(chain(4)), drawing = drawing_of(both);
  require_sound(drawing, both);
  CHECK(drawing.warnings.empty());
  CHECK(count(drawing, Layer::visual) == count(alone, Layer::visual) + count(rope, Layer::visual));
  CHECK(measured(drawing, Layer::visual, 0).volume == Approx(measured(alone, Layer::visual, 0).volume));
  const Index end = both.names.link.at("rope/link4").slot;
  CHECK(measured(drawing, Layer::visual, end).volume == Approx(measured(rope, Layer::visual, 4).volume));
}

TEST_CASE("bodies that hang at one place are reached by one rod") {
  const Drawing drawing = drawing_of(balanced_tree(3, 2));
  // a rod and a ball each, and a ball at both ends
  CHECK(count(drawing, Layer::visual) == 8);
}

TEST_CASE("generated models are a handful of meshes, however many links they have") {
  for (const char* name : {"chain:10000", "ball-chain:200", "paper-chain:3", "tree:1023", "random:300", "humanoids:100", "chain:1", "ring:5",
                           "fourbars:4", "ladder:4", "roller-chain:4", "net:3x4"}) {
    CAPTURE(name);
    const Model model = generate(name);
    const Drawing drawing = drawing_of(model);
    require_sound(drawing, model);
    CHECK(drawing.warnings.empty());
    CHECK(drawing.meshes.size() <= 3);
    std::set<Index> seen;
    std::size_t triangles = 0;
    for (const DrawnPart& part : drawing.parts) {
      if (part.layer != Layer::visual) continue;
      seen.insert(part.slot);
      triangles += drawing.meshes[part.mesh].indices.size() / 3;
    }
    const bool has_knuckles = name == std::string("humanoids:100");
    CHECK(seen.size() >= static_cast<std::size_t>(has_knuckles ? 1400 : model.tree.bodies()));
    CHECK(triangles < 1'000'000);
  }
}

TEST_CASE("the box of a body's inertia has its mass and inertia") {
  for (const Vector3d& edges : {Vector3d(1, 2, 3), Vector3d(0.1, 0.1, 4), Vector3d(0.5, 0.5, 0.5), Vector3d(1, 2, 0)}) {
    Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();
    frame.linear() = Eigen::AngleAxisd(0.7, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
    const OriginInertia body(box_inertia(2.5, edges, {0.3, -0.2, 0.9}), frame);
    const std::optional<InertiaBox> box = inertia_box(body.numbers());
    REQUIRE(box);
    const Vector3d found(box->edges[0], box->edges[1], box->edges[2]);
    const OriginInertia again(box_inertia(2.5, found, Vector3d::Zero()), Eigen::Isometry3d(isometry(box->pose)));
    CHECK((again.about_origin - body.about_origin).norm() < 1e-12 * body.about_origin.norm());
    CHECK((again.moment - body.moment).norm() < 1e-12);
    CHECK(isometry(box->pose).linear().determinant() == Approx(1));
  }
  CHECK_FALSE(inertia_box(std::array<double, 10>{0, 0, 0, 0, 1, 0, 0, 1, 0, 1}));  // no mass
  CHECK_FALSE(inertia_box(std::array<double, 10>{1, 0, 0, 0, 0, 0, 0, 0, 0, 0}));  // a point
  const std::optional<InertiaBox> none = inertia_box(std::array<double, 10>{1, 0, 0, 0, 1, 0, 0, 1, 0, 5});
  REQUIRE(none);  // of no solid: the edges that have one
  CHECK(std::ranges::min(none->edges) == 0);
}

TEST_CASE("the ground is its plane, or its terrain with the heights that bodies touch") {
  const Model model = chain(2);
  Effects effects;
  effects.ground = Ground{.normal = {0.6, 0, 0.8}, .height = 2};
  const auto points_of = [](const Drawing& drawing) {
    std::vector<Vector3d> points;
    for (const DrawnPart& part : drawing.parts) {
      if (part.layer != Layer::ground) continue;
      CHECK(part.slot == 0);
      const TriangleMesh& mesh = drawing.meshes[part.mesh];
      for (std::uint32_t k = 0; k < mesh.positions.size() / 3; ++k) points.push_back(isometry(part.pose) * vector_at(mesh.positions, k));
    }
    return points;
  };
  const Drawing plane = drawing_of(model, effects);
  require_sound(plane, model);
  CHECK(points_of(plane).size() == 4);
  for (const Vector3d& point : points_of(plane)) CHECK(point.dot(Vector3d(0.6, 0, 0.8)) == Approx(2));

  HeightField field{.columns = 5, .rows = 4, .spacing_x = 0.5, .spacing_y = 0.25, .origin_x = -1, .origin_y = 2, .heights = {}};
  for (int k = 0; k < 20; ++k) field.heights.push_back(0.1 * ((7 * k) % 5));
  effects.ground = Ground{.height = 1, .terrain = field};
  const Drawing terrain = drawing_of(model, effects);
  require_sound(terrain, model);
  Vector3d least = Vector3d::Constant(1e9), most = -least;
  for (const Vector3d& point : points_of(terrain)) {
    CHECK(point.z() == Approx(1 + height_below(field, point.x(), point.y())).margin(1e-5));
    least = least.cwiseMin(point);
    most = most.cwiseMax(point);
  }
  CHECK(least.x() < -3);
  CHECK(most.y() > 4);
  for (const DrawnPart& part : terrain.parts) {
    if (part.layer == Layer::ground) CHECK(least_agreement(terrain.meshes[part.mesh]) > 0.7);
  }

  field = {.columns = 1500,
           .rows = 1000,
           .spacing_x = 0.1,
           .spacing_y = 0.1,
           .origin_x = 0,
           .origin_y = 0,
           .heights = std::vector<double>(1'500'000, 0.5)};
  effects.ground->terrain = field;
  const Drawing large = drawing_of(model, effects);
  require_sound(large, model);
  REQUIRE(large.warnings.size() == 1);
  CHECK_THAT(large.warnings[0], Catch::Contains("one in 3 of its points"));
  CHECK(points_of(large).size() < 260'000);
}

TEST_CASE("every robot at hand gives a drawing, whatever of its files is missing") {
  for (const std::string& file : robot_files()) {
    CAPTURE(file);
    for (const Base base : {Base::fixed, Base::floating}) {
      const Model model = load_urdf(file, base);
      const Drawing drawing = drawing_of(model);
      require_sound(drawing, model);
      CHECK(count(drawing, Layer::visual) > 0);
      CHECK(count(drawing, Layer::inertia) > 0);
    }
  }
}

}  // namespace
}  // namespace linden::drawing_test

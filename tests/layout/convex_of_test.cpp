#include "models/shapes/convex_of.hpp"

#include <algorithm>
#include <catch2/catch.hpp>

#include "layout/effects.hpp"
#include "models/shapes/collision_pairs.hpp"
#include "tests/layout/robots.hpp"
#include "tests/scratch_folder.hpp"

namespace linden::convex_of_test {
namespace {

using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;

std::string collision(const std::string& shape, const std::string& origin = "") {
  return "<collision>" + origin + "<geometry>" + shape + "</geometry></collision>";
}

template <class Call>
std::string refusal(const Call& call) {
  try {
    call();
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST_CASE("collision shapes become convex ones of their sizes, those fixed to the world first") {
  const Model model = parse_urdf(
      robot(link("floor", collision("<box size=\"4 2 0.2\"/>")) +
            link("b", collision("<sphere radius=\"0.3\"/>", "<origin xyz=\"1 2 3\"/>") + collision("<cylinder radius=\"0.1\" length=\"0.6\"/>") +
                          collision("<capsule radius=\"0.2\" length=\"0.8\"/>")) +
            joint("j", "continuous", "floor", "b", "<axis xyz=\"0 0 1\"/>")),
      "test.urdf");
  std::vector<std::string> notes;
  const std::vector<ConvexBody> shapes = convex_of(model, notes);
  CHECK(notes.empty());
  REQUIRE(shapes.size() == 4);
  CHECK((shapes[0].slot == 0 && shapes[0].link == "floor" && shapes[0].shape.kind == ConvexKind::box));
  CHECK(shapes[0].shape.half == std::array<double, 3>{2, 1, 0.1});
  CHECK((shapes[1].slot == 1 && shapes[1].link == "b" && shapes[1].shape.kind == ConvexKind::point && shapes[1].shape.radius == 0.3));
  CHECK(shapes[1].pose.shift == std::array<double, 3>{1, 2, 3});
  CHECK((shapes[2].shape.kind == ConvexKind::cylinder && shapes[2].shape.radius == 0));
  CHECK(shapes[2].shape.half == std::array<double, 3>{0.1, 0.1, 0.3});
  CHECK((shapes[3].shape.kind == ConvexKind::segment && shapes[3].shape.radius == 0.2 && shapes[3].shape.half[2] == 0.4));
}

TEST_CASE("a mesh becomes the hull of its points, scaled and mirrored, about the middle of its box") {
  const ScratchFolder folder;
  // a pyramid with a dent: the point inside is no corner of the hull
  folder.write("part.obj", "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nv 1 1 3\nv 1 1 0.5\nf 1 2 5\n");
  folder.write("robot.urdf", robot(link("a") + link("b", collision("<mesh filename=\"part.obj\" scale=\"1 -1 2\"/>", "<origin xyz=\"10 0 0\"/>") +
                                                             collision("<mesh filename=\"part.obj\" scale=\"1 -1 2\"/>") +
                                                             collision("<mesh filename=\"absent.stl\"/>")) +
                                   joint("j", "continuous", "a", "b", "<axis xyz=\"0 0 1\"/>")));
  std::vector<std::string> notes;
  const std::vector<ConvexBody> shapes = convex_of(load_urdf(folder.file("robot.urdf")), notes);
  REQUIRE(notes.size() == 2);
  CHECK_THAT(notes[0], StartsWith("link \"b\": mesh \"absent.stl\" not found; it touches nothing"));
  CHECK(notes[1] == "2 meshes stand as their convex hulls");
  REQUIRE(shapes.size() == 2);
  CHECK(shapes[0].shape.hull == shapes[1].shape.hull);  // read once
  CHECK(shapes[0].pose.shift == std::array<double, 3>{11, -1, 3});
  REQUIRE(shapes[0].shape.kind == ConvexKind::hull);
  const ConvexHull& hull = *shapes[0].shape.hull;
  CHECK(hull.points.size() == 5);
  CHECK(hull.faces.size() == 5);
  CHECK(std::ranges::find(hull.points, std::array<double, 3>{0, 0, 3}) != hull.points.end());
  CHECK(std::ranges::find(hull.points, std::array<double, 3>{-1, 1, -3}) != hull.points.end());
}

TEST_CASE("links of one body, neighbours, tied bodies and disabled links are not looked at") {
  const std::string axis = "<axis xyz=\"0 0 1\"/>";
  Model model = parse_urdf(robot(link("world_fixed") + link("a") + link("b") + link("c") + link("c_tip") + link("d") +
                                 joint("j1", "continuous", "world_fixed", "a", axis) + joint("j2", "continuous", "a", "b", axis) +
                                 joint("j3", "continuous", "b", "c", axis) + joint("j4", "fixed", "c", "c_tip") +
                                 joint("j5", "continuous", "world_fixed", "d", axis)),
                           "test.urdf");
  const auto looked_at = [&](const CollisionPairs& pairs, const std::string& one, const std::string& other) {
    const Index a = place_of(model, one).slot, b = place_of(model, other).slot;
    CHECK(pairs.may_touch(a, one, b, other) == pairs.may_touch(b, other, a, one));
    return pairs.may_touch(a, one, b, other);
  };
  const CollisionPairs all(model);
  CHECK(!looked_at(all, "c", "c_tip"));
  CHECK(!looked_at(all, "a", "b"));
  CHECK(!looked_at(all, "b", "c_tip"));
  CHECK(!looked_at(all, "world_fixed", "a"));
  CHECK(!looked_at(all, "world_fixed", "d"));
  CHECK(looked_at(all, "world_fixed", "b"));
  CHECK(looked_at(all, "a", "c_tip"));
  CHECK(looked_at(all, "a", "d"));  // hung on the world both, no neighbours
  const CollisionPairs some(model, {{"c_tip", "a"}});
  CHECK(!looked_at(some, "a", "c_tip"));
  CHECK(looked_at(some, "a", "c"));
  model.couplings.push_back({.name = "loop", .kind = CouplingKind::hinge, .slot_a = place_of(model, "d").slot, .slot_b = place_of(model, "c").slot});
  model.couplings.push_back({.name = "gear", .kind = CouplingKind::gear});
  const CollisionPairs tied(model);
  CHECK(!looked_at(tied, "c_tip", "d"));
  CHECK(looked_at(tied, "a", "d"));
  CHECK_THAT(refusal([&] { CollisionPairs(model, {{"a", "c_tipp"}}); }), Contains("has no link \"c_tipp\"") && Contains("c_tip"));
}

TEST_CASE("an SRDF file says which pairs are disabled") {
  const ScratchFolder folder;
  folder.write("r.srdf", "<?xml version=\"1.0\"?>\n<robot name=\"r\">\n<group name=\"arm\"/>\n"
                         "<disable_collisions link1=\"a\" link2=\"b\" reason=\"Adjacent\"/>\n"
                         "<disable_collisions link1=\"c\" link2=\"a\"/>\n</robot>\n");
  CHECK(srdf_disabled_pairs(folder.file("r.srdf")) == LinkPairs{{"a", "b"}, {"c", "a"}});
  folder.write("half.srdf", "<robot>\n<disable_collisions link1=\"a\"/>\n</robot>\n");
  CHECK_THAT(refusal([&] { srdf_disabled_pairs(folder.file("half.srdf")); }), Contains("half.srdf:2: <disable_collisions> without link1 and link2"));
  folder.write("other.srdf", "<model/>");
  CHECK_THAT(refusal([&] { srdf_disabled_pairs(folder.file("other.srdf")); }), Contains("its root is <model>; expected <robot>"));
  CHECK_THAT(refusal([&] { srdf_disabled_pairs(folder.file("absent.srdf")); }), Contains("there is no such file"));
}

}  // namespace
}  // namespace linden::convex_of_test

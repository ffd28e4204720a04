#include "engine/queries/proximity.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <set>

#include "engine/simulation.hpp"
#include "models/urdf/urdf.hpp"
#include "tests/layout/robots.hpp"

namespace linden::proximity_test {
namespace {

using Catch::Matchers::Contains;

std::string box(const std::string& size, const std::string& origin = "0 0 0") {
  return "<collision><origin xyz=\"" + origin + "\"/><geometry><box size=\"" + size + "\"/></geometry></collision>";
}
std::string ball(double radius) { return fmt::format("<collision><geometry><sphere radius=\"{}\"/></geometry></collision>", radius); }

std::string slide(const std::string& name, const std::string& parent, const std::string& child, const std::string& at) {
  return joint(name, "prismatic", parent, child,
               "<axis xyz=\"0 0 1\"/><origin xyz=\"" + at + "\"/><limit lower=\"-9\" upper=\"9\" effort=\"9\" velocity=\"9\"/>");
}

/// A tower of two sliders on a base, a bar fixed to the upper one, and beside it a slider of its own.
Model tower() {
  return parse_urdf(robot(link("base", box("4 4 0.2", "0 0 -0.1")) + link("low", box("1 1 0.2")) + link("high", ball(0.1)) +
                          link("bar", box("0.1 3 0.1")) + link("bare") + link("aside", ball(0.2) + box("0.2 0.2 0.2", "0 0 1")) + slide("s1", "base", "low", "0 0 1") +
                          slide("s2", "low", "high", "0 0 1") + joint("f", "fixed", "high", "bar", "<origin xyz=\"0 0 0.5\"/>") +
                          joint("g", "fixed", "high", "bare") + slide("s3", "base", "aside", "0 1 2.5")),
                    "test.urdf");
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

TEST_CASE("the distance of two links is that of their nearest shapes, with the places and the direction") {
  const Model model = tower();
  const Proximity shapes(model);
  CHECK(shapes.notes().empty());
  const Kinematics now(model);
  // the bar's middle line at z = 2.5, as the ball of radius 0.2 at y = 1
  const LinkDistance far = shapes.distance(now, "high", "aside");
  CHECK(std::abs(far.distance - (std::hypot(1, 0.5) - 0.3)) < 1e-15);
  CHECK(std::abs(far.normal[1] - 1 / std::hypot(1, 0.5)) < 1e-15);
  CHECK(std::abs(far.on_a[1] - 0.1 / std::hypot(1, 0.5)) < 1e-15);
  CHECK(std::abs(far.on_b[2] - (2.5 - 0.2 * 0.5 / std::hypot(1, 0.5))) < 1e-15);
  const LinkDistance back = shapes.distance(now, "aside", "high");
  CHECK(std::abs(back.distance - far.distance) < 1e-15);
  CHECK(std::abs(back.normal[1] + far.normal[1]) < 1e-15);
  // neighbours are asked for by name like any: the box of 0.2 about z = 1 over the base
  CHECK(std::abs(shapes.distance(now, "base", "low").distance - 0.9) < 1e-15);
  const LinkDistance deep = shapes.distance(now, "bar", "aside");  // its line runs through the middle of the ball
  CHECK(std::abs(deep.distance - -0.25) < 1e-15);
  const std::vector<double> q{-0.95, 0, 0};
  const Kinematics sunk(model, q);
  CHECK(std::abs(shapes.distance(sunk, "base", "low").distance - -0.05) < 1e-15);
}

TEST_CASE("near finds all pairs of shapes within the margin that are no neighbours, with the points where they meet") {
  const Model model = tower();
  const Proximity shapes(model);
  const auto names = [](const std::vector<NearPair>& pairs) {
    std::vector<std::string> found;
    for (const NearPair& pair : pairs) found.push_back(pair.link_a + "-" + pair.link_b);
    return found;
  };
  // low sinks into the base, its neighbour, and high with it: 2 mm over the base's top
  std::vector<double> q(3, 0.0);
  q[static_cast<std::size_t>(row_of(model, "s1"))] = -0.95;
  q[static_cast<std::size_t>(row_of(model, "s2"))] = -0.948;
  const Kinematics now(model, q);
  const std::vector<NearPair> pairs = shapes.near(now, 0.01);
  REQUIRE(names(pairs) == std::vector<std::string>{"base-high"});
  CHECK(std::abs(pairs[0].distance - 0.002) < 1e-15);
  CHECK(pairs[0].slot_a == 0);
  CHECK(pairs[0].slot_b == place_of(model, "high").slot);
  CHECK(std::abs(pairs[0].normal[2] - 1) < 1e-15);
  REQUIRE(pairs[0].points.size() == 1);
  CHECK(std::abs(pairs[0].points[0].place[2] - 0.001) < 1e-15);
  CHECK(shapes.near(now, 0.001).empty());
  // the bar over a face of aside's box: two faces, four points
  q = {0, 0, 0};
  q[static_cast<std::size_t>(row_of(model, "s3"))] = -1.151;
  const std::vector<NearPair> face = shapes.near(Kinematics(model, q), 0.01);
  REQUIRE(names(face) == std::vector<std::string>{"aside-bar"});
  CHECK(face[0].points.size() == 4);
  CHECK(std::abs(face[0].distance - 0.001) < 1e-14);
  CHECK(face[0].shape_b == 5);
  const Proximity less(model, {{"aside", "bar"}});
  CHECK(less.near(Kinematics(model, q), 0.01).empty());
  CHECK(std::abs(less.distance(Kinematics(model, q), "aside", "bar").distance - 0.001) < 1e-14);  // by name all the same
}

TEST_CASE("of a robot near finds what the distances of all its links say") {
  const Model model = load_urdf(std::string(LINDEN_MODELS_DIR) + "/humanoid.urdf", Base::floating);
  const Proximity shapes(model);
  Simulation simulation(model, {.step = 1e-3});
  simulation.run(200);
  const Kinematics now(simulation);
  std::set<std::string> links;
  for (const BodyShape& shape : model.shapes) links.insert(shape.link);
  REQUIRE(links.size() > 10);
  const CollisionPairs pairs(model);
  std::set<std::pair<std::string, std::string>> expected, found;
  for (const std::string& a : links) {
    for (const std::string& b : links) {
      if (a >= b || !pairs.may_touch(place_of(model, a).slot, a, place_of(model, b).slot, b)) continue;
      if (shapes.distance(now, a, b).distance <= 0.1) expected.emplace(a, b);
    }
  }
  for (const NearPair& pair : shapes.near(now, 0.1)) {
    found.emplace(std::min(pair.link_a, pair.link_b), std::max(pair.link_a, pair.link_b));
    CHECK(pair.shape_a < pair.shape_b);
    CHECK(pair.points.size() >= 1);
    for (const NearPoint& point : pair.points) CHECK(point.gap <= 0.1);
  }
  CHECK(expected.size() > 3);
  CHECK(found == expected);
}

TEST_CASE("what cannot be asked is told, with the nearest name") {
  const Model model = tower();
  const Proximity shapes(model);
  const Kinematics now(model);
  CHECK_THAT(refusal([&] { shapes.distance(now, "base", "lowe"); }), Contains("has no link \"lowe\"") && Contains("low"));
  CHECK_THAT(refusal([&] { shapes.distance(now, "bare", "base"); }), Contains("link \"bare\" has no collision shape"));
  CHECK_THAT(refusal([&] { shapes.distance(now, "base", "base"); }), Contains("from itself"));
  CHECK_THAT(refusal([&] { shapes.near(now, -1); }), Contains("margin: -1 m; expected zero or more"));
  CHECK_THAT(refusal([&] { Proximity(model, {{"base", "nobody"}}); }), Contains("has no link \"nobody\""));
}

}  // namespace
}  // namespace linden::proximity_test

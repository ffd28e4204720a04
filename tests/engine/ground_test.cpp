#include <catch2/catch.hpp>

#include <cmath>
#include <functional>
#include <numbers>

#include "engine/batch.hpp"
#include "engine/scene/scene_file.hpp"
#include "folder.hpp"
#include "models/build/builder.hpp"
#include "models/build/generators.hpp"
#include "models/build/random.hpp"
#include "scenes.hpp"

namespace linden::ground_test {
namespace {

using Eigen::Vector3d;

constexpr double kG = 9.81;
constexpr double kRadius = 0.1;

double radians(double degrees) { return degrees * std::numbers::pi / 180; }

/// One kilogram that floats, with the inertia of a shape, and what of it touches the ground.
struct Body {
  std::string name;
  double inertia;   // about y, which it rolls about [kg m^2]
  double height;    // of its centre over a plane it lies on
  double contacts;  // that bear its weight
  Contacts touching;
};

ContactBlock block(const std::array<double, 3>& half, double radius) {
  return {.slot = 1, .center = {}, .axes = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}, .half = half, .radius = radius};
}

Body ball() { return {"ball", 0.4 * kRadius * kRadius, kRadius, 1, {.spheres = {{.slot = 1, .center = {}, .radius = kRadius}}, .rims = {}, .blocks = {}}}; }
Body wheel() {
  Body it{"wheel", 0.5 * kRadius * kRadius, kRadius, 2, {}};
  for (const double y : {-0.05, 0.05}) it.touching.rims.push_back({.slot = 1, .center = {0, y, 0}, .axis = {0, 1, 0}, .radius = kRadius});
  return it;
}
Body capsule() {
  Body it{"capsule", 0.45 * kRadius * kRadius, kRadius, 2, {}};
  for (const double y : {-0.1, 0.1}) {
    it.touching.spheres.push_back({.slot = 1, .center = {0, y, 0}, .radius = kRadius, .outward = {0, 10 * y, 0}});
  }
  it.touching.blocks = {block({0, 0.1, 0}, kRadius)};
  return it;
}
Body box() {
  Body it{"box", 2.0 / 3 * 0.05 * 0.05, 0.05, 4, {}};
  for (const double x : {-0.1, 0.1}) {
    for (const double y : {-0.1, 0.1}) {
      for (const double z : {-0.05, 0.05}) it.touching.spheres.push_back({.slot = 1, .center = {x, y, z}, .radius = 0});
    }
  }
  it.touching.blocks = {block({0.1, 0.1, 0.05}, 0)};
  return it;
}
/// A cylinder on its flat side.
Body can() {
  Body it{"can", 0.5 * kRadius * kRadius, 0.05, 4, {}};
  for (const double z : {-0.05, 0.05}) it.touching.rims.push_back({.slot = 1, .center = {0, 0, z}, .axis = {0, 0, 1}, .radius = kRadius});
  return it;
}

Model model_of(const Body& body) {
  LinkSpec link;
  link.name = "body";
  link.joint = "base";
  link.type = JointType::free;
  link.inertia = {1, Vector3d::Zero(), Vector3d(body.inertia, body.inertia, body.inertia).asDiagonal()};
  return TreeBuilder("body").add(link).build();
}

/// Heights along x alone, far to both sides of y; what lies between points is straight.
HeightField along_x(const std::function<double(double)>& height, double from, double to, double spacing) {
  HeightField field{.columns = static_cast<Index>(std::lround((to - from) / spacing)) + 1, .rows = 7, .spacing_x = spacing, .spacing_y = 0.37,
                    .origin_x = from, .origin_y = -1.1, .heights = {}};
  for (Index row = 0; row < field.rows; ++row) {
    for (Index column = 0; column < field.columns; ++column) field.heights.push_back(height(from + column * spacing));
  }
  return field;
}

/// The ground as a tilted plane, or level with heights that slope; both fall along x.
Ground slope(double angle, bool terrain) {
  Ground ground{.stiffness = 1e5, .damping = 100, .friction = 1};
  if (terrain) {
    ground.terrain = along_x([&](double x) { return -x * std::tan(angle); }, -8, 8, 0.23);
  } else {
    ground.normal = {std::sin(angle), 0, std::cos(angle)};
  }
  return ground;
}

/// Where the body lies at a distance along the slope, as deep as its weight presses it.
std::vector<double> lying(const Body& body, const Ground& ground, double angle, double along) {
  const double height = body.height - kG * std::cos(angle) / (body.contacts * ground.stiffness);
  const Vector3d at = along * Vector3d(std::cos(angle), 0, -std::sin(angle)) + height * Vector3d(std::sin(angle), 0, std::cos(angle));
  return {at.x(), at.y(), at.z(), 0, std::sin(angle / 2), 0, std::cos(angle / 2)};
}

Simulation placed(const Body& body, const Ground& given, const std::vector<double>& q, const std::vector<double>& v, double step = 1e-3,
                  std::array<double, 3> gravity = {0, 0, -kG}) {
  Effects effects;
  effects.ground = given;
  effects.ground->contacts = body.touching;
  Simulation simulation(model_of(body), {.step = step, .gravity = gravity}, effects);
  simulation.set_positions(q);
  simulation.set_velocities(v);
  return simulation;
}

double along_slope(Simulation& simulation, double angle) {
  return simulation.positions()[0] * std::cos(angle) - simulation.positions()[2] * std::sin(angle);
}

double balance(Simulation& simulation) { return simulation.energy().total() + simulation.effect_work().taken(); }

}  // namespace

TEST_CASE("round bodies roll down slopes as their inertia says, on a plane and on a terrain, to first order of the step", "[ground]") {
  for (const Body& body : {ball(), wheel(), capsule()}) {
    for (const bool terrain : {false, true}) {
      for (const double degrees : {0.0, 10.0, 20.0, 35.0, 60.0}) {
        const double angle = radians(degrees), acceleration = kG * std::sin(angle) / (1 + body.inertia / (kRadius * kRadius)), start = 0.5;
        const double duration = 0.8, expected = start * duration + 0.5 * acceleration * duration * duration;
        double error[2];
        for (int halving = 0; halving < 2; ++halving) {
          const Ground ground = slope(angle, terrain);
          Simulation rolling = placed(body, ground, lying(body, ground, angle, 0), {0, start / kRadius, 0, start, 0, 0}, 2e-3 / (1 + halving));
          run(rolling, static_cast<int>(std::lround(duration / rolling.options().step)));
          error[halving] = std::abs(along_slope(rolling, angle) - expected);
          INFO(body.name << " on a " << (terrain ? "terrain" : "plane") << " of " << degrees << " degrees, energy " << rolling.energy().total());
          CHECK(std::abs(rolling.positions()[1]) < 1e-9);
        }
        INFO(body.name << " on a " << (terrain ? "terrain" : "plane") << " of " << degrees << " degrees: " << error[0] << ", " << error[1]);
        CHECK(error[0] < 4e-3 * expected);
        CHECK((error[1] < 1e-5 || error[1] < 0.7 * error[0]));
      }
    }
  }
}

TEST_CASE("what is steeper than its friction slides as Coulomb says: flat bodies with g (sin - mu cos), round ones spinning up", "[ground]") {
  const double mu = 0.1;
  for (const Body& body : {ball(), wheel(), capsule(), box(), can()}) {
    for (const bool terrain : {false, true}) {
      for (const double degrees : {0.0, 10.0, 20.0, 35.0, 60.0}) {
        const double angle = radians(degrees);
        const bool round = body.name != "box" && body.name != "can";
        if (round && std::tan(angle) < 1.2 * mu * (1 + kRadius * kRadius / body.inertia)) continue;  // it would roll
        const double acceleration = kG * (std::sin(angle) - mu * std::cos(angle)), start = 2, duration = 0.5;
        const double expected = start * duration + 0.5 * acceleration * duration * duration;
        Ground ground = slope(angle, terrain);
        ground.friction = mu;
        Simulation sliding = placed(body, ground, lying(body, ground, angle, 0), {0, round ? start / kRadius : 0, 0, start, 0, 0});
        run(sliding, static_cast<int>(std::lround(duration / sliding.options().step)));
        INFO(body.name << " on a " << (terrain ? "terrain" : "plane") << " of " << degrees << " degrees");
        CHECK(along_slope(sliding, angle) == Approx(expected).epsilon(2e-3));
        if (round) {
          const double spin = start / kRadius + mu * kG * std::cos(angle) * kRadius / body.inertia * duration;
          CHECK(sliding.velocities()[1] == Approx(spin).epsilon(5e-3));
        }
      }
    }
  }
}

TEST_CASE("a wheel that rolls on the level keeps its speed and its energy at any step", "[ground]") {
  Ground ground = slope(0, false);
  ground.damping = 0;
  for (const double step : {5e-4, 1e-3, 2e-3}) {
    Simulation rolling = placed(wheel(), ground, lying(wheel(), ground, 0, 0), {0, 20, 0, 2, 0, 0}, step);
    const double start = rolling.energy().total();
    run(rolling, 10);
    const double early = rolling.energy().total();
    run(rolling, static_cast<int>(std::lround(5 / step)) - 10);
    INFO("step " << step);
    // a twist over a step moves its centre along an arc: to second order of the turn a step
    const double turn = 20 * step, second_order = turn * turn / 4;
    CHECK(rolling.positions()[0] == Approx(10).epsilon(second_order));
    CHECK(rolling.momentum().linear[0] == Approx(2).epsilon(second_order));
    CHECK(rolling.momentum().angular[1] - rolling.positions()[2] * rolling.momentum().linear[0] == Approx(0.005 * 20).epsilon(second_order));
    CHECK(rolling.energy().total() == Approx(start).epsilon(second_order));
    CHECK(rolling.energy().total() == Approx(early).epsilon(1e-10));
  }
}

TEST_CASE("a leaning disc that rolls in a circle is given no energy", "[ground]") {
  // one rim alone, leaning 0.3 rad, rolling along x
  Body disc{"disc", 0.25 * kRadius * kRadius, kRadius, 1, {}};
  disc.touching.rims = {{.slot = 1, .center = {0, 0, 0}, .axis = {0, 1, 0}, .radius = kRadius}};
  double gained[2];
  for (int halving = 0; halving < 2; ++halving) {
    Ground ground = slope(0, false);
    ground.damping = 0;
    const double lean = 0.3, height = kRadius * std::cos(lean) - kG / ground.stiffness;
    Simulation rolling = placed(disc, ground, {0, 0, height, std::sin(lean / 2), 0, 0, std::cos(lean / 2)}, {0, 30, 0, 3, 0, 0}, 1e-3 / (1 + halving));
    const double start = rolling.energy().total();
    double most = start;
    for (int step = 0; step < 2000 * (1 + halving); ++step) {
      run(rolling, 1);
      most = std::max(most, rolling.energy().total());
    }
    gained[halving] = (most - start) / start;
  }
  INFO(gained[0] << ", " << gained[1]);
  CHECK(gained[0] < 2e-3);
  CHECK((gained[1] < 1e-6 || gained[1] < gained[0] / 1.8));
}

TEST_CASE("a ball and a wheel pass over creases, up and down, and are given no energy beyond the second order of the step", "[ground]") {
  for (const Body& body : {ball(), wheel()}) {
    for (const double bend : {30.0, -30.0, 10.0, -10.0, 60.0}) {
      for (const double friction : {0.0, 1.0}) {
        double gained[2];
        for (int halving = 0; halving < 2; ++halving) {
          Ground ground{.stiffness = 1e5, .damping = 0, .friction = friction};
          ground.terrain = along_x([&](double x) { return std::max(x - 1, 0.0) * std::tan(radians(bend)); }, -5, 15, 0.5);
          const double step = 1e-3 / (1 + halving), speed = 1;
          Simulation rolling = placed(body, ground, lying(body, ground, 0, 0), {0, speed / kRadius, 0, speed, 0, 0}, step);
          const double start = rolling.energy().total();
          double most = start, highest = 0;
          for (int k = 0; k < std::lround(2 / step); ++k) {
            run(rolling, 1);
            most = std::max(most, rolling.energy().total());
            highest = std::max(highest, rolling.positions()[2]);
          }
          gained[halving] = most - start;
          INFO(body.name << " over " << bend << " degrees, friction " << friction << ", step " << step << ": highest " << highest);
          const double kinetic = 0.5 * (1 + body.inertia / (kRadius * kRadius)) * speed * speed;
          CHECK(highest < kRadius + kinetic / kG + 1e-3);
          // it meets the ground on the other side, not what is below it
          const double x = rolling.positions()[0], over = std::max(x - 1, 0.0) * std::tan(radians(bend));
          CHECK(rolling.positions()[2] > over + 0.9 * kRadius);
          if (body.name == "ball") CHECK(std::abs(rolling.positions()[1]) < 1e-9);
        }
        INFO(body.name << " over " << bend << " degrees, friction " << friction << ": given " << gained[0] << ", " << gained[1]);
        CHECK(gained[0] < 2e-3);
        CHECK((gained[1] < 1e-6 || gained[1] < 0.4 * gained[0]));
      }
    }
  }
}

TEST_CASE("a ball comes to rest in a groove and in a corner of three faces, as deep as its weight presses it", "[ground]") {
  Ground groove{.stiffness = 1e5, .damping = 300, .friction = 0.3};
  groove.terrain = along_x([](double x) { return std::abs(x); }, -4, 4, 0.5);
  Simulation in_groove = placed(ball(), groove, {0.03, 0, 0.3, 0, 0, 0, 1}, std::vector<double>(6, 0.0));
  run(in_groove, 4000);
  // two faces of 45 degrees each bear m g / sqrt 2
  const double depth = kG / std::sqrt(2.0) / groove.stiffness;
  CHECK(std::abs(in_groove.positions()[0]) < 1e-4);
  CHECK(in_groove.positions()[2] == Approx((kRadius - depth) * std::sqrt(2.0)).margin(5e-5));
  CHECK(std::abs(in_groove.energy().kinetic) < 1e-9);

  // a pit whose corner lies at a grid point: floor, and walls that rise towards -x and -y
  Ground corner{.stiffness = 1e5, .damping = 300, .friction = 0};
  HeightField pit{.columns = 9, .rows = 9, .spacing_x = 0.5, .spacing_y = 0.5, .origin_x = -2, .origin_y = -2, .heights = {}};
  for (int row = 0; row < 9; ++row) {
    for (int column = 0; column < 9; ++column) pit.heights.push_back(std::max({0.0, -(column * 0.5 - 2), -(row * 0.5 - 2)}));
  }
  corner.terrain = pit;
  // pulled towards the corner
  Simulation in_corner = placed(ball(), corner, {0.3, 0.3, 0.2, 0, 0, 0, 1}, std::vector<double>(6, 0.0), 1e-3, {-2, -2, -9});
  run(in_corner, 8000);
  // against the walls, whose normals are (1, 0, 1) / sqrt 2 and (0, 1, 1) / sqrt 2, and on the floor
  const double side = kRadius * std::tan(radians(22.5));
  CHECK(in_corner.positions()[0] == Approx(side).margin(2e-4));
  CHECK(in_corner.positions()[1] == Approx(side).margin(2e-4));
  CHECK(in_corner.positions()[2] == Approx(kRadius).margin(2e-4));
  CHECK(std::abs(in_corner.energy().kinetic) < 1e-8);
}

TEST_CASE("beyond the map its last heights go on, level where they are, and nothing is pushed along them", "[ground]") {
  for (const Body& body : {ball(), wheel(), box()}) {
    Ground ground{.stiffness = 1e5, .damping = 300, .friction = 0};
    ground.terrain = along_x([](double x) { return -x * std::tan(radians(20)); }, -5, 5, 0.5);
    const double edge = -5 * std::tan(radians(20));
    Simulation still = placed(body, ground, {6, 0, edge + body.height - kG / (body.contacts * ground.stiffness), 0, 0, 0, 1}, {0, 0, 0, 0.25, 0, 0});
    const double start = still.energy().total();
    run(still, 2000);
    INFO(body.name);
    CHECK(still.positions()[0] == Approx(6.5).margin(1e-6));
    CHECK(still.positions()[2] == Approx(edge + body.height - kG / (body.contacts * ground.stiffness)).margin(1e-6));
    CHECK(still.energy().total() <= start + 1e-9);
    // along the edge the slope goes on sideways
    Simulation beside = placed(body, ground, {0, 4, 0.5, 0, 0, 0, 1}, std::vector<double>(6, 0.0));
    run(beside, 1000);
    CHECK(beside.positions()[0] > 0.5);
    CHECK(beside.positions()[1] == Approx(4).margin(0.01));
    // far beyond any cell that a number can name there is nothing
    Simulation lost = placed(body, ground, {1e12, 0, 0.5, 0, 0, 0, 1}, std::vector<double>(6, 0.0));
    run(lost, 10);
    CHECK(lost.velocities()[5] == Approx(-kG * 0.01).epsilon(1e-6));
  }
}

TEST_CASE("ridges and peaks hold what lies on them between its corners and ends", "[ground]") {
  // two ridges along y, 0.1 m apart and as high
  Ground ridges{.stiffness = 1e5, .damping = 300, .friction = 0.8};
  ridges.terrain = along_x([](double x) { return std::abs(std::abs(x) - 0.05) < 1e-9 ? 0.1 : 0.0; }, -1, 1, 0.05);
  struct Lying {
    Body body;
    double contacts;
    bool turned;
  };
  for (const auto& [body, contacts, turned] : {Lying{box(), 4, false}, Lying{capsule(), 2, true}}) {
    const double quarter = turned ? std::sqrt(0.5) : 0;
    Simulation lying = placed(body, ridges, {0, 0, 0.1 + body.height + 1e-3, 0, 0, quarter, turned ? quarter : 1}, std::vector<double>(6, 0.0));
    run(lying, 3000);
    INFO(body.name);
    CHECK(lying.positions()[2] == Approx(0.1 + body.height - kG / (contacts * ridges.stiffness)).margin(1e-6));
    CHECK(std::abs(lying.positions()[0]) + std::abs(lying.positions()[1]) < 1e-6);
    CHECK(std::abs(lying.positions()[3]) + std::abs(lying.positions()[4]) < 1e-6);
  }
  // three peaks
  Ground peaks = ridges;
  HeightField field{.columns = 41, .rows = 41, .spacing_x = 0.05, .spacing_y = 0.05, .origin_x = -1, .origin_y = -1, .heights = std::vector<double>(41 * 41, 0.0)};
  for (const auto& [column, row] : {std::pair{19, 19}, {21, 19}, {20, 21}}) field.heights[static_cast<std::size_t>(row * 41 + column)] = 0.1;
  peaks.terrain = field;
  Simulation lying = placed(box(), peaks, {0, 0, 0.151, 0, 0, 0, 1}, std::vector<double>(6, 0.0));
  run(lying, 3000);
  // the peak at y = 0.05 bears half of the weight, the two at -0.05 a quarter each
  CHECK(lying.positions()[2] == Approx(0.15 - kG * (0.5 + 0.25) / 2 / peaks.stiffness).margin(2e-6));
  CHECK(std::abs(lying.positions()[0]) < 1e-6);
}

TEST_CASE("a box and a capsule that fall across ridges and bounce are given no energy beyond the second order of the step", "[ground]") {
  for (const Body& body : {box(), capsule()}) {
    double gained[2];
    for (int halving = 0; halving < 2; ++halving) {
      Ground ridges{.stiffness = 1e5, .damping = 0, .friction = 0};
      ridges.terrain = along_x([](double x) { return std::abs(std::abs(x) - 0.05) < 1e-9 ? 0.1 : 0.0; }, -1, 1, 0.05);
      Simulation falling = placed(body, ridges, {0.01, 0, 0.3, 0.05, 0.04, std::sqrt(0.5), std::sqrt(0.5 - 0.05 * 0.05 - 0.04 * 0.04)},
                                  std::vector<double>(6, 0.0), 4e-4 / (1 + halving));
      const double start = falling.energy().total();
      double most = start;
      for (int k = 0; k < 700 * (1 + halving); ++k) {
        run(falling, 1);
        most = std::max(most, falling.energy().total());
      }
      gained[halving] = most - start;
    }
    INFO(body.name << ": " << gained[0] << ", " << gained[1]);
    CHECK(gained[0] < 5e-3);
    CHECK((gained[1] < 1e-5 || gained[1] < 0.5 * gained[0]));
  }
}

TEST_CASE("what tumbles over rough ground is given no energy, whatever features take over from one another", "[ground]") {
  for (const Body& body : {ball(), wheel(), capsule(), box(), can()}) {
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
      Random random(seed);
      Ground rough{.stiffness = 2e4, .damping = 100, .friction = 0.4 * static_cast<double>(seed % 3)};
      HeightField field = along_x([](double) { return 0.0; }, -2, 2, seed % 2 == 0 ? 0.1 : 0.3);
      field.rows = field.columns;
      field.spacing_y = field.spacing_x;
      field.origin_y = -2;
      field.heights.resize(static_cast<std::size_t>(field.rows * field.columns));
      for (double& height : field.heights) height = 0.4 * field.spacing_x * random.uniform(-1, 1);
      rough.terrain = field;
      const std::vector<double> turned = [&] {
        std::vector<double> q{0.03, 0.02, 0.5, random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
        const double length = std::hypot(std::hypot(q[3], q[4]), std::hypot(q[5], q[6]));
        for (std::size_t k = 3; k < 7; ++k) q[k] /= length;
        return q;
      }();
      Simulation tumbling = placed(body, rough, turned, {random.uniform(-4, 4), random.uniform(-4, 4), 0, 0.5, 0.3, 0});
      double least = tumbling.energy().total(), given = 0;
      for (int k = 0; k < 1500; ++k) {
        run(tumbling, 1);
        const double now = tumbling.energy().total();
        least = std::min(least, now);
        given = std::max(given, now - least);
      }
      INFO(body.name << ", seed " << seed << ": given " << given << " J of some 5 J");
      CHECK(given < 0.03);
    }
  }
}

TEST_CASE("energy with the work of friction and damping balances while bodies slide, roll and bounce over a terrain", "[ground]") {
  for (const Body& body : {ball(), wheel(), capsule(), box()}) {
    double error[2];
    for (int halving = 0; halving < 2; ++halving) {
      Ground ground{.stiffness = 2e4, .damping = 50, .friction = 0.4};
      ground.terrain = along_x([](double x) { return 0.1 * std::sin(3 * x) - 0.1 * x; }, -3, 9, 0.4);
      Simulation moving = placed(body, ground, {0.2, 0, 0.35, 0, 0, 0, 1}, {0.3, 5, 0.2, 1, 0.1, 0}, 1e-3 / (1 + halving));
      const double start = balance(moving);
      double most = moving.energy().total();
      const double first = most;
      for (int k = 0; k < 2000 * (1 + halving); ++k) {
        run(moving, 1);
        most = std::max(most, moving.energy().total());
      }
      error[halving] = std::abs(balance(moving) - start);
      INFO(body.name);
      CHECK(most < first + 5e-3);
    }
    INFO(body.name << ": " << error[0] << ", " << error[1]);
    CHECK(error[0] < 0.05);
  }
}

TEST_CASE("a scene is told where its step does not resolve its ground, and what would", "[ground]") {
  const Folder folder;
  folder.write("ball.urdf",
               "<robot name=\"r\"><link name=\"base\"><inertial><mass value=\"1\"/><inertia ixx=\"0.004\" ixy=\"0\" ixz=\"0\" iyy=\"0.004\" iyz=\"0\" "
               "izz=\"0.004\"/></inertial><collision><geometry><sphere radius=\"0.1\"/></geometry></collision></link></robot>");
  const auto warnings = [&](const std::string& step, const std::string& ground) {
    return parse_scene("model: ball.urdf\nbase: floating\nstep: " + step + "\nduration: 1\neffects:\n  gravity: [0, 0, -9.81]\n  ground: " + ground + "\n",
                       folder.file("s.yaml"))
        .model.warnings;
  };
  const auto told = warnings("0.005", "{stiffness: 1e5}");
  REQUIRE(told.size() == 1);
  CHECK_THAT(told[0], Catch::Contains("s.yaml:7: effects.ground: a step of 0.005 s does not resolve a stiffness of 1e+05 N/m under the 1 kg of link \"base\""));
  CHECK_THAT(told[0], Catch::Contains("0.00316 s") && Catch::Contains("4e+04 N/m"));
  CHECK(warnings("0.003", "{stiffness: 1e5}").empty());
  CHECK(warnings("0.005", "{stiffness: 3e4}").empty());
  CHECK(warnings("0.005", "{stiffness: 1e5, damping: 300}").empty());  // what bounces as little as that shows no difference
}

}  // namespace linden::ground_test

// Joints that close loops and have a coordinate of their own.
#include <catch2/catch.hpp>

#include "engine/batch.hpp"
#include "engine/scene/scene_file.hpp"
#include "layout/support/input_error.hpp"
#include "tests/engine/mechanisms.hpp"
#include "tests/scratch_folder.hpp"

namespace linden::closing_joint_test {
namespace {

using Catch::Matchers::Contains;

/// The four-bar closed where coupler and rocker meet, by a joint that has a coordinate.
Model closed_by_a_joint(bool rocker_first = false) {
  const Model open = [] {
    Model model = four_bar(CouplingKind::hinge);
    model.couplings.clear();
    return model;
  }();
  CouplingSpec pin{.name = "pin", .kind = CouplingKind::hinge, .link_a = "coupler", .link_b = "rocker", .at = PointAndAxis{{2, 0, 2}, {0, 1, 0}}};
  if (rocker_first) {
    std::swap(pin.link_a, pin.link_b);
    pin.at->axis = {0, -1, 0};
  }
  pin.joint = ClosingJoint{.name = "pin"};
  return coupled(open, {pin});
}

/// The same where that joint is one of the tree's, and the rocker's other end closes the loop.
Model closed_at_the_ground() {
  TreeBuilder builder("four-bar");
  builder.add(bar("crank", "", {0, 0, 0}, {0, 0, 1}));
  builder.add(bar("coupler", "crank", {0, 0, 1}, {2, 0, 1}));
  LinkSpec rocker = bar("rocker", "coupler", {2, 0, 1}, {1, 0, -2});
  rocker.joint = "pin";
  builder.add(std::move(rocker));
  CouplingSpec foot{.name = "foot", .kind = CouplingKind::hinge, .link_a = "rocker", .link_b = "world", .at = PointAndAxis{{3, 0, 0}, {0, 1, 0}}};
  return coupled(builder.build(), {foot});
}

Index position_row(const Model& model, const std::string& joint) { return model.tree.first_q(model.names.slot_of_joint.at(joint)); }

/// Effects on a joint, by the row of its velocity.
using Acting = Effects (*)(Index row);

template <class Entry>
Effects acting(const Entry& entry) {
  Effects effects;
  effects.list<Entry>().push_back(entry);
  return effects;
}

/// Crank and pin after so many steps from rest.
std::pair<double, double> after(const Model& model, Acting acts, int steps, double* taken = nullptr) {
  const Index q = position_row(model, "pin");
  Simulation simulation(model, {.step = 1e-3}, acts(row_of(model, "pin")));
  for (int k = 0; k < steps; ++k) {
    const StepReport report = simulation.step();
    INFO(simulation.describe(report));
    REQUIRE(report.ok());
  }
  if (taken != nullptr) *taken = simulation.effect_work().taken();
  return {simulation.positions()[static_cast<std::size_t>(position_row(model, "crank_joint"))], simulation.positions()[static_cast<std::size_t>(q)]};
}

const std::pair<const char*, Acting> kActing[] = {
    {"nothing", [](Index) { return Effects{}; }},
    {"damping", [](Index row) { return acting<JointDamping>({row, 0.5}); }},
    {"friction", [](Index row) { return acting<JointFriction>({row, 1.5}); }},
    {"a spring", [](Index row) { return acting<JointSpring>({.row = row, .stiffness = 30, .rest = 0}); }},
};

}  // namespace

TEST_CASE("what acts on a joint that closes a loop acts as on any other") {
  for (const auto& [name, acts] : kActing) {
    INFO(name);
    double taken = 0, expected_taken = 0;
    const auto [crank, pin] = after(closed_by_a_joint(), acts, 1500, &taken);
    const auto [expected_crank, expected_pin] = after(closed_at_the_ground(), acts, 1500, &expected_taken);
    const auto [other_crank, other_pin] = after(closed_by_a_joint(true), acts, 1500);
    // two cuts are two discretizations, both of second order
    CHECK(std::abs(expected_crank) > 0.3);
    CHECK(crank == Approx(expected_crank).margin(2e-5));
    CHECK(pin == Approx(expected_pin).margin(2e-5));
    CHECK(other_crank == Approx(crank).margin(2e-5));
    CHECK(other_pin == Approx(pin).margin(2e-5));
    CHECK(taken == Approx(expected_taken).margin(1e-4));
  }
}

TEST_CASE("a joint that closes a loop stops at its limits, and bounces without loss") {
  const Model model = closed_by_a_joint();
  const Index v = row_of(model, "pin");
  const std::size_t q = static_cast<std::size_t>(position_row(model, "pin"));
  for (const double restitution : {0.0, 1.0}) {
    Effects effects;
    effects.limits.push_back({.row = v, .lower = -0.4, .upper = 0.4, .restitution = restitution});
    Simulation simulation(model, {.step = 1e-3}, effects);
    const double start = simulation.energy().total();
    double least = 0, most = 0;
    for (int k = 0; k < 4000; ++k) {
      const StepReport report = simulation.step();
      INFO(simulation.describe(report));
      REQUIRE(report.ok());
      least = std::min(least, simulation.positions()[q]);
      most = std::max(most, simulation.positions()[q]);
    }
    CHECK(least >= -0.4 - 1e-9);
    CHECK(most <= 0.4 + 1e-9);
    CHECK((least < -0.399 || most > 0.399));
    CHECK(worst_gap(simulation.couplings()) < 1e-12);
    if (restitution == 1) CHECK(simulation.energy().total() == Approx(start).margin(0.02));
  }
}

TEST_CASE("a link that is shared with a joint keeps its mass, and a joint to the world shares the link that moves") {
  const Model shared = closed_by_a_joint();
  CHECK(shared.tree.bodies() == 4);
  CHECK(shared.constants.subtree_mass(0) == Approx(four_bar(CouplingKind::hinge).constants.subtree_mass(0)).epsilon(1e-14));
  REQUIRE(shared.couplings.size() == 1);
  CHECK(shared.couplings[0].kind == CouplingKind::weld);
  Model open = four_bar(CouplingKind::hinge);
  open.couplings.clear();
  CouplingSpec foot{.name = "foot", .kind = CouplingKind::slider, .link_a = "coupler", .link_b = "world", .at = PointAndAxis{{2, 0, 2}, {1, 0, 0}}};
  foot.joint = ClosingJoint{.name = "slide"};
  const Model slides = coupled(open, {foot});
  CHECK(slides.names.link.contains("coupler at slide"));
  CHECK(slides.tree.parent(slides.names.link.at("coupler at slide").slot) == 0);
}

TEST_CASE("the coordinate is that of the second link against the first, whichever of them is shared") {
  // of the world against the rocker: the angle of a rocker that hangs on the world, the other way round
  Model open = closed_at_the_ground();
  open.couplings.clear();
  CouplingSpec foot{.name = "foot", .kind = CouplingKind::hinge, .link_a = "rocker", .link_b = "world", .at = PointAndAxis{{3, 0, 0}, {0, 1, 0}}};
  foot.joint = ClosingJoint{.name = "foot"};
  Simulation shared(coupled(open, {foot}), {.step = 1e-3}), plain(four_bar(CouplingKind::hinge), {.step = 1e-3});
  REQUIRE(shared.run(1000).ok());
  REQUIRE(plain.run(1000).ok());
  const double rocker = plain.positions()[static_cast<std::size_t>(position_row(plain.model(), "rocker_joint"))];
  CHECK(std::abs(rocker) > 0.1);
  CHECK(shared.positions()[static_cast<std::size_t>(position_row(shared.model(), "foot"))] == Approx(-rocker).margin(2e-5));
}

TEST_CASE("a joint between links that it could not move is refused") {
  Model model = four_bar(CouplingKind::hinge);
  model.couplings.clear();
  for (const char* massless : {"coupler", "rocker"}) {
    for (int k = 0; k < 10; ++k) model.constants.inertia(model.names.link.at(massless).slot, k) = 0;
  }
  CouplingSpec pin{.name = "pin", .kind = CouplingKind::hinge, .link_a = "coupler", .link_b = "rocker", .at = PointAndAxis{{2, 0, 2}, {0, 1, 0}}};
  pin.joint = ClosingJoint{.name = "pin"};
  CHECK_THROWS_WITH(coupled(model, {pin}), Contains("neither \"coupler\" nor \"rocker\" has an inertia that it could move"));
}

TEST_CASE("in a batch a joint that closes a loop moves as alone") {
  const auto model = std::make_shared<const Model>(closed_by_a_joint());
  const Effects effects = acting<JointFriction>({row_of(*model, "pin"), 1.5});
  Batch batch(model, 3, {.step = 1e-3}, effects);
  batch.step(500);
  Simulation alone(*model, {.step = 1e-3}, effects);
  REQUIRE(alone.run(500).ok());
  const auto together = batch.positions().instance(1);
  for (Index row = 0; row < together.size(); ++row) CHECK(together[row] == Approx(alone.positions()[static_cast<std::size_t>(row)]).margin(1e-9));
}

TEST_CASE("a coordinate for what has none is refused") {
  const Model model = four_bar(CouplingKind::hinge);
  CouplingSpec ball{.name = "knot", .kind = CouplingKind::ball, .link_a = "coupler", .link_b = "rocker", .at = PointAndAxis{{2, 0, 2}}};
  ball.joint = ClosingJoint{.name = "k"};
  CHECK_THROWS_WITH(coupled(model, {ball}), Contains("a ball has no coordinate of its own; expected a hinge, a slider or a cable"));
  CouplingSpec soft{.name = "soft", .kind = CouplingKind::hinge, .link_a = "coupler", .link_b = "rocker", .at = PointAndAxis{{2, 0, 2}, {0, 1, 0}}};
  soft.shift = {100, 0};
  soft.joint = ClosingJoint{.name = "s"};
  CHECK_THROWS_WITH(coupled(model, {soft}), Contains("it gives way"));
  soft.shift = {};
  soft.joint = ClosingJoint{.name = "crank_joint"};
  CHECK_THROWS_WITH(coupled(model, {soft}), Contains("there is a joint \"crank_joint\" already; expected a name of its own"));
}

TEST_CASE("a scene gives the joint that closes a loop a name, and asks for effects by it") {
  const ScratchFolder folder;
  folder.write("four.yaml", "model: " LINDEN_MODELS_DIR "/four_bar.urdf\n"
                            "couplings:\n"
                            "  - {type: hinge, name: pin, joint: pin_joint, between: [coupler, rocker], point: [2, 0, 2], axis: [0, 1, 0]}\n"
                            "effects: {gravity: [0, 0, -9.81], friction: {pin_joint: 2}, limits: {pin_joint: {lower: -0.5, upper: 0.5}}}\n");
  const Scene scene = load_scene(folder.file("four.yaml"));
  REQUIRE(scene.effects.friction.size() == 1);
  CHECK(scene.effects.friction[0].row == row_of(scene.model, "pin_joint"));
  REQUIRE(scene.effects.limits.size() == 1);
  Simulation simulation(scene);
  CHECK(simulation.run(200).ok());
}

}  // namespace linden::closing_joint_test

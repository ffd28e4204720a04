// Joints tied by mimics are one coordinate: its inertia, its forces, its friction and its limits, whichever of its links have mass.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/batch.hpp"
#include "models/build/builder.hpp"
#include "tests/engine/scenes.hpp"

namespace linden::mimic_test {
namespace {

constexpr double kStep = 1e-3;

Options still() {
  Options options;
  options.step = kStep;
  options.tolerance = 1e-14;  // what is compared are laws, to rounding
  options.gravity = {0, 0, 0};
  return options;
}

/// A coordinate by its leader's place among positions and velocities, all screws.
Index leader_of(const Model& model) {
  REQUIRE_FALSE(model.mimics.empty());
  return model.mimics.front().leader_v;
}

/// Two slides along `axis` from the world, of masses m_l and m_f: q_f = a q_l + b.
struct Slides {
  double leader_mass = 0, follower_mass = 0, multiplier = 1, offset = 0;
  double inertia() const { return leader_mass + multiplier * multiplier * follower_mass; }
};

LinkSpec slide(const std::string& name, double mass) {
  LinkSpec link;
  link.name = name;
  link.joint = name + "_slide";
  link.type = JointType::prismatic;
  link.inertia.mass = mass;
  return link;
}

Model tied(const Slides& slides) {
  const LinkSpec leader = slide("leader", slides.leader_mass);
  LinkSpec follower = slide("follower", slides.follower_mass);
  follower.mimic = leader.joint;
  follower.multiplier = slides.multiplier;
  follower.offset = slides.offset;
  return TreeBuilder("tied").add(leader).add(follower).build();
}

Model single(double mass) { return TreeBuilder("single").add(slide("leader", mass)).build(); }

/// Both massive, either massless, geared either way.
const Slides kSlides[] = {{1, 1, -2, 0.1}, {0.02, 0, -1, 0}, {0, 0.5, 3, -0.2}, {0, 2, -0.25, 0}, {0.3, 0, 0, 0.4}, {0.3, 5, 0, 0.4}};

/// Rounding of a displacement is some 1e-13 of a velocity, and adds up over steps.
constexpr double kRounding = 1e-11;

/// Effects on the leader of a tied pair, and on the one joint of its twin.
template <class Make>
void check_against_twin(const Make& effects, double speed, int steps) {
  for (const Slides& slides : kSlides) {
    CAPTURE(slides.leader_mass, slides.follower_mass, slides.multiplier);
    const Model model = tied(slides);
    const Index leader = leader_of(model), follower = model.mimics.front().follower_v;
    Simulation pair(model, still(), effects(leader, slides.inertia()));
    Simulation twin(single(slides.inertia()), still(), effects(0, slides.inertia()));
    std::vector<double> v(2, 0.0);
    v[static_cast<std::size_t>(leader)] = speed;
    pair.set_velocities(v);
    twin.set_velocities(std::vector<double>{speed});
    double worst = 0;
    for (int k = 0; k < steps; ++k) {
      run(pair, 1);
      run(twin, 1);
      const double q = twin.positions()[0];
      worst = std::max(worst, std::abs(pair.positions()[static_cast<std::size_t>(leader)] - q));
      // a multiplication and an addition may be one instruction there and two here
      CHECK(pair.positions()[static_cast<std::size_t>(follower)] ==
            Approx(slides.multiplier * pair.positions()[static_cast<std::size_t>(leader)] + slides.offset).epsilon(0).margin(1e-15));
      worst = std::max(worst, std::abs(pair.velocities()[static_cast<std::size_t>(leader)] - twin.velocities()[0]));
      const EffectWork&a = pair.effect_work(), &b = twin.effect_work();
      for (const double more : {pair.energy().total() - twin.energy().total(), a.of<JointDamping>() - b.of<JointDamping>(),
                                a.of<JointFriction>() - b.of<JointFriction>(), a.of<JointLimit>() - b.of<JointLimit>(),
                                a.of<Servo>() - b.of<Servo>(), a.of<JointTorque>() - b.of<JointTorque>()}) {
        worst = std::max(worst, std::abs(more) / slides.inertia());
      }
    }
    INFO("largest difference: " << worst);
    CHECK(worst < kRounding);
    CHECK(twin.effect_work().magnitude() > 0);
  }
}

TEST_CASE("a force on a coordinate meets the inertia of all that it moves", "[mimic]") {
  for (const Slides& slides : kSlides) {
    CAPTURE(slides.leader_mass, slides.follower_mass, slides.multiplier);
    const Model model = tied(slides);
    const auto leader = static_cast<std::size_t>(leader_of(model));
    Effects effects;
    effects.torques = {{.row = static_cast<Index>(leader), .force = {{0}, {0.7}}}};
    Simulation simulation(model, still(), effects);
    run(simulation, 1000);
    const double q = 0.5 * 0.7 / slides.inertia();  // after 1 s; kick, drift, kick is exact
    CHECK(simulation.positions()[leader] == Approx(q).epsilon(1e-11));
    CHECK(simulation.velocities()[leader] == Approx(2 * q).epsilon(1e-11));
    CHECK(simulation.energy().kinetic == Approx(0.7 * q).epsilon(1e-11));
    CHECK(simulation.effect_work().of<JointTorque>() == Approx(0.7 * q).epsilon(1e-11));
  }
}

TEST_CASE("the weight of a follower pulls on its leader", "[mimic]") {
  for (const Slides& slides : kSlides) {
    CAPTURE(slides.leader_mass, slides.follower_mass, slides.multiplier);
    const Model model = tied(slides);
    const auto leader = static_cast<std::size_t>(leader_of(model));
    Options options = still();
    options.gravity = {0, 0, -9.81};
    Simulation simulation(model, options);
    run(simulation, 1000);
    const double force = -9.81 * (slides.leader_mass + slides.multiplier * slides.follower_mass);
    CHECK(simulation.positions()[leader] == Approx(0.5 * force / slides.inertia()).epsilon(1e-11));
  }
}

TEST_CASE("dampers, servos and armature on a coordinate act as on one joint of its inertia", "[mimic]") {
  check_against_twin(
      [](Index row, double inertia) {
        Effects effects;
        effects.damping = {{.row = row, .coefficient = 3 * inertia}};
        return effects;
      },
      0.8, 500);
  // damping that stops the coordinate well within a step
  check_against_twin(
      [](Index row, double inertia) {
        Effects effects;
        effects.damping = {{.row = row, .coefficient = 1e5 * inertia}};
        return effects;
      },
      0.8, 20);
  check_against_twin(
      [](Index row, double inertia) {
        Effects effects;
        effects.armature = {{.row = row, .inertia = 0.3 * inertia}};
        effects.servos = {{.row = row, .stiffness = 200 * inertia, .damping = 4 * inertia, .target = 0.3, .max_force = 30 * inertia}};
        return effects;
      },
      -0.4, 1000);
}

TEST_CASE("friction slows a coordinate and holds it as it does one joint", "[mimic]") {
  check_against_twin(
      [](Index row, double inertia) {
        Effects effects;
        effects.friction = {{.row = row, .force = 2 * inertia}};
        effects.torques = {{.row = row, .force = {{0, 1, 1, 2}, {0, 0, 3 * inertia, 0}}}};
        return effects;
      },
      0.7, 2000);
}

TEST_CASE("a limit that a coordinate is pushed against holds it and lets it go as it does one joint", "[mimic]") {
  check_against_twin(
      [](Index row, double inertia) {
        Effects effects;
        effects.limits = {{.row = row, .lower = -0.1003, .upper = 0.0717}};
        effects.torques = {{.row = row, .force = {{0, 0.5, 0.5, 2}, {2 * inertia, 2 * inertia, -inertia, -inertia}}}};
        return effects;
      },
      0.7, 2000);
}

TEST_CASE("friction on a leader bears the weight of its follower, as far as it can", "[mimic]") {
  for (const Slides& slides : kSlides) {
    if (slides.multiplier == 0) continue;
    CAPTURE(slides.leader_mass, slides.follower_mass, slides.multiplier);
    const Model model = tied(slides);
    const Index leader = leader_of(model);
    Options options = still();
    options.gravity = {0, 0, -9.81};
    const double weight = -9.81 * (slides.leader_mass + slides.multiplier * slides.follower_mass);
    for (const double share : {1.01, 0.9}) {
      Effects effects;
      effects.friction = {{.row = leader, .force = share * std::abs(weight)}};
      Simulation simulation(model, options, effects);
      run(simulation, 1000);
      const double q = simulation.positions()[static_cast<std::size_t>(leader)];
      if (share > 1) {
        CHECK(q == 0);
        CHECK(simulation.effect_work().of<JointFriction>() == 0);
        continue;
      }
      // from the first step that slides on, whose friction acts at its beginning
      const double acceleration = (1 - share) * weight / slides.inertia();
      CHECK(q == Approx(0.5 * acceleration).epsilon(5 * kStep));
      CHECK(simulation.effect_work().of<JointFriction>() == Approx(share * std::abs(weight * q)).epsilon(5 * kStep));
    }
  }
}

TEST_CASE("a coordinate stops at its limit, and the limit takes its energy once", "[mimic]") {
  for (const Slides& slides : kSlides) {
    CAPTURE(slides.leader_mass, slides.follower_mass, slides.multiplier);
    const Model model = tied(slides);
    const auto leader = static_cast<std::size_t>(leader_of(model));
    for (const double upper : {0.3, 0.3004, 0.30097}) {
      for (const double speed : {1.0, -1.0}) {
        Effects effects;
        effects.limits = {{.row = static_cast<Index>(leader), .lower = -upper, .upper = upper}};
        Simulation simulation(model, still(), effects);
        std::vector<double> v(2, 0.0);
        v[leader] = speed;
        simulation.set_velocities(v);
        const double energy = 0.5 * slides.inertia();
        CHECK(simulation.energy().kinetic == Approx(energy).epsilon(1e-13));
        run(simulation, 299);
        CHECK(simulation.effect_work().of<JointLimit>() == Approx(0).margin(1e-13));
        run(simulation, 4);  // the step that ends on the limit and the one that stays there
        CHECK(simulation.positions()[leader] == Approx(speed * upper).epsilon(1e-14));
        CHECK(simulation.effect_work().of<JointLimit>() == Approx(energy).epsilon(1e-12));
        CHECK(simulation.energy().kinetic == Approx(0).margin(1e-20));
        run(simulation, 500);
        CHECK(simulation.positions()[leader] == Approx(speed * upper).epsilon(1e-14));
        CHECK(simulation.effect_work().of<JointLimit>() == Approx(energy).epsilon(1e-12));
      }
    }
  }
}

TEST_CASE("a coordinate that falls on its limit rests there, and the limit takes what it has fallen", "[mimic]") {
  for (const Slides& slides : kSlides) {
    CAPTURE(slides.leader_mass, slides.follower_mass, slides.multiplier);
    const Model model = tied(slides);
    const auto leader = static_cast<std::size_t>(leader_of(model));
    const double weight = 9.81 * (slides.leader_mass + slides.multiplier * slides.follower_mass);
    const double end = weight > 0 ? -0.3 : 0.3;
    Effects effects;
    effects.limits = {{.row = static_cast<Index>(leader), .lower = -0.3, .upper = 0.3}};
    Options options = still();
    options.gravity = {0, 0, -9.81};
    Simulation simulation(model, options, effects);
    const double start = simulation.energy().total();
    run(simulation, 3000);
    CHECK(simulation.positions()[leader] == Approx(end).epsilon(1e-14));
    const double taken = simulation.effect_work().of<JointLimit>(), fallen = std::abs(weight * end);
    CHECK(start - simulation.energy().potential == Approx(fallen).epsilon(1e-12));
    // but for what the load gives in a step to what is at rest
    CHECK(taken == Approx(fallen).margin(0.5 * weight * weight * kStep * kStep / slides.inertia()));
    run(simulation, 100);
    CHECK(simulation.effect_work().of<JointLimit>() == taken);
  }
}

/// Hinges about y, one after the other; hinge k turns by multiplier k times q. The last link bears all mass.
struct Finger {
  std::vector<double> multiplier{1, 1.36, 1.42}, length{0.05, 0.03};  // [1], [m]
  double mass = 0.02, center = 0.02, moment = 1e-6;                  // [kg], [m], [kg m^2]

  Model model() const {
    TreeBuilder builder("finger");
    for (std::size_t k = 0; k < multiplier.size(); ++k) {
      LinkSpec link;
      link.name = fmt::format("link{}", k);
      link.joint = fmt::format("hinge{}", k);
      link.axis = Eigen::Vector3d::UnitY();
      if (k > 0) {
        link.parent = fmt::format("link{}", k - 1);
        link.placement = Isometry(Eigen::Translation3d(length[k - 1], 0, 0));
        link.mimic = "hinge0";
        link.multiplier = multiplier[k];
      }
      if (k + 1 == multiplier.size()) link.inertia = {mass, {center, 0, 0}, moment * Eigen::Matrix3d::Identity()};
      builder.add(link);
    }
    return builder.build();
  }

  /// Acceleration of q under gravity: M(q) a + 1/2 M'(q) v^2 + V'(q) = 0, M = m |p'|^2 + I (sum of multipliers)^2, p the centre of mass.
  double acceleration(double q, double v) const {
    double turned = 0;
    Eigen::Vector2d first(0, 0), second(0, 0);  // p' and p'', along x and z
    for (std::size_t k = 0; k < multiplier.size(); ++k) {
      turned += multiplier[k];
      const double reach = k < length.size() ? length[k] : center, s = std::sin(turned * q), c = std::cos(turned * q);
      first += reach * turned * Eigen::Vector2d(-s, -c);
      second += reach * turned * turned * Eigen::Vector2d(-c, s);
    }
    const double inertia = mass * first.squaredNorm() + moment * turned * turned;
    return -(mass * first.dot(second) * v * v + mass * 9.81 * first.y()) / inertia;
  }

  /// q after a fall from rest at 0, by Runge and Kutta's method in steps far below those of the simulation.
  double fallen(double time) const {
    const int steps = 20'000;
    const double h = time / steps;
    double q = 0, v = 0;
    for (int k = 0; k < steps; ++k) {
      const double a1 = acceleration(q, v), v2 = v + 0.5 * h * a1, a2 = acceleration(q + 0.5 * h * v, v2), v3 = v + 0.5 * h * a2;
      const double a3 = acceleration(q + 0.5 * h * v2, v3), v4 = v + h * a3, a4 = acceleration(q + h * v3, v4);
      q += h / 6 * (v + 2 * v2 + 2 * v3 + v4);
      v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
    }
    return q;
  }
};

TEST_CASE("massless links that ties alone move fall as the one coordinate that they are", "[mimic]") {
  const Finger finger;
  CHECK(finger.acceleration(0, 0) == Approx(49).epsilon(2e-3));
  {
    Simulation simulation(finger.model(), {.step = 1e-5});
    run(simulation, 1);
    CHECK(simulation.velocities()[0] == Approx(1e-5 * finger.acceleration(0, 0)).epsilon(1e-6));
  }
  // over the lowest point, through poses in which the untied links would come to stand in one line
  const double reference = finger.fallen(0.25);
  double error[2];
  for (const int k : {0, 1}) {
    const double h = k == 0 ? 1e-3 : 0.5e-3;
    Simulation simulation(finger.model(), {.step = h});
    run(simulation, k == 0 ? 250 : 500);
    error[k] = simulation.positions()[0] - reference;
  }
  INFO("errors at 1 ms and half of it: " << error[0] << ", " << error[1]);
  CHECK(std::abs(error[0]) < 1e-3);
  CHECK(error[0] / error[1] == Approx(4).epsilon(0.1));
}

TEST_CASE("a finger without inertia of its own keeps its energy on a hand that moves freely", "[mimic]") {
  const Finger finger;
  TreeBuilder builder("hand");
  LinkSpec palm;
  palm.name = "palm";
  palm.joint = "base";
  palm.type = JointType::free;
  palm.inertia = box_inertia(0.1, {0.04, 0.05, 0.06}, {0.01, 0, 0});
  builder.add(palm);
  for (std::size_t k = 0; k < 3; ++k) {
    LinkSpec link;
    link.name = fmt::format("link{}", k);
    link.parent = k == 0 ? "palm" : fmt::format("link{}", k - 1);
    link.joint = fmt::format("hinge{}", k);
    link.axis = Eigen::Vector3d::UnitY();
    link.placement = Isometry(Eigen::Translation3d(0.03, 0, 0));
    if (k > 0) link.mimic = "hinge0";
    link.multiplier = finger.multiplier[k];
    if (k == 2) link.inertia = {finger.mass, {finger.center, 0, 0}, finger.moment * Eigen::Matrix3d::Identity()};
    builder.add(link);
  }
  Simulation simulation(builder.build(), still());
  const Model& model = simulation.model();
  std::vector<double> v(static_cast<std::size_t>(model.tree.shape.velocities), 0.0);
  v[0] = 0.5;
  v[2] = -0.3;
  v[static_cast<std::size_t>(leader_of(model))] = 4;
  simulation.set_velocities(v);
  const double energy = simulation.energy().kinetic;
  const Momentum before = simulation.momentum();
  double band = 0;
  for (int k = 0; k < 2000; ++k) {
    run(simulation, 1);
    band = std::max(band, std::abs(simulation.energy().kinetic - energy));
  }
  CHECK(band < 1e-3 * energy);
  const Momentum after = simulation.momentum();
  for (std::size_t k = 0; k < 3; ++k) {
    CHECK(after.angular[k] == Approx(before.angular[k]).margin(1e-14));
    CHECK(after.linear[k] == Approx(before.linear[k]).margin(1e-13));
  }
}

TEST_CASE("instances with massless followers, friction and limits move as a simulation to the bit, in any company", "[mimic][batch]") {
  const std::shared_ptr<const Model> model = std::make_shared<const Model>(Finger{}.model());
  Effects effects;
  effects.friction = {{.row = 0, .force = 1e-3}};
  effects.limits = {{.row = 0, .lower = -1, .upper = 0.5}};
  const auto run_batch = [&](std::int64_t size, int threads, std::initializer_list<int> parts) {
    Batch batch(model, size, {}, effects, {.threads = threads});
    for (std::int64_t i = 0; i < size; ++i) {
      batch.reset(i, std::vector<double>(3, 0.0), std::vector<double>{0.5 * static_cast<double>(i % 5) - 2, 0, 0});
    }
    for (const int steps : parts) batch.step(steps);
    CHECK(batch.summary().frozen == 0);
    std::vector<std::vector<double>> positions;
    for (std::int64_t i = 0; i < 5; ++i) {
      const auto q = batch.positions().instance(i);
      positions.emplace_back(q.begin(), q.end());
    }
    return positions;
  };
  const auto reference = run_batch(5, 1, {300});
  CHECK(run_batch(11, 2, {300}) == reference);
  CHECK(run_batch(5, 2, {1, 99, 200}) == reference);
  for (int i = 0; i < 5; ++i) {
    Simulation simulation(model, {}, effects);
    simulation.set_velocities(std::vector<double>{0.5 * i - 2, 0, 0});
    run(simulation, 300);
    CHECK(distance(simulation.positions(), reference[static_cast<std::size_t>(i)]) < 1e-9);
    CHECK(simulation.positions()[0] <= 0.5 + 1e-12);
  }
}

}  // namespace
}  // namespace linden::mimic_test

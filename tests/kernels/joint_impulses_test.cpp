#include "kernels/effects/joint_impulses.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <tuple>

#include "kernels/effects/armature.hpp"
#include "kernels/effects/ball_spring.hpp"
#include "kernels/effects/damping.hpp"
#include "kernels/effects/limits.hpp"
#include "kernels/effects/servo.hpp"
#include "kernels/effects/spring.hpp"
#include "kernels/effects/torque.hpp"
#include "layout/workspace.hpp"
#include "models/build/generators.hpp"
#include "models/build/random.hpp"
#include "tests/kernels/lanes.hpp"

namespace linden::joint_impulses_test {
namespace {

constexpr double kStep = 2e-3, kPosition = 0.3, kBefore = 4e-3;
constexpr Index kRow = 1;  // of two: the other must stay as it is

/// One joint in the middle of a step.
template <class S>
struct JointRow {
  JointImpulses<S> sum;
  Field<S> q, delta, before, target, end;
  Field<Index> q_row;

  explicit JointRow(double displacement = 0) {
    const Shape shape{.slots = 3, .positions = 2, .velocities = 2, .blocks = 2};
    sum.allocate(shape);
    poison_all(sum);
    for (Field<S>* field : {&q, &delta, &before, &target, &end}) field->allocate(2, S(0.0));
    q_row.allocate(2);
    q_row(1) = 1;
    q(kRow) = S(kPosition);
    delta(kRow) = S(displacement);
    before(kRow) = S(kBefore);
    clear(sum);
    sum.plain_target(0) = sum.plain_target(1) = S(0.0);
  }
};

/// Impulses that an effect puts at both ends of a step [N m s], at a displacement.
struct Impulses {
  double begin, end;
};
template <class Effect>
Impulses impulses(const Effect& effect, double displacement) {
  JointRow<double> row(displacement);
  effect(row);
  joint_impulses_map(row.sum, row.delta, row.target);
  joint_impulses_end_map(row.sum, kStep, row.delta, row.end);
  CHECK((row.target(0) == 0 && row.end(0) == 0));
  return {row.target(kRow) / kStep, row.end(kRow)};
}

/// force(position in the step, rate): what the effect says of itself. Both ends must get their shares of the force at the point of the
/// step that the share stands for, and the factor what the beginning's changes by.
template <class Effect>
void check_force(const Effect& effect, double share, const std::function<double(double, double)>& force) {
  for (const double displacement : {0.0, 5e-3, -0.02}) {
    INFO("share " << share << ", displacement " << displacement);
    const double expected = kStep * force(kPosition + share * displacement, displacement / kStep);
    const Impulses found = impulses(effect, displacement);
    CHECK(found.begin == Approx(share * expected).epsilon(1e-12).margin(1e-15));
    CHECK(found.end == Approx((1 - share) * expected).epsilon(1e-12).margin(1e-15));
    constexpr double kMove = 1e-4;
    const double slope = (impulses(effect, displacement + kMove).begin - impulses(effect, displacement - kMove).begin) / (2 * kMove);
    JointRow<double> row(displacement);
    effect(row);
    CHECK(row.sum.stiffness(kRow) == Approx(-kStep * slope).epsilon(1e-9).margin(1e-15));
    CHECK(row.sum.stiffness(0) == 0);
  }
}

const double kShares[] = {0.5, 0.7, 1.0};

Servos<double> one_servo(const std::vector<Servo>& entries, double share, double mode, double lead) {
  Servos<double> servos;
  servos.entries = entries;
  servos.stiffness.allocate(1, entries[0].stiffness);
  servos.damping.allocate(1, entries[0].damping);
  servos.share.allocate(1, share);
  servos.end_share.allocate(1, 1 - share);
  servos.target.allocate(1, entries[0].target);
  servos.mode.allocate(1, mode);
  servos.lead.allocate(1, lead);
  return servos;
}

Frictions<double> one_friction(const std::vector<JointFriction>& entries, double mode) {
  Frictions<double> frictions{entries, {}, {}};
  frictions.force.allocate(1, entries[0].force);
  frictions.mode.allocate(1, mode);
  return frictions;
}

}  // namespace

TEST_CASE("each joint effect puts its force at both ends of a step, and its derivative into the factor") {
  SECTION("spring: at the middle of the step") {
    const std::vector<JointSpring> springs{{.row = kRow, .stiffness = 40, .rest = 0.1}};
    check_force([&](auto& row) { spring_map<double>(springs, row.q_row, kStep, row.q, row.sum); }, 0.5,
                [](double q, double) { return -40 * (q - 0.1); });
  }
  SECTION("damping") {
    const std::vector<JointDamping> dampers{{.row = kRow, .coefficient = 3}};
    for (const double share : kShares) {
      const std::vector<double> shares{share};
      check_force([&](auto& row) { damping_map<double>(dampers, shares, kStep, row.sum); }, share,
                  [](double, double rate) { return -3 * rate; });
    }
  }
  SECTION("torque: half at each end") {
    const std::vector<JointTorque> torques{{.row = kRow, .force = {}}};
    Field<double> force;
    force.allocate(1, 7.0);
    check_force([&](auto& row) { torque_map<double>(torques, force, kStep, row.sum); }, 0.5, [](double, double) { return 7.0; });
  }
  SECTION("servo within its force, and at it on either side") {
    const std::vector<Servo> entries{{.row = kRow, .stiffness = 50, .damping = 2, .target = -0.4, .max_force = 11}};
    for (const double share : kShares) {
      for (const double mode : {0.0, 1.0, -1.0}) {
        INFO("mode " << mode);
        check_force(
            [&](auto& row) {
              const Servos<double> servos = one_servo(entries, share, mode, 3);
              servo_map(servos, row.q_row, kStep, row.q, row.sum);
            },
            share, [&](double q, double rate) { return mode == 0 ? 50 * (-0.4 - q) - 2 * rate + 3 : mode * 11; });
      }
    }
  }
  SECTION("friction that slides, and softly where it would hold") {
    const std::vector<JointFriction> entries{{.row = kRow, .force = 5}};
    constexpr double kCreep = 0.3;
    for (const double mode : {0.0, 1.0, -1.0}) {
      INFO("mode " << mode);
      check_force(
          [&](auto& row) {
            const Frictions<double> frictions = one_friction(entries, mode);
            friction_map(frictions, kStep, kCreep, row.sum);
          },
          1.0, [&](double, double rate) { return mode == 0 ? -5 * rate / kCreep : -mode * 5; });
    }
  }
}

TEST_CASE("a rotor's momentum is its inertia times the rate, at both ends") {
  const std::vector<Armature> rotors{{.row = kRow, .inertia = 0.4}};
  const Impulses found = impulses([&](auto& row) { armature_map<double>(rotors, row.sum); }, 0.01);
  CHECK(found.begin == Approx(-0.4 * 0.01 / kStep));
  CHECK(found.end == Approx(0.4 * 0.01 / kStep));
  JointRow<double> row(0.01);
  add_armature<double>(rotors, row.delta, row.target);
  CHECK(row.target(kRow) == Approx(0.004));
  CHECK(armature_energy<double>(rotors, row.delta) == Approx(0.5 * 0.4 * 1e-4));
}

TEST_CASE("a share is one half where a step is short and goes over to one where it is long") {
  CHECK(begin_share(0) == 0.5);
  CHECK(begin_share(1) == 0.5);
  CHECK(begin_share(2) == 0.75);
  CHECK(begin_share(1e9) == Approx(1));
  // of a damper alone, x <- x (1 - (1 - s) r) / (1 + s r) at ratio r: it must never change its sign
  for (const double ratio : {0.1, 1.0, 1.5, 3.0, 100.0, 1e9}) {
    INFO(ratio);
    CHECK(1 - (1 - begin_share(ratio)) * ratio > 0);
  }
}

TEST_CASE("effects work along what turns their impulses into kinetic energy") {
  // a rotor alone, until it is at rest: what damping took is what it had
  constexpr double kInertia = 0.02, kRate = 3;
  const std::vector<JointDamping> dampers{{.row = kRow, .coefficient = 6}};
  for (const double share : {0.5, 1.0}) {
    const std::vector<double> shares{share};
    double p = kInertia * kRate, before = kStep * kRate, taken = 0;
    for (int k = 0; k < 300; ++k) {
      JointRow<double> row;
      damping_map<double>(dampers, shares, kStep, row.sum);
      row.delta(kRow) = kStep * p / (kInertia + row.sum.gain(kRow));
      row.before(kRow) = before;
      joint_impulses_end_map(row.sum, kStep, row.delta, row.end);
      damping_loss<double>(dampers, shares, kStep, row.delta, row.before, [&](Index, double loss) { taken += loss; });
      p = kInertia * row.delta(kRow) / kStep + row.end(kRow);
      before = row.delta(kRow);
    }
    INFO("share " << share);
    CHECK(taken == Approx(0.5 * kInertia * kRate * kRate).epsilon(1e-12));
  }
}

TEST_CASE("friction holds up to its force, slides the way it is pushed, and stops where it would turn back") {
  const std::vector<JointFriction> entries{{.row = kRow, .force = 5}};
  Field<double> residual;
  residual.allocate(2, 0.0);
  const double most = kStep * kStep * 5;
  for (const double sign : {1.0, -1.0}) {
    JointRow<double> row;
    Frictions<double> holds = one_friction(entries, 0);
    residual(kRow) = sign * 0.999 * most;
    CHECK(friction_overload(holds, kStep, residual) == Approx(0.999));
    CHECK_FALSE(update_friction(holds, kStep, residual, true, 0.0, row.delta));
    residual(kRow) = sign * 1.001 * most;
    CHECK_FALSE(update_friction(holds, kStep, residual, false, 0.0, row.delta));  // not settled yet
    CHECK_FALSE(update_friction(holds, kStep, residual, true, 2.0, row.delta));   // another holds more
    CHECK(update_friction(holds, kStep, residual, true, 0.0, row.delta));
    CHECK(holds.mode(0) == -sign);
    row.delta(kRow) = sign * 1e-6;  // against the way it slides
    CHECK(update_friction(holds, kStep, residual, false, 0.0, row.delta));
    CHECK(holds.mode(0) == 0);
    CHECK(row.delta(kRow) == 0);
  }
}

TEST_CASE("a limit stops a joint where it is, and lets go of one that is pulled away") {
  const std::vector<JointLimit> entries{{.row = kRow, .lower = -1, .upper = kPosition + 0.01}};
  Field<double> before;
  before.allocate(2, 1e-3);
  const auto limits_at = [&](double displacement, JointRow<double>& row) {
    Limits<double> limits{entries, {}, {}, {}};
    for (Field<double>* field : {&limits.lowest, &limits.highest, &limits.mode}) field->allocate(1, std::nan(""));
    row.delta(kRow) = displacement;
    begin_limits(limits, row.q_row, kStep, row.q, before, true, false, row.delta);
    return limits;
  };
  JointRow<double> row;
  Field<double> residual;
  residual.allocate(2, 0.0);
  CHECK(limits_at(0.005, row).mode(0) == 0);
  CHECK(row.delta(kRow) == 0.005);
  Limits<double> stopped = limits_at(0.02, row);
  CHECK(stopped.mode(0) == 1);
  CHECK(row.delta(kRow) == Approx(0.01).epsilon(1e-12));
  hold_limits(stopped, row.sum);
  CHECK(std::isinf(row.sum.stiffness(kRow)));
  residual(kRow) = -1;  // pushed on
  CHECK_FALSE(update_limits(stopped, residual, true, false, row.delta));
  residual(kRow) = 1;  // pulled back
  CHECK_FALSE(update_limits(stopped, residual, false, false, row.delta));
  CHECK(update_limits(stopped, residual, true, false, row.delta));
  CHECK(stopped.mode(0) == 0);
  row.delta(kRow) = 0.5;
  CHECK(update_limits(stopped, residual, true, false, row.delta));
  CHECK(row.delta(kRow) == Approx(0.01).epsilon(1e-12));
}

TEST_CASE("a joint that bounces passes a limit that it is not at yet, where the step may be cut there") {
  Field<double> before;
  before.allocate(2, 1e-3);
  for (const double restitution : {0.0, 0.5}) {
    for (const double room : {0.01, 0.5 * kAtLimit}) {
      const std::vector<JointLimit> entries{{.row = kRow, .lower = -1, .upper = kPosition + room, .restitution = restitution}};
      JointRow<double> row;
      Limits<double> limits{entries, {}, {}, {}};
      for (Field<double>* field : {&limits.lowest, &limits.highest, &limits.mode}) field->allocate(1, std::nan(""));
      row.delta(kRow) = 0.02;
      begin_limits(limits, row.q_row, kStep, row.q, before, true, true, row.delta);
      const bool passes = restitution > 0 && room > kAtLimit;
      CHECK(limits.mode(0) == (passes ? 0 : 1));
      CHECK(row.delta(kRow) == Approx(passes ? 0.02 : room).epsilon(1e-6));
      // where it may not pass a solution that it is stopped in has a blow in it, unless it rested there
      row.delta(kRow) = 0.02;
      begin_limits(limits, row.q_row, kStep, row.q, before, true, false, row.delta);
      CHECK(stopped_bounces(limits, row.q_row, row.q, row.delta, before, true) == (restitution > 0));
      before(kRow) = 0;
      CHECK(stopped_bounces(limits, row.q_row, row.q, row.delta, before, true) == passes);
      before(kRow) = 1e-3;
      limits.mode(0) = 0;
      row.delta(kRow) = room;  // and so has one in which it comes there by itself
      CHECK(stopped_bounces(limits, row.q_row, row.q, row.delta, before, true) == (restitution > 0));
    }
  }
}

TEST_CASE("of joints that are at the wrong states one alone changes where that is asked, once they are settled") {
  const std::vector<JointLimit> entries{{.row = 0, .lower = -1, .upper = 1}, {.row = kRow, .lower = -1, .upper = 1}};
  Limits<double> limits{entries, {}, {}, {}};
  limits.lowest.allocate(2, -0.01);
  limits.highest.allocate(2, 0.01);
  limits.mode.allocate(2, 0.0);
  JointRow<double> row(0.02);  // beyond
  row.delta(0) = 0.01;         // held, and pulled away
  limits.mode(0) = 1;
  Field<double> residual;
  residual.allocate(2, 1.0);
  CHECK_FALSE(update_limits(limits, residual, false, true, row.delta));
  CHECK(update_limits(limits, residual, true, true, row.delta));
  CHECK((limits.mode(0) == 1 && limits.mode(1) == 1));
  CHECK(row.delta(kRow) == 0.01);
  residual(kRow) = -1;
  CHECK(update_limits(limits, residual, true, true, row.delta));
  CHECK((limits.mode(0) == 0 && limits.mode(1) == 1));
  CHECK_FALSE(update_limits(limits, residual, true, true, row.delta));
}

TEST_CASE("a limit of velocity leaves a joint its reach within a step, and less where a limit of position is nearer") {
  const double reach = 0.8 * kStep;
  Field<double> before;
  before.allocate(2, 1e-3);
  const auto room = [&](double lower, double upper) {
    const std::vector<JointLimit> entries{{.row = kRow, .lower = kPosition + lower, .upper = kPosition + upper, .velocity = 0.8}};
    Limits<double> limits{entries, {}, {}, {}};
    for (Field<double>* field : {&limits.lowest, &limits.highest, &limits.mode}) field->allocate(1, std::nan(""));
    JointRow<double> row(0.1);
    begin_limits(limits, row.q_row, kStep, row.q, before, true, false, row.delta);
    CHECK(limits.mode(0) == 1);
    CHECK(row.delta(kRow) == limits.highest(0));
    return std::pair(limits.lowest(0), limits.highest(0));
  };
  CHECK(room(-1, 1) == std::pair(-reach, reach));
  CHECK(room(-1, 1e-4).first == -reach);
  CHECK(room(-1, 1e-4).second == Approx(1e-4).epsilon(1e-9));
  CHECK(room(-1e-4, 1).first == Approx(-1e-4).epsilon(1e-9));
  CHECK(room(-1e-4, 1).second == reach);
  CHECK(room(-1, -1).second == 0);  // beyond a limit it goes no further
}

TEST_CASE("a ball joint's spring pulls as its potential falls") {
  // along a displacement the work is the potential's loss, but for the third power of the turn
  const Model model = ball_chain(1);
  Random random(3);
  for (int sample = 0; sample < 20; ++sample) {
    const auto turn = [&](double size) {
      return exp(Twist<double>{{random.uniform(-size, size), random.uniform(-size, size), random.uniform(-size, size)}, {0, 0, 0}}).r;
    };
    const Quaternion<double> rest = turn(0.5), at = turn(1.0);
    const std::vector<BallSpring> springs{{.slot = 1, .stiffness = 6, .rest = {rest.v.x, rest.v.y, rest.v.z, rest.w}}};
    Field<double> q, delta, target, end;
    q.allocate(4);
    for (Field<double>* field : {&delta, &target, &end}) field->allocate(3, 0.0);
    Field<double, 7> motion;
    motion.allocate(2);
    double before_error = 0;
    const Vec3<double> way{random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)};
    for (const double size : {0.02, 0.01}) {
      const Vec3<double> u = size * way;
      const Displacement<double> M = exp(Twist<double>{u, {0, 0, 0}});
      const auto put = [&](const Quaternion<double>& r) {
        q(0) = r.v.x;
        q(1) = r.v.y;
        q(2) = r.v.z;
        q(3) = r.w;
      };
      put(at * M.r);
      const Field<Index> no_rows;
      const double potential_after = BallSpringLaw<double>::potential(springs[0], {q, no_rows, model.tree});
      put(at);
      store(motion, 1, M);
      store3(delta, 0, u);
      const double gained = potential_after - BallSpringLaw<double>::potential(springs[0], {q, no_rows, model.tree});
      const double error = std::abs(gained - dot(ball_pull<double>(springs[0], model.tree, q, motion).tau, u));
      CHECK(error < 6 * size * size * size);
      if (before_error > 1e-12) CHECK(error < before_error / 6);
      before_error = error;
      // both ends get the derivative of h V(middle of the step) along a turn of theirs
      target(0) = target(1) = target(2) = end(0) = end(1) = end(2) = 0;
      ball_spring_map<double>(springs, model.tree, kStep, q, motion, target);
      ball_spring_end_map<double>(springs, model.tree, kStep, q, motion, end);
      const auto middle = [&](const Vec3<double>& first, const Vec3<double>& last) {
        const auto turned = [](const Vec3<double>& by) { return exp(Twist<double>{by, {0, 0, 0}}); };
        const Displacement<double> between = turned(-first) * M * turned(last);
        const auto half = turned(0.5 * log(between).w);
        put(at * turned(first).r * half.r);
        return BallSpringLaw<double>::potential(springs[0], {q, no_rows, model.tree});
      };
      const Vec3<double> axes[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, none{0, 0, 0};
      constexpr double kMove = 1e-4;
      for (int k = 0; k < 3; ++k) {
        const Vec3<double> move = kMove * axes[k];
        const double first = (middle(move, none) - middle(-move, none)) / (2 * kMove);
        const double last = (middle(none, move) - middle(none, -move)) / (2 * kMove);
        CHECK(target(k) == Approx(-kStep * kStep * first).margin(1e-7 * kStep * kStep));
        CHECK(end(k) == Approx(-kStep * last).margin(1e-7 * kStep));
      }
    }
  }
}

TEST_CASE("joint effects treat all lanes alike and allocate nothing") {
  static const std::vector<Servo> kServos{{.row = kRow, .stiffness = 50, .damping = 2, .max_force = 11}};
  static const std::vector<JointFriction> kFrictions{{.row = kRow, .force = 5}};
  Random random(5);
  std::vector<std::array<double, 5>> samples;  // position, displacement, target, force of friction, residual
  for (int k = 0; k < 64; ++k) {
    samples.push_back({random.uniform(-1, 1), random.uniform(-0.01, 0.01), random.uniform(-1, 1), random.uniform(0, 9),
                       random.uniform(-4e-5, 4e-5)});
  }
  const auto rig = []<class S>(S) {
    JointRow<S> row;
    Servos<S> servos;
    servos.entries = kServos;
    servos.stiffness.allocate(1, S(kServos[0].stiffness));
    servos.damping.allocate(1, S(kServos[0].damping));
    servos.share.allocate(1, S(0.7));
    servos.end_share.allocate(1, S(0.3));
    Frictions<S> frictions{kFrictions, {}, {}};
    Field<S> residual;
    for (Field<S>* field : {&servos.target, &servos.mode, &servos.lead, &frictions.force, &frictions.mode}) field->allocate(1);
    residual.allocate(2, S(0.0));
    return std::tuple(std::move(row), std::move(servos), std::move(frictions), std::move(residual));
  };
  auto rigs = std::tuple(rig(double()), rig(Pack()));
  const auto force = [&](const auto& in) {
    using S = std::decay_t<decltype(in[0])>;
    auto& [row, servos, frictions, residual] = std::get<std::is_same_v<S, double> ? 0 : 1>(rigs);
    const S h(kStep), zero(0.0);
    clear(row.sum);
    row.q(kRow) = in[0];
    row.delta(kRow) = in[1];
    servos.target(0) = in[2];
    servos.lead(0) = in[3];
    frictions.force(0) = in[3];
    residual(kRow) = in[4];
    servos.mode(0) = frictions.mode(0) = zero;
    update_servos(servos, row.q_row, h, row.q, row.delta);
    update_friction(frictions, h, residual, zero < S(1.0), zero, row.delta);
    servo_map(servos, row.q_row, h, row.q, row.sum);
    friction_map(frictions, h, 0.0, row.sum);
    hold_friction(frictions, row.sum);
    joint_impulses_map(row.sum, row.delta, row.target);
    joint_impulses_end_map(row.sum, h, row.delta, row.end);
    return std::array<S, 3>{row.target(kRow) / h, row.end(kRow), S(0.1) * frictions.mode(0)};
  };
  check_value_lanes<5>(force, samples, 1e-14);
}

}  // namespace linden::joint_impulses_test

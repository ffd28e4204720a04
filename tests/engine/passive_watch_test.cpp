// Effects that can only take energy are watched: one that gives is named, with the place, the time and the amount.
#include "engine/effects/passive_watch.hpp"

#include <catch2/catch.hpp>

#include "engine/drift.hpp"
#include "scenes.hpp"

namespace linden::passive_watch_test {
namespace {

EffectAccount step(double friction, double ground, double kinetic = 1) {
  EffectAccount account;
  account.work.of<JointFriction>() = friction;
  account.work.of<Ground>() = ground;
  account.least[kListOf<JointFriction>].see(1, friction);
  account.least[kListOf<Ground>].see(2, ground);
  account.kinetic = kinetic;
  return account;
}

}  // namespace

TEST_CASE("a passive effect that gives is told once, with joint or body, time and the most it gave") {
  const Model model = chain(3);
  PassiveWatch watch(model, Effects{});
  watch.add(step(0.5, 0.2), 0.001);
  watch.add(step(-0.005, 0.1), 0.002);  // what second order leaves: under a hundredth of what went to and fro
  CHECK(watch.gifts().empty());
  watch.add(step(0.1, -0.2), 0.003);
  REQUIRE(watch.gifts().size() == 1);
  watch.add(step(0.1, -0.3), 0.004);
  watch.add(step(0.1, 0.4), 0.005);
  REQUIRE(watch.gifts().size() == 1);
  const PassiveGift& gift = watch.gifts().front();
  CHECK(gift.effect == "ground");
  CHECK(gift.where == "body \"" + model.names.body[2] + "\"");
  CHECK(gift.time == 0.003);
  CHECK(gift.amount == Approx(0.5));
  CHECK_THAT(describe(gift), Catch::Contains("effects.ground gave 0.5 J") && Catch::Contains("0.003 s"));
  watch.add(step(-0.9, 0.1), 0.006);
  REQUIRE(watch.gifts().size() == 2);
  CHECK(watch.gifts()[1].where == "joint \"" + model.names.velocity[1] + "\"");
}

TEST_CASE("a watch goes on from all that another one knows") {
  const Model model = chain(3);
  PassiveWatch one(model, Effects{}), other(model, Effects{});
  one.add(step(0.5, 0.2), 0.001);
  one.add(step(0.1, -0.2), 0.002);
  REQUIRE(one.gifts().size() == 1);
  other.go_on(one.known());
  for (PassiveWatch* watch : {&one, &other}) {
    watch->add(step(0.1, -0.1), 0.003);
    watch->add(step(-0.9, 0.1), 0.004);
  }
  REQUIRE(other.gifts().size() == 2);
  for (std::size_t k = 0; k < 2; ++k) CHECK(describe(other.gifts()[k]) == describe(one.gifts()[k]));
}

TEST_CASE("what strikes in one step shares a blow, and only what all of it gives is a gift") {
  const Model model = chain(3);
  const auto blow = [](double limits, double ground, double friction) {
    EffectAccount account = step(friction, ground);
    account.work.of<JointLimit>() = limits;
    account.least[kListOf<JointLimit>].see(0, limits);
    return account;
  };
  PassiveWatch together(model, Effects{}), apart(model, Effects{}), rubbing(model, Effects{});
  together.add(blow(-0.8, 1.0, 0), 0.001);  // a foot lands, and its joint is thrown on its limit
  CHECK(together.gifts().empty());
  together.add(blow(-0.8, 0.5, 0), 0.002);
  REQUIRE(together.gifts().size() == 1);
  CHECK(together.gifts().front().effect == "limits");
  CHECK(together.gifts().front().amount == Approx(0.3));
  apart.add(blow(0, 1.0, 0), 0.001);
  apart.add(blow(-0.8, 0, 0), 0.002);
  CHECK(apart.gifts().size() == 1);
  rubbing.add(blow(-0.8, 0, 1.0), 0.001);  // friction does not strike
  CHECK(rubbing.gifts().size() == 1);
}

TEST_CASE("what contacts give to bodies that began within each other is no gift") {
  const Model model = chain(3);
  EffectAccount account;
  account.work.of<PairContact>() = -0.6;
  account.kinetic = 0.1;
  PassiveWatch watch(model, Effects{}), less(model, Effects{}), late(model, Effects{});
  EffectAccount follows = account, nothing = account;
  account.freed = 1.2;  // half of it in the step that follows
  nothing.work.of<PairContact>() = 0;
  watch.add(account, 0.001);
  watch.add(follows, 0.002);
  CHECK(watch.gifts().empty());
  late.add(account, 0.001);
  late.add(nothing, 0.002);
  late.add(follows, 0.003);
  CHECK(late.gifts().size() == 1);
  account.freed = 0.5;
  less.add(account, 0.001);
  REQUIRE(less.gifts().size() == 1);
  CHECK(less.gifts().front().amount == Approx(0.1));
}

TEST_CASE("what a gift is measured by does not vanish as things come to rest") {
  const Model model = chain(2);
  PassiveWatch watch(model, Effects{});
  watch.add(step(1, 0, 2), 0.001);
  for (int k = 0; k < 100; ++k) watch.add(step(-1e-5, 0, 1e-20), 0.002);
  CHECK(watch.gifts().empty());
}

TEST_CASE("drag gives where there is a wind, and may not in still air") {
  const Model model = chain(2);
  Effects windy;
  windy.wind = {1, 0, 0};
  EffectAccount account;
  account.work.of<Drag>() = -1;
  account.kinetic = 0.1;
  for (const bool wind : {false, true}) {
    PassiveWatch watch(model, wind ? windy : Effects{});
    watch.add(account, 0.001);
    CHECK(watch.gifts().size() == (wind ? 0u : 1u));
  }
}

TEST_CASE("what went to and fro is not only kinetic energy") {
  EnergyDrift drift(10);
  drift.add(0, {0, 5});
  drift.add(1, {0, 3}, 2, 0);  // let down slowly
  drift.add(2, {0, 3}, 2.5, 0.5);
  CHECK(drift.scale() == 0);
  CHECK(drift.exchanged() == 2.5);
  CHECK(drift.band() == 0);
  CHECK(drift.first_change() == 0);
}

}  // namespace linden::passive_watch_test

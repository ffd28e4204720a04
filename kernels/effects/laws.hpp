// kernels/effects/laws.hpp
// All laws, in the order in which a step asks them; their sums are taken in that order, so that it is part of what a scene computes.
//
//   JointLaws   rows of joints
//   BodyLaws    forces on bodies
//
// What acts between two bodies - loops, contact of bodies with each other - has no law here: it is rows of couplings, and their laws stand in
// kernels/couplings/.
//
// Whatever goes over all effects goes over these lists: engine/effects/ (plan, sweeps within a step, impulses), engine/sweeps/ (the printed
// schedule and what each sweep costs), engine/baseline/.
#pragma once

#include <tuple>

#include "kernels/effects/armature.hpp"
#include "kernels/effects/ball_spring.hpp"
#include "kernels/effects/damping.hpp"
#include "kernels/effects/dead_zone_spring.hpp"
#include "kernels/effects/drag.hpp"
#include "kernels/effects/friction.hpp"
#include "kernels/effects/given_motion.hpp"
#include "kernels/effects/ground_law.hpp"
#include "kernels/effects/limits.hpp"
#include "kernels/effects/servo.hpp"
#include "kernels/effects/spring.hpp"
#include "kernels/effects/torque.hpp"
#include "kernels/effects/wrench.hpp"

namespace linden {

template <class S>
using JointLaws = std::tuple<ArmatureLaw<S>,
                             SpringLaw<S>,
                             BallSpringLaw<S>,
                             DeadZoneSpringLaw<S>,
                             DampingLaw<S>,
                             TorqueLaw<S>,
                             ServoLaw<S>,
                             FrictionLaw<S>,
                             LimitsLaw<S>,
                             MotionLaw<S>>;

template <class S>
using BodyLaws = std::tuple<DragLaw<S>,
                            WrenchLaw<S>,
                            GroundLaw<S>>;

inline constexpr std::size_t kBodyLaws = std::tuple_size_v<BodyLaws<double>>;
static_assert(kBodyLaws == kBodyEffects, "every effect of bodies needs a law in BodyLaws, kernels/effects/laws.hpp");

/// Place of a law in its list.
template <class Law, class Laws>
inline constexpr std::size_t kPlaceOf = 0;
template <class Law, class... Others>
inline constexpr std::size_t kPlaceOf<Law, std::tuple<Law, Others...>> = 0;
template <class Law, class First, class... Others>
inline constexpr std::size_t kPlaceOf<Law, std::tuple<First, Others...>> = 1 + kPlaceOf<Law, std::tuple<Others...>>;

/// The law of entries of a kind.
template <class Entry, class Laws>
struct LawFor;
template <class Entry, class First, class... Others>
struct LawFor<Entry, std::tuple<First, Others...>>
    : std::conditional_t<std::is_same_v<typename First::Entry, Entry>, std::type_identity<First>, LawFor<Entry, std::tuple<Others...>>> {};

/// Laws of a scene, each built where it stands.
template <class Laws>
Laws laws_of(const LawSetup& setup) {
  return [&]<std::size_t... K>(std::index_sequence<K...>) {
    return Laws((void(K), setup)...);
  }(std::make_index_sequence<std::tuple_size_v<Laws>>());
}

/// visit.operator()<Law>() of every law of a list, in order.
template <class Laws, class Visit>
constexpr void each_law_type(const Visit& visit) {
  [&]<std::size_t... K>(std::index_sequence<K...>) {
    (visit.template operator()<std::tuple_element_t<K, Laws>>(), ...);
  }(std::make_index_sequence<std::tuple_size_v<Laws>>());
}

/// visit(law) of every law that has anything to do.
template <class... Law, class Visit>
LINDEN_INLINE void each_law(std::tuple<Law...>& laws, const Visit& visit) {
  (void(std::get<Law>(laws).any() && (visit(std::get<Law>(laws)), true)), ...);
}
template <class... Law, class Visit>
LINDEN_INLINE void each_law(const std::tuple<Law...>& laws, const Visit& visit) {
  (void(std::get<Law>(laws).any() && (visit(std::get<Law>(laws)), true)), ...);
}

struct NoBook {
  void operator()(Index, const auto&) const {}
};

/// Stops the compiler, saying why, where a law lacks a part that it has to have.
template <class Law, class S>
consteval void require_parts() {
  constexpr EffectFacts facts = Law::Entry::facts;
  static_assert(kListOf<typename Law::Entry> < kEffectLists,
                "the law's entries have no list: name it in LINDEN_EFFECT_LISTS, layout/effects.hpp");
  static_assert(requires { Law::sweeps.size(); }, "the law does not say what its parts are called: give it `sweeps`, as in law.hpp");
  if constexpr (facts.has_states) {
    static_assert(requires(Law& law, const StepView<S>& step, const StateUpdate<MaskOf<S>>& now, const S& least, const Field<S>& r, Field<S>& d) {
      { law.update_states(step, now, least, r, d) } -> std::same_as<MaskOf<S>>;
    }, "the facts say that the effect has states: give its law `update_states`, as in law.hpp");
  }
  if constexpr (facts.account != Account::none) {
    static_assert(requires(const Law& law, const StepView<S>& step, const SolvedStep<S>& solved) { law.account(step, solved, NoBook{}); },
                  "the facts say that the effect takes or gives energy: give its law `account`, as in law.hpp");
  }
}

template <class Law, class S>
consteval void require_joint_parts() {
  constexpr EffectFacts facts = Law::Entry::facts;
  static_assert(facts.site == Site::joint, "a law of joints stands in the list of bodies, or its facts name the wrong site");
  static_assert(requires(const Law& law, const StepView<S>& step, JointImpulses<S>& sum) { law.add(step, sum); },
                "a law of joints has rows: give it `add`, as in law.hpp");
  if constexpr (facts.stores) {
    static_assert(requires(const typename Law::Entry& entry, const JointsView<S>& at) { { Law::potential(entry, at) } -> std::same_as<S>; },
                  "the facts say that the effect stores energy: give its law `potential`, as in law.hpp");
  }
  if constexpr (facts.sudden.empty() || requires(const typename Law::Entry& entry) { entry.settles(); } ||
                requires(const typename Law::Entry& entry) { entry.jumps(); }) {
    static_assert(requires(const typename Law::Entry& entry, const Instant& now, Field<double>& force) { Law::push(entry, now, force); },
                  "what is not sudden is a force at every instant: give the law `push`, as in law.hpp, or say in its facts what is sudden");
  }
}

template <class Law, class S>
consteval void require_body_parts() {
  constexpr EffectFacts facts = Law::Entry::facts;
  static_assert(facts.site == Site::body, "a law of bodies stands in the list of joints, or its facts name the wrong site");
  static_assert(requires(const LawSetup& setup) { Law::touching(setup).front().slot; },
                "give the law `touching`, as in law.hpp: what it has on bodies");
  if constexpr (facts.stores) {
    static_assert(requires(Law& law, const Field<S, 12>& pose) { { law.place(pose) } -> std::same_as<S>; },
                  "the facts say that the effect stores energy: give its law `place`, as in law.hpp");
  }
  if constexpr (facts.sudden.empty() || requires(const typename Law::Entry& entry) { entry.settles(); }) {
    static_assert(requires(const typename Law::Entry& entry, const BodiesInstant& now, Field<double, 6>& impulse) {
      Law::push(entry, now, impulse);
    }, "what is not sudden is a force at every instant: give the law `push`, as in law.hpp, or say in its facts what is sudden");
  }
}

/// Every law has its parts, and every list of Effects one law.
template <class S>
consteval bool laws_are_complete() {
  std::array<int, kEffectLists> laws{};
  each_law_type<JointLaws<S>>([&]<class Law>() {
    require_parts<Law, S>();
    require_joint_parts<Law, S>();
    ++laws[kListOf<typename Law::Entry>];
  });
  each_law_type<BodyLaws<S>>([&]<class Law>() {
    require_parts<Law, S>();
    require_body_parts<Law, S>();
    ++laws[kListOf<typename Law::Entry>];
  });
  for (std::size_t list = 0; list < laws.size(); ++list) {
    if (laws[list] != (kEffectFacts[list]->site == Site::pair ? 0 : 1)) return false;
  }
  return true;
}
static_assert(laws_are_complete<double>(), "every list of Effects needs one law: name it in JointLaws or BodyLaws, kernels/effects/laws.hpp");

}  // namespace linden

// layout/effects/facts.hpp
// What everybody has to know of an effect who is not its law: every kind of entry (armature.hpp, damping.hpp, ...) states its facts, and
// from these follow accounts, what is refused where, the text of a scene's effects, and which parts its law must have (kernels/effects/law.hpp).
//
//   struct JointDamping {
//     Index row;
//     double coefficient;
//     static constexpr EffectFacts facts{.name = "damping", .owners = "damping", .site = Site::joint, .account = Account::taken};
//   };
#pragma once

#include <cstdint>
#include <iterator>
#include <string_view>

namespace linden {

/// What an effect acts on: entries of joints have a velocity row, or of a ball joint a slot; entries of bodies have a slot. What acts between pairs of
/// bodies is no force that a law adds, but rows of couplings (engine/sweeps/coupling_sweeps.hpp).
enum class Site : std::uint8_t { joint, body, pair };

/// What becomes of the energy that an effect exchanges: nothing, as the effect keeps or stores it; or it is booked, as taken by what can
/// only take, or as given by what drives. A step of an order above 2 goes back in time between whiles, where only the first have a place, and
/// entries of which one_way() is not true: what they take they take either way.
enum class Account : std::uint8_t { none, taken, given };

struct EffectFacts {
  std::string_view name;           // as scenes, reports and messages call it
  std::string_view owners;         // as a checkpoint calls what several entries act on
  Site site;
  Account account = Account::none;
  bool stores = false;             // has a potential
  bool single = false;             // no two entries on one joint
  bool on_balls = false;           // beside joints about or along one axis ball joints can have it, an entry a row
  bool has_states = false;         // of which one holds is settled within the solve; an entry's settles() may say: not for this one
  bool strikes = false;            // stops within a step what meets it: what it takes of a blow depends on what else struck in that step
  std::string_view sudden = {};    // what of it jumps, in words; empty where its force is a continuous function of positions and velocities;
                                   // an entry's jumps() may say: not of this one
};

/// Whether states of this entry are settled within the solve.
template <class Entry>
constexpr bool settles(const Entry& entry) {
  if constexpr (requires { entry.settles(); }) {
    return entry.settles();
  } else {
    return Entry::facts.has_states;
  }
}

/// Whether steps back in time would return what this entry takes or gives, so that orders above 2 have no place for it.
template <class Entry>
constexpr bool one_way(const Entry& entry) {
  if constexpr (requires { entry.one_way(); }) {
    return entry.one_way();
  } else {
    return Entry::facts.account != Account::none;
  }
}

/// Whether the force of this entry jumps with the motion.
template <class Entry>
constexpr bool jumps(const Entry& entry) {
  if constexpr (requires { entry.jumps(); }) {
    return entry.jumps();
  } else {
    return !Entry::facts.sudden.empty() && (settles(entry) || !Entry::facts.has_states);
  }
}

/// Units of a number of a joint that turns, and of one that slides.
struct Units {
  const char* turning;
  const char* sliding;
};
inline constexpr Units kPositionUnits{"rad", "m"}, kVelocityUnits{"rad/s", "m/s"}, kForceUnits{"N m", "N"}, kInertiaUnits{"kg m^2", "kg"},
    kStiffnessUnits{"N m/rad", "N/m"}, kDampingUnits{"N m s/rad", "N s/m"};

/// What a number may be.
enum class Allowed : std::uint8_t { finite, not_negative };

/// How a scene has to give a number: it must, or it may.
enum class Given : std::uint8_t { always, perhaps };

/// What becomes of a number of a joint that follows another, q_f = m q + o, where it is carried to the one that leads: it is multiplied by
/// m^2 as inertia and damping are, or by |m| as forces are; or the effect is refused on followers.
enum class Carried : std::uint8_t { never, by_square, by_size };

/// A number of an entry. Where an entry has a table of all of its numbers, `fields`, checks, scenes, texts and reports follow from it:
///
///   one number that is carried    {joint: number}, a number for all joints, or `urdf` where `in_file` says which of layout/attributes.hpp
///   else                          {joint: {name: number, ...}}
template <class Entry>
struct NumberField {
  const char* name;  // as scenes, reports and messages call it
  double Entry::*member;
  Units units;
  Allowed allowed;
  Given given = Given::always;
  Carried carried = Carried::never;
};

template <class Entry>
concept HasFields = requires { Entry::fields[0].member; };

/// Whether an entry is one number that a joint's leader takes over.
template <class Entry>
consteval bool is_one_number() {
  if constexpr (HasFields<Entry>) {
    return std::size(Entry::fields) == 1 && Entry::fields[0].carried != Carried::never;
  } else {
    return false;
  }
}

}  // namespace linden

// engine/step/effect_work.hpp
// The account of a scene's effects.
#pragma once

namespace linden {

/// What effects gave (driving ones) or took (losses) [J].
#define LINDEN_EFFECT_WORK(FIELD)     \
  FIELD(damping, "taken")             \
  FIELD(friction, "taken")            \
  FIELD(limits, "taken")              \
  FIELD(servo, "given")               \
  FIELD(torque, "given")              \
  FIELD(wrench, "given")              \
  FIELD(drag, "taken")                \
  FIELD(ground, "taken")

template <class S>
struct EffectWork {
#define LINDEN_MEMBER(name, sense) S name = S(0.0);
  LINDEN_EFFECT_WORK(LINDEN_MEMBER)
#undef LINDEN_MEMBER

  void add(const EffectWork& more) {
#define LINDEN_ADD(name, sense) name = name + more.name;
    LINDEN_EFFECT_WORK(LINDEN_ADD)
#undef LINDEN_ADD
  }
  S given() const { return servo + torque + wrench; }
  S taken() const { return damping + friction + limits + drag + ground; }
};

}  // namespace linden

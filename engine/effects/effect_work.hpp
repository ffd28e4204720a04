// engine/effects/effect_work.hpp
// The account of a scene's effects.
#pragma once

#include <algorithm>
#include <cmath>

#include "layout/field.hpp"

namespace linden {

/// What effects gave (driving ones) or took (losses) [J].
#define LINDEN_EFFECT_WORK(FIELD)     \
  FIELD(damping, "taken")             \
  FIELD(friction, "taken")            \
  FIELD(limits, "taken")              \
  FIELD(servo, "given")               \
  FIELD(torque, "given")              \
  FIELD(motion, "given")              \
  FIELD(wrench, "given")              \
  FIELD(drag, "taken")                \
  FIELD(ground, "taken")

struct EffectWork {
#define LINDEN_MEMBER(name, sense) double name = 0;
  LINDEN_EFFECT_WORK(LINDEN_MEMBER)
#undef LINDEN_MEMBER

  void add(const EffectWork& more) {
#define LINDEN_ADD(name, sense) name += more.name;
    LINDEN_EFFECT_WORK(LINDEN_ADD)
#undef LINDEN_ADD
  }
  double magnitude() const {
    double sum = 0;
#define LINDEN_MAGNITUDE(name, sense) sum += std::abs(name);
    LINDEN_EFFECT_WORK(LINDEN_MAGNITUDE)
#undef LINDEN_MAGNITUDE
    return sum;
  }
  /// What drives, and on the whole took energy, is among what takes.
  double given() const { return driven(1); }
  double taken() const { return damping + friction + limits + drag + ground + driven(-1); }

 private:
  /// Of what drives: all that gave (way 1), or took (way -1).
  double driven(double way) const {
    double sum = 0;
    for (const double work : {servo, torque, motion, wrench}) sum += std::max(way * work, 0.0);
    return sum;
  }
};

/// Where an effect took least in a step: below zero it gave there.
struct LeastLoss {
  double loss = 0;  // [J]
  Index at = -1;    // velocity row of a joint, slot of a body; -1: nowhere

  void see(Index where, double more) {
    if (more >= loss) return;
    loss = more;
    at = where;
  }
};

/// Of one step, with where each of those effects gave that can only take.
struct EffectAccount {
  EffectWork work;
  LeastLoss damping, friction, limits, drag, ground;
  double kinetic = 0;  // of the mean motion [J]

  void add(const EffectAccount& part) {
    work.add(part.work);
    const auto least = [](LeastLoss& mine, const LeastLoss& other) { mine.see(other.at, other.loss); };
    least(damping, part.damping);
    least(friction, part.friction);
    least(limits, part.limits);
    least(drag, part.drag);
    least(ground, part.ground);
    kinetic = part.kinetic;
  }
};

}  // namespace linden

// engine/effects/effect_work.hpp
// The account of a scene's effects: of each of them as its facts say, layout/effects/facts.hpp; and of couplings that give way.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "layout/effects.hpp"

namespace linden {

/// What effects gave (driving ones) or took (losses) [J].
struct EffectWork {
  std::array<double, kEffectLists> each{};  // list by list; zero of what neither gives nor takes
  double couplings = 0;                     // taken by couplings that give way

  /// Of the effect with entries of this kind: work.of<JointFriction>().
  template <class Entry>
  double& of() {
    return each[kListOf<Entry>];
  }
  template <class Entry>
  double of() const {
    return each[kListOf<Entry>];
  }

  void add(const EffectWork& more) {
    for (std::size_t k = 0; k < each.size(); ++k) each[k] += more.each[k];
    couplings += more.couplings;
  }
  double magnitude() const {
    double sum = std::abs(couplings);
    for (const double work : each) sum += std::abs(work);
    return sum;
  }
  /// What drives, and on the whole took energy, is among what takes.
  double given() const { return driven(1); }
  double taken() const {
    double sum = couplings;
    for (std::size_t k = 0; k < each.size(); ++k) sum += kEffectFacts[k]->account == Account::taken ? each[k] : 0;
    return sum + driven(-1);
  }

 private:
  /// Of what drives: all that gave (way 1), or took (way -1).
  double driven(double way) const {
    double sum = 0;
    for (std::size_t k = 0; k < each.size(); ++k) sum += kEffectFacts[k]->account == Account::given ? std::max(way * each[k], 0.0) : 0;
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
  std::array<LeastLoss, kEffectLists> least;
  double kinetic = 0;  // of the mean motion [J]
  double freed = 0;    // what contacts may give that push out of each other what began, or was found, within each other [J]

  void add(const EffectAccount& part) {
    work.add(part.work);
    for (std::size_t k = 0; k < least.size(); ++k) least[k].see(part.least[k].at, part.least[k].loss);
    kinetic = part.kinetic;
    freed += part.freed;
  }
};

}  // namespace linden

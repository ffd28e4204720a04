// engine/effects/passive_watch.hpp
// Watches that effects which can only take energy give none: damping, friction, limits, drag in still air, ground.
//
//   gift = most that the effect had taken so far - what it has taken now
//
// A loss is booked along the mean of neighbouring displacements, so that of a single step may be negative by what second order leaves where a
// motion turns. What is told is a gift above kGift of the energy that went to and fro: the largest kinetic energy of a step, or what all
// effects did together, so that it does not shrink as things come to rest. What contacts give to bodies that began within each other, where they push
// them out, is no gift: half of it is given in the step that follows, since work goes along the mean of two.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "engine/effects/effect_work.hpp"
#include "layout/model.hpp"

namespace linden {

/// An effect that gave energy although it can only take it.
struct PassiveGift {
  std::string effect;
  std::string where;  // `joint "elbow"`, `body "hand"`: where it gave most in the step in which that was found
  double time = 0;    // of that step's end [s]
  double amount = 0;  // the largest so far [J]
};

class PassiveWatch {
 public:
  PassiveWatch(const Model& model, const Effects& effects);

  /// After a step that ended at `time`.
  void add(const EffectAccount& step, double time);
  /// One entry an effect at most, in the order in which they were found.
  const std::vector<PassiveGift>& gifts() const { return known_.gifts; }

  /// All there is to know of the steps so far, for a checkpoint.
  struct Watched {
    double taken = 0, most = 0;
    int gift = -1;  // its entry among the gifts
  };
  struct Known {
    double scale = 0, done = 0;
    double owed = 0;  // what contacts may yet give to what they pushed out of each other in the last step [J]
    std::array<Watched, kEffectLists> watched{};  // list by list
    std::vector<PassiveGift> gifts{};
  };
  const Known& known() const { return known_; }
  void go_on(const Known& known) { known_ = known; }

 private:
  static constexpr double kGift = 0.01;

  const Model& model_;
  bool still_air_;  // where none moves, drag gives nothing either
  Known known_;
};

/// One sentence for each.
std::string describe(const PassiveGift& gift);

}  // namespace linden

// engine/program/animator.hpp
// A simulation that is looked at: frames with all that can be asked for as curves.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "engine/program/quantities.hpp"
#include "engine/program/views.hpp"
#include "engine/view/animation_recorder.hpp"

namespace linden {

class Animator {
 public:
  /// steps: that are to come. observed: names of observations. Forces are kept from here on.
  Animator(Simulation& simulation, const ViewArguments& arguments, std::int64_t steps, const std::vector<std::string>& observed);

  /// Steps between two frames.
  std::int64_t stride() const { return stride_; }
  /// A frame of the state that the simulation is in.
  void look();
  /// Of all frames up to now none is kept; what a frame takes is used again.
  void forget_frames() { recorder_.forget_frames(); }
  const Animation& animation() const { return recorder_.animation(); }

 private:
  void add_curves(std::size_t frames);

  Simulation& simulation_;
  Observer observer_;
  AnimationRecorder recorder_;
  std::int64_t stride_ = 1;
  std::vector<std::size_t> shown_;  // arrays of the observer that are curves
  std::vector<double> numbers_;
};

}  // namespace linden

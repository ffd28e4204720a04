// engine/view/animation_recorder.hpp
// Collects a motion frame by frame: from positions alone, so that a simulation, instances of a batch and a recording are all seen alike.
//
//   AnimationRecorder recorder(model, effects, "humanoid", 1);
//   recorder.add_curves({{"velocity", "left_knee", "rad/s", slot}});         numbers beside the poses, as many as wanted
//   recorder.add(time, q, numbers, forces_of(simulation, 0));
//   page_of(recorder.animation());
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "engine/queries/kinematics.hpp"
#include "engine/view/animation.hpp"

namespace linden {

class Simulation;

class AnimationRecorder {
 public:
  /// The model must outlive it. Opens the meshes that the model names.
  AnimationRecorder(const Model& model, const Effects& effects, std::string title, std::int64_t instances);

  /// Before the first frame.
  void add_curves(std::vector<Curve> curves);
  /// A sentence for those who look.
  void add_note(std::string note) { animation_.notes.push_back(std::move(note)); }

  /// One frame: time [s] behind those before it, positions [instances x nq], a number of each curve, forces. Throws InputError for a number
  /// of the positions that is not finite.
  void add(double time, std::span<const double> positions, std::span<const double> numbers = {}, std::vector<DrawnForce> forces = {});

  /// Frames that were collected are forgotten; all else stays.
  void forget_frames();

  /// What was collected up to now.
  const Animation& animation() const { return animation_; }

 private:
  Animation animation_;
  Kinematics now_;
  std::vector<Pose> frames_;   // [slots] of links in their bodies
};

/// Pushes of the ground in the step that was taken last; none where the simulation does not keep them (Simulation::keep_forces).
std::vector<DrawnForce> forces_of(const Simulation& simulation, std::int64_t instance);

/// Steps between two frames, for `fps` frames a second [1/s] or as many of them as a picture of the whole can hold. `poses`: bodies that are
/// shown in each.
struct FrameStride {
  std::int64_t steps = 1;
  std::string note;  // what there is to say where there are fewer frames than were asked for; else empty
};
FrameStride frame_stride(std::int64_t steps, double step, double fps, std::int64_t poses);

}  // namespace linden

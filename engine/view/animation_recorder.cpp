#include "engine/view/animation_recorder.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "engine/simulation.hpp"
#include "kernels/queries/body_motion_down.hpp"
#include "layout/support/input_error.hpp"
#include "models/build/isometry.hpp"
#include "models/build/vectors.hpp"

namespace linden {
namespace {

Isometry world_of(const Placement<double>& T) {
  Isometry isometry = Isometry::Identity();
  isometry.linear() << T.R.x.x, T.R.x.y, T.R.x.z, T.R.y.x, T.R.y.y, T.R.y.z, T.R.z.x, T.R.z.y, T.R.z.z;
  isometry.translation() << T.p.x, T.p.y, T.p.z;
  return isometry;
}

/// Quaternion x y z w and place.
void append_pose(const Isometry& T, std::vector<float>& poses) {
  const Eigen::Quaterniond q = Eigen::Quaterniond(T.linear()).normalized();
  for (const double number : {q.x(), q.y(), q.z(), q.w()}) poses.push_back(static_cast<float>(number));
  for (const double number : T.translation()) poses.push_back(static_cast<float>(number));
}

/// Frame of the link at each body's joint, in the body's: a body's own frame has the joint's axis as z, which no robot's file knows.
std::vector<Pose> link_frames(const Model& model) {
  std::vector<Pose> frames(static_cast<std::size_t>(model.tree.shape.slots));
  for (std::size_t slot = 1; slot < frames.size(); ++slot) {
    const auto place = model.names.link.find(model.names.body[slot]);
    if (place != model.names.link.end()) frames[slot] = place->second.in_body;
  }
  return frames;
}

/// Couplings that go from point to point.
std::vector<DrawnLine> lines_of(const Model& model, const std::vector<Pose>& frames) {
  std::vector<DrawnLine> lines;
  for (const Coupling& coupling : model.couplings) {
    DrawnLine line{coupling.name, {}};
    const auto add = [&](Index slot, const std::array<double, 3>& at) {
      const Eigen::Vector3d place = isometry(frames[static_cast<std::size_t>(slot)]).inverse() * vector_of(at);
      line.points.push_back({slot, {static_cast<float>(place.x()), static_cast<float>(place.y()), static_cast<float>(place.z())}});
    };
    for (const CablePoint& point : coupling.points) add(point.slot, point.at);
    if (coupling.kind == CouplingKind::rod) {
      add(coupling.slot_a, coupling.frame_a.shift);
      add(coupling.slot_b, coupling.frame_b.shift);
    }
    if (!line.points.empty()) lines.push_back(std::move(line));
  }
  return lines;
}

}  // namespace

AnimationRecorder::AnimationRecorder(const Model& model, const Effects& effects, std::string title, std::int64_t instances)
    : now_(model), frames_(link_frames(model)) {
  animation_.title = std::move(title);
  animation_.drawing = drawing_of(model, effects);
  for (DrawnPart& part : animation_.drawing.parts) {
    part.pose = pose_of(isometry(frames_[static_cast<std::size_t>(part.slot)]).inverse() * isometry(part.pose));
  }
  animation_.lines = lines_of(model, frames_);
  animation_.instances = instances;
  const Tree& tree = model.tree;
  for (Index i = 1; i < tree.shape.slots; ++i) {
    animation_.bodies.push_back(model.names.body[static_cast<std::size_t>(i)]);
    animation_.joints.push_back(model.names.joint[static_cast<std::size_t>(i)]);
    animation_.parents.push_back(tree.parent(i) - 1);
  }
}

void AnimationRecorder::add_curves(std::vector<Curve> curves) {
  for (Curve& curve : curves) animation_.curves.push_back(std::move(curve));
}

void AnimationRecorder::add(double time, std::span<const double> positions, std::span<const double> numbers, std::vector<DrawnForce> forces) {
  const auto nq = static_cast<std::size_t>(now_.model().tree.shape.positions);
  for (std::int64_t instance = 0; instance < animation_.instances; ++instance) {
    const std::span<const double> q = positions.subspan(static_cast<std::size_t>(instance) * nq, nq);
    const auto wrong = std::ranges::find_if_not(q, [](double x) { return std::isfinite(x); });
    if (wrong != q.end()) {
      throw InputError(fmt::format("what is to be shown: position {} of instance {} at {:.6g} s is {}; expected finite numbers",
                                   now_.model().names.position[static_cast<std::size_t>(wrong - q.begin())], instance, time, *wrong));
    }
    now_.set(q);
    for (Index i = 1; i < now_.model().tree.shape.slots; ++i) {
      append_pose(world_of(load<Placement, double>(now_.bodies().pose, i)) * isometry(frames_[static_cast<std::size_t>(i)]),
                  animation_.poses);
    }
  }
  animation_.times.push_back(time);
  for (std::size_t k = 0; k < animation_.curves.size(); ++k) animation_.curves[k].values.push_back(static_cast<float>(numbers[k]));
  animation_.forces.push_back(std::move(forces));
}

void AnimationRecorder::forget_frames() {
  animation_.times.clear();
  animation_.poses.clear();
  animation_.forces.clear();
  for (Curve& curve : animation_.curves) curve.values.clear();
}

std::vector<DrawnForce> forces_of(const Simulation& simulation, std::int64_t instance) {
  std::vector<DrawnForce> forces;
  if (!simulation.keeps_forces()) return forces;
  const auto floats = [](const std::array<double, 3>& a) {
    return std::array<float, 3>{static_cast<float>(a[0]), static_cast<float>(a[1]), static_cast<float>(a[2])};
  };
  for (const ContactPoint& point : simulation.contact_points()) {
    forces.push_back({instance, point.slot, floats(point.place), floats(point.force)});
  }
  return forces;
}

FrameStride frame_stride(std::int64_t steps, double step, double fps, std::int64_t poses) {
  constexpr double kMostPoses = 6e6;  // some 60 MB of a page, and 200 MB while it is written
  const auto asked = std::max<std::int64_t>(1, std::llround(1 / (fps * step)));
  const double frames = kMostPoses / static_cast<double>(poses);
  const auto least = static_cast<std::int64_t>(std::ceil(static_cast<double>(steps) / std::max(1.0, frames)));
  if (least <= asked) return {asked, ""};
  return {least, fmt::format("one frame in {:.3g} s: {:.3g} million places of bodies are shown at most", static_cast<double>(least) * step,
                             kMostPoses / 1e6)};
}

}  // namespace linden

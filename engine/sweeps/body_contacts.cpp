#include "engine/sweeps/body_contacts.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/collision/convex_pair.hpp"
#include "kernels/effects/ground_contact.hpp"
#include "kernels/values/se3.hpp"

namespace linden {
namespace {

/// Contacts that are remembered, for each shape; no shape is touched at more places at once.
constexpr std::size_t kMostOfShape = 32;

/// Numbers of one.
constexpr std::size_t kNumbers = kNumbersOfTouch, kForce = 3, kLoad = 6;

Vec3<double> vector(const double* numbers) { return {numbers[0], numbers[1], numbers[2]}; }

Placement<double> placement(const Pose& pose) {
  double numbers[12];
  std::ranges::copy(pose.rotation, numbers);
  std::ranges::copy(pose.shift, numbers + 9);
  return Placement<double>::from(numbers);
}

/// Whether what touches by it turns as a ball does, about its middle.
bool is_round(const ConvexShape& shape) { return shape.kind == ConvexKind::point || shape.kind == ConvexKind::segment; }

double half_of(std::uint64_t feature, int half) { return static_cast<double>(half == 0 ? feature >> 32 : feature & 0xffffffffu); }

Pose pose_of(const Placement<double>& placement) {
  Pose pose;
  double numbers[12];
  placement.to(numbers);
  std::copy_n(numbers, 9, pose.rotation.begin());
  std::copy_n(numbers + 9, 3, pose.shift.begin());
  return pose;
}

Pose pose_in(const Placement<double>& body, const Mat3<double>& R, const Vec3<double>& at) {
  return pose_of({transpose(body.R) * R, transpose_times(body.R, at - body.p)});
}

/// Two directions across a normal, and the normal, as rows.
std::array<double, 9> directions_of(const Vec3<double>& n) {
  const double x = std::abs(n.x), y = std::abs(n.y), z = std::abs(n.z);
  const Vec3<double> least = x <= y && x <= z ? Vec3<double>{1, 0, 0} : y <= z ? Vec3<double>{0, 1, 0} : Vec3<double>{0, 0, 1};
  const Vec3<double> one = unit_vector(cross(n, least)), other = cross(n, one);
  return {one.x, one.y, one.z, other.x, other.y, other.z, n.x, n.y, n.z};
}

}  // namespace

BodyContacts::BodyContacts(const PairContact& contact) : contact_(contact) {
  for (const ConvexBody& shape : contact.shapes) reach_.push_back(core_reach(shape.shape) + shape.shape.radius);
  poses_.resize(contact.shapes.size());
  memory_.assign(first_number() + kNumbers * std::min(kMostOfShape * contact.shapes.size(), 4 * contact.pairs.size()), 0.0);
  forget();
}

void BodyContacts::forget() {
  std::ranges::fill(memory_, 0.0);
  std::fill_n(memory_.begin() + 1, 3 * contact_.shapes.size(), std::numeric_limits<double>::quiet_NaN());
  forces_.clear();
}

bool BodyContacts::find(const Field<double, 12>& pose) {
  const std::size_t shapes = contact_.shapes.size();
  std::vector<double>& moved = moved_;
  moved.assign(shapes, 0.0);
  for (std::size_t k = 0; k < shapes; ++k) {
    const ConvexBody& shape = contact_.shapes[k];
    poses_[k] = pose_of(placed_in(load<Placement, double>(pose, shape.slot), placement(shape.pose)));
    const Vec3<double> step = vector(poses_[k].shift.data()) - vector(&memory_[1 + 3 * k]);
    const double distance = std::sqrt(dot(step, step));
    if (std::isfinite(distance)) moved[k] = distance;
  }
  touches_.clear();
  std::size_t count = 0;
  bool changed = false;
  for (std::size_t pair = 0; pair < contact_.pairs.size(); ++pair) {
    const auto& [a, b] = contact_.pairs[pair];
    const double margin = gap_looked_at(reach_[a], reach_[b], moved[a], moved[b]);
    const Vec3<double> apart = vector(poses_[b].shift.data()) - vector(poses_[a].shift.data());
    const double reach = reach_[a] + reach_[b] + margin;
    if (dot(apart, apart) > reach * reach) continue;
    const ContactPatch patch = contact_patch(contact_.shapes[a].shape, poses_[a], contact_.shapes[b].shape, poses_[b], margin);
    for (std::size_t k = 0; k < static_cast<std::size_t>(patch.count); ++k, ++count) {
      const PatchPoint& point = patch.points[k];
      const bool swapped = is_round(contact_.shapes[a].shape) && !is_round(contact_.shapes[b].shape);
      const ConvexBody &first = contact_.shapes[swapped ? b : a], &second = contact_.shapes[swapped ? a : b];
      const Vec3<double> n = swapped ? -1.0 * patch.normal : patch.normal, half = (0.5 * point.gap) * n;
      touches_.push_back({pair, point.feature, point.gap, {point.place.x, point.place.y, point.place.z}, directions_of(n)});
      const std::array<double, 9>& d = touches_.back().across;
      const Mat3<double> R = transpose(Mat3<double>{vector(&d[0]), vector(&d[3]), vector(&d[6])});
      const bool both = is_round(first.shape) && is_round(second.shape);
      const CouplingKind kind = both ? CouplingKind::round_contact : CouplingKind::face_contact;
      if (count == couplings_.size()) couplings_.emplace_back();
      Coupling& coupling = couplings_[count];
      changed = changed || coupling.kind != kind || coupling.slot_a != first.slot || coupling.slot_b != second.slot;
      coupling.kind = kind;
      coupling.slot_a = first.slot;
      coupling.slot_b = second.slot;
      coupling.frame_a = pose_in(load<Placement, double>(pose, first.slot), R, point.place - half);
      coupling.frame_b = pose_in(load<Placement, double>(pose, second.slot), R, point.place + half);
      coupling.rounding = {both ? first.shape.radius : 0, is_round(second.shape) ? second.shape.radius : 0};
    }
  }
  changed = changed || count != coupled_;
  couplings_.resize(count);
  coupled_ = count;
  return changed;
}

std::span<const double> BodyContacts::remembered(std::size_t touch) const {
  for (std::size_t at = first_number(); at < memory_.size() && memory_[at] != 0; at += kNumbers) {
    const auto pair = static_cast<std::size_t>(memory_[at]) - 1;
    if (pair == touches_[touch].pair && memory_[at + 1] == half_of(touches_[touch].feature, 0) && memory_[at + 2] == half_of(touches_[touch].feature, 1)) return std::span(memory_).subspan(at, kNumbers);
  }
  return {};
}

double BodyContacts::stored_of_last() const {
  double sum = 0;
  for (std::size_t at = first_number(); at < memory_.size() && memory_[at] != 0; at += kNumbers) sum += stored_by(memory_[at + kLoad]);
  return sum;
}

ContactLaw BodyContacts::law_of(std::size_t touch, double h) const {
  double borne = 0;  // the most of its pair
  for (std::size_t at = first_number(); at < memory_.size() && memory_[at] != 0; at += kNumbers) {
    if (static_cast<std::size_t>(memory_[at]) - 1 == touches_[touch].pair) borne = std::max(borne, memory_[at + kLoad]);
  }
  const double depth = std::max(0.0, -touches_[touch].gap), known = borne / contact_.stiffness + h * kRecoverySpeed;
  return {h * h * contact_.stiffness, contact_.friction, h * kCreep, std::max(0.0, depth - known)};
}

std::array<double, 3> BodyContacts::guess_of(std::size_t touch, double h) const {
  const std::span<const double> last = remembered(touch);
  std::array<double, 3> guess{};
  for (std::size_t j = 0; !last.empty() && j < 3; ++j) guess[j] = h * h * dot(vector(&touches_[touch].across[3 * j]), vector(&last[kForce]));
  return guess;
}

Vec3<double> BodyContacts::force_on_b(std::size_t touch) const {
  const std::array<double, 9>& d = touches_[touch].across;
  const Force& force = forces_[touch];
  return force[0] * vector(&d[0]) + force[1] * vector(&d[3]) + force[2] * vector(&d[6]);
}

std::vector<TouchImpulse> BodyContacts::impulses(double h) const {
  std::vector<TouchImpulse> pushing;
  for (std::size_t k = 0; k < touches_.size(); ++k) {
    if (forces_[k][2] == 0) continue;
    const Touch& touch = touches_[k];
    TouchImpulse& one = pushing.emplace_back(TouchImpulse{touch.pair, touch.feature, couplings_[k].slot_a, couplings_[k].slot_b, touch.place});
    std::copy_n(touch.across.begin() + 6, 3, one.normal.begin());
    (h * force_on_b(k)).to(one.impulse.data());
  }
  return pushing;
}

void BodyContacts::remember() {
  for (std::size_t k = 0; k < poses_.size(); ++k) {
    std::ranges::copy(poses_[k].shift, memory_.begin() + static_cast<std::ptrdiff_t>(1 + 3 * k));
  }
  std::size_t at = first_number();
  for (std::size_t k = 0; k < touches_.size() && at < memory_.size(); ++k) {
    if (forces_[k][2] == 0) continue;
    const Vec3<double> force = force_on_b(k);
    const std::array numbers{static_cast<double>(touches_[k].pair + 1), half_of(touches_[k].feature, 0), half_of(touches_[k].feature, 1), force.x, force.y, force.z, forces_[k][2]};
    std::ranges::copy(numbers, memory_.begin() + static_cast<std::ptrdiff_t>(at));
    at += kNumbers;
  }
  std::fill(memory_.begin() + static_cast<std::ptrdiff_t>(at), memory_.end(), 0.0);
}

}  // namespace linden

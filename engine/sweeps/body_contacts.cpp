#include "engine/sweeps/body_contacts.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "kernels/collision/convex_pair.hpp"
#include "kernels/collision/height_contacts.hpp"
#include "kernels/effects/ground_contact.hpp"
#include "kernels/values/se3.hpp"

namespace linden {
namespace {

/// Contacts that are remembered, for each shape; no shape is touched at more places at once.
constexpr std::size_t kMostOfShape = 32;

/// Where numbers of one are.
constexpr std::size_t kForceAt = 3, kSpringAt = 6, kDepthAt = 7, kMomentAt = 8;

Vec3<double> vector(const double* numbers) { return {numbers[0], numbers[1], numbers[2]}; }

Placement<double> placement(const Pose& pose) {
  double numbers[12];
  std::ranges::copy(pose.rotation, numbers);
  std::ranges::copy(pose.shift, numbers + 9);
  return Placement<double>::from(numbers);
}

/// Whether what touches by it turns as a ball does, about its middle.
bool is_round(const ConvexShape& shape) { return shape.kind == ConvexKind::point || shape.kind == ConvexKind::segment; }

/// Of two shapes the one that is rounder rolls on the other, which is taken for flat there.
int roundness(const ConvexShape& shape) {
  return is_round(shape) ? 2 : shape.kind == ConvexKind::cylinder || shape.kind == ConvexKind::ellipsoid ? 1 : 0;
}

/// A cylinder that stands within this sine of upright does so on places of its rim, which are no lowest ones of the circle.
constexpr double kStands = 0.02;
/// Nor is a place that is farther than this share of its radius from the one that is.
constexpr double kLowest = 0.01;
/// Whether a shape lies with a face where its normal is n; not with an edge or a corner, nor with what is round.
bool lies_flat(const ConvexShape& shape, const Pose& pose, const Vec3<double>& n) {
  constexpr double kAlong = 1 - 1e-9;
  const Vec3<double> own = transpose_times(Mat3<double>::from(pose.rotation.data()), n);
  if (shape.kind == ConvexKind::plane) return true;
  if (shape.kind == ConvexKind::box) return std::max({std::abs(own.x), std::abs(own.y), std::abs(own.z)}) > kAlong;
  if (shape.kind == ConvexKind::cylinder) return std::abs(own.z) > kAlong;
  if (shape.kind != ConvexKind::hull) return false;
  return std::ranges::any_of(shape.hull->faces, [&](const ConvexHull::Face& face) { return dot(vector(face.normal.data()), own) > kAlong; });
}

/// As Coupling::oval of a shape that meets a face with this place of its core: of what is round a ball, an ellipsoid itself, of a cylinder the circle
/// about its axis there, be it its rim or its side. d: the rows of Touch::across.
std::array<double, 6> oval_of(const ConvexShape& shape, const Pose& pose, const std::array<double, 9>& d, const Vec3<double>& place) {
  if (roundness(shape) == 0) return {};
  if (is_round(shape)) return {shape.radius * shape.radius, 0, 0, shape.radius * shape.radius, 0, shape.radius * shape.radius};
  const Mat3<double> axes = transpose(Mat3<double>::from(pose.rotation.data())), across = Mat3<double>::from(d.data());
  const bool is_circle = shape.kind == ConvexKind::cylinder;
  std::array<double, 6> oval{};
  for (const Vec3<double>& semi_axis : {shape.half[0] * axes.x, shape.half[is_circle ? 0 : 1] * axes.y, (is_circle ? 0 : shape.half[2]) * axes.z}) {
    const Vec3<double> u = across * semi_axis;
    const std::array more{u.x * u.x, u.x * u.y, u.x * u.z, u.y * u.y, u.y * u.z, u.z * u.z};
    for (std::size_t k = 0; k < more.size(); ++k) oval[k] += more[k];
  }
  const double radius = shape.half[0], depth = std::sqrt(oval[5]);
  if (!is_circle) return depth > 0 ? oval : std::array<double, 6>{};
  if (depth <= kStands * radius) return {};
  const Vec3<double> middle = place - vector(pose.shift.data()) + transpose_times(across, Vec3<double>{oval[2] / depth, oval[4] / depth, depth});
  const Vec3<double> off = middle - dot(middle, axes.z) * axes.z;
  return dot(off, off) <= kLowest * radius * kLowest * radius ? oval : std::array<double, 6>{};
}

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

BodyContacts::BodyContacts(const PairContact& contact, const Model& model)
    : contact_(contact), rows_(static_cast<std::size_t>(model.tree.shape.velocities)), numbers_of_touch_(numbers_of_touch(contact)) {
  const BodyConstants<double>& bodies = model.constants;
  const auto mass = [&](std::size_t shape) {
    const Index slot = contact.shapes[shape].slot;
    if (slot == 0) return std::numeric_limits<double>::infinity();
    return bodies.inertia(slot, 0) > 0 ? bodies.inertia(slot, 0) : bodies.subtree_mass(slot);
  };
  for (const auto& [a, b] : contact.pairs) lighter_.push_back(std::min(mass(a), mass(b)));
  for (const ConvexBody& shape : contact.shapes) reach_.push_back(core_reach(shape.shape) + shape.shape.radius);
  poses_.resize(contact.shapes.size());
  // of two shapes the smaller decides, so that the largest need not look farther than the next; what has no end meets the largest of the others
  std::vector<double> sorted = reach_;
  std::ranges::sort(sorted, std::greater());
  const auto endless = static_cast<std::size_t>(std::ranges::count(sorted, std::numeric_limits<double>::infinity()));
  const double next = endless < sorted.size() ? sorted[std::min(std::max<std::size_t>(1, endless), sorted.size() - 1)] : 0;
  for (const double reach : reach_) near_.push_back(0.5 * kNearBy * std::min(reach, next));
  for (std::uint32_t a = 0; a <= contact.shapes.size(); ++a) {
    const auto of_a = std::ranges::lower_bound(contact.pairs, std::pair(a, std::uint32_t(0)));
    first_pair_.push_back(static_cast<std::size_t>(of_a - contact.pairs.begin()));
  }
  std::size_t most = 0;
  for (const auto& [a, b] : contact.pairs) most += contact.shapes[a].shape.heights ? kMostHeightContacts : 4;
  memory_.assign(first_number() + numbers_of_touch_ * std::min(kMostOfShape * contact.shapes.size(), most), 0.0);
  forget();
}

void BodyContacts::forget() {
  std::ranges::fill(memory_, 0.0);
  std::fill_n(memory_.begin() + kRememberedMiddle, 3 * contact_.shapes.size(), std::numeric_limits<double>::quiet_NaN());
  forces_.clear();
}

bool BodyContacts::find(const Field<double, 12>& pose) {
  const std::size_t shapes = contact_.shapes.size();
  std::vector<double>& moved = moved_;
  moved.assign(shapes, 0.0);
  for (std::size_t k = 0; k < shapes; ++k) {
    const ConvexBody& shape = contact_.shapes[k];
    poses_[k] = pose_of(placed_in(load<Placement, double>(pose, shape.slot), placement(shape.pose)));
    const Vec3<double> step = vector(poses_[k].shift.data()) - vector(&memory_[kRememberedMiddle + 3 * k]);
    const double distance = std::sqrt(dot(step, step));
    if (std::isfinite(distance)) moved[k] = distance;
  }
  bounds_.clear();
  for (std::size_t k = 0; k < shapes; ++k) {
    Bounds& bounds = bounds_.emplace_back(bounds_of(contact_.shapes[k].shape, poses_[k]));
    for (std::size_t axis = 0; axis < 3; ++axis) {
      bounds.low[axis] -= near_[k] + 2 * moved[k];
      bounds.high[axis] += near_[k] + 2 * moved[k];
    }
  }
  const std::size_t last = couplings_.size();
  touches_.clear();
  changed_ = false;
  for (const auto& [a, b] : broad_phase_.pairs(bounds_, 0)) {
    const std::size_t pair = number_of(a, b);
    if (pair == contact_.pairs.size()) continue;
    add(pair, gap_looked_at(reach_[a], reach_[b], moved[a], moved[b]), pose);
  }
  couplings_.resize(touches_.size());
  steps_.resize(touches_.size());
  return changed_ || touches_.size() != last;
}

std::size_t BodyContacts::number_of(std::uint32_t a, std::uint32_t b) const {
  const auto begin = contact_.pairs.begin();
  const auto end = begin + static_cast<std::ptrdiff_t>(first_pair_[a + 1]);
  const auto found = std::ranges::lower_bound(begin + static_cast<std::ptrdiff_t>(first_pair_[a]), end, std::pair(a, b));
  return found != end && *found == std::pair(a, b) ? static_cast<std::size_t>(found - begin) : contact_.pairs.size();
}

/// Where the shapes of a pair touch, or will.
void BodyContacts::add(std::size_t pair, double margin, const Field<double, 12>& pose) {
  const auto& [a, b] = contact_.pairs[pair];
  const Vec3<double> apart = vector(poses_[b].shift.data()) - vector(poses_[a].shift.data());
  const double reach = reach_[a] + reach_[b] + margin;
  if (dot(apart, apart) > reach * reach) return;
  if (const auto& heights = contact_.shapes[a].shape.heights) {
    HeightContacts found;
    height_contacts(*heights, poses_[a], contact_.shapes[b].shape, poses_[b], margin, found);
    for (std::size_t k = 0; k < found.count; ++k) add_place(pair, found.at[k].normal, found.at[k].point, found.at[k].on_face, pose);
    return;
  }
  const ContactPatch patch = contact_patch(contact_.shapes[a].shape, poses_[a], contact_.shapes[b].shape, poses_[b], margin);
  for (std::size_t k = 0; k < static_cast<std::size_t>(patch.count); ++k) add_place(pair, patch.normal, patch.points[k], false, pose);
}

void BodyContacts::add_place(std::size_t pair, const Vec3<double>& normal, const PatchPoint& point, bool on_face, const Field<double, 12>& pose) {
  const auto& [a, b] = contact_.pairs[pair];
  const bool swapped = roundness(contact_.shapes[a].shape) > roundness(contact_.shapes[b].shape);
  const ConvexBody &first = contact_.shapes[swapped ? b : a], &second = contact_.shapes[swapped ? a : b];
  const Vec3<double> n = swapped ? -1.0 * normal : normal, half = (0.5 * point.gap) * n;
  touches_.push_back({pair, point.feature, point.gap, {point.place.x, point.place.y, point.place.z}, directions_of(n)});
  const std::array<double, 9>& d = touches_.back().across;
  const Mat3<double> R = transpose(Mat3<double>::from(d.data()));
  const bool both = is_round(first.shape) && is_round(second.shape);
  const CouplingKind kind = both ? CouplingKind::round_contact : CouplingKind::face_contact;
  if (touches_.size() > couplings_.size()) couplings_.emplace_back();
  Coupling& coupling = couplings_[touches_.size() - 1];
  const double arm = contact_.material(pair).resists_turning() ? std::min(reach_[a], reach_[b]) : 0;
  changed_ = changed_ || coupling.kind != kind || coupling.slot_a != first.slot || coupling.slot_b != second.slot || (coupling.length > 0) != (arm > 0);
  coupling.kind = kind;
  coupling.length = arm;
  coupling.slot_a = first.slot;
  coupling.slot_b = second.slot;
  coupling.frame_a = pose_in(load<Placement, double>(pose, first.slot), R, point.place - half);
  coupling.frame_b = pose_in(load<Placement, double>(pose, second.slot), R, point.place + half);
  // a ball on an edge keeps a place on it, and not its own lowest one
  const bool rolls = !both && (!is_round(second.shape) || on_face || lies_flat(first.shape, poses_[swapped ? b : a], n));
  const bool has_core = roundness(second.shape) == 1 || (is_round(second.shape) && !rolls);
  coupling.rounding = {both ? first.shape.radius : 0, has_core ? second.shape.radius : 0};
  coupling.oval = {};
  if (rolls) coupling.oval = oval_of(second.shape, poses_[swapped ? a : b], d, point.place + half + coupling.rounding[1] * n);
}

/// They are in the order of pairs, and end where nothing is remembered.
std::span<const double> BodyContacts::remembered_of_pair(std::size_t pair) const {
  const auto number = [&](std::size_t k) { return memory_[first_number() + numbers_of_touch_ * k]; };
  const auto search = [&](double least) {
    std::size_t low = 0, high = (memory_.size() - first_number()) / numbers_of_touch_;
    while (low < high) {
      const std::size_t middle = (low + high) / 2;
      if (number(middle) != 0 && number(middle) < least) low = middle + 1;
      else high = middle;
    }
    return low;
  };
  const auto name = static_cast<double>(pair + 1);
  const std::size_t begin = search(name), end = search(name + 1);
  return std::span(memory_).subspan(first_number() + numbers_of_touch_ * begin, numbers_of_touch_ * (end - begin));
}

std::span<const double> BodyContacts::remembered(std::size_t touch) const {
  const std::span<const double> of_pair = remembered_of_pair(touches_[touch].pair);
  for (std::size_t at = 0; at < of_pair.size(); at += numbers_of_touch_) {
    const bool same = of_pair[at + 1] == half_of(touches_[touch].feature, 0) && of_pair[at + 2] == half_of(touches_[touch].feature, 1);
    if (same) return of_pair.subspan(at, numbers_of_touch_);
  }
  return {};
}

double BodyContacts::stored_of_last() const {
  double sum = 0;
  for (std::size_t at = first_number(); at < memory_.size() && memory_[at] != 0; at += numbers_of_touch_) sum += 0.25 * memory_[at + kSpringAt] * memory_[at + kDepthAt];
  return sum;
}

ContactLaw BodyContacts::begin(std::size_t touch, double h, double opened, double gravity) {
  const Touch& at = touches_[touch];
  const ContactMaterial& material = contact_.material(at.pair);
  const double rigid = kRigid * lighter_[at.pair] / (h * h), stiffness = std::min(material.stiffness, rigid);
  Step& step = steps_[touch];
  step = {.law = {h * h * stiffness, material.friction, h * kContactCreep, 0}, .stiffness = stiffness, .spring_lift = 0};
  if (const double arm = couplings_[touch].length; arm > 0) {
    step.law.rolling = material.rolling_friction / arm;
    step.law.torsion = material.torsional_friction / arm;
  }
  const double fall = 2 * h * h * gravity;
  if (material.restitution > 0 && -opened > h * kLeastRebound + fall && at.gap + opened < fall) {
    step.law.stiffness = h * h * rigid;
    step.law.lift = material.restitution * opened - at.gap;
    step.stiffness = 0;
    return step.law;
  }
  const std::span<const double> of_pair = remembered_of_pair(at.pair);
  double borne = 0;  // the deepest of it
  for (std::size_t one = 0; one < of_pair.size(); one += numbers_of_touch_) borne = std::max(borne, of_pair[one + kDepthAt]);
  const double gap = std::min(0.0, at.gap);
  step.found = std::max(0.0, -gap - borne);
  step.spring_lift = std::max(0.0, step.found - h * kRecoverySpeed);
  const double spring = step.law.stiffness, damper = h * material.damping;
  step.law.stiffness = spring + damper;
  step.law.lift = (spring * step.spring_lift - damper * gap) / (spring + damper);
  return step.law;
}

BodyContacts::Force BodyContacts::guess_of(std::size_t touch, double h) const {
  const std::span<const double> last = remembered(touch);
  Force guess{};
  if (last.empty()) return guess;
  const double arm = couplings_[touch].length;
  for (std::size_t j = 0; j < 3; ++j) {
    const Vec3<double> way = vector(&touches_[touch].across[3 * j]);
    guess[j] = h * h * dot(way, vector(&last[kForceAt]));
    if (arm > 0) guess[3 + j] = h * h / arm * dot(way, vector(&last[kMomentAt]));
  }
  return guess;
}

Vec3<double> BodyContacts::push_on_b(std::size_t touch, const Force& along) const {
  const std::array<double, 9>& d = touches_[touch].across;
  return along[0] * vector(&d[0]) + along[1] * vector(&d[3]) + along[2] * vector(&d[6]);
}

Vec3<double> BodyContacts::moment_on_b(std::size_t touch, const Force& along) const {
  const std::array<double, 9>& d = touches_[touch].across;
  return couplings_[touch].length * (along[3] * vector(&d[0]) + along[4] * vector(&d[3]) + along[5] * vector(&d[6]));
}

void BodyContacts::push_lasting(double h, const Field<double, 12>& pose, Field<double, 6>& impulse) const {
  for (std::size_t k = 0; k < touches_.size(); ++k) {
    const Vec3<double> on_b = (0.5 / h) * push_on_b(k, lasting_[k]), turns_b = (0.5 / h) * moment_on_b(k, lasting_[k]);
    const Vec3<double> place = vector(touches_[k].place.data());
    for (const auto& [slot, sign] : {std::pair(couplings_[k].slot_a, -1.0), std::pair(couplings_[k].slot_b, 1.0)}) {
      if (slot == 0) continue;
      const auto body = load<Placement, double>(pose, slot);
      const Vec3<double> own = transpose_times(body.R, sign * on_b), arm = transpose_times(body.R, place - body.p);
      const Vec3<double> moment = cross(arm, own) + transpose_times(body.R, sign * turns_b);
      store(impulse, slot, load<Wrench, double>(impulse, slot) + Wrench<double>{moment, own});
    }
  }
}

std::vector<TouchImpulse> BodyContacts::impulses(double h) const {
  std::vector<TouchImpulse> pushing;
  for (std::size_t k = 0; k < touches_.size(); ++k) {
    if (forces_[k][2] == 0) continue;
    const Touch& touch = touches_[k];
    TouchImpulse& one = pushing.emplace_back(TouchImpulse{touch.pair, touch.feature, couplings_[k].slot_a, couplings_[k].slot_b, touch.place});
    std::copy_n(touch.across.begin() + 6, 3, one.normal.begin());
    (h * push_on_b(k, forces_[k])).to(one.impulse.data());
    (h * moment_on_b(k, forces_[k])).to(one.moment.data());
  }
  return pushing;
}

void BodyContacts::remember() {
  for (std::size_t k = 0; k < poses_.size(); ++k) {
    std::ranges::copy(poses_[k].shift, memory_.begin() + static_cast<std::ptrdiff_t>(kRememberedMiddle + 3 * k));
  }
  const auto loads = std::span(memory_).subspan(remembered_load(poses_.size()), 2 * poses_.size());
  std::ranges::fill(loads, 0.0);
  for (std::size_t k = 0; k < touches_.size(); ++k) {
    if (forces_[k][2] == 0) continue;
    const auto& [a, b] = contact_.pairs[touches_[k].pair];
    for (const std::size_t shape : {a, b}) {
      loads[2 * shape] += 1;
      loads[2 * shape + 1] += forces_[k][2];
    }
  }
  std::size_t at = first_number();
  for (std::size_t k = 0; k < touches_.size() && at < memory_.size(); ++k) {
    if (forces_[k][2] == 0 || steps_[k].stiffness == 0) continue;
    const Vec3<double> force = push_on_b(k, forces_[k]), moment = moment_on_b(k, forces_[k]);
    const std::array numbers{static_cast<double>(touches_[k].pair + 1), half_of(touches_[k].feature, 0), half_of(touches_[k].feature, 1),
                             force.x, force.y, force.z, steps_[k].spring(), steps_[k].depth, moment.x, moment.y, moment.z};
    std::copy_n(numbers.begin(), numbers_of_touch_, memory_.begin() + static_cast<std::ptrdiff_t>(at));
    at += numbers_of_touch_;
  }
  for (; at < memory_.size() && memory_[at] != 0; at += numbers_of_touch_) {
    std::fill_n(memory_.begin() + static_cast<std::ptrdiff_t>(at), numbers_of_touch_, 0.0);
  }
}

}  // namespace linden

#include "kernels/collision/convex_pair.hpp"

#include <bit>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <set>
#include <span>
#include <vector>

#include "tests/kernels/allocation_counter.hpp"
#include "tests/reference/convex_plain.hpp"
#include "tests/reference/random_convex.hpp"

namespace linden::convex_pair_test {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using reference::pose_at;
using reference::random_shape;

constexpr double kEver = std::numeric_limits<double>::infinity();

Vector3d eigen(const Vec3<double>& a) { return {a.x, a.y, a.z}; }
std::span<const PatchPoint> points_of(const ContactPatch& patch) { return {patch.points.data(), static_cast<std::size_t>(patch.count)}; }

Matrix3d turn(double angle, const Vector3d& axis) { return Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix(); }
Pose at(const Vector3d& p) { return pose_at(Matrix3d::Identity(), p); }

struct Pair {
  ConvexShape a, b;
  Pose pose_a, pose_b;
  double size;
};

/// Overlapping by much, by little, or apart.
Pair random_pair(Random& random, int kind_a, int kind_b) {
  Pair pair{random_shape(random, kind_a), random_shape(random, kind_b), {}, {}, 0};
  pair.pose_a = pose_at(random.rotation().toRotationMatrix(), Vector3d(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)));
  const double reach = core_reach(pair.a) + core_reach(pair.b) + pair.a.radius + pair.b.radius;
  const Vector3d shift = random.uniform(0.05, 1.1) * reach * (random.rotation() * Vector3d::UnitX());
  pair.pose_b = pose_at(random.rotation().toRotationMatrix(), isometry(pair.pose_a).translation() + shift);
  pair.size = shift.norm() + reach;
  return pair;
}

ContactPatch patch_of(const Pair& pair, double margin = kEver) { return contact_patch(pair.a, pair.pose_a, pair.b, pair.pose_b, margin); }

const Vector3d kX(1, 0, 0), kY(0, 1, 0), kZ(0, 0, 1);

TEST_CASE("the distance of two shapes is the largest over all directions, their normal is that direction, and they meet at a place of both") {
  Random random(1);
  for (int i = 0; i < reference::kRandomKinds; ++i) {
    for (int j = 0; j < reference::kRandomKinds; ++j) {
      for (int k = 0; k < 6; ++k) {
        const Pair pair = random_pair(random, i, j);
        const ContactPatch patch = patch_of(pair);
        const auto a = reference::plain_convex(pair.a, pair.pose_a), b = reference::plain_convex(pair.b, pair.pose_b);
        const Vector3d n = eigen(patch.normal);
        CAPTURE(i, j, k, patch.distance, pair.size);
        CHECK(std::abs(n.norm() - 1) < 1e-14);
        CHECK(std::abs(patch.distance - reference::distance_along(a, b, n)) < 1e-14 * pair.size);
        const double plain = reference::signed_distance(a, b);
        CHECK(patch.distance > plain - 1e-9 * pair.size);
        CHECK(patch.distance < plain + 1e-3 * pair.size);  // that of a direction is never too large: the twin had better be as good
        REQUIRE(patch.count >= 1);
        const PatchPoint& nearest = patch.nearest();
        CHECK(std::abs(nearest.gap - patch.distance) < 2e-11 * pair.size);
        const Vector3d place = eigen(nearest.place);
        CHECK(reference::outside(a, place - 0.5 * nearest.gap * n) < 1e-8 * pair.size);
        CHECK(reference::outside(b, place + 0.5 * nearest.gap * n) < 1e-8 * pair.size);
        for (const PatchPoint& point : points_of(patch)) CHECK(point.gap > patch.distance - 1e-14 * pair.size);
      }
    }
  }
}

TEST_CASE("spheres, capsules and boxes overlap by what their closed forms say, to rounding") {
  const ConvexShape ball{.kind = ConvexKind::point, .radius = 0.3}, capsule{.kind = ConvexKind::segment, .half = {0, 0, 0.5}, .radius = 0.1};
  const ConvexShape box{.kind = ConvexKind::box, .half = {0.5, 0.4, 0.3}};
  const auto distance = [](const ConvexShape& a, const Pose& pose_a, const ConvexShape& b, const Pose& pose_b) {
    return contact_patch(a, pose_a, b, pose_b, kEver).distance;
  };
  CHECK(std::abs(distance(ball, at({1, 2, 3}), ball, at({1, 2.5, 3})) - -0.1) < 1e-15);
  CHECK(std::abs(distance(ball, at({0, 0, 0}), capsule, at({0.35, 0, 0.4})) - -0.05) < 1e-15);
  CHECK(std::abs(distance(ball, at({0, 0, 0}), capsule, at({0, 0.3, 0.9})) - 0.1) < 1e-15);                   // 3 4 5 to its end
  CHECK(std::abs(distance(ball, at({0.7, 0, 0}), box, at({0, 0, 0})) - -0.1) < 1e-15);                         // over a face
  CHECK(std::abs(distance(ball, at({0.8, 0.8, 0}), box, at({0, 0, 0})) - 0.2) < 1e-15);                        // beyond an edge
  CHECK(std::abs(distance(ball, at({0.4, 0, 0}), box, at({0, 0, 0})) - -0.4) < 1e-15);                         // its centre within
  CHECK(std::abs(distance(capsule, at({0, 0, 0.85}), box, at({0, 0, 0})) - -0.05) < 1e-15);                    // standing on it
  CHECK(std::abs(distance(capsule, pose_at(turn(M_PI / 2, kY), {0, 0, 0.35}), box, at({0, 0, 0})) - -0.05) < 1e-15);
  CHECK(std::abs(distance(capsule, pose_at(turn(M_PI / 2, kY), {0, 0, 0.25}), box, at({0, 0, 0})) - -0.15) < 1e-15);  // its line within
  CHECK(std::abs(distance(box, at({0, 0, 0}), box, at({0.1, 0.2, 0.55})) - -0.05) < 1e-15);
  // a corner on a face: half the diagonal of a cube is its height
  const ConvexShape cube{.kind = ConvexKind::box, .half = {0.1, 0.1, 0.1}};
  const Matrix3d on_corner = Eigen::Quaterniond::FromTwoVectors(Vector3d(-1, -1, -1), -kZ).toRotationMatrix();
  CHECK(std::abs(distance(box, at({0, 0, 0}), cube, pose_at(on_corner, {0.1, 0.1, 0.3 + std::sqrt(0.03) - 0.01})) - -0.01) < 1e-15);
  // edge across edge
  const Pose lower = pose_at(turn(M_PI / 4, kX), {0, 0, 0}), upper = pose_at(turn(M_PI / 4, kY), {0, 0, 2 * std::sqrt(0.02) - 0.01});
  CHECK(std::abs(distance(cube, lower, cube, upper) - -0.01) < 1e-15);
}

TEST_CASE("a box on a box meets it with four points, its corners or where their sides cross, whatever stands for a box") {
  const std::array<double, 3> half{0.5, 0.4, 0.1};
  const ConvexShape forms[] = {{.kind = ConvexKind::box, .half = half}, reference::box_as_hull(half)};
  for (const ConvexShape& a : forms) {
    for (const ConvexShape& b : forms) {
      const ContactPatch patch = contact_patch(a, at({0, 0, 0}), b, at({0.3, 0.2, 0.199}), 0.01);
      REQUIRE(patch.count == 4);
      CHECK((eigen(patch.normal) - kZ).norm() < 1e-14);
      double low_x = 1, high_x = -1, low_y = 1, high_y = -1;
      std::set<std::uint64_t> features;
      for (const PatchPoint& point : points_of(patch)) {
        CHECK(std::abs(point.gap - -0.001) < 1e-15);
        CHECK(std::abs(point.place.z - 0.0995) < 1e-15);
        low_x = std::min(low_x, point.place.x), high_x = std::max(high_x, point.place.x);
        low_y = std::min(low_y, point.place.y), high_y = std::max(high_y, point.place.y);
        features.insert(point.feature);
      }
      CHECK(std::abs(low_x - -0.2) + std::abs(high_x - 0.5) + std::abs(low_y - -0.2) + std::abs(high_y - 0.4) < 1e-14);
      CHECK(features.size() == 4);
    }
  }
  // turned by an eighth: eight corners, of which four hold the most
  const ConvexShape square{.kind = ConvexKind::box, .half = {0.5, 0.5, 0.1}};
  const ContactPatch patch = contact_patch(square, at({0, 0, 0}), square, pose_at(turn(M_PI / 4, kZ), {0, 0, 0.2}), 0.01);
  REQUIRE(patch.count == 4);
  Vector3d sum = Vector3d::Zero();
  for (const PatchPoint& point : points_of(patch)) {
    sum += eigen(point.place);
    CHECK(std::abs(std::hypot(point.place.x, point.place.y) - std::hypot(0.5, std::sqrt(0.5) - 0.5)) < 1e-14);
  }
  CHECK(std::hypot(sum.x(), sum.y()) < 1e-14);  // on all sides of the middle
}

TEST_CASE("edges, corners and round bodies meet at as many points as they touch with") {
  const ConvexShape cube{.kind = ConvexKind::box, .half = {0.1, 0.1, 0.1}}, table{.kind = ConvexKind::box, .half = {1, 1, 0.1}};
  const ConvexShape ball{.kind = ConvexKind::point, .radius = 0.3}, capsule{.kind = ConvexKind::segment, .half = {0, 0, 0.5}, .radius = 0.1};
  const ConvexShape cylinder{.kind = ConvexKind::cylinder, .half = {0.2, 0.2, 0.3}};
  const Matrix3d lying = turn(M_PI / 2, kY);
  const double edge = std::sqrt(0.02);
  const auto count = [&](const ConvexShape& b, const Pose& pose) {
    const ContactPatch patch = contact_patch(table, at({0, 0, -0.1}), b, pose, 0.001);
    CHECK((eigen(patch.normal) - kZ).norm() < 1e-12);
    for (const PatchPoint& point : points_of(patch)) CHECK(std::abs(point.gap) < 1e-12);
    return patch.count;
  };
  CHECK(count(ball, at({0, 0, 0.3})) == 1);
  CHECK(count(cube, at({0, 0, 0.1})) == 4);
  CHECK(count(cube, pose_at(turn(M_PI / 4, kX), {0, 0, edge})) == 2);
  CHECK(count(cube, pose_at(Eigen::Quaterniond::FromTwoVectors(Vector3d(-1, -1, -1), -kZ).toRotationMatrix(), {0, 0, std::sqrt(0.03)})) == 1);
  CHECK(count(capsule, pose_at(lying, {0, 0, 0.1})) == 2);
  CHECK(count(capsule, pose_at(lying, {0.9, 0, 0.1})) == 2);  // over the edge of the table
  CHECK(count(capsule, at({0, 0, 0.6})) == 1);
  CHECK(count(cylinder, pose_at(lying, {0, 0, 0.2})) == 2);
  CHECK(count(cylinder, at({0, 0, 0.3})) == 4);
  CHECK(count(cylinder, pose_at(turn(0.5, kX), {0, 0, 0.2 * std::sin(0.5) + 0.3 * std::cos(0.5)})) == 1);
  CHECK(contact_patch(cube, pose_at(turn(M_PI / 4, kX), {0, 0, 0}), cube, pose_at(turn(M_PI / 4, kY), {0, 0, 2 * edge}), 0.001).count == 1);
  CHECK(contact_patch(cylinder, at({0, 0, 0}), cylinder, at({0.1, 0, 0.6}), 0.001).count == 4);
  CHECK(contact_patch(cylinder, at({0, 0, 0}), cylinder, at({0, 0.4, 0.1}), 0.001).count == 2);
  CHECK(contact_patch(cylinder, at({0, 0, 0}), cylinder, pose_at(lying, {0, 0.4, 0.1}), 0.001).count == 1);
  // and the half space under them
  const auto on_plane = [&](const ConvexShape& b, const Pose& pose) {
    const ContactPatch patch = plane_patch({0, 0, 1}, 0, b, pose, 0.001);
    CHECK(std::abs(patch.distance) < 1e-14);
    for (const PatchPoint& point : points_of(patch)) CHECK(std::abs(point.gap) + std::abs(point.place.z) < 1e-14);
    return patch.count;
  };
  CHECK(on_plane(ball, at({0, 0, 0.3})) == 1);
  CHECK(on_plane(cube, at({0, 0, 0.1})) == 4);
  CHECK(on_plane(reference::box_as_hull({0.1, 0.1, 0.1}), at({0, 0, 0.1})) == 4);
  CHECK(on_plane(cube, pose_at(turn(M_PI / 4, kX), {0, 0, edge})) == 2);
  CHECK(on_plane(capsule, pose_at(lying, {0, 0, 0.1})) == 2);
  CHECK(on_plane(cylinder, pose_at(lying, {0, 0, 0.2})) == 2);
  CHECK(on_plane(cylinder, at({0, 0, 0.3})) == 4);
  CHECK(on_plane({.kind = ConvexKind::ellipsoid, .half = {0.1, 0.2, 0.3}}, at({0, 0, 0.3})) == 1);
}

TEST_CASE("a half space is below every shape by its support along the normal") {
  Random random(2);
  for (int kind = 0; kind < reference::kRandomKinds; ++kind) {
    for (int k = 0; k < 20; ++k) {
      const ConvexShape shape = random_shape(random, kind);
      const Pose pose = pose_at(random.rotation().toRotationMatrix(), Vector3d(random.uniform(-1, 1), 3, 4));
      const Vector3d n = random.rotation() * kX;
      const double offset = random.uniform(3, 5);
      const ContactPatch patch = plane_patch({n.x(), n.y(), n.z()}, offset, shape, pose, kEver);
      const auto plain = reference::plain_convex(shape, pose);
      CHECK(std::abs(patch.distance - (-plain.reach(-n) - offset)) < 1e-14);
      CHECK(std::abs(patch.nearest().gap - patch.distance) < 1e-14);
      CHECK(std::abs(n.dot(eigen(patch.nearest().place)) - offset - 0.5 * patch.distance) < 1e-14);
    }
  }
}

TEST_CASE("a plane is that half space, as either of both, and keeps its digits where it is far from the world's origin") {
  Random random(8);
  const ConvexShape plane{.kind = ConvexKind::plane};
  for (int kind = 0; kind < reference::kRandomKinds; ++kind) {
    for (int k = 0; k < 20; ++k) {
      const ConvexShape shape = random_shape(random, kind);
      const Matrix3d R = random.rotation().toRotationMatrix();
      const Vector3d on(random.uniform(-9, 9), random.uniform(-9, 9), random.uniform(-9, 9));
      const double height = random.uniform(-0.1, 1);
      const Vector3d n = R.col(2), middle = on + 3 * R.col(0) - 5 * R.col(1) + height * n;
      const Pose there = pose_at(R, on), pose = pose_at(random.rotation().toRotationMatrix(), middle);
      const ContactPatch one = contact_patch(plane, there, shape, pose, 0.2), other = contact_patch(shape, pose, plane, there, 0.2);
      const ContactPatch expected = plane_patch({n.x(), n.y(), n.z()}, n.dot(on), shape, pose, 0.2);
      CAPTURE(kind, k, expected.distance);
      CHECK(std::abs(one.distance - expected.distance) < 1e-14);
      CHECK(eigen(one.normal) == n);
      CHECK(other.distance == one.distance);
      CHECK(eigen(other.normal) == -n);
      REQUIRE(one.count == expected.count);
      REQUIRE(other.count == one.count);
      CHECK((one.count > 0) == (one.distance <= 0.2));
      for (const PatchPoint& point : points_of(one)) {
        CHECK(std::abs(n.dot(eigen(point.place) - on) - 0.5 * point.gap) < 2e-14);
        const auto same = [&](const PatchPoint& p) { return p.feature == (point.feature << 32 | point.feature >> 32) && eigen(p.place) == eigen(point.place); };
        CHECK(std::ranges::any_of(points_of(other), same));
      }
    }
  }
  // a kilometre and more away from its own origin and the world's
  const ConvexShape cube{.kind = ConvexKind::box, .half = {0.1, 0.1, 0.1}};
  const ContactPatch far = contact_patch(plane, at({1000, 0, 1000}), cube, at({-3000, 0, 1000.0625}), 0.01);
  CHECK(std::abs(far.distance - (0.0625 - 0.1)) < 1e-15);
  CHECK(far.count == 4);
}

TEST_CASE("beyond the margin there are no points, and the distance is a bound below the true one and above the margin") {
  Random random(3);
  int beyond = 0;
  for (int k = 0; k < 3000; ++k) {
    const Pair pair = random_pair(random, k % 8, k / 8 % 8);
    const ContactPatch whole = patch_of(pair), near = patch_of(pair, 0.02);
    if (whole.distance > 0.02 + 1e-12) {
      beyond += 1;
      CHECK(near.count == 0);
      CHECK(near.distance > 0.02);
      CHECK(near.distance < whole.distance + 1e-12);
    } else if (whole.distance < 0.02 - 1e-12) {
      CHECK(near.distance == whole.distance);
      CHECK(near.count >= 1);
      for (const PatchPoint& point : points_of(near)) CHECK(point.gap <= 0.02 + 1e-12);
    }
  }
  CHECK(beyond > 500);
}

TEST_CASE("as the bodies move the gap changes by the velocity along the normal where they meet") {
  Random random(4);
  int tried = 0, off = 0, at_one_place = 0;
  for (int k = 0; k < 4000; ++k) {
    const Pair pair = random_pair(random, k % 8, k / 8 % 8);
    const ContactPatch now = patch_of(pair);
    const Vector3d n = eigen(now.normal);
    const Vector3d w = random.rotation() * kX, v = random.rotation() * kX;
    const Isometry T = isometry(pair.pose_b);
    const auto moved = [&](double by) {
      Pair other = pair;
      other.pose_b = pose_at(turn(by, w) * T.linear(), T.translation() + by * v);
      return patch_of(other).distance;
    };
    // each place turns about the origin of b; edges that are nearly parallel meet between two that are as near
    double slowest = kEver, fastest = -kEver;
    for (const PatchPoint& point : points_of(now)) {
      if (point.gap > now.distance + 1e-9 * pair.size) continue;
      const double rate = n.dot(v + w.cross(eigen(point.place) + 0.5 * now.distance * n - T.translation()));
      slowest = std::min(slowest, rate), fastest = std::max(fastest, rate);
    }
    constexpr double by = 1e-6;
    const double forward = (moved(by) - now.distance) / by, back = (now.distance - moved(-by)) / by;
    tried += 1;
    // where features change between the three the slopes differ
    if (std::abs(forward - back) > 1e-4) off += 1;
    else CHECK((0.5 * (forward + back) > slowest - 1e-5 && 0.5 * (forward + back) < fastest + 1e-5));
    at_one_place += fastest - slowest < 1e-5;
  }
  CHECK(off < tried / 50);
  CHECK(at_one_place > tried - tried / 50);
}

TEST_CASE("small motions move distance, normal and points little, but where a normal passes from one face to the next") {
  Random random(5);
  int jumps = 0, tried = 0;
  for (int k = 0; k < 4000; ++k) {
    const Pair pair = random_pair(random, k % 8, k / 8 % 8);
    Pair other = pair;
    const Isometry T = isometry(pair.pose_b);
    other.pose_b = pose_at(turn(1e-8, random.rotation() * kX) * T.linear(), T.translation() + 1e-8 * (random.rotation() * kX));
    const ContactPatch one = patch_of(pair), two = patch_of(other);
    CHECK(std::abs(one.distance - two.distance) < 3e-8);
    tried += 1;
    if ((eigen(one.normal) - eigen(two.normal)).norm() > 1e-5 || (eigen(one.nearest().place) - eigen(two.nearest().place)).norm() > 1e-5) jumps += 1;
  }
  CHECK(jumps < tried / 400);
}

TEST_CASE("capsules that turn to parallel meet at two places that part without a jump") {
  const ConvexShape capsule{.kind = ConvexKind::segment, .half = {0, 0, 0.5}, .radius = 0.1};
  double before = 0;
  for (const double angle : {0.3, 0.11, 0.1003, 0.0999, 0.09, 0.05, 0.01, 3e-3, 1e-3, 3e-4, 1e-5, 1e-9, 0.0}) {
    const ContactPatch patch = contact_patch(capsule, at({0, 0, 0}), capsule, pose_at(turn(angle, kX), {0.199, 0, 0}), 0.01);
    CAPTURE(angle);
    CHECK(std::abs(patch.distance - -0.001) < 1e-15);
    CHECK((eigen(patch.normal) - kX).norm() < 1e-12);
    REQUIRE(patch.count == (angle > 0.1 ? 1 : 2));
    double apart = 0;
    if (patch.count == 2) {
      const Vector3d one = eigen(patch.points[0].place), two = eigen(patch.points[1].place);
      apart = (two - one).norm();
      CHECK((0.5 * (one + two) - Vector3d(0.0995, 0, 0)).norm() < 1e-9);
      if (angle == 0.0999) CHECK(apart < 2e-4);
      if (angle == 0) CHECK(std::abs(apart - 1) < 1e-15);
    }
    CHECK(apart >= before);
    before = apart;
    for (const PatchPoint& point : points_of(patch)) CHECK(std::abs(point.gap - -0.001) < 1e-14);
  }
}

TEST_CASE("features stay while a box slides and rocks on another, and a cylinder rolls smoothly") {
  for (const bool hulls : {false, true}) {
    const std::array<double, 3> half{0.2, 0.15, 0.1};
    const ConvexShape table{.kind = ConvexKind::box, .half = {1, 1, 0.1}};
    const ConvexShape box = hulls ? reference::box_as_hull(half) : ConvexShape{.kind = ConvexKind::box, .half = half};
    std::set<std::uint64_t> seen;
    for (int k = 0; k < 500; ++k) {
      const double t = 0.01 * k;
      // tilted either way by far less than it sinks
      const Matrix3d R = turn(0.3 + 0.02 * t, kZ) * turn(1e-5 * std::sin(7 * t), kX) * turn(1e-5 * std::cos(5 * t), kY);
      const ContactPatch patch = contact_patch(table, at({0, 0, -0.1}), box, pose_at(R, {0.1 * t, 0.05 * t, 0.0999}), 0.001);
      REQUIRE(patch.count == 4);
      CHECK((eigen(patch.normal) - kZ).norm() < 3e-5);
      for (const PatchPoint& point : points_of(patch)) seen.insert(point.feature & 0xffffffffu);
    }
    CHECK(seen.size() == 4);
  }
  const ConvexShape table{.kind = ConvexKind::box, .half = {1, 1, 0.1}}, cylinder{.kind = ConvexKind::cylinder, .half = {0.2, 0.2, 0.3}};
  for (int k = 0; k < 500; ++k) {
    const double angle = 0.01 * k;
    const Pose lying = pose_at(turn(M_PI / 2, kY) * turn(angle, kZ), {0.1, 0.2 * angle - 0.5, 0.1999});
    const ContactPatch patch = contact_patch(table, at({0, 0, -0.1}), cylinder, lying, 0.01);
    REQUIRE(patch.count == 2);
    CHECK(std::abs(patch.distance - -1e-4) < 1e-15);
    CHECK((eigen(patch.normal) - kZ).norm() < 1e-14);
    for (const PatchPoint& point : points_of(patch)) {
      CHECK(std::abs(point.gap - -1e-4) < 1e-15);
      CHECK(std::abs(point.place.y - (0.2 * angle - 0.5)) < 1e-14);
    }
  }
}

TEST_CASE("a pair has the same patch to the bit whatever was asked before, and allocates nothing") {
  Random random(6);
  std::vector<Pair> pairs;
  for (int k = 0; k < 640; ++k) pairs.push_back(random_pair(random, k % 8, k / 8 % 8));
  std::vector<ContactPatch> first;
  first.reserve(pairs.size());
  const AllocationCounter allocations;
  for (const Pair& pair : pairs) first.push_back(patch_of(pair));
  CHECK(allocations.count() == 0);
  const auto bits = [](double x) { return std::bit_cast<std::uint64_t>(x); };
  const auto same = [&](const Vec3<double>& a, const Vec3<double>& b) {
    return bits(a.x) == bits(b.x) && bits(a.y) == bits(b.y) && bits(a.z) == bits(b.z);
  };
  for (std::size_t k = pairs.size(); k-- > 0;) {
    const ContactPatch again = patch_of(pairs[k]);
    REQUIRE(again.count == first[k].count);
    CHECK((bits(again.distance) == bits(first[k].distance) && same(again.normal, first[k].normal)));
    for (std::size_t p = 0; p < static_cast<std::size_t>(again.count); ++p) {
      const PatchPoint &one = again.points[p], &other = first[k].points[p];
      CHECK((one.feature == other.feature && bits(one.gap) == bits(other.gap) && same(one.place, other.place)));
      if (p > 0) CHECK(one.feature > again.points[p - 1].feature);
    }
  }
}

TEST_CASE("shapes of a micrometre and of a kilometre, flat ones and such without length have a patch, and each its distance") {
  Random random(7);
  const auto pick = [&] {
    const int kind = static_cast<int>(random.below(8));
    ConvexShape shape = random_shape(random, kind);
    const double scale = std::pow(10, random.uniform(-5, 3.5));
    if (shape.kind == ConvexKind::hull) {
      std::vector<Vector3d> points;
      for (const auto& p : shape.hull->points) points.push_back(scale * Vector3d(p[0], p[1], random.below(4) == 0 ? 0 : p[2]));
      if (random.below(4) == 0) {
        for (Vector3d& p : points) p.z() = 0;
      }
      shape.hull = convex_hull(points);
    }
    for (double& half : shape.half) half = random.below(6) == 0 ? 0 : half * scale;
    if (shape.kind == ConvexKind::cylinder) shape.half[1] = shape.half[0];
    shape.radius = random.below(4) == 0 ? 0 : shape.radius * scale;
    return shape;
  };
  double worst = 0;
#ifdef LINDEN_SANITIZED
  const int pairs = 5000;  // some minutes for all
#else
  const int pairs = 100000;
#endif
  for (int k = 0; k < pairs; ++k) {
    const ConvexShape a = pick(), b = pick();
    REQUIRE((a.kind != ConvexKind::hull || a.hull));
    REQUIRE((b.kind != ConvexKind::hull || b.hull));
    const double reach = core_reach(a) + core_reach(b) + a.radius + b.radius;
    const Vector3d shift = (random.below(20) == 0 ? 0.0 : random.uniform(0, 1)) * reach * (random.rotation() * kX);
    const Matrix3d R = random.below(5) == 0 ? Matrix3d::Identity() : random.rotation().toRotationMatrix();
    const Pose pose_a = at({0, 0, 0}), pose_b = pose_at(R, shift);
    const ContactPatch patch = contact_patch(a, pose_a, b, pose_b, kEver);
    const double size = shift.norm() + reach;
    const Vector3d n = eigen(patch.normal);
    bool sound = std::isfinite(patch.distance) && std::abs(n.norm() - 1) < 1e-12 && patch.count >= 1 && patch.count <= 4;
    for (const PatchPoint& point : points_of(patch)) {
      sound = sound && std::isfinite(point.gap) && eigen(point.place).allFinite() && point.gap >= patch.distance - 1e-12 * size;
    }
    CAPTURE(k, static_cast<int>(a.kind), static_cast<int>(b.kind), size, patch.distance);
    REQUIRE(sound);
    const double along = reference::distance_along(reference::plain_convex(a, pose_a), reference::plain_convex(b, pose_b), n);
    worst = std::max(worst, std::abs(patch.distance - along) / size);
  }
  CHECK(worst < 1e-14);
}

}  // namespace
}  // namespace linden::convex_pair_test

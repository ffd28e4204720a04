// Where convex shapes meet a height field: as on a plane where it is one, and in the hills as the nearest place of the surface has it, which is searched
// for triangle by triangle.
#include "kernels/collision/height_contacts.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <set>
#include <vector>

#include "kernels/collision/convex_pair.hpp"
#include "tests/kernels/allocation_counter.hpp"
#include "tests/reference/convex_plain.hpp"
#include "tests/reference/random_convex.hpp"

namespace linden::height_contacts_test {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using reference::pose_at;

Vector3d eigen(const Vec3<double>& a) { return {a.x, a.y, a.z}; }
Vec3<double> vec(const Vector3d& a) { return {a.x(), a.y(), a.z()}; }

HeightField field_of(Index columns, Index rows, double dx, double dy, const std::function<double(double, double)>& height, double x0 = 0, double y0 = 0) {
  HeightField field{columns, rows, dx, dy, x0, y0, {}};
  for (Index j = 0; j < rows; ++j) {
    for (Index i = 0; i < columns; ++i) field.heights.push_back(height(x0 + i * dx, y0 + j * dy));
  }
  return field;
}

HeightContacts contacts(const HeightField& field, const Pose& pose, const ConvexShape& shape, const Pose& pose_of_shape, double margin) {
  HeightContacts found;
  height_contacts(field, pose, shape, pose_of_shape, margin, found);
  std::set<std::uint64_t> features;
  for (std::size_t k = 0; k < found.count; ++k) {
    CHECK(std::abs(eigen(found.at[k].normal).norm() - 1) < 1e-14);
    features.insert(found.at[k].point.feature);
  }
  CHECK(features.size() == found.count);
  CHECK(are_near({.kind = ConvexKind::heights, .heights = std::make_shared<HeightField>(field)}, pose, shape, pose_of_shape, margin) == (found.count > 0));
  return found;
}

double least_gap(const HeightContacts& found) {
  double least = 1e300;
  for (std::size_t k = 0; k < found.count; ++k) least = std::min(least, found.at[k].point.gap);
  return least;
}

/// Nearest place of a triangle, by trying all of its features.
Vector3d nearest_of_triangle(const Vector3d& x, const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const Vector3d n = (b - a).cross(c - a).normalized();
  const Vector3d q = x - n.dot(x - a) * n;
  const auto inside = [&](const Vector3d& p, const Vector3d& r) { return n.cross(r - p).dot(q - p) >= 0; };
  if (inside(a, b) && inside(b, c) && inside(c, a)) return q;
  Vector3d best = a;
  const auto edge = [&](const Vector3d& p, const Vector3d& r) {
    const Vector3d on = p + std::clamp((x - p).dot(r - p) / (r - p).squaredNorm(), 0.0, 1.0) * (r - p);
    if ((x - on).norm() < (x - best).norm()) best = on;
  };
  edge(a, b), edge(b, c), edge(c, a);
  return best;
}

/// All triangles of a map, and of the two cells around it.
void each_triangle(const HeightField& field, const std::function<void(const Vector3d&, const Vector3d&, const Vector3d&)>& action) {
  const auto at = [&](Index i, Index j) {
    const Index column = std::clamp(i, 0, field.columns - 1), row = std::clamp(j, 0, field.rows - 1);
    return Vector3d(field.origin_x + i * field.spacing_x, field.origin_y + j * field.spacing_y, field.heights[static_cast<std::size_t>(row * field.columns + column)]);
  };
  for (Index j = -2; j <= field.rows; ++j) {
    for (Index i = -2; i <= field.columns; ++i) {
      action(at(i, j), at(i + 1, j), at(i, j + 1));
      action(at(i + 1, j + 1), at(i, j + 1), at(i + 1, j));
    }
  }
}

Pose random_pose(Random& random) {
  return pose_at(random.rotation().toRotationMatrix(), Vector3d(random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(-2, 2)));
}

TEST_CASE("on triangles that lie in one plane all shapes meet that plane, wherever they are") {
  Random random(1);
  for (const double slope : {0.0, 0.3}) {
    const HeightField field = field_of(9, 7, 0.125, 0.25, [&](double x, double y) { return 0.5 + slope * x - 0.5 * slope * y; }, -0.5, -0.75);
    const Vector3d n = Vector3d(-slope, 0.5 * slope, 1).normalized(), on(0, 0, 0.5);
    for (int k = 0; k < 400; ++k) {
      const ConvexShape shape = reference::random_shape(random, k % reference::kRandomKinds);
      const Pose pose = random_pose(random);
      const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> R(pose.rotation.data());
      const Vector3d p(pose.shift.data());
      const Vector3d up = R * n, through = p + R * on;
      // over the middle of the map, beyond whose edge a slope ends
      const Vector3d aside = through + 0.2 * R * Vector3d(random.uniform(-1, 1), random.uniform(-1, 1), 0);
      const Matrix3d turn = random.rotation().toRotationMatrix();
      const double low = reference::plain_convex(shape, pose_at(turn, {0, 0, 0})).reach(-up);
      const double reach = reference::plain_convex(shape, pose_at(turn, {0, 0, 0})).reach(up);
      if (slope > 0 && std::max(low, reach) > 0.15) continue;
      const Vector3d middle = aside + (low + random.uniform(-0.01, 0.03) - up.dot(aside - through)) * up;
      const Pose there = pose_at(turn, middle);
      const ContactPatch plane = plane_patch(vec(up), up.dot(through), shape, there, 0.02);
      const HeightContacts found = contacts(field, pose, shape, there, 0.02);
      CAPTURE(k, slope, plane.distance, found.count, plane.count);
      REQUIRE((found.count > 0) == (plane.count > 0));
      if (plane.count == 0) continue;
      CHECK(std::abs(least_gap(found) - plane.distance) < 1e-13);
      for (std::size_t c = 0; c < found.count; ++c) {
        CHECK((eigen(found.at[c].normal) - up).norm() < 1e-14);
        CHECK(std::abs(up.dot(eigen(found.at[c].point.place) - through) - 0.5 * found.at[c].point.gap) < 1e-13);
      }
      // and every point that the plane has
      for (int c = 0; c < plane.count; ++c) {
        double nearest = 1e300;
        for (std::size_t d = 0; d < found.count; ++d)
          nearest = std::min(nearest, (eigen(found.at[d].point.place) - eigen(plane.points[static_cast<std::size_t>(c)].place)).norm());
        CHECK(nearest < 1e-12);
      }
    }
  }
}

TEST_CASE("a ball in the hills is as far away as the nearest place of their triangles, and pushed away from there") {
  Random random(2);
  int faces = 0, others = 0, several = 0;
  for (int k = 0; k < 3000; ++k) {
    const HeightField field = field_of(6, 6, 0.2, 0.3, [&](double, double) { return random.uniform(0, 0.25); }, -0.5, -0.75);
    const ConvexShape ball{.kind = ConvexKind::point, .radius = random.uniform(0.02, 0.3)};
    const Vector3d middle(random.uniform(-0.6, 0.6), random.uniform(-0.8, 0.8), random.uniform(0, 0.6));
    double nearest = 1e300;
    Vector3d on;
    double straight = -1e300;  // height of the surface straight below
    each_triangle(field, [&](const Vector3d& a, const Vector3d& b, const Vector3d& c) {
      const Vector3d q = nearest_of_triangle(middle, a, b, c);
      if ((middle - q).norm() < nearest) nearest = (middle - q).norm(), on = q;
      const Vector3d n = (b - a).cross(c - a);
      const auto left = [&](const Vector3d& p, const Vector3d& r) { return (r - p).x() * (middle - p).y() - (r - p).y() * (middle - p).x() >= 0; };
      if (left(a, b) && left(b, c) && left(c, a)) straight = a.z() - (n.x() * (middle - a).x() + n.y() * (middle - a).y()) / n.z();
    });
    if (middle.z() < straight + 1e-6) continue;  // within the hill
    const HeightContacts found = contacts(field, Pose{}, ball, pose_at(Matrix3d::Identity(), middle), 0.05);
    const double gap = nearest - ball.radius;
    CAPTURE(k, gap, ball.radius, found.count);
    if (std::abs(gap - 0.05) < 1e-9) continue;
    REQUIRE((found.count > 0) == (gap < 0.05));
    if (found.count == 0) continue;
    std::size_t best = 0;
    for (std::size_t c = 1; c < found.count; ++c) {
      if (found.at[c].point.gap < found.at[best].point.gap) best = c;
    }
    bool there = false;
    for (std::size_t c = 0; c < found.count; ++c) {
      const Vector3d n = eigen(found.at[c].normal), foot = eigen(found.at[c].point.place) - 0.5 * found.at[c].point.gap * n;
      there = there || (std::abs(found.at[c].point.gap - gap) < 1e-9 && (foot - on).norm() < 1e-6 && (n - (middle - on) / nearest).norm() < 1e-6);
      CHECK((foot + (found.at[c].point.gap + ball.radius) * n - middle).norm() < 1e-9);
    }
    CHECK(there);
    CHECK(found.at[best].point.gap > gap - 1e-9);
    (found.at[best].normal.z < 1 && found.count == 1 ? faces : others) += 1;
    several += found.count > 1;
  }
  CHECK(faces > 300);
  CHECK(several > 100);
}

TEST_CASE("a ball that is drawn over the hills at a height keeps its gap from place to place") {
  Random random(3);
  const HeightField field = field_of(12, 12, 0.2, 0.2, [&](double, double) { return random.uniform(0, 0.1); }, -1.1, -1.1);
  const ConvexShape ball{.kind = ConvexKind::point, .radius = 0.15};
  double last = 0;
  for (int k = 0; k < 20000; ++k) {
    const double t = 1e-4 * k, x = -1 + t, y = 0.9 * std::sin(3 * t);
    const HeightContacts found = contacts(field, Pose{}, ball, pose_at(Matrix3d::Identity(), {x, y, 0.22}), 0.2);
    REQUIRE(found.count > 0);
    const double gap = least_gap(found);
    if (k > 0) CHECK(std::abs(gap - last) < 3e-4);  // it moves by 2.9e-4 at most
    last = gap;
  }
}

TEST_CASE("a box rests on peaks, on ridges and over an edge by the places that hold it") {
  const ConvexShape box{.kind = ConvexKind::box, .half = {0.5, 0.5, 0.1}};
  const auto lies = [&](const HeightField& field, double top, const Matrix3d& turn = Matrix3d::Identity()) {
    const Pose pose = pose_at(turn, {0, 0, top + 0.1});
    const HeightContacts found = contacts(field, Pose{}, box, pose, 0.001);
    for (std::size_t k = 0; k < found.count; ++k) CHECK(std::abs(found.at[k].point.gap) < 1e-6);
    return found;
  };
  // three peaks of a metre's grid
  const HeightField peaks = field_of(21, 21, 0.1, 0.1, [](double x, double y) {
    const auto near = [&](double a, double b) { return std::abs(x - a) < 0.01 && std::abs(y - b) < 0.01; };
    return near(0.3, 0.3) || near(-0.3, 0.2) || near(0, -0.4) ? 0.05 : 0.0;
  }, -1, -1);
  CHECK(lies(peaks, 0.05).count == 3);
  // along a ridge, square to it and turned: both of its ends under the box
  const HeightField ridge = field_of(21, 21, 0.1, 0.1, [](double x, double) { return 0.3 - std::abs(x); }, -1, -1);
  for (const double angle : {0.0, 0.2}) {
    for (const double tilt : {0.0, 1e-7, -1e-7}) {
      const Matrix3d turn = (Eigen::AngleAxisd(angle, Vector3d::UnitZ()) * Eigen::AngleAxisd(tilt, Vector3d::UnitX())).toRotationMatrix();
      const HeightContacts found = lies(ridge, 0.3, turn);
      double low = 1, high = -1;
      for (std::size_t k = 0; k < found.count; ++k) {
        CHECK(std::abs(found.at[k].point.place.x) < 1e-6);
        CHECK(found.at[k].normal.z > 1 - 1e-9);
        low = std::min(low, found.at[k].point.place.y);
        high = std::max(high, found.at[k].point.place.y);
      }
      CAPTURE(angle, tilt, found.count);
      CHECK(high == Approx(0.5 / std::cos(angle)).margin(1e-6));
      CHECK(low == Approx(-0.5 / std::cos(angle)).margin(1e-6));
    }
  }
  // half of it over the end of a shelf, a corner of which is under it too
  const HeightField shelf = field_of(21, 21, 0.1, 0.1, [](double x, double y) { return x < 0.05 && y < 0.25 ? 0.2 : -0.8; }, -1, -1);
  for (const double tilt : {0.0, 1e-7, -1e-7}) {
    const HeightContacts found = lies(shelf, 0.2, Eigen::AngleAxisd(tilt, Vector3d(1, 1, 0).normalized()).toRotationMatrix());
    CAPTURE(tilt, found.count);
    const auto has = [&](double x, double y) {
      for (std::size_t k = 0; k < found.count; ++k) {
        if (std::hypot(found.at[k].point.place.x - x, found.at[k].point.place.y - y) < 1e-5) return true;
      }
      return false;
    };
    CHECK(has(-0.5, -0.5));  // a corner of it on the shelf
    CHECK(has(0, -0.5));     // where the shelf's edges leave it
    CHECK(has(-0.5, 0.2));
    CHECK(has(0, 0.2));      // the shelf's corner
  }
}

TEST_CASE("a corner of a box that crosses creases keeps its name, and a groove holds it by both sides") {
  const ConvexShape box{.kind = ConvexKind::box, .half = {0.1, 0.1, 0.1}};
  const Matrix3d on_corner = Eigen::Quaterniond::FromTwoVectors(Vector3d(-1, -1, -1), -Vector3d::UnitZ()).toRotationMatrix();
  const HeightField flat = field_of(11, 11, 0.1, 0.1, [](double, double) { return 0.0; }, -0.5, -0.5);
  const double up = 0.1 * std::sqrt(3.0);
  std::set<std::uint64_t> names;
  for (int k = 0; k < 500; ++k) {
    const HeightContacts found = contacts(flat, Pose{}, box, pose_at(on_corner, {-0.4 + 1.7e-3 * k, 0.3 - 1.1e-3 * k, up - 1e-6}), 1e-3);
    REQUIRE(found.count == 1);
    CHECK(std::abs(found.at[0].point.gap + 1e-6) < 1e-14);
    names.insert(found.at[0].point.feature);
  }
  CHECK(names.size() == 1);
  const HeightField groove = field_of(11, 11, 0.1, 0.1, [](double x, double) { return 0.5 * std::abs(x); }, -0.5, -0.5);
  const double steep = std::sqrt(1.25);
  for (const double x : {-1e-4, -1e-9, 0.0, 1e-9, 1e-4}) {
    for (const double depth : {-1e-6, 0.0, 1e-6, 1e-3}) {
      CAPTURE(x, depth);
      const HeightContacts found = contacts(groove, Pose{}, box, pose_at(on_corner, {x, 0.03, up - depth}), 1e-3);
      REQUIRE(found.count == 2);
      CHECK(found.at[0].point.gap + found.at[1].point.gap == Approx(-2 * depth / steep).margin(1e-12));
      CHECK(found.at[0].normal.x * found.at[1].normal.x == Approx(-0.2));
    }
  }
}

TEST_CASE("hulls and round shapes in the hills are not parted from them by any normal of theirs where they overlap, and touch where they are nearest") {
  Random random(5);
  int tried = 0, missed = 0;
#ifdef LINDEN_SANITIZED
  const int shapes = 150;
#else
  const int shapes = 1500;
#endif
  for (int k = 0; k < shapes; ++k) {
    const HeightField field = field_of(8, 8, 0.15, 0.15, [&](double, double) { return random.uniform(0, 0.12); }, -0.525, -0.525);
    const ConvexShape shape = reference::random_shape(random, k % reference::kRandomKinds);
    const Matrix3d turn = random.rotation().toRotationMatrix();
    const auto distance_at = [&](double z) {
      const Pose pose = pose_at(turn, {0.01, 0.02, z});
      double least = 1e300;
      each_triangle(field, [&](const Vector3d& a, const Vector3d& b, const Vector3d& c) {
        const ConvexShape triangle{.kind = ConvexKind::hull, .hull = convex_hull({a, b, c})};
        const ContactPatch patch = contact_patch(triangle, Pose{}, shape, pose, least);
        least = std::min(least, patch.distance);
      });
      return least;
    };
    // let down until it is a hair above the hills
    double high = 3, low = 0;
    for (int step = 0; step < 12; ++step) {
      const double z = 0.5 * (low + high);
      (distance_at(z) > 1e-3 ? high : low) = z;
    }
    const double gap = distance_at(high);
    if (!(gap > 1e-4) || gap > 0.02) continue;
    tried += 1;
    const HeightContacts found = contacts(field, Pose{}, shape, pose_at(turn, {0.01, 0.02, high}), 0.03);
    CAPTURE(k, k % reference::kRandomKinds, gap, found.count);
    CHECK(found.count > 0);
    if (found.count == 0) continue;
    CAPTURE(least_gap(found));
    // along a normal that is up to kFacing aside it is less by so much
    CHECK(least_gap(found) > std::sqrt(1 - kFacing * kFacing) * gap - 1e-9);
    CHECK(least_gap(found) < gap + 1e-7);
    missed += least_gap(found) > gap + 1e-7;
  }
  CHECK(3 * tried > 2 * shapes);
  CHECK(missed == 0);
}

TEST_CASE("a ball is on faces where it touches them, and not on edges and peaks") {
  const ConvexShape ball{.kind = ConvexKind::point, .radius = 0.1};
  const auto on = [&](double slope, double low, double high, const Vector3d& middle) {
    const HeightField field = field_of(21, 21, 0.1, 0.1, [&](double x, double y) { return std::clamp(slope * std::max(std::abs(x), std::abs(y)), low, high); }, -1, -1);
    return contacts(field, Pose{}, ball, pose_at(Matrix3d::Identity(), middle), 1e-6);
  };
  const double steep = std::sqrt(1.25);
  const HeightContacts level = on(0, 0, 0, {0.03, 0.02, 0.1}), on_vertex = on(0, 0, 0, {0, 0, 0.1});
  REQUIRE(level.count == 1);
  CHECK(level.at[0].on_face);
  REQUIRE(on_vertex.count == 1);
  CHECK(on_vertex.at[0].on_face);
  // a pyramid: its side, an edge of it, its top
  const HeightContacts side = on(-0.5, -1, 0, {0.52 + 0.05 / steep, 0.01, -0.26 + 0.1 / steep}), top = on(-0.5, -1, 0, {0, 0, 0.1});
  REQUIRE(side.count == 1);
  CHECK(side.at[0].on_face);
  REQUIRE(top.count == 1);
  CHECK_FALSE(top.at[0].on_face);
  // a flat top, and the edge around it
  const HeightContacts rim = on(-0.5, -1, -0.25, {0.5, 0.01, -0.15});
  REQUIRE(rim.count == 1);
  CHECK(rim.at[0].on_face);
  const HeightContacts over_rim = on(-0.5, -1, -0.25, {0.5 + 0.1 * std::sin(0.2), 0.01, -0.25 + 0.1 * std::cos(0.2)});
  REQUIRE(over_rim.count == 1);
  CHECK_FALSE(over_rim.at[0].on_face);
}

TEST_CASE("heights are met without allocation, and nothing of what is far off") {
  const HeightField field = field_of(9, 9, 0.1, 0.1, [](double x, double y) { return 0.05 * std::sin(20 * x) * std::cos(30 * y); }, -0.4, -0.4);
  const ConvexShape box{.kind = ConvexKind::box, .half = {0.3, 0.3, 0.1}};
  HeightContacts found;
  const AllocationCounter allocations;
  height_contacts(field, Pose{}, box, pose_at(Matrix3d::Identity(), {0, 0, 0.13}), 0.05, found);
  CHECK(allocations.count() == 0);
  CHECK(found.count > 2);
  CHECK(found.count <= kMostHeightContacts);
  height_contacts(field, Pose{}, box, pose_at(Matrix3d::Identity(), {1e9, 0, 0.1}), 0.05, found);
  CHECK(found.count == 0);
  height_contacts(field, Pose{}, box, pose_at(Matrix3d::Identity(), {0, 0, 5}), 0.05, found);
  CHECK(found.count == 0);
}

}  // namespace
}  // namespace linden::height_contacts_test

#include "kernels/effects/ground.hpp"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "tests/kernels/lanes.hpp"

namespace linden::ground_test {
namespace {

using Eigen::Vector3d;
using Vector6 = Eigen::Matrix<double, 6, 1>;
constexpr double kStep = 1e-3;

class Numbers {
 public:
  explicit Numbers(std::uint64_t seed) : engine_(seed) {}
  double within(double bound) { return std::uniform_real_distribution<double>(-bound, bound)(engine_); }
  Vector3d vector(double bound) { return {within(bound), within(bound), within(bound)}; }
  Vector3d direction() {
    Vector3d v = vector(1);
    while (v.norm() > 1 || v.norm() < 0.1) v = vector(1);
    return v.normalized();
  }
  Displacement<double> displacement(double turn, double shift) {
    const Vector3d w = turn * direction(), v = shift * direction();
    return exp(Twist<double>{{w.x(), w.y(), w.z()}, {v.x(), v.y(), v.z()}});
  }

 private:
  std::mt19937_64 engine_;
};

Vec3<double> vec(const Vector3d& v) { return {v.x(), v.y(), v.z()}; }
Vector3d eigen(const Vec3<double>& v) { return {v.x, v.y, v.z}; }
Vector6 eigen(const Wrench<double>& w) {
  Vector6 v;
  v << w.n.x, w.n.y, w.n.z, w.f.x, w.f.y, w.f.z;
  return v;
}
Twist<double> twist(const Vector6& v) { return {{v[0], v[1], v[2]}, {v[3], v[4], v[5]}}; }

/// A shape with centre and axis, a feature, and their gap as a plain formula.
struct Pair {
  Vector3d center, axis, point, line;  // line: normal of a plane
  double radius;
  std::function<double(const Vector3d& c, const Vector3d& a)> gap;
  std::function<GapChange<double>(const Displacement<double>&, Mat3<double>& bend_force, Mat3<double>& bend_moment)> change;
};

Vec3<double> moved_by(const Displacement<double>& D, const Vector3d& c) { return point_displacement(D, vec(c)); }

std::vector<Pair> random_pairs(Numbers& random) {
  std::vector<Pair> pairs(8);
  for (Pair& pair : pairs) {
    pair.center = random.vector(0.5);
    pair.axis = random.direction();
    pair.line = random.direction();
    pair.point = pair.center + random.vector(0.5);
    pair.radius = 0.2 + random.within(0.1);
  }
  const auto plane = [](const Pair& p, const Vector3d& c) { return p.line.dot(c - p.point); };
  const Mat3<double> none = diagonal(0.0);
  Pair& sphere = pairs[0];
  sphere.gap = [=](const Vector3d& c, const Vector3d&) { return plane(sphere, c) - sphere.radius; };
  sphere.change = [=](const Displacement<double>& D, Mat3<double>& force, Mat3<double>& moment) {
    force = moment = none;
    return sphere_over_plane(vec(sphere.line), moved_by(D, sphere.center));
  };
  Pair& edge = pairs[1];
  edge.gap = [=](const Vector3d& c, const Vector3d&) { return edge.line.cross(c - edge.point).norm() - edge.radius; };
  edge.change = [=](const Displacement<double>& D, Mat3<double>& force, Mat3<double>& moment) {
    moment = none;
    return sphere_over_line(vec(edge.line), vec(edge.center - edge.point), moved_by(D, edge.center), force);
  };
  Pair& corner = pairs[2];
  corner.gap = [=](const Vector3d& c, const Vector3d&) { return (c - corner.point).norm() - corner.radius; };
  corner.change = [=](const Displacement<double>& D, Mat3<double>& force, Mat3<double>& moment) {
    moment = none;
    return sphere_over_line({0, 0, 0}, vec(corner.center - corner.point), moved_by(D, corner.center), force);
  };
  Pair& circle = pairs[3];
  const double side = random.within(1) < 0 ? -1 : 1;
  circle.gap = [=](const Vector3d& c, const Vector3d& a) { return plane(circle, c) + side * circle.radius * circle.line.cross(a).norm(); };
  circle.change = [=](const Displacement<double>& D, Mat3<double>& force, Mat3<double>& moment) {
    force = none;
    return circle_over_plane(vec(circle.line), vec(circle.axis), circle.radius, side, D.r, moved_by(D, circle.center), moment);
  };
  Pair& pierced = pairs[4];
  if (std::abs(pierced.line.dot(pierced.axis)) < kPierces) pierced.axis = pierced.line;
  const auto distance = [=](const Vector3d& c, const Vector3d& a) {
    const double t = (c - pierced.point).dot(a) / pierced.line.dot(a);
    return (pierced.point + t * pierced.line - c).norm();
  };
  const CircleAndLine<double> at(vec(pierced.line), vec(pierced.center - pierced.point), vec(pierced.axis));
  const double scale = 1 / std::sqrt(dot(at.gradient.f, at.gradient.f));
  pierced.gap = [=](const Vector3d& c, const Vector3d& a) { return scale * (distance(c, a) - pierced.radius); };
  pierced.change = [=](const Displacement<double>& D, Mat3<double>& force, Mat3<double>& moment) {
    force = moment = none;
    return circle_over_line(vec(pierced.line), vec(pierced.center - pierced.point), vec(pierced.axis), D.r, moved_by(D, pierced.center));
  };
  // lines and faces of a block; `axis` is theirs
  const auto across = [](const Vector3d& line, const Vector3d& a) { return a.cross(line); };
  Pair& crossing = pairs[5];
  if (std::abs(crossing.line.dot(crossing.axis)) > 0.9) crossing.axis = crossing.line.unitOrthogonal();
  const Vector3d toward = across(crossing.line, crossing.axis) * (random.within(1) < 0 ? -1 : 1);
  crossing.gap = [=](const Vector3d& c, const Vector3d& a) {
    const Vector3d w = across(crossing.line, a);
    return (w.dot(toward) < 0 ? -1 : 1) * w.normalized().dot(c - crossing.point) - crossing.radius;
  };
  Pair& on_line = pairs[6];
  on_line.gap = [=](const Vector3d& c, const Vector3d& a) { return a.cross(c - on_line.point).norm() - on_line.radius; };
  Pair& on_face = pairs[7];
  on_face.gap = [=](const Vector3d& c, const Vector3d& a) { return a.dot(c - on_face.point); };
  const auto touching = [](const Pair& p, BlockContact contact, const Vector3d& sideways) {
    return [=](const Displacement<double>& D, Mat3<double>& force, Mat3<double>& moment) {
      force = moment = diagonal(0.0);
      const Vec3<double> a = vec(p.axis), a1 = a + turned_by(D.r, a), foot = vec(p.center - p.point);
      const auto begin = touch_block(contact, a, vec(p.line), foot, p.radius, vec(sideways));
      const auto end = touch_block(contact, a1, vec(p.line), foot + moved_by(D, p.center), p.radius, vec(sideways));
      return GapChange<double>{end.gap - begin.gap, 0.5 * (begin.gradient() + end.gradient()), end.gradient()};
    };
  };
  crossing.change = touching(crossing, BlockContact::crossing, toward);
  on_line.change = touching(on_line, BlockContact::corner_on_line, toward);
  on_face.change = touching(on_face, BlockContact::corner_on_face, toward);
  return pairs;
}

double gap_after(const Pair& pair, const Displacement<double>& D) {
  return pair.gap(pair.center + eigen(moved_by(D, pair.center)), eigen(rotate(D.r, vec(pair.axis))));
}

/// D, then the twist x of the body about the centre of the shape, in the directions of the frame at k.
Displacement<double> further(const Pair& pair, const Displacement<double>& D, const Vector6& x) {
  const Vec3<double> c = vec(pair.center) + moved_by(D, pair.center), w{x[0], x[1], x[2]}, v{x[3], x[4], x[5]};
  return exp(Twist<double>{w, v - cross(w, c)}) * D;
}

}  // namespace

TEST_CASE("a gap rises by what its formula says, and its end is the gradient there", "[ground]") {
  Numbers random(11);
  for (int round = 0; round < 200; ++round) {
    const double turn = round % 2 == 0 ? 0.3 : 3e-3;
    for (const Pair& pair : random_pairs(random)) {
      const Displacement<double> D = random.displacement(turn, 0.1 * turn);
      Mat3<double> force, moment;
      const GapChange<double> change = pair.change(D, force, moment);
      CHECK(change.rise == Approx(gap_after(pair, D) - pair.gap(pair.center, pair.axis)).margin(1e-13));
      const Vector6 end = eigen(change.end);
      for (int k = 0; k < 6; ++k) {
        constexpr double move = 1e-6;
        const double slope = (gap_after(pair, further(pair, D, move * Vector6::Unit(k))) - gap_after(pair, further(pair, D, -move * Vector6::Unit(k)))) / (2 * move);
        CHECK(end[k] == Approx(slope).margin(1e-7 * (1 + end.norm())));
      }
    }
  }
}

TEST_CASE("the wrench along a gap does the gap's work: exactly where only the centre counts, to the third power of a turn elsewhere", "[ground]") {
  std::array<double, 8> error{}, half_error{};
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    for (const double turn : {0.02, 0.01}) {
      Numbers random(seed);
      const std::vector<Pair> pairs = random_pairs(random);
      for (std::size_t k = 0; k < pairs.size(); ++k) {
        const Displacement<double> D = random.displacement(turn, 0.1 * turn);
        Mat3<double> force, moment;
        const GapChange<double> change = pairs[k].change(D, force, moment);
        const double work = dot(change.mean.f, moved_by(D, pairs[k].center)) + dot(change.mean.n, rotation_vector(D.r));
        (turn == 0.02 ? error : half_error)[k] += std::abs(work - change.rise) / 100;
      }
    }
  }
  for (std::size_t k = 0; k < error.size(); ++k) {
    INFO("pair " << k << ": " << error[k] << ", " << half_error[k]);
    if (k < 3) {
      CHECK(error[k] < 1e-15);
    } else {
      CHECK(half_error[k] < error[k] / 7);
    }
  }
  CHECK(error[3] < 1e-6);
}

TEST_CASE("bends are the derivatives of the wrench along a gap", "[ground]") {
  Numbers random(3);
  for (int round = 0; round < 50; ++round) {
    for (const Pair& pair : random_pairs(random)) {
      const Displacement<double> D = random.displacement(0.1, 0.01);
      Mat3<double> bend_force, bend_moment, ignored;
      pair.change(D, bend_force, bend_moment);
      const bool bends_by_turn = eigen(bend_moment.x).norm() + eigen(bend_moment.y).norm() + eigen(bend_moment.z).norm() > 0;
      const bool bends_by_shift = eigen(bend_force.x).norm() + eigen(bend_force.y).norm() + eigen(bend_force.z).norm() > 0;
      for (int k = 0; k < 3; ++k) {
        constexpr double move = 1e-6;
        const Vector3d unit = Vector3d::Unit(k);
        if (bends_by_turn) {
          const Vector6 x = move * Vector6::Unit(k);
          const Vector6 slope = (eigen(pair.change(further(pair, D, x), ignored, ignored).mean) - eigen(pair.change(further(pair, D, -x), ignored, ignored).mean)) / (2 * move);
          CHECK((slope.head<3>() - eigen(bend_moment * vec(unit))).norm() < 1e-7);
        }
        if (bends_by_shift) {
          const Vector6 x = move * Vector6::Unit(k + 3);
          const Vector6 slope = (eigen(pair.change(further(pair, D, x), ignored, ignored).mean) - eigen(pair.change(further(pair, D, -x), ignored, ignored).mean)) / (2 * move);
          CHECK((slope.tail<3>() - eigen(bend_force * vec(unit))).norm() < 1e-6);
        }
      }
    }
  }
}

TEST_CASE("lowest and highest of a disc that passes through flat are two springs on its material", "[ground]") {
  // both inside: the sum of their couples is linear in the tilt, whichever way the disc passes
  Numbers random(4);
  for (int round = 0; round < 100; ++round) {
    const Vector3d n = random.direction();
    const Vector3d across = n.unitOrthogonal(), other = n.cross(across);
    const Vector3d tilt = 1e-4 * (random.within(1) * across + random.within(1) * other), turn = 2e-4 * (random.within(1) * across + random.within(1) * other);
    const Vector3d axis = Eigen::AngleAxisd(tilt.norm(), tilt.normalized()) * n;
    const Displacement<double> D = exp(Twist<double>{vec(turn), {0, 0, 0}});
    const double radius = 0.1, stiffness = 1e5, depth = 1e-3;
    Vector3d couple = Vector3d::Zero();
    for (const double side : {-1.0, 1.0}) {
      Mat3<double> bend;
      const GapChange<double> change = circle_over_plane(vec(n), vec(axis), radius, side, D.r, {0, 0, 0}, bend);
      const double gap = -depth + side * radius * n.cross(axis).norm();
      couple += stiffness * (-gap - change.rise / 2) * eigen(change.mean.n);
    }
    // tilted by the mean of tilt and tilt + turn
    const Vector3d expected = -2 * stiffness * radius * radius * (tilt + turn / 2);
    CHECK((couple - expected).norm() < 1e-6 * stiffness * radius * radius * 1e-4 + 1e-3 * expected.norm());
  }
}

namespace {

/// A bumpy map of 6 x 5 points whose triangles are steep to 45 degrees.
HeightField bumps(std::uint64_t seed, double size) {
  Numbers random(seed);
  HeightField field{.columns = 6, .rows = 5, .spacing_x = 0.5, .spacing_y = 0.4, .origin_x = -1, .origin_y = -0.7, .heights = {}};
  for (int k = 0; k < 30; ++k) field.heights.push_back(random.within(size));
  return field;
}

double height_at(const HeightField& field, double column, double row) {
  const auto c = static_cast<std::size_t>(std::clamp(column, 0.0, field.columns - 1.0)), r = static_cast<std::size_t>(std::clamp(row, 0.0, field.rows - 1.0));
  return field.heights[r * static_cast<std::size_t>(field.columns) + c];
}

/// Distance of a point to a triangle, by its own region.
double to_triangle(const Vector3d& p, const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  const Vector3d n = (b - a).cross(c - a).normalized();
  const Vector3d q = p - n.dot(p - a) * n;
  const auto left_of = [&](const Vector3d& u, const Vector3d& v) { return n.dot((v - u).cross(q - u)) >= 0; };
  if (left_of(a, b) && left_of(b, c) && left_of(c, a)) return std::abs(n.dot(p - a));
  const auto to_segment = [&](const Vector3d& u, const Vector3d& v) {
    const double t = std::clamp((p - u).dot(v - u) / (v - u).squaredNorm(), 0.0, 1.0);
    return (p - u - t * (v - u)).norm();
  };
  return std::min({to_segment(a, b), to_segment(b, c), to_segment(c, a)});
}

/// Distance of a point above the surface to all of its triangles, the map going on by its last rows.
double to_surface(const HeightField& field, const Vector3d& p) {
  double least = 1e9;
  for (int j = -8; j < 12; ++j) {
    for (int i = -8; i < 12; ++i) {
      const auto at = [&](int c, int r) {
        return Vector3d(field.origin_x + c * field.spacing_x, field.origin_y + r * field.spacing_y, height_at(field, c, r));
      };
      least = std::min(least, to_triangle(p, at(i, j), at(i + 1, j), at(i, j + 1)));
      least = std::min(least, to_triangle(p, at(i + 1, j + 1), at(i, j + 1), at(i + 1, j)));
    }
  }
  return least;
}

double height_below(const HeightField& field, double x, double y) {
  const double u = (x - field.origin_x) / field.spacing_x, v = (y - field.origin_y) / field.spacing_y;
  const double column = std::floor(u), row = std::floor(v), a = u - column, b = v - row;
  const double h10 = height_at(field, column + 1, row), h01 = height_at(field, column, row + 1);
  if (a + b <= 1) {
    const double h00 = height_at(field, column, row);
    return h00 + a * (h10 - h00) + b * (h01 - h00);
  }
  const double h11 = height_at(field, column + 1, row + 1);
  return h11 + (1 - a) * (h01 - h11) + (1 - b) * (h10 - h11);
}

double least_gap(const TerrainFeatures& features) {
  double least = 1e9;
  for (int k = 0; k < features.count(); ++k) least = std::min(least, features[k].gap);
  return least;
}

}  // namespace

TEST_CASE("the nearest feature of a terrain is as near as the nearest point of all its triangles, on the map and beyond", "[ground]") {
  const double radius = 0.15;
  int met = 0;
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const HeightField field = bumps(seed, 0.3);
    Numbers random(100 + seed);
    for (int round = 0; round < 100; ++round) {
      Vector3d p(random.within(2.5), random.within(2), 0);
      p.z() = height_below(field, p.x(), p.y()) + 0.05 + std::abs(random.within(0.2));
      const double distance = to_surface(field, p);
      if (distance > radius || distance < 0.02) continue;
      met += 1;
      const TerrainFeatures features(field, {vec(p), radius, {0, 0, 0}, 0});
      REQUIRE(features.count() > 0);
      INFO("seed " << seed << ", at " << p.transpose());
      CHECK(least_gap(features) == Approx(distance - radius).margin(1e-12));
    }
  }
  CHECK(met > 500);
}

TEST_CASE("on a plane of many triangles one feature holds a shape, with the plane's normal", "[ground]") {
  // 35 degrees along x and 20 along y
  HeightField field{.columns = 9, .rows = 9, .spacing_x = 0.1, .spacing_y = 0.13, .origin_x = -0.4, .origin_y = -0.5, .heights = {}};
  const Vector3d n = Vector3d(-std::tan(0.61), -std::tan(0.35), 1).normalized();
  for (int j = 0; j < 9; ++j) {
    for (int i = 0; i < 9; ++i) field.heights.push_back((i * 0.1 - 0.4) * std::tan(0.61) + (j * 0.13 - 0.5) * std::tan(0.35));
  }
  Numbers random(5);
  for (int round = 0; round < 300; ++round) {
    const Vector3d axis = random.direction();
    for (int kind = 0; kind < 3; ++kind) {
      const double radius = kind == 1 ? 0.12 : 0, rim = kind == 2 ? 0.12 : 0;
      const double gap = 0.01 * random.within(1), reach = radius + rim * n.cross(axis).norm();
      const Vector3d on_plane = Vector3d(random.within(0.2), random.within(0.2), 0);
      Vector3d p = on_plane + Vector3d(0, 0, on_plane.x() * std::tan(0.61) + on_plane.y() * std::tan(0.35)) + (reach + gap) * n;
      const TerrainFeatures features(field, {vec(p), radius, vec(axis), rim});
      INFO("kind " << kind << ", gap " << gap);
      int near = 0;
      for (int k = 0; k < features.count(); ++k) {
        if (features[k].gap > 0.02) continue;  // a crease at the edge of the map
        near += 1;
        CHECK(features[k].gap == Approx(gap).margin(1e-12));
        CHECK((eigen(features[k].normal) - n).norm() < 1e-9);
        CHECK(features[k].weight == 1);
      }
      CHECK(near == 1);
    }
  }
}

TEST_CASE("a ball's potential on a terrain passes over creases and corners without a jump", "[ground]") {
  const double radius = 0.15, depth = 1e-3, move = 1e-4;
  double most = 0;
  for (std::uint64_t seed = 0; seed < 8; ++seed) {
    const HeightField field = bumps(seed, 0.2);
    Numbers random(200 + seed);
    for (int path = 0; path < 6; ++path) {
      const Vector3d from(random.within(2), random.within(1.5), 0), along = Vector3d(random.within(1), random.within(1), 0).normalized();
      const auto features_at = [&](const Vector3d& p) { return TerrainFeatures(field, {vec(p), radius, {0, 0, 0}, 0}); };
      double last = -1;
      for (int step = 0; step < 4000; ++step) {
        // pressed in by `depth` where it stands
        Vector3d p = from + step * move * along;
        double low = height_below(field, p.x(), p.y()), high = low + 1;
        for (int k = 0; k < 40; ++k) {
          p.z() = (low + high) / 2;
          (least_gap(features_at(p)) > -depth ? high : low) = p.z();
        }
        const TerrainFeatures features = features_at(p);
        double potential = 0;
        for (int k = 0; k < features.count(); ++k) {
          const double inside = std::max(-features[k].gap, 0.0);
          potential += features[k].weight * inside * inside;
        }
        if (last >= 0) most = std::max(most, std::abs(std::sqrt(potential) - last));
        last = std::sqrt(potential);
      }
    }
  }
  // what else it touches comes and goes as it moves, by moves of 0.1 mm
  CHECK(most < 2 * move);
  CHECK(most > 0.1 * move);
}

namespace {

struct Scenery {
  GroundPlan plan;
  Placement<double> pose;
  Displacement<double> D;
};

/// A body over the ground with points of all kinds that press on it.
Scenery random_scenery(Numbers& random, bool terrain, bool rim, bool ball) {
  Scenery it;
  it.plan.ground.stiffness = 2e4;
  it.plan.ground.damping = 30;
  it.plan.ground.friction = 0.6;
  it.plan.frame = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  it.plan.least_load = 1;
  if (terrain) {
    it.plan.ground.terrain = bumps(7, 0.15);
    it.plan.highest = 0.15;
  }
  const Vector3d c = random.vector(0.1), axis = random.direction();
  const int ranks = terrain ? kTerrainRanks : 1;
  for (int rank = 0; rank < ranks; ++rank) {
    for (int quarter = 0; quarter < (rim && rank == 0 ? 4 : 1); ++quarter) {
      it.plan.points.push_back({1, {c.x(), c.y(), c.z()}, rim || !ball ? 0 : 0.2, {axis.x(), axis.y(), axis.z()}, rim ? 0.2 : 0, quarter, rank});
      it.plan.share.push_back(0.5 + std::abs(random.within(0.4)));
    }
  }
  const Vector3d turn = random.direction();
  it.pose.R = rotation(exp(Twist<double>{vec(turn), {0, 0, 0}}).r);
  it.pose.p = {random.within(0.6), random.within(0.5), 0};
  it.D = random.displacement(0.05, 0.002);
  // down to where it presses
  GroundPoints<double> points;
  points.allocate({.slots = static_cast<Index>(it.plan.points.size())});
  Field<double, 12> pose;
  pose.allocate(2);
  it.pose.p.z = 1;
  for (int k = 0; k < 60; ++k) {
    store(pose, 1, it.pose);
    find_ground(it.plan, pose, points);
    double least = 1e9;
    for (Index p = 0; p < points.gap.rows(); ++p) least = std::min(least, points.gap(p));
    it.pose.p.z -= std::min(0.5, 0.7 * (least + 4e-3));
  }
  return it;
}

struct Pressed {
  BodyImpulses<double> sum;
  Field<double, 6> impulse;
  Field<double, 7> displacement;
  GroundPoints<double> points;
  double potential = 0;

  explicit Pressed(const Scenery& scenery) {
    sum.allocate({.slots = 2, .positions = 7, .velocities = 6, .blocks = 36});
    impulse.allocate(2);
    displacement.allocate(2);
    points.allocate({.slots = static_cast<Index>(scenery.plan.points.size())});
    store(sum.pose, 1, scenery.pose);
    potential = find_ground(scenery.plan, sum.pose, points);
  }
  Vector6 act(const Scenery& scenery, double stiction_speed, const Vector6& eta) {
    clear_body(sum, 1);
    for (int k = 0; k < 6; ++k) impulse(1, k) = 0;
    store(displacement, 1, scenery.D * exp(twist(eta)));
    ground_map(scenery.plan, 0, scenery.plan.points.size(), {scenery.plan.ground.friction, scenery.plan.least_load}, kStep, stiction_speed, displacement, points, sum, impulse);
    return Eigen::Map<const Vector6>(impulse.row(1));
  }
};

}  // namespace

TEST_CASE("the factor's share of the ground is near the derivative of its force, of all shapes and features", "[ground]") {
  Numbers random(21);
  int pressed = 0;
  for (int round = 0; round < 120; ++round) {
    const bool terrain = round % 2 == 1, rim = round % 3 == 0, ball = round % 3 == 1;
    const Scenery scenery = random_scenery(random, terrain, rim, ball);
    for (const double slides : {0.0, 1.0}) {
      for (const double stiction_speed : {0.0, 1e-3, 10.0}) {
        Pressed body(scenery);
        for (Index k = 0; k < body.points.slides.rows(); ++k) body.points.slides(k) = slides;
        body.act(scenery, stiction_speed, Vector6::Zero());
        double closed = 0;
        for (Index k = 0; k < body.points.closed.rows(); ++k) closed += body.points.closed(k);
        if (closed == 0) continue;
        pressed += 1;
        const auto pull = Mat6<double>::from(body.sum.body_stiffness.row(1));
        Eigen::Matrix<double, 6, 6> exact, taken;
        constexpr double move = 1e-7;
        for (int k = 0; k < 6; ++k) {
          const Vector6 eta = move * Vector6::Unit(k);
          exact.col(k) = (body.act(scenery, stiction_speed, eta) - body.act(scenery, stiction_speed, -eta)) / (2 * move);
          taken.col(k) = eigen(pull * twist(Vector6::Unit(k)));
        }
        INFO("terrain " << terrain << ", rim " << rim << ", ball " << ball << ", slides " << slides << ", stiction_speed " << stiction_speed << "\n" << exact << "\n\n" << taken);
        // a turn of 0.05 rad, and a circle on an edge whose wrench is taken not to bend
        const double tolerance = rim || terrain ? 0.06 : ball ? 1e-3 : 1e-6;
        CHECK((exact - taken).norm() < tolerance * exact.norm());
      }
    }
  }
  CHECK(pressed > 300);
}

TEST_CASE("every lane gets what its own pose calls for, with the same bits in any place, and nothing allocates", "[ground]") {
  Numbers random(31);
  for (int round = 0; round < 24; ++round) {
    const bool terrain = round % 2 == 1, rim = round % 3 == 0, ball = round % 3 == 1;
    const Scenery first = random_scenery(random, terrain, rim, ball);
    const auto run = [&](std::size_t turned) {
      BodyImpulses<Pack> sum;
      Field<Pack, 6> impulse;
      Field<Pack, 7> displacement;
      GroundPoints<Pack> points;
      sum.allocate({.slots = 2, .positions = 7, .velocities = 6, .blocks = 36});
      impulse.allocate(2);
      displacement.allocate(2);
      points.allocate({.slots = static_cast<Index>(first.plan.points.size())});
      for (std::size_t l = 0; l < Pack::size; ++l) {
        const double at = static_cast<double>((l + turned) % Pack::size);
        Placement<double> pose = first.pose;
        pose.p.x += 0.07 * at;
        pose.p.z += 1e-3 * at;
        double numbers[12];
        pose.to(numbers);
        for (int k = 0; k < 12; ++k) set_lane(sum.pose(1, k), l, numbers[k]);
        first.D.to(numbers);
        for (int k = 0; k < 7; ++k) set_lane(displacement(1, k), l, numbers[k]);
      }
      const AllocationCounter allocated;
      find_ground(first.plan, sum.pose, points);
      guess_ground(first.plan, Pack(kStep), false, displacement, points);
      clear_body(sum, 1);
      ground_map(first.plan, 0, first.plan.points.size(), {Pack(first.plan.ground.friction), Pack(first.plan.least_load)}, Pack(kStep), 0.0, displacement, points, sum, impulse);
      update_ground(points, Pack(1.0) > Pack(0.0), Pack(0.0));
      CHECK(allocated.count() == 0);
      std::vector<std::array<double, Pack::size>> all;
      const auto keep = [&](const auto& field) {
        for (const Pack& number : field.flat()) {
          std::array<double, Pack::size> each;
          for (std::size_t l = 0; l < Pack::size; ++l) each[(l + turned) % Pack::size] = lane(number, l);
          all.push_back(each);
        }
      };
      keep(impulse);
      keep(sum.body_stiffness);
      keep(sum.applied);
      GroundPoints<Pack>::each(points, [&](const char*, const auto& field, Rows, const char*) { keep(field); });
      return all;
    };
    const auto straight = run(0), turned = run(1);
    bool same = true;
    for (std::size_t k = 0; k < straight.size(); ++k) {
      for (std::size_t l = 0; l < Pack::size; ++l) same = same && same_bits(straight[k][l], turned[k][l]);
    }
    CHECK(same);
  }
}

}  // namespace linden::ground_test

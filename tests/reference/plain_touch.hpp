// tests/reference/plain_touch.hpp
// Where bodies touch each other, by brute force: for the plain simulator, and as slow as it may be.
//
//   direction  n of a pair: that along which it is the farthest apart, or the least within each other (convex_plain.hpp), by trying many
//   corners    of either shape, those not farther from the plane across n than `near`; a rim is 16 of them, beginning with the foremost; of an
//              ellipsoid the foremost point alone
//   places     corners of one within those of the other, and where edges of both cross, seen along n
//   gap        there, from the highest of all triangles of one's corners to that of the other's, less both radii
//
// Shares nothing with kernels/collision but the shapes: no face, edge or feature of a shape is known.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "layout/effects/contact.hpp"
#include "tests/reference/convex_plain.hpp"
#include "tests/reference/plain_motion.hpp"

namespace linden::reference {

struct PlainTouch {
  Index slot_a, slot_b;
  Vector3d place, normal;  // world; midway between both, from a to b
  double gap;
};

/// A shape seen along a direction n: corners as two coordinates across it and how far they are along it.
struct PlainOutline {
  std::vector<Vector3d> corners;

  /// rows: two directions across n, and n.
  PlainOutline(const PlainConvex& shape, const Matrix3d& rows, double near) {
    const Vector3d n = rows.row(2).transpose();
    std::vector<Vector3d> all;
    for (const Vector3d& p : shape.points) {
      const Vector3d axis = shape.disc_axis, way = n - n.dot(axis) * axis;
      const Vector3d along_n = shape.ellipsoid.transpose() * n, foremost = along_n.norm() > 0 ? Vector3d(p + shape.ellipsoid * along_n.normalized()) : p;
      if (shape.disc_radius == 0) {
        all.push_back(rows * foremost);
        continue;
      }
      const Vector3d first = way.norm() > 1e-9 ? Vector3d(way.normalized()) : Vector3d(axis.unitOrthogonal()), second = axis.cross(first);
      for (int k = 0; k < 16; ++k) {
        const double turn = k * M_PI / 8;
        all.push_back(rows * (foremost + shape.disc_radius * (std::cos(turn) * first + std::sin(turn) * second)));
      }
    }
    double most = -std::numeric_limits<double>::infinity();
    for (const Vector3d& p : all) most = std::max(most, p.z());
    for (const Vector3d& p : all) {
      const auto beside = [&](const Vector3d& other) { return (p - other).norm() < kSame; };
      if (p.z() >= most - near && std::ranges::none_of(corners, beside)) corners.push_back(p);
    }
    for (std::size_t i = 0; i < corners.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        if (is_edge(corners[i], corners[j])) edges.push_back({i, j});
      }
    }
  }

  /// Whether a place is within the corners; of two or one, on them.
  bool holds(const Eigen::Vector2d& x) const {
    if (corners.size() == 1) return (x - corners[0].head<2>()).norm() < kSame;
    for (const auto& [i, j] : edges) {
      const Eigen::Vector2d from = corners[i].head<2>(), along = corners[j].head<2>() - from;
      const double share = std::clamp((x - from).dot(along) / along.squaredNorm(), 0.0, 1.0);
      if ((x - from - share * along).norm() < kSame) return true;
      const double side = side_of(corners[i], corners[j], x), inner = inside_of(corners[i], corners[j]);
      if (side * inner <= 0) return false;
    }
    return corners.size() > 2;
  }

  /// How far it reaches along n there.
  double height(const Eigen::Vector2d& x) const {
    double highest = -std::numeric_limits<double>::infinity(), foremost = highest;
    const std::size_t count = corners.size();
    for (std::size_t i = 0; i < count; ++i) {
      foremost = std::max(foremost, corners[i].z());
      if ((x - corners[i].head<2>()).norm() < kSame) highest = std::max(highest, corners[i].z());
      for (std::size_t j = 0; j < i; ++j) {
        const Eigen::Vector2d along = (corners[j] - corners[i]).head<2>(), from = x - corners[i].head<2>();
        const double share = along.squaredNorm() > 0 ? from.dot(along) / along.squaredNorm() : 0;
        if (share >= 0 && share <= 1 && (from - share * along).norm() < kSame) {
          highest = std::max(highest, corners[i].z() + share * (corners[j].z() - corners[i].z()));
        }
        for (std::size_t k = 0; k < j; ++k) {
          Eigen::Matrix2d sides;
          sides << (corners[j] - corners[i]).head<2>(), (corners[k] - corners[i]).head<2>();
          if (std::abs(sides.determinant()) < kSame * kSame) continue;
          const Eigen::Vector2d shares = sides.inverse() * from;
          if (shares.minCoeff() < -1e-9 || shares.sum() > 1 + 1e-9) continue;
          highest = std::max(highest, corners[i].z() + shares[0] * (corners[j].z() - corners[i].z()) + shares[1] * (corners[k].z() - corners[i].z()));
        }
      }
    }
    return std::isfinite(highest) ? highest : foremost;
  }

  std::vector<std::pair<std::size_t, std::size_t>> edges;
  static constexpr double kSame = 1e-7;  // places so near each other are one [m]

 private:
  static double side_of(const Vector3d& a, const Vector3d& b, const Eigen::Vector2d& x) {
    const Eigen::Vector2d along = (b - a).head<2>().normalized(), to = x - a.head<2>();
    return along.x() * to.y() - along.y() * to.x();
  }
  /// The side of most of it.
  double inside_of(const Vector3d& a, const Vector3d& b) const {
    double most = 0;
    for (const Vector3d& p : corners) {
      const double side = side_of(a, b, p.head<2>());
      if (std::abs(side) > std::abs(most)) most = side;
    }
    return most;
  }
  /// All others on one side.
  bool is_edge(const Vector3d& a, const Vector3d& b) const {
    if ((a - b).head<2>().norm() < kSame) return false;
    double least = 0, most = 0;
    for (const Vector3d& p : corners) {
      const double side = side_of(a, b, p.head<2>());
      least = std::min(least, side);
      most = std::max(most, side);
    }
    return least > -kSame || most < kSame;
  }
};

class PlainTouching {
 public:
  explicit PlainTouching(const PairContact& contact) : contact_(contact) {
    for (const ConvexBody& shape : contact.shapes) {
      const PlainConvex plain = plain_convex(shape.shape, {});
      double far = 0;
      for (const Vector3d& p : plain.points) far = std::max(far, p.norm());
      reach_.push_back(far + plain.disc_radius + plain.ellipsoid.norm() + plain.ball);
    }
  }

  /// All places that are no farther apart than `near`. directions: of each pair, as they were the last time; empty at first.
  std::vector<PlainTouch> places(const std::vector<BodyMotion>& motions, double near, std::vector<Vector3d>& directions) const {
    directions.resize(contact_.pairs.size(), Vector3d::Zero());
    std::vector<PlainConvex> shapes;
    std::vector<Vector3d> middles;
    for (const ConvexBody& shape : contact_.shapes) {
      const BodyMotion& motion = motions[static_cast<std::size_t>(shape.slot)];
      const Matrix3d in_body = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(shape.pose.rotation.data()), R = motion.R * in_body;
      middles.push_back(motion.world(Vector3d(shape.pose.shift[0], shape.pose.shift[1], shape.pose.shift[2])));
      Pose pose;
      for (int k = 0; k < 9; ++k) pose.rotation[static_cast<std::size_t>(k)] = R(k / 3, k % 3);
      for (int k = 0; k < 3; ++k) pose.shift[static_cast<std::size_t>(k)] = middles.back()[k];
      shapes.push_back(plain_convex(shape.shape, pose));
    }
    std::vector<PlainTouch> result;
    for (std::size_t k = 0; k < contact_.pairs.size(); ++k) {
      const std::size_t a = contact_.pairs[k].first, b = contact_.pairs[k].second;
      if ((middles[b] - middles[a]).norm() > reach_[a] + reach_[b] + near) continue;
      const auto apart = [&](const Vector3d& n) { return distance_along(shapes[a], shapes[b], n); };
      directions[k] = direction(apart, directions[k]);
      if (apart(directions[k]) > near) continue;
      add_places(shapes[a], shapes[b], directions[k], near, contact_.shapes[a].slot, contact_.shapes[b].slot, result);
    }
    return result;
  }

 private:
  /// Where it is the largest.
  template <class Function>
  static Vector3d direction(const Function& apart, const Vector3d& last) {
    const bool known = last.norm() > 0.5;
    std::vector<SearchedDirection> all = directions_around(apart, known ? 200 : 1500);
    SearchedDirection best = climbed(apart, known ? SearchedDirection{apart(last), last} : all[0], 0.02);
    for (std::size_t k = 0; k < 3; ++k) {
      // what begins far below can hardly end above
      if (known && all[k].value <= best.value - 0.02) continue;
      const SearchedDirection other = climbed(apart, all[k], 0.05);
      if (other.value > best.value + 1e-12) best = other;
    }
    return best.n;
  }

  static void add_places(const PlainConvex& a, const PlainConvex& b, const Vector3d& n, double near, Index slot_a, Index slot_b,
                         std::vector<PlainTouch>& result) {
    Matrix3d rows, back;
    const Vector3d across = n.unitOrthogonal();
    rows << across.transpose(), n.cross(across).transpose(), n.transpose();
    back << rows.topRows<2>(), -n.transpose();
    const PlainOutline one(a, rows, near), other(b, back, near);
    std::vector<Eigen::Vector2d> places;
    const auto add = [&](const Eigen::Vector2d& x) {
      if (std::ranges::none_of(places, [&](const Eigen::Vector2d& y) { return (x - y).norm() < 10 * PlainOutline::kSame; })) places.push_back(x);
    };
    for (const Vector3d& p : one.corners) {
      if (other.holds(p.head<2>())) add(p.head<2>());
    }
    for (const Vector3d& p : other.corners) {
      if (one.holds(p.head<2>())) add(p.head<2>());
    }
    for (const auto& [i, j] : one.edges) {
      for (const auto& [k, l] : other.edges) {
        const Eigen::Vector2d p = one.corners[i].head<2>(), u = one.corners[j].head<2>() - p, q = other.corners[k].head<2>(), w = other.corners[l].head<2>() - q;
        const double cross = u.x() * w.y() - u.y() * w.x();
        if (std::abs(cross) < 1e-6 * u.norm() * w.norm()) continue;
        const Eigen::Vector2d to = q - p;
        const double s = (to.x() * w.y() - to.y() * w.x()) / cross, t = (to.x() * u.y() - to.y() * u.x()) / cross;
        if (s >= 0 && s <= 1 && t >= 0 && t <= 1) add(p + s * u);
      }
    }
    const auto foremost = [](const PlainOutline& outline) {
      return *std::ranges::max_element(outline.corners, {}, [](const Vector3d& p) { return p.z(); });
    };
    if (places.empty()) add(0.5 * (foremost(one) + foremost(other)).head<2>());
    for (const Eigen::Vector2d& x : places) {
      const double top = one.height(x) + a.ball, bottom = -other.height(x) - b.ball;
      if (bottom - top > near) continue;
      result.push_back({slot_a, slot_b, rows.transpose() * Vector3d(x.x(), x.y(), 0.5 * (top + bottom)), n, bottom - top});
    }
  }

  PairContact contact_;
  std::vector<double> reach_;
};

}  // namespace linden::reference

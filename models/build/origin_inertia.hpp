// models/build/origin_inertia.hpp
// Mass, first moment and inertia about the frame's origin: sums of these are exact, unlike sums about moving centres.
//
// What rounds is compiled once, in the library: a model has the same bits whatever flags those who include this are compiled with.
//
// source  Featherstone, Rigid Body Dynamics Algorithms, 2.13 (spatial inertia, change of frame)
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <span>

#include "models/build/builder.hpp"

namespace linden {

struct OriginInertia {
  double mass = 0;
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  Eigen::Matrix3d about_origin = Eigen::Matrix3d::Zero();

  OriginInertia() = default;
  /// `frame`: pose in the frame wanted of the frame that `center` and `about_center` are given in.
  OriginInertia(const LinkInertia& link, const Eigen::Isometry3d& frame);

  /// m, m c, and xx xy xz yy yz zz about the origin, as models keep it.
  explicit OriginInertia(std::span<const double, 10> numbers)
      : mass(numbers[0]), moment(numbers[1], numbers[2], numbers[3]) {
    about_origin << numbers[4], numbers[5], numbers[6], numbers[5], numbers[7], numbers[8], numbers[6], numbers[8], numbers[9];
  }
  std::array<double, 10> numbers() const {
    const Eigen::Matrix3d& I = about_origin;
    return {mass, moment[0], moment[1], moment[2], I(0, 0), I(0, 1), I(0, 2), I(1, 1), I(1, 2), I(2, 2)};
  }

  OriginInertia& operator+=(const OriginInertia& other) {
    mass += other.mass;
    moment += other.moment;
    about_origin += other.about_origin;
    return *this;
  }

  /// The same matter seen from a frame in which this one has pose `frame`.
  OriginInertia seen_from(const Eigen::Isometry3d& frame) const;

  static Eigen::Matrix3d parallel_axis(double mass, const Eigen::Vector3d& c) {
    return mass * (c.squaredNorm() * Eigen::Matrix3d::Identity() - c * c.transpose());
  }
};

}  // namespace linden

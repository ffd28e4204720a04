// layout/origin_inertia.hpp
// Mass, first moment and inertia about the frame's origin: sums of these are exact, unlike sums about moving centres.
//
// source  Featherstone, Rigid Body Dynamics Algorithms, 2.13 (spatial inertia, change of frame)
#pragma once

#include <Eigen/Geometry>

#include "layout/builder.hpp"

namespace linden {

struct OriginInertia {
  double mass = 0;
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  Eigen::Matrix3d about_origin = Eigen::Matrix3d::Zero();

  OriginInertia() = default;
  /// `frame`: pose in the frame wanted of the frame that `center` and `about_center` are given in.
  OriginInertia(const LinkInertia& link, const Eigen::Isometry3d& frame) : mass(link.mass) {
    const Eigen::Vector3d center = frame * link.center;
    moment = mass * center;
    about_origin = frame.linear() * link.about_center * frame.linear().transpose() + parallel_axis(mass, center);
    about_origin = (0.5 * (about_origin + about_origin.transpose())).eval();
  }

  OriginInertia& operator+=(const OriginInertia& other) {
    mass += other.mass;
    moment += other.moment;
    about_origin += other.about_origin;
    return *this;
  }

  /// The same matter seen from a frame in which this one has pose `frame`.
  OriginInertia seen_from(const Eigen::Isometry3d& frame) const {
    OriginInertia result;
    const Eigen::Vector3d turned = frame.linear() * moment;
    const Eigen::Vector3d p = frame.translation();
    result.mass = mass;
    result.moment = turned + mass * p;
    result.about_origin = frame.linear() * about_origin * frame.linear().transpose() + parallel_axis(mass, p) +
                          2 * p.dot(turned) * Eigen::Matrix3d::Identity() - p * turned.transpose() - turned * p.transpose();
    return result;
  }

  static Eigen::Matrix3d parallel_axis(double mass, const Eigen::Vector3d& c) {
    return mass * (c.squaredNorm() * Eigen::Matrix3d::Identity() - c * c.transpose());
  }
};

}  // namespace linden

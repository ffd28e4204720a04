#include "models/build/origin_inertia.hpp"

namespace linden {

OriginInertia::OriginInertia(const LinkInertia& link, const Eigen::Isometry3d& frame) : mass(link.mass) {
  const Eigen::Vector3d center = frame * link.center;
  moment = mass * center;
  about_origin = frame.linear() * link.about_center * frame.linear().transpose() + parallel_axis(mass, center);
  about_origin = (0.5 * (about_origin + about_origin.transpose())).eval();
}

OriginInertia OriginInertia::seen_from(const Eigen::Isometry3d& frame) const {
  OriginInertia result;
  const Eigen::Vector3d turned = frame.linear() * moment;
  const Eigen::Vector3d p = frame.translation();
  result.mass = mass;
  result.moment = turned + mass * p;
  result.about_origin = frame.linear() * about_origin * frame.linear().transpose() + parallel_axis(mass, p) +
                        2 * p.dot(turned) * Eigen::Matrix3d::Identity() - p * turned.transpose() - turned * p.transpose();
  return result;
}

}  // namespace linden

#include "engine/view/inertia_box.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "models/build/isometry.hpp"
#include "models/build/origin_inertia.hpp"

namespace linden {

std::optional<InertiaBox> inertia_box(std::span<const double, 10> inertia) {
  const OriginInertia body(inertia);
  if (!(body.mass > 0)) return std::nullopt;
  const Eigen::Vector3d center = body.moment / body.mass;
  const Eigen::Matrix3d about_center = body.about_origin - OriginInertia::parallel_axis(body.mass, center);
  if (!about_center.allFinite()) return std::nullopt;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> principal(about_center);
  const Eigen::Vector3d moments = principal.eigenvalues();
  InertiaBox box;
  for (int k = 0; k < 3; ++k) {
    const double square = 6 * (moments.sum() - 2 * moments[k]) / body.mass;
    box.edges[static_cast<std::size_t>(k)] = std::sqrt(std::max(square, 0.0));
  }
  if (!(*std::ranges::max_element(box.edges) > 0)) return std::nullopt;
  Isometry pose = Isometry::Identity();
  pose.linear() = principal.eigenvectors();
  if (pose.linear().determinant() < 0) pose.linear().col(2) *= -1;
  pose.translation() = center;
  box.pose = pose_of(pose);
  return box;
}

}  // namespace linden

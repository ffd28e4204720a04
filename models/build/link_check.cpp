#include "models/build/link_check.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "layout/support/input_error.hpp"
#include "layout/support/words.hpp"

namespace linden {
namespace {

using Eigen::Matrix3d, Eigen::Vector3d;

/// A principal moment may be negative by this share of the largest, or of mass times size squared: what rounding does to files (real robots
/// reach 2.5e-16).
/// The triangle inequality only warns: of the 304 inertias in nine robots' files 20 break it, by 0.16 to 1.0 of their largest
/// moment (placeholders, swapped axes), and their energy is positive all the same.
constexpr double kNegativeSlack = 1e-6;
constexpr double kTriangleSlack = 1e-9;
/// No body of a robot is smaller [m]; of one whose mass lies in its joint the size is not known.
constexpr double kSmallest = 1e-3;

[[noreturn]] void fail(const std::string& source, const std::string& message) { throw InputError(source + ": " + message); }

void check_numbers(const LinkSpec& link, const std::string& source) {
  const auto& i = link.inertia;
  const bool finite = link.placement.matrix().allFinite() && link.axis.allFinite() && std::isfinite(i.mass) &&
                      i.center.allFinite() && i.about_center.allFinite() && std::isfinite(link.pitch) &&
                      std::isfinite(link.damping) && std::isfinite(link.friction) && std::isfinite(link.multiplier) &&
                      std::isfinite(link.offset);
  const bool limits_are_numbers = !std::isnan(link.limits.lower) && !std::isnan(link.limits.upper) &&
                                  !std::isnan(link.limits.velocity) && !std::isnan(link.limits.effort);
  if (!finite || !limits_are_numbers) {
    fail(source, fmt::format("link {} or its joint {} holds a number that is not finite", quoted(link.name), quoted(link.joint)));
  }
  if (link.limits.lower > link.limits.upper) {
    fail(source, fmt::format("joint {}: its lower limit {} is above its upper limit {}", quoted(link.joint), link.limits.lower,
                     link.limits.upper));
  }
  if (link.damping < 0 || link.friction < 0) {
    fail(source, fmt::format("joint {}: damping {} and friction {} must not be negative", quoted(link.joint), link.damping,
                     link.friction));
  }
}

void check_inertia(const LinkSpec& link, const std::string& source, std::vector<std::string>& warnings) {
  const LinkInertia& inertia = link.inertia;
  if (inertia.mass < 0) {
    fail(source, fmt::format("link {}: mass {} kg is negative; expected zero or more", quoted(link.name), inertia.mass));
  }
  const Matrix3d& about = inertia.about_center;
  if (!about.isApprox(about.transpose(), 1e-9) && !about.isZero(0)) {
    fail(source, fmt::format("link {}: its inertia matrix is not symmetric", quoted(link.name)));
  }
  const Vector3d moments = Eigen::SelfAdjointEigenSolver<Matrix3d>(about, Eigen::EigenvaluesOnly).eigenvalues();
  const double largest = moments.cwiseAbs().maxCoeff();
  if (largest == 0) return;
  const double negative = -moments[0] / largest;
  const double excess = (moments[2] - moments[0] - moments[1]) / largest;
  const std::string principal = fmt::format("principal moments {:.6g} {:.6g} {:.6g} kg m^2", moments[0], moments[1], moments[2]);
  if (negative > kNegativeSlack) {
    warnings.push_back(fmt::format("link {}: its inertia is not positive definite ({}); used as it is, as part of what moves with it",
                                   quoted(link.name), principal));
    return;
  }
  if (inertia.mass == 0) {
    warnings.push_back(fmt::format("link {} has inertia but no mass ({})", quoted(link.name), principal));
  }
  if (excess > kTriangleSlack) {
    warnings.push_back(fmt::format(
        "link {}: no solid body has this inertia ({}): the largest moment exceeds the sum of the others by {:.2g} of itself; "
        "used as it is",
        quoted(link.name), principal, excess));
  }
}

void check_shape(const LinkShape& shape, const char* what, const LinkSpec& link, const std::string& source) {
  if (is_of_world_alone(shape.shape.kind)) {
    fail(source, fmt::format("link {}: a {} is an ellipsoid, a plane or heights, which stand in the world alone; expected another kind; add it by with_world",
                             quoted(link.name), what));
  }
  const bool mirrors = shape.shape.kind == ShapeKind::mesh;
  for (const double size : shape.shape.size) {
    if (!std::isfinite(size) || (size < 0 && !mirrors) || !isometry(shape.pose).matrix().allFinite()) {
      fail(source, fmt::format("link {}: a {} has a negative size, or a size or pose that is not finite", quoted(link.name), what));
    }
  }
}

void check_shapes(const LinkSpec& link, const std::string& source) {
  for (const LinkShape& shape : link.shapes) check_shape(shape, "collision shape", link, source);
  for (const LinkVisual& visual : link.visuals) check_shape(visual.shape, "visual", link, source);
}

}  // namespace

void check(const LinkSpec& link, const std::string& source, std::vector<std::string>& warnings) {
  check_numbers(link, source);
  check_inertia(link, source, warnings);
  check_shapes(link, source);
}

void check_body(const std::string& link, const OriginInertia& inertia, double reach, const std::string& source) {
  Matrix3d about = inertia.about_origin;
  double size = std::max(reach, kSmallest);
  if (inertia.mass > 0) {
    const Vector3d center = inertia.moment / inertia.mass;
    about -= OriginInertia::parallel_axis(inertia.mass, center);
    size = std::max(size, center.norm());
  }
  if (!about.allFinite()) return;  // too large for numbers, which the builder tells
  const Vector3d moments = Eigen::SelfAdjointEigenSolver<Matrix3d>(about, Eigen::EigenvaluesOnly).eigenvalues();
  const double scale = std::max(moments.cwiseAbs().maxCoeff(), inertia.mass * size * size);
  if (!(moments[0] < -kNegativeSlack * scale)) return;
  fail(source, fmt::format("link {}: its inertia, with all that is fixed to it, is not positive definite (principal moments {:.6g} {:.6g} "
                           "{:.6g} kg m^2); check the signs of its products of inertia",
                           quoted(link), moments[0], moments[1], moments[2]));
}

}  // namespace linden

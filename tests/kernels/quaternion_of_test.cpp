#include "kernels/queries/quaternion_of.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "tests/kernels/lanes.hpp"
#include "tests/kernels/values.hpp"

namespace linden::quaternion_of_test {
namespace {

const auto quaternion = [](const auto& numbers) {
  using S = typename std::remove_cvref_t<decltype(numbers)>::value_type;
  return numbers_of<S>(quaternion_of(Mat3<S>::from(numbers.data())));
};

/// Random turns; none, the smallest, and half turns about every axis and between.
std::vector<std::array<double, 9>> turns() {
  std::vector<std::array<double, 9>> samples;
  const auto add = [&](const Eigen::Matrix3d& R) {
    std::array<double, 9> numbers{};
    mat3(R).to(numbers.data());
    samples.push_back(numbers);
  };
  Random random(1);
  for (int k = 0; k < 200; ++k) add(random.rotation().toRotationMatrix());
  const Eigen::Vector3d axes[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 0}, {1, -1, 1}, {0, 1, -2}};
  for (const double angle : {0.0, 1e-8, 1e-3, 3.14, M_PI}) {
    for (const Eigen::Vector3d& axis : axes) add(Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix());
  }
  return samples;
}

TEST_CASE("the quaternion of a rotation turns as it does, has unit length and w of zero or more") {
  double worst = 0;
  for (const auto& sample : turns()) {
    const auto q = quaternion(sample);
    const Quaternion<double> r{{q[0], q[1], q[2]}, q[3]};
    see(worst, (eigen(rotation(r)) - eigen(Mat3<double>::from(sample.data()))).norm(), std::abs(dot(r.v, r.v) + r.w * r.w - 1));
    CHECK(r.w >= 0);
  }
  INFO("worst error: " << worst);
  CHECK(worst < 4e-15);
}

TEST_CASE("the quaternion of a small turn keeps its digits") {
  const Eigen::Vector3d axis = Eigen::Vector3d(1, -2, 3).normalized();
  const Eigen::Matrix3d R = Eigen::Matrix3d::Identity() + 1e-9 * reference::hat<double>(axis);
  std::array<double, 9> numbers{};
  mat3(R).to(numbers.data());
  const auto q = quaternion(numbers);
  CHECK((Eigen::Vector3d(q[0], q[1], q[2]) - 0.5e-9 * axis).norm() < 1e-24);
}

TEST_CASE("quaternion_of gives equal bits in every lane") { check_value_lanes(quaternion, turns(), 1e-15); }

}  // namespace
}  // namespace linden::quaternion_of_test

#include "kernels/values/spatial.hpp"

#include <catch2/catch.hpp>

#include "tests/kernels/lanes.hpp"
#include "tests/kernels/values.hpp"

namespace linden::spatial_test {
namespace {

using reference::adjoint;
using reference::inverse;

constexpr double kTight = 8 * kEpsilon;

/// Equal to a few epsilon of the numbers that enter, all about 1.
template <class Found, class Expected>
void check_equal(const Found& found, const Expected& expected) {
  CAPTURE(found, expected);
  CHECK((found - expected).cwiseAbs().maxCoeff() <= kTight * std::max(1.0, expected.norm()));
}

TEST_CASE("vectors and 3 x 3 matrices calculate as Eigen's do") {
  Random random(1);
  for (int sample = 0; sample < 20; ++sample) {
    const Vec3<double> a = random_vec3(random, 1), b = random_vec3(random, 1);
    const Mat3<double> A{random_vec3(random, 1), random_vec3(random, 1), random_vec3(random, 1)};
    const Mat3<double> B{random_vec3(random, 1), random_vec3(random, 1), random_vec3(random, 1)};
    const double s = random.uniform(-2, 2);
    const Eigen::Vector3d ea = eigen(a), eb = eigen(b);
    const Eigen::Matrix3d eA = eigen(A), eB = eigen(B);
    check_equal(eigen(a + b), ea + eb);
    check_equal(eigen(a - b), ea - eb);
    check_equal(eigen(-a), -ea);
    check_equal(eigen(s * a), s * ea);
    CHECK(dot(a, b) == Approx(ea.dot(eb)).margin(kTight));
    check_equal(eigen(cross(a, b)), ea.cross(eb));
    Vec3<double> sum = a;
    sum += b;
    check_equal(eigen(sum), ea + eb);
    check_equal(eigen(A + B), eA + eB);
    check_equal(eigen(A - B), eA - eB);
    check_equal(eigen(s * A), s * eA);
    check_equal(eigen(A * b), eA * eb);
    check_equal(eigen(A * B), eA * eB);
    Mat3<double> total = A;
    total += B;
    check_equal(eigen(total), eA + eB);
    check_equal(eigen(Mat3<double>::row_times(a, B)), (ea.transpose() * eB).transpose());
    check_equal(eigen(transpose(A)), eA.transpose());
    check_equal(eigen(transpose_times(A, b)), eA.transpose() * eb);
    check_equal(eigen(times_transpose(A, B)), eA * eB.transpose());
    check_equal(eigen(outer(a, b)), ea * eb.transpose());
    check_equal(eigen(hat(a)) * eb, ea.cross(eb));
    check_equal(eigen(hat_times(a, B)), reference::hat<double>(ea) * eB);
    check_equal(eigen(times_hat(B, a)), eB * reference::hat<double>(ea));
    check_equal(eigen(diagonal(s)), s * Eigen::Matrix3d::Identity());
  }
}

TEST_CASE("quaternions turn and multiply as their matrices do") {
  Random random(2);
  for (int sample = 0; sample < 20; ++sample) {
    const Quaternion<double> a = random_quaternion(random), b = random_quaternion(random);
    const Vec3<double> v = random_vec3(random, 1);
    const Eigen::Matrix3d A = reference::rotation_matrix<double>(eigen(a)),
                          B = reference::rotation_matrix<double>(eigen(b));
    check_equal(eigen(rotation(a)), A);
    check_equal(eigen(rotate(a, v)), A * eigen(v));
    check_equal(eigen(rotation(a * b)), A * B);
    CHECK(eigen(a * b).norm() == Approx(1).epsilon(kTight));
  }
  // a quarter turn about z brings x to y
  const double s = std::sqrt(0.5);
  const Vec3<double> turned = rotate(Quaternion<double>{{0, 0, s}, s}, Vec3<double>{1, 0, 0});
  CHECK(turned.x == Approx(0).margin(kTight));
  CHECK(turned.y == Approx(1));
  CHECK(turned.z == 0);
}

TEST_CASE("twists and wrenches add, scale and pair as six-vectors") {
  Random random(3);
  const Twist<double> V = random_twist(random, 1), W = random_twist(random, 1);
  const Wrench<double> F = random_wrench(random, 1), G = random_wrench(random, 1);
  check_equal(eigen(V + W), eigen(V) + eigen(W));
  check_equal(eigen(V - W), eigen(V) - eigen(W));
  check_equal(eigen(3.0 * V), 3 * eigen(V));
  check_equal(eigen(F + G), eigen(F) + eigen(G));
  check_equal(eigen(F - G), eigen(F) - eigen(G));
  check_equal(eigen(3.0 * F), 3 * eigen(F));
  CHECK(dot(F, V) == Approx(eigen(F).dot(eigen(V))).margin(kTight));
}

TEST_CASE("twists and wrenches change frames by the adjoint of the paper's (15)") {
  Random random(4);
  for (int sample = 0; sample < 20; ++sample) {
    const Placement<double> X = random_placement(random);
    const Displacement<double> D = random_displacement(random), E = random_displacement(random);
    const Twist<double> V = random_twist(random, 1);
    const Wrench<double> F = random_wrench(random, 1);
    const reference::Matrix6<double> down = adjoint<double>(inverse<double>(eigen(X)));
    check_equal(eigen(to_child(X, V)), down * eigen(V));
    check_equal(eigen(to_parent(X, F)), down.transpose() * eigen(F));
    check_equal(eigen(to_child(D, V)), adjoint<double>(inverse<double>(eigen(D))) * eigen(V));
    check_equal(eigen(carried(D, F)), adjoint<double>(eigen(D)).transpose() * eigen(F));
    check_equal(eigen(D * E), eigen(D) * eigen(E));
    // power is the same in either frame
    CHECK(dot(to_parent(X, F), V) == Approx(dot(F, to_child(X, V))).margin(kTight));
  }
}

TEST_CASE("a force at a lever arm has the moment everyone knows") {
  const Placement<double> X{diagonal(1.0), {2, 0, 0}};
  const Wrench<double> F = to_parent(X, Wrench<double>{{0, 0, 0}, {0, 3, 0}});
  CHECK((F.n.x == 0 && F.n.y == 0 && F.n.z == 6 && F.f.y == 3));
  const Twist<double> V = to_child(X, Twist<double>{{0, 0, 1}, {0, 0, 0}});
  CHECK((V.w.z == 1 && V.v.x == 0 && V.v.y == 2 && V.v.z == 0));
}

TEST_CASE("an inertia and a 6 x 6 matrix map twists to wrenches") {
  Random random(5);
  for (int sample = 0; sample < 20; ++sample) {
    const Inertia<double> G = random_inertia(random);
    const Mat6<double> A = random_matrix6(random), B = random_matrix6(random);
    const Twist<double> V = random_twist(random, 1);
    check_equal(eigen(G * V), eigen(G) * eigen(V));
    check_equal(eigen(A * V), eigen(A) * eigen(V));
    check_equal(eigen(A + B), eigen(A) + eigen(B));
  }
  // the linear momentum is the mass times the velocity of the centre of mass
  const Inertia<double> point{2, {2, 0, 0}, 0, 0, 0, 2, 0, 2};
  const Wrench<double> m = point * Twist<double>{{0, 0, 3}, {0, 1, 0}};
  CHECK((m.f.x == 0 && m.f.y == 8 && m.f.z == 0 && m.n.z == 8));
}

TEST_CASE("values are read from rows and written to rows component by component") {
  Field<double, 7> field;
  field.allocate(3);
  for (std::size_t k = 0; k < 21; ++k) field.flat()[k] = static_cast<double>(k);
  const auto D = load<Displacement, double>(field, 1);
  CHECK((D.r.v.x == 7 && D.r.v.y == 8 && D.r.v.z == 9 && D.r.w == 10 && D.p.x == 11 && D.p.y == 12 && D.p.z == 13));
  store(field, 2, D);
  CHECK((field(2, 0) == 7 && field(2, 3) == 10 && field(2, 6) == 13 && field(1, 6) == 13 && field(0, 6) == 6));
  Field<double> rows;
  rows.allocate(6);
  store3(rows, 2, Vec3<double>{1, 2, 3});
  CHECK((rows(1) == 0 && rows(2) == 1 && rows(3) == 2 && rows(4) == 3 && rows(5) == 0));
  const auto back = load3<double>(rows, 2);
  CHECK((back.x == 1 && back.y == 2 && back.z == 3));
  const auto spread = load3<Pack>(rows, 2);
  for (std::size_t l = 0; l < Pack::size; ++l) CHECK((lane(spread.x, l) == 1 && lane(spread.z, l) == 3));
}

TEST_CASE("spatial operations give equal bits in every lane and allocate nothing") {
  Random random(6);
  std::vector<std::array<double, 31>> samples;
  for (std::size_t k = 0; k < 2 * Pack::size + 1; ++k) {
    const Placement<double> X = random_placement(random);
    const Displacement<double> D = random_displacement(random);
    const Twist<double> V = random_twist(random, 1);
    const Wrench<double> F = random_wrench(random, 1);
    samples.push_back(
        joined(numbers_of<double>(X), numbers_of<double>(D), numbers_of<double>(V), numbers_of<double>(F)));
  }
  check_value_lanes(
      [](const auto& in) {
        using S = std::decay_t<decltype(in[0])>;
        const auto X = unpacked<Placement<S>>(in, 0);
        const auto D = unpacked<Displacement<S>>(in, 12);
        const auto V = unpacked<Twist<S>>(in, 19);
        const auto F = unpacked<Wrench<S>>(in, 25);
        return joined(numbers_of<S>(to_child(X, V)), numbers_of<S>(to_parent(X, F)), numbers_of<S>(to_child(D, V)),
                      numbers_of<S>(carried(D, F)), numbers_of<S>(D * D), numbers_of<S>(rotation(D.r)));
      },
      samples, kTight);
}

}  // namespace
}  // namespace linden::spatial_test

#include "kernels/values/se3.hpp"

#include <catch2/catch.hpp>
#include <functional>
#include <numbers>

#include "tests/kernels/lanes.hpp"
#include "tests/kernels/values.hpp"

namespace linden::se3_test {
namespace {

using reference::Dual;
using Long3 = reference::Vector3<long double>;
using Long4 = Eigen::Matrix<long double, 4, 1>;
using Long6 = reference::Vector6<long double>;
using Long66 = reference::Matrix6<long double>;

constexpr double kPi = std::numbers::pi;

template <class S>
Vec3<S> rounded(const Vec3<double>& a) {
  return {static_cast<S>(a.x), static_cast<S>(a.y), static_cast<S>(a.z)};
}

/// Twists with angles over the whole range: every decade from 1e-300 (1e-30 in float), evenly up to pi, and as close to
/// pi as `gap`. Shifts about as long as the angle, about 1, or anything between.
template <class S>
std::vector<Twist<S>> sample_twists(int count, double gap) {
  Random random(17);
  const double decades = std::is_same_v<S, float> ? 30 : 300;
  std::vector<Twist<S>> samples;
  for (int k = 0; k < count; ++k) {
    const double angle = k % 4 == 0   ? std::pow(10.0, random.uniform(-decades, 0))
                         : k % 4 == 1 ? kPi - std::max(gap, std::pow(10.0, random.uniform(-9, 0)))
                         : k % 4 == 2 ? std::pow(10.0, random.uniform(-8, 0.49))
                                      : random.uniform(0, kPi - gap);
    const double length = k % 3 == 0 ? 1 : k % 3 == 1 ? angle : std::pow(angle, random.uniform(0, 1));
    samples.push_back({rounded<S>(random_direction(random, angle)), rounded<S>(random_direction(random, length))});
  }
  return samples;
}

template <class S>
Long3 exact(const Vec3<S>& a) {
  return {static_cast<long double>(a.x), static_cast<long double>(a.y), static_cast<long double>(a.z)};
}

template <class S>
Long6 exact(const Twist<S>& u) {
  Long6 result;
  result << exact(u.w), exact(u.v);
  return result;
}

/// Worst errors of a family of results, in epsilons of S.
template <class S>
class Worst {
 public:
  /// |found - truth| in units of `scale`.
  void see(const Vec3<S>& found, const Long3& truth, long double scale) {
    const long double error = (exact(found) - truth).norm();
    if (error == 0) return;
    const auto epsilons =
        static_cast<double>(error / scale / static_cast<long double>(std::numeric_limits<S>::epsilon()));
    worst_ = std::isfinite(epsilons) ? std::max(worst_, epsilons) : std::numeric_limits<double>::infinity();
  }
  void see(const Vec3<S>& found, const Long3& truth) { see(found, truth, truth.norm()); }
  void check(const char* what, double bound) const {
    INFO(what << ": worst error " << worst_ << " epsilon");
    CHECK(worst_ <= bound);
  }

 private:
  double worst_ = 0;
};

/// Truth of exp: quaternion by sine and cosine, shift by the power series of the 4 x 4 matrix.
struct LongDisplacement {
  Long4 r;
  Long3 p;
};

LongDisplacement long_exp(const Long6& u) {
  return {reference::rotation_quaternion<long double>(u.head<3>()),
          reference::exp<long double>(u).topRightCorner<3, 1>()};
}

template <class S>
void check_exp(double gap, double bound) {
  Worst<S> vector, scalar, shift;
  for (const Twist<S>& u : sample_twists<S>(4000, gap)) {
    const LongDisplacement truth = long_exp(exact(u));
    const Displacement<S> found = exp(u);
    vector.see(found.r.v, truth.r.head<3>());
    scalar.see({found.r.w, S(0), S(0)}, {truth.r[3], 0, 0}, 1);
    shift.see(found.p, truth.p);
  }
  vector.check("exp, vector part of the quaternion", bound);
  scalar.check("exp, w of the quaternion", bound);
  shift.check("exp, shift", bound);
}

template <class S>
void check_log(double gap, double bound) {
  Worst<S> angular, linear;
  for (const Twist<S>& u : sample_twists<S>(4000, gap)) {
    // a displacement as it is stored, rounded; its log exactly
    const LongDisplacement near = long_exp(exact(u));
    Displacement<S> D;
    D.r = {{static_cast<S>(near.r[0]), static_cast<S>(near.r[1]), static_cast<S>(near.r[2])},
           static_cast<S>(near.r[3])};
    D.p = {static_cast<S>(near.p[0]), static_cast<S>(near.p[1]), static_cast<S>(near.p[2])};
    Long4 r;
    r << exact(D.r.v), static_cast<long double>(D.r.w);
    const Long3 w = reference::rotation_vector<long double>(r);
    const Long3 v = reference::bernoulli_series<long double, 3>(reference::hat<long double>(w)) * exact(D.p);
    const Twist<S> found = log(D);
    angular.see(found.w, w);
    linear.see(found.v, v);
  }
  angular.check("log, angular", bound);
  linear.check("log, linear", bound);
}

template <class S>
void check_dlog(double gap, double bound) {
  Random random(23);
  Worst<S> angular, linear, moment, force, moment_back, force_back, moment_moved, force_moved;
  for (const Twist<S>& u : sample_twists<S>(4000, gap)) {
    const Long66 D = reference::dlog<long double>(exact(u)), back = reference::dlog<long double>(-exact(u));
    const Twist<S> y{rounded<S>(random_vec3(random, 1)), rounded<S>(random_vec3(random, 1))};
    const Twist<S> found = dlog(u, y);
    const Long6 truth = D * exact(y);
    angular.see(found.w, truth.head<3>());
    // the shift's two contributions may cancel: their own size is the measure
    linear.see(found.v, truth.tail<3>(),
               (D.topLeftCorner<3, 3>() * exact(y.v)).norm() + (D.bottomLeftCorner<3, 3>() * exact(y.w)).norm());

    const Wrench<S> m{y.w, y.v};
    const Wrench<S> mu = dlog_transpose(Logarithm<S>(u), m), nu = dlog_transpose(Logarithm<S>(S(-1) * u), m);
    const auto see = [&](const Wrench<S>& F, const Long66& by, Worst<S>& n, Worst<S>& f) {
      f.see(F.f, by.bottomRightCorner<3, 3>().transpose() * exact(m.f));
      const Long3 turned = by.topLeftCorner<3, 3>().transpose() * exact(m.n);
      const Long3 carried = by.bottomLeftCorner<3, 3>().transpose() * exact(m.f);
      n.see(F.n, turned + carried, turned.norm() + carried.norm());
    };
    see(mu, D, moment, force);
    see(nu, back, moment_back, force_back);
    see(dlog_transpose(Logarithm<S>(exp(u)), m), D, moment_moved, force_moved);
  }
  angular.check("dlog, angular", bound);
  linear.check("dlog, linear", bound);
  moment.check("dlog transposed, moment", bound);
  force.check("dlog transposed, force", bound);
  moment_back.check("dlog of -u transposed, moment", bound);
  force_back.check("dlog of -u transposed, force", bound);
  // with the rounding of exp and log before it
  moment_moved.check("dlog transposed of a displacement, moment", 2 * bound);
  force_moved.check("dlog transposed of a displacement, force", 2 * bound);
}

TEST_CASE("exp has relative errors of a few epsilon from 1e-300 to pi - 1e-9") { check_exp<double>(1e-9, 6); }
TEST_CASE("log has relative errors of a few epsilon from 1e-300 to pi - 1e-9") { check_log<double>(1e-9, 6); }
TEST_CASE("dlog and its transpose have relative errors of a few epsilon from 1e-300 to pi - 1e-9") {
  check_dlog<double>(1e-9, 5);
}

TEST_CASE("exp has relative errors of a few epsilon in float") { check_exp<float>(1e-6, 6); }
TEST_CASE("log has relative errors of a few epsilon in float") { check_log<float>(1e-6, 6); }
TEST_CASE("dlog and its transpose have relative errors of a few epsilon in float") { check_dlog<float>(1e-6, 5); }

TEST_CASE("the truth for exp, log and dlog is consistent in itself") {
  for (const Twist<double>& twist : sample_twists<double>(200, 0.1)) {
    const Long6 u = exact(twist);
    const reference::Matrix4<long double> X = reference::exp<long double>(u);
    CHECK((reference::log<long double>(X) - u).norm() <= 1e-16L * (1 + u.norm()));
    CHECK((X * reference::inverse<long double>(X) - reference::Matrix4<long double>::Identity()).norm() < 1e-17L);
    const auto R = reference::rotation_matrix<long double>(reference::rotation_quaternion<long double>(u.head<3>()));
    CHECK((R - X.topLeftCorner<3, 3>()).norm() < 1e-17L);
    // dexp_V = sum ad_V^j / (j + 1)! is the inverse of dlog_V, and Ad_exp(V) = sum ad_V^j / j!
    Long66 power = Long66::Identity(), dexp = Long66::Zero(), carried = Long66::Zero();
    for (int j = 0; j < 60; ++j) {
      carried += power;
      dexp += power / static_cast<long double>(j + 1);
      power = (power * reference::ad<long double>(u) / static_cast<long double>(j + 1)).eval();
    }
    const Long66 D = reference::dlog<long double>(u);
    CHECK((D * dexp - Long66::Identity()).norm() < 1e-16L * D.norm() * dexp.norm());
    CHECK((reference::adjoint<long double>(X) - carried).norm() < 1e-16L * carried.norm());
  }
}

TEST_CASE("exp and log take closed values") {
  // a quarter turn about z on a circle of radius 2
  const Displacement<double> quarter = exp(Twist<double>{{0, 0, kPi / 2}, {kPi, 0, 0}});
  CHECK(quarter.r.w == Approx(std::sqrt(0.5)).epsilon(1e-15));
  CHECK(quarter.r.v.z == Approx(std::sqrt(0.5)).epsilon(1e-15));
  CHECK(quarter.p.x == Approx(2).epsilon(1e-15));
  CHECK(quarter.p.y == Approx(2).epsilon(1e-15));
  CHECK(quarter.p.z == 0);
  const Twist<double> back = log(quarter);
  CHECK(back.w.z == Approx(kPi / 2).epsilon(1e-15));
  CHECK(back.v.x == Approx(kPi).epsilon(1e-15));
  CHECK(back.v.y == Approx(0).margin(1e-15));
  // nothing moves, and a shift alone
  const Displacement<double> none = exp(Twist<double>{{0, 0, 0}, {1, 2, 3}});
  CHECK((none.r.w == 1 && none.r.v.x == 0 && none.p.x == 1 && none.p.y == 2 && none.p.z == 3));
  const Twist<double> shift = log(none);
  CHECK((shift.w.x == 0 && shift.v.x == 1 && shift.v.y == 2 && shift.v.z == 3));
}

TEST_CASE("log undoes exp for every angle below pi") {
  double worst = 0;
  for (const Twist<double>& u : sample_twists<double>(4000, 1e-3)) {
    see(worst, relative_error(eigen(log(exp(u))), eigen(u)));
  }
  INFO("worst relative error of log(exp(u)): " << worst / kEpsilon << " epsilon");
  CHECK(worst < 16 * kEpsilon);
}

TEST_CASE("dlog at a pure shift is I - 1/2 ad and a wrench carried to the step's end is dlog of -u transposed") {
  const Twist<double> shift{{0, 0, 0}, {1, 2, 3}}, y{{1, 0, -1}, {2, 1, 0}};
  const Twist<double> moved = dlog(shift, y);
  CHECK((moved.w.x == 1 && moved.w.y == 0 && moved.w.z == -1));
  // v - 1/2 (1 2 3) x (1 0 -1) = (2 1 0) - 1/2 (-2 4 -2)
  CHECK((moved.v.x == 3 && moved.v.y == -1 && moved.v.z == 1));

  Random random(29);
  double worst = 0;
  for (const Twist<double>& u : sample_twists<double>(1000, 1e-3)) {
    const Wrench<double> m = random_wrench(random, 1);
    const Wrench<double> mu = dlog_transpose(Logarithm<double>(u), m), nu = dlog_transpose(Logarithm<double>(-1.0 * u), m);
    see(worst, relative_error(eigen(carried(exp(u), mu)), eigen(nu)));
  }
  INFO("worst relative difference between Ad_exp(u)^T mu and nu: " << worst / kEpsilon << " epsilon");
  CHECK(worst < 32 * kEpsilon);
}

/// h mu of a pose at k+1 that is changed by eta, in dual numbers: the six columns of K.
reference::Matrix6<double> varied_momentum(const Inertia<double>& G, const Twist<double>& u) {
  using T = Dual<6>;
  const auto wide = [](const Vec3<double>& a) {
    return Vec3<T>{a.x, a.y, a.z};
  };
  const Inertia<T> wide_G{G.m, wide(G.mc), G.xx, G.xy, G.xz, G.yy, G.yz, G.zz};
  const Twist<T> eta{{T(0, 0), T(0, 1), T(0, 2)}, {T(0, 3), T(0, 4), T(0, 5)}};
  const Twist<T> moved = log(exp(Twist<T>{wide(u.w), wide(u.v)}) * exp(eta));
  const reference::Vector6<T> mu = eigen(dlog_transpose(Logarithm<T>(moved), wide_G * moved));
  reference::Matrix6<double> K;
  for (int row = 0; row < 6; ++row) {
    for (std::size_t column = 0; column < 6; ++column) K(row, static_cast<int>(column)) = mu[row].slope[column];
  }
  return K;
}

/// The same in plain matrices: log of exp(u) exp(eta) and the series of dlog.
reference::Matrix6<double> varied_momentum_plain(const Inertia<double>& G, const Twist<double>& u) {
  using T = Dual<6>;
  reference::Vector6<T> eta;
  for (int k = 0; k < 6; ++k) eta[k] = T(0, k);
  const reference::Matrix4<T> X = reference::exp<T>(eigen(u).cast<T>()) * reference::exp<T>(eta);
  const reference::Vector6<T> moved = reference::log<T>(X);
  const reference::Vector6<T> momentum = eigen(G).cast<T>() * moved;
  const reference::Vector6<T> mu = reference::dlog<T>(moved).transpose() * momentum;
  reference::Matrix6<double> K;
  for (int row = 0; row < 6; ++row) {
    for (std::size_t column = 0; column < 6; ++column) K(row, static_cast<int>(column)) = mu[row].slope[column];
  }
  return K;
}

TEST_CASE("pose_derivative is the derivative of h mu, for small turns and for turns of 2 and 3 rad") {
  Random random(31);
  double worst = 0, worst_plain = 0;
  for (const double angle : {0.0, 1e-12, 1e-6, 1e-3, 0.1, 1.0, 2.0, 2.5, 3.0, 3.1}) {
    for (int sample = 0; sample < 20; ++sample) {
      const Inertia<double> G = random_inertia(random);
      const Twist<double> u{random_direction(random, angle), random_vec3(random, sample % 2 == 0 ? 1 : angle)};
      const reference::Matrix6<double> K = eigen(pose_derivative(G, u, G * u));
      see(worst, relative_error(K, varied_momentum(G, u)));
      see(worst_plain, relative_error(K, varied_momentum_plain(G, u)));
    }
  }
  INFO("worst relative error of K against dual numbers: " << worst << ", in plain matrices: " << worst_plain);
  CHECK(worst < 1e-12);
  CHECK(worst_plain < 1e-12);
}

TEST_CASE("pose_derivative at rest is the inertia, and to first order what the paper's brackets say") {
  Random random(37);
  const Inertia<double> G = random_inertia(random);
  const Twist<double> none{{0, 0, 0}, {0, 0, 0}};
  CHECK(relative_error(eigen(pose_derivative(G, none, G * none)), eigen(G)) == 0);
  // K = G + 1/2 (G ad_u - ad_u^T G - [m]~) + O(u^2), [m]~ eta = ad_eta^T m
  for (const double size : {1e-3, 1e-4}) {
    const Twist<double> u = random_twist(random, size);
    const reference::Matrix6<double> ad = reference::ad<double>(eigen(u)), inertia = eigen(G);
    reference::Matrix6<double> swapped;
    for (int k = 0; k < 6; ++k)
      swapped.col(k) = reference::ad<double>(reference::Vector6<double>::Unit(k)).transpose() * eigen(G * u);
    const reference::Matrix6<double> first = 0.5 * (inertia * ad - ad.transpose() * inertia - swapped);
    const reference::Matrix6<double> K = eigen(pose_derivative(G, u, G * u));
    CHECK((K - inertia - first).norm() < 4 * size * size * inertia.norm());
    CHECK((K - inertia).norm() > 0.1 * size * inertia.norm());
  }
}

TEST_CASE("pose_derivative to first order leaves out what is quadratic in the turn") {
  Random random(37);
  for (const double size : {1e-1, 1e-2, 1e-3, 1e-4}) {
    const Twist<double> u{random_direction(random, size), random_direction(random, size)};
    const Inertia<double> G = random_inertia(random);
    const reference::Matrix6<double> K = eigen(pose_derivative(G, u, G * u));
    const reference::Matrix6<double> difference = eigen(pose_derivative_first_order(G, u.w)) - K;
    CHECK(difference.norm() < size * size * K.norm());
    CHECK(difference.norm() > 1e-3 * size * size * K.norm());
  }
}

TEST_CASE("exp, log, dlog and pose_derivative give equal bits in every lane and allocate nothing") {
  Random random(41);
  std::vector<std::array<double, 16>> samples;
  for (const Twist<double>& u : sample_twists<double>(2 * Pack::size + 3, 0.1)) {
    samples.push_back(joined(numbers_of<double>(u), numbers_of<double>(random_inertia(random))));
  }
  check_value_lanes(
      [](const auto& in) {
        using S = std::decay_t<decltype(in[0])>;
        const auto u = unpacked<Twist<S>>(in, 0);
        return joined(numbers_of<S>(exp(u)), numbers_of<S>(log(exp(u))), numbers_of<S>(dlog(u, u)));
      },
      samples, 16 * kEpsilon);
  check_value_lanes(
      [](const auto& in) {
        using S = std::decay_t<decltype(in[0])>;
        const auto u = unpacked<Twist<S>>(in, 0);
        const auto G = unpacked<Inertia<S>>(in, 6);
        return joined(numbers_of<S>(dlog_transpose(Logarithm<S>(exp(u)), G * u)), numbers_of<S>(pose_derivative(G, u, G * u)),
                      numbers_of<S>(pose_derivative_first_order(G, u.w)));
      },
      samples, 64 * kEpsilon);
}

}  // namespace
}  // namespace linden::se3_test

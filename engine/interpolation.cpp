#include "engine/interpolation.hpp"

#include "kernels/values/joints.hpp"
#include "kernels/values/se3.hpp"

namespace linden {
namespace {

Vec3<double> vec3_at(std::span<const double> numbers, Index row) { return Vec3<double>::from(numbers.data() + row); }

}  // namespace

std::vector<double> positions_between(const Model& model, const Ends& ends, double share) {
  std::vector<double> q(ends.q0.begin(), ends.q0.end());
  const double s = share, of_end = s * s * (3 - 2 * s), of_begin_rate = s * (1 - s) * (1 - s), of_end_rate = s * s * (s - 1);
  const auto cubic = [&](double end, double begin_rate, double end_rate) {
    return of_end * end + of_begin_rate * begin_rate + of_end_rate * end_rate;
  };
  const auto cubics = [&](const Vec3<double>& end, const Vec3<double>& begin_rate, const Vec3<double>& end_rate) {
    return Vec3<double>{cubic(end.x, begin_rate.x, end_rate.x), cubic(end.y, begin_rate.y, end_rate.y), cubic(end.z, begin_rate.z, end_rate.z)};
  };
  for (Index slot = 1; slot < model.tree.shape.slots; ++slot) {
    const Index row = model.tree.first_q(slot), v = model.tree.first_v(slot);
    const auto at = static_cast<std::size_t>(row), rate = static_cast<std::size_t>(v);
    const JointKind kind = model.tree.kind(slot);
    if (kind == JointKind::screw) {
      q[at] += cubic(ends.q1[at] - ends.q0[at], ends.h * ends.v0[rate], ends.h * ends.v1[rate]);
      continue;
    }
    const bool is_free = kind == JointKind::free;
    const Index turn = is_free ? row + 3 : row;
    const auto quaternion = [&](std::span<const double> of) {
      return Quaternion<double>{vec3_at(of, turn), of[static_cast<std::size_t>(turn) + 3]};
    };
    const auto shift = [&](std::span<const double> of) { return is_free ? vec3_at(of, row) : Vec3<double>{0, 0, 0}; };
    const auto twist = [&](std::span<const double> of) {
      return Twist<double>{ends.h * vec3_at(of, v), is_free ? ends.h * vec3_at(of, v + 3) : Vec3<double>{0, 0, 0}};
    };
    const Quaternion<double> begin = quaternion(ends.q0), back{-begin.v, begin.w};
    Displacement<double> moved{back * quaternion(ends.q1), rotate(back, shift(ends.q1) - shift(ends.q0))};
    if (moved.r.w < 0) moved.r = {-moved.r.v, -moved.r.w};  // the same turn
    const Twist<double> u = log(moved), begin_rate = twist(ends.v0);
    const Twist<double> end_rate = dlog(Twist<double>{-u.w, -u.v}, twist(ends.v1));
    const Displacement<double> part = exp(Twist<double>{cubics(u.w, begin_rate.w, end_rate.w), cubics(u.v, begin_rate.v, end_rate.v)});
    const Quaternion<double> turned = begin * part.r;
    turned.v.to(q.data() + turn);
    q[static_cast<std::size_t>(turn) + 3] = turned.w;
    if (is_free) (shift(ends.q0) + rotate(begin, part.p)).to(q.data() + row);
  }
  return q;
}

}  // namespace linden

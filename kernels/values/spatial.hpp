// kernels/values/spatial.hpp
// Values that sweeps work on: three-vectors, rotations, placements, twists, wrenches, 6 x 6 matrices, and how they are read from and
// written to the rows of a field.
//
// Scalar is a double, a float, or a pack of W of them; nothing here branches on a value.
//
// Conventions (the paper's): twists are (w, v), angular first; wrenches are (n, f), moment first. A placement (R, p) takes child
// coordinates to parent coordinates, x_parent = R x_child + p. Quaternions are x y z w.
#pragma once

#include <cmath>

#include "kernels/values/scalar.hpp"
#include "layout/field.hpp"

namespace linden {

template <class S>
struct Vec3 {
  S x, y, z;

  template <class E>
  LINDEN_INLINE static Vec3 from(const E* row) {
    return {as<S>(row[0]), as<S>(row[1]), as<S>(row[2])};
  }
  LINDEN_INLINE void to(S* row) const {
    row[0] = x;
    row[1] = y;
    row[2] = z;
  }

  LINDEN_INLINE friend Vec3 operator+(const Vec3& a, const Vec3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  LINDEN_INLINE friend Vec3 operator-(const Vec3& a, const Vec3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  LINDEN_INLINE friend Vec3 operator-(const Vec3& a) { return {-a.x, -a.y, -a.z}; }
  LINDEN_INLINE friend Vec3 operator*(const S& s, const Vec3& a) { return {s * a.x, s * a.y, s * a.z}; }
  LINDEN_INLINE friend Vec3 operator/(const Vec3& a, const S& s) { return {a.x / s, a.y / s, a.z / s}; }
  LINDEN_INLINE Vec3& operator+=(const Vec3& b) { return *this = *this + b; }
};

template <class S>
LINDEN_INLINE S dot(const Vec3<S>& a, const Vec3<S>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

template <class S>
LINDEN_INLINE Vec3<S> cross(const Vec3<S>& a, const Vec3<S>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// Rows x, y, z.
template <class S>
struct Mat3 {
  Vec3<S> x, y, z;

  template <class E>
  LINDEN_INLINE static Mat3 from(const E* row) {
    return {Vec3<S>::from(row), Vec3<S>::from(row + 3), Vec3<S>::from(row + 6)};
  }
  LINDEN_INLINE void to(S* row) const {
    x.to(row);
    y.to(row + 3);
    z.to(row + 6);
  }

  LINDEN_INLINE friend Mat3 operator+(const Mat3& a, const Mat3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  LINDEN_INLINE friend Mat3 operator-(const Mat3& a, const Mat3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  LINDEN_INLINE friend Mat3 operator*(const S& s, const Mat3& a) { return {s * a.x, s * a.y, s * a.z}; }
  LINDEN_INLINE friend Vec3<S> operator*(const Mat3& a, const Vec3<S>& b) { return {dot(a.x, b), dot(a.y, b), dot(a.z, b)}; }
  LINDEN_INLINE friend Mat3 operator*(const Mat3& a, const Mat3& b) {
    return {row_times(a.x, b), row_times(a.y, b), row_times(a.z, b)};
  }
  LINDEN_INLINE Mat3& operator+=(const Mat3& b) { return *this = *this + b; }

  LINDEN_INLINE static Vec3<S> row_times(const Vec3<S>& row, const Mat3& b) { return row.x * b.x + row.y * b.y + row.z * b.z; }
};

template <class S>
LINDEN_INLINE Mat3<S> transpose(const Mat3<S>& a) {
  return {{a.x.x, a.y.x, a.z.x}, {a.x.y, a.y.y, a.z.y}, {a.x.z, a.y.z, a.z.z}};
}

/// A^T b
template <class S>
LINDEN_INLINE Vec3<S> transpose_times(const Mat3<S>& a, const Vec3<S>& b) {
  return b.x * a.x + b.y * a.y + b.z * a.z;
}

/// A B^T
template <class S>
LINDEN_INLINE Mat3<S> times_transpose(const Mat3<S>& a, const Mat3<S>& b) {
  return {b * a.x, b * a.y, b * a.z};
}

/// a b^T
template <class S>
LINDEN_INLINE Mat3<S> outer(const Vec3<S>& a, const Vec3<S>& b) {
  return {a.x * b, a.y * b, a.z * b};
}

/// The matrix a^ with a^ b = a x b.
template <class S>
LINDEN_INLINE Mat3<S> hat(const Vec3<S>& a) {
  const S zero(0.0);
  return {{zero, -a.z, a.y}, {a.z, zero, -a.x}, {-a.y, a.x, zero}};
}

/// a^ B: every column crossed with a.
template <class S>
LINDEN_INLINE Mat3<S> hat_times(const Vec3<S>& a, const Mat3<S>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// B a^: every row b becomes b x a.
template <class S>
LINDEN_INLINE Mat3<S> times_hat(const Mat3<S>& b, const Vec3<S>& a) {
  return {cross(b.x, a), cross(b.y, a), cross(b.z, a)};
}

template <class S>
LINDEN_INLINE Mat3<S> diagonal(const S& s) {
  const S zero(0.0);
  return {{s, zero, zero}, {zero, s, zero}, {zero, zero, s}};
}

template <class S>
struct Quaternion {
  Vec3<S> v;
  S w;

  LINDEN_INLINE friend Quaternion operator*(const Quaternion& a, const Quaternion& b) {
    return {a.w * b.v + b.w * a.v + cross(a.v, b.v), a.w * b.w - dot(a.v, b.v)};
  }
};

/// R(q) a = a + 2 v x (w a + v x a)
template <class S>
LINDEN_INLINE Vec3<S> rotate(const Quaternion<S>& q, const Vec3<S>& a) {
  return a + S(2.0) * cross(q.v, q.w * a + cross(q.v, a));
}

template <class S>
LINDEN_INLINE Mat3<S> rotation(const Quaternion<S>& q) {
  const S one(1.0), two(2.0);
  const S xx = two * q.v.x * q.v.x, yy = two * q.v.y * q.v.y, zz = two * q.v.z * q.v.z;
  const S xy = two * q.v.x * q.v.y, xz = two * q.v.x * q.v.z, yz = two * q.v.y * q.v.z;
  const S xw = two * q.v.x * q.w, yw = two * q.v.y * q.w, zw = two * q.v.z * q.w;
  return {{one - yy - zz, xy - zw, xz + yw}, {xy + zw, one - xx - zz, yz - xw}, {xz - yw, yz + xw, one - xx - yy}};
}

/// Twist (w, v): angular [rad/s], linear [m/s].
template <class S>
struct Twist {
  Vec3<S> w, v;

  template <class E>
  LINDEN_INLINE static Twist from(const E* row) {
    return {Vec3<S>::from(row), Vec3<S>::from(row + 3)};
  }
  LINDEN_INLINE void to(S* row) const {
    w.to(row);
    v.to(row + 3);
  }

  LINDEN_INLINE friend Twist operator+(const Twist& a, const Twist& b) { return {a.w + b.w, a.v + b.v}; }
  LINDEN_INLINE friend Twist operator-(const Twist& a, const Twist& b) { return {a.w - b.w, a.v - b.v}; }
  LINDEN_INLINE friend Twist operator*(const S& s, const Twist& a) { return {s * a.w, s * a.v}; }
};

/// Wrench, impulse or momentum (n, f): moment about the frame's origin, force.
template <class S>
struct Wrench {
  Vec3<S> n, f;

  template <class E>
  LINDEN_INLINE static Wrench from(const E* row) {
    return {Vec3<S>::from(row), Vec3<S>::from(row + 3)};
  }
  LINDEN_INLINE void to(S* row) const {
    n.to(row);
    f.to(row + 3);
  }

  LINDEN_INLINE friend Wrench operator+(const Wrench& a, const Wrench& b) { return {a.n + b.n, a.f + b.f}; }
  LINDEN_INLINE friend Wrench operator-(const Wrench& a, const Wrench& b) { return {a.n - b.n, a.f - b.f}; }
  LINDEN_INLINE friend Wrench operator-(const Wrench& a) { return {-a.n, -a.f}; }
  LINDEN_INLINE friend Wrench operator*(const S& s, const Wrench& a) { return {s * a.n, s * a.f}; }
  LINDEN_INLINE friend Wrench operator/(const Wrench& a, const S& s) { return {a.n / s, a.f / s}; }
};

template <class S>
LINDEN_INLINE S dot(const Wrench<S>& a, const Twist<S>& b) {
  return dot(a.n, b.w) + dot(a.f, b.v);
}

/// Rotation matrix and shift: child -> parent.
template <class S>
struct Placement {
  Mat3<S> R;
  Vec3<S> p;

  template <class E>
  LINDEN_INLINE static Placement from(const E* row) {
    return {Mat3<S>::from(row), Vec3<S>::from(row + 9)};
  }
  LINDEN_INLINE void to(S* row) const {
    R.to(row);
    p.to(row + 9);
  }
};

/// Unit quaternion and shift: a displacement near identity keeps its relative accuracy.
template <class S>
struct Displacement {
  Quaternion<S> r;
  Vec3<S> p;

  template <class E>
  LINDEN_INLINE static Displacement from(const E* row) {
    return {{Vec3<S>::from(row), as<S>(row[3])}, Vec3<S>::from(row + 4)};
  }
  LINDEN_INLINE void to(S* row) const {
    r.v.to(row);
    row[3] = r.w;
    p.to(row + 4);
  }

  LINDEN_INLINE friend Displacement operator*(const Displacement& a, const Displacement& b) {
    return {a.r * b.r, a.p + rotate(a.r, b.p)};
  }
};

/// Ad_{X^-1} V: a twist given in the parent's frame, in the child's.
template <class S>
LINDEN_INLINE Twist<S> to_child(const Placement<S>& X, const Twist<S>& V) {
  return {transpose_times(X.R, V.w), transpose_times(X.R, V.v + cross(V.w, X.p))};
}

/// Ad_{D^-1} V for a displacement.
template <class S>
LINDEN_INLINE Twist<S> to_child(const Displacement<S>& D, const Twist<S>& V) {
  const Quaternion<S> back{-D.r.v, D.r.w};
  return {rotate(back, V.w), rotate(back, V.v + cross(V.w, D.p))};
}

/// Ad_{X^-1}^T F: a wrench given in the child's frame, in the parent's.
template <class S>
LINDEN_INLINE Wrench<S> to_parent(const Placement<S>& X, const Wrench<S>& F) {
  const Vec3<S> f = X.R * F.f;
  return {X.R * F.n + cross(X.p, f), f};
}

/// Ad_D^T F: a wrench given in the frame before the displacement D, in the frame after it.
template <class S>
LINDEN_INLINE Wrench<S> carried(const Displacement<S>& D, const Wrench<S>& F) {
  const Quaternion<S> back{-D.r.v, D.r.w};
  return {rotate(back, F.n - cross(D.p, F.f)), rotate(back, F.f)};
}

/// Mass, first moment and inertia about the frame's origin (the frame need not sit at the centre of mass).
template <class S>
struct Inertia {
  S m;
  Vec3<S> mc;
  S xx, xy, xz, yy, yz, zz;

  template <class E>
  LINDEN_INLINE static Inertia from(const E* row) {
    return {as<S>(row[0]), Vec3<S>::from(row + 1), as<S>(row[4]), as<S>(row[5]), as<S>(row[6]), as<S>(row[7]), as<S>(row[8]), as<S>(row[9])};
  }

  LINDEN_INLINE Mat3<S> rotational() const { return {{xx, xy, xz}, {xy, yy, yz}, {xz, yz, zz}}; }

  /// G V
  LINDEN_INLINE friend Wrench<S> operator*(const Inertia& G, const Twist<S>& V) {
    return {G.rotational() * V.w + cross(G.mc, V.v), G.m * V.v - cross(G.mc, V.w)};
  }
};

/// Twist -> wrench: n = aa w + ab v, f = ba w + bb v.
template <class S>
struct Mat6 {
  Mat3<S> aa, ab, ba, bb;

  template <class E>
  LINDEN_INLINE static Mat6 from(const E* row) {
    return {Mat3<S>::from(row), Mat3<S>::from(row + 9), Mat3<S>::from(row + 18), Mat3<S>::from(row + 27)};
  }
  LINDEN_INLINE void to(S* row) const {
    aa.to(row);
    ab.to(row + 9);
    ba.to(row + 18);
    bb.to(row + 27);
  }
  LINDEN_INLINE friend Mat6 operator+(const Mat6& a, const Mat6& b) { return {a.aa + b.aa, a.ab + b.ab, a.ba + b.ba, a.bb + b.bb}; }
  LINDEN_INLINE friend Wrench<S> operator*(const Mat6& a, const Twist<S>& b) {
    return {a.aa * b.w + a.ab * b.v, a.ba * b.w + a.bb * b.v};
  }
};

/// Row i of a field as a value; a scalar constant is spread over the lanes of a pack.
template <template <class> class Value, class S, class Element, int Components>
LINDEN_INLINE Value<S> load(const Field<Element, Components>& field, Index i) {
  static_assert(sizeof(Value<S>) == sizeof(S) * Components);
  return Value<S>::from(field.row(i));
}

template <class S, int Components, class Value>
LINDEN_INLINE void store(Field<S, Components>& field, Index i, const Value& value) {
  static_assert(sizeof(Value) == sizeof(S) * Components);
  value.to(field.row(i));
}

/// Three or six consecutive rows of a one-component field: the velocities of a ball or free joint.
template <class S, class Element>
LINDEN_INLINE Vec3<S> load3(const Field<Element>& field, Index row) {
  return {as<S>(field(row)), as<S>(field(row + 1)), as<S>(field(row + 2))};
}

template <class S>
LINDEN_INLINE void store3(Field<S>& field, Index row, const Vec3<S>& value) {
  field(row) = value.x;
  field(row + 1) = value.y;
  field(row + 2) = value.z;
}

}  // namespace linden

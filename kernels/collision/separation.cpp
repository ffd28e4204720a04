#include "kernels/collision/separation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/collision/directions.hpp"

namespace linden {
namespace {

constexpr double kTouchingOfSize = 1e-7;      // of the size: nearer than this EPA takes over
constexpr double kRoundingOfSize = 4e-16;     // of the size
constexpr int kMostNearer = 64;          // of GJK
constexpr int kMostCorners = 132;        // of EPA's polytope
constexpr int kMostFaces = 1024;

Vec3<double> support_difference(const PlacedConvex& a, const PlacedConvex& b, const Vec3<double>& n) { return support(a, n) - support(b, -n); }
bool same_place(const Vec3<double>& a, const Vec3<double>& b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

/// A cross product of two edges at unit length. Where these are nearly parallel it is rounded off, and its share along one of them, which the length
/// of that edge multiplies, is taken away.
Vec3<double> at_right_angles(const Vec3<double>& product, const Vec3<double>& edge) {
  Vec3<double> n = product / length_of(product);
  n = n - dot(n, edge) * edge;
  return n / length_of(n);
}

/// Points of A - B, one to four.
struct Simplex {
  Vec3<double> w[4];
  int count = 0;
};

/// The point of a segment, triangle or tetrahedron that is nearest to the origin; leaves the corners that it lies between.
Vec3<double> nearest_of_segment(Simplex& s) {
  const Vec3<double> a = s.w[0], d = s.w[1] - a;
  const double along = -dot(a, d), length = dot(d, d);
  if (along <= 0) {
    s.count = 1;
    return a;
  }
  if (along >= length) {
    s.w[0] = s.w[1];
    s.count = 1;
    return s.w[0];
  }
  return a + (along / length) * d;
}

Vec3<double> nearest_of_triangle(Simplex& s) {
  const Vec3<double> a = s.w[0], b = s.w[1], c = s.w[2];
  const Vec3<double> ab = b - a, ac = c - a;
  const Vec3<double> normal = cross(ab, ac);
  const double area = dot(normal, normal);
  // shares of the corners, times area: of the origin's foot in the plane
  const double share_c = -dot(cross(ab, a), normal), share_b = -dot(cross(a, ac), normal), share_a = area - share_b - share_c;
  if (area > 0 && share_a > 0 && share_b > 0 && share_c > 0) return (dot(a, normal) / area) * normal;
  // else on an edge: the nearest of the three
  Simplex best;
  Vec3<double> nearest{};
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k) {
    Simplex edge;
    edge.w[0] = s.w[k];
    edge.w[1] = s.w[(k + 1) % 3];
    edge.count = 2;
    const Vec3<double> v = nearest_of_segment(edge);
    if (dot(v, v) < least) least = dot(v, v), nearest = v, best = edge;
  }
  s = best;
  return nearest;
}

Vec3<double> nearest_of_tetrahedron(Simplex& s) {
  Simplex best;
  Vec3<double> nearest{};
  double least = std::numeric_limits<double>::infinity();
  bool inside = true;
  for (int k = 0; k < 4; ++k) {
    const Vec3<double> a = s.w[k], b = s.w[(k + 1) % 4], c = s.w[(k + 2) % 4], other = s.w[(k + 3) % 4];
    const Vec3<double> normal = cross(b - a, c - a);
    const double origin = -dot(a, normal), opposite = dot(other - a, normal);
    if (opposite != 0 && (origin > 0) == (opposite > 0) && origin != 0) continue;  // it lies on the inner side of this face
    inside = false;
    Simplex face;
    face.w[0] = a;
    face.w[1] = b;
    face.w[2] = c;
    face.count = 3;
    const Vec3<double> v = nearest_of_triangle(face);
    if (dot(v, v) < least) least = dot(v, v), nearest = v, best = face;
  }
  if (inside) return {0, 0, 0};
  s = best;
  return nearest;
}

Vec3<double> nearest_of(Simplex& s) {
  switch (s.count) {
    case 1: return s.w[0];
    case 2: return nearest_of_segment(s);
    case 3: return nearest_of_triangle(s);
    default: return nearest_of_tetrahedron(s);
  }
}

struct PolytopeFace {
  int v[3];    // corners, anticlockwise seen from outside
  int across[3];  // face beyond the edge from v[k] to v[k + 1]
  int edge[3];    // which edge of that face it is
  Vec3<double> n;
  double d;    // distance of its plane from the origin, along n
  bool alive;
};

/// The polytope of EPA. Distances are signed by the way a face's corners run: the origin may lie outside.
class Polytope {
 public:
  Polytope(const PlacedConvex& a, const PlacedConvex& b, double size) : a_(a), b_(b), size_(size) {}

  /// A direction that is least nearby. Where A - B is flat its normal.
  Vec3<double> deepest(const Simplex& start, double tolerance) {
    Vec3<double> flat;
    if (!begin(start, flat)) return flat;
    Vec3<double> best = flat;
    double least = std::numeric_limits<double>::infinity();
    while (points_ < kMostCorners) {
      int nearest = -1;
      for (int k = 0; k < faces_; ++k) {
        if (face_[k].alive && (nearest < 0 || face_[k].d < face_[nearest].d)) nearest = k;
      }
      if (nearest < 0) break;
      const Vec3<double> n = face_[nearest].n;
      if (dot(n, n) == 0) break;  // all that is left is slivers
      const Vec3<double> w = support_difference(a_, b_, n);
      const double h = dot(n, w);
      if (h < least) least = h, best = n;
      // what was found along another face may be as near as this one can come
      if (least - face_[nearest].d <= tolerance) break;
      if (h - face_[nearest].d <= kRoundingOfSize * size_ || faces_ + 2 * points_ + 8 > kMostFaces || !add(nearest, w)) break;
    }
    return best;
  }

 private:
  /// Four points with a volume; else the normal of what there is.
  bool begin(const Simplex& start, Vec3<double>& flat) {
    const double least = 1e-13 * size_;
    Vec3<double> s, t;
    p_[0] = start.w[0];
    points_ = 1;
    const auto try_points = [&](auto&& farther, std::initializer_list<Vec3<double>> directions) {
      // the farthest of what the simplex has and what lies along some directions
      double best = least;
      Vec3<double> found{};
      const auto consider = [&](const Vec3<double>& w) {
        const double far = farther(w);
        if (far > best) best = far, found = w;
      };
      for (int k = 1; k < start.count; ++k) consider(start.w[k]);
      if (best <= 1e-3 * size_) {
        for (const Vec3<double>& n : directions) consider(support_difference(a_, b_, n));
      }
      if (best <= least) return false;
      p_[points_++] = found;
      return true;
    };
    flat = {0, 0, 1};
    const auto from_first = [&](const Vec3<double>& w) { return length_of(w - p_[0]); };
    if (!try_points(from_first, {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}})) return false;
    Vec3<double> line = p_[1] - p_[0];
    line = line / length_of(line);
    directions_across(line, s, t);
    flat = least_of(s, t);
    const Vec3<double> u = 0.5 * s + 0.8660254037844386 * t, v = -0.5 * s + 0.8660254037844386 * t;
    if (!try_points([&](const Vec3<double>& w) { return length_of(cross(w - p_[0], line)); }, {s, -s, u, -u, v, -v})) return false;
    Vec3<double> normal = cross(p_[1] - p_[0], p_[2] - p_[0]);
    normal = normal / length_of(normal);
    flat = least_of(normal, normal);
    if (!try_points([&](const Vec3<double>& w) { return std::abs(dot(w - p_[0], normal)); }, {normal, -normal})) return false;
    if (dot(p_[3] - p_[0], normal) > 0) std::swap(p_[1], p_[2]);
    // the fourth lies behind the face of the first three
    const int corners[4][3] = {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}};
    for (const auto& c : corners) new_face(c[0], c[1], c[2]);
    link(0, 0, 1, 2), link(0, 1, 2, 2), link(0, 2, 3, 2);
    link(1, 1, 2, 0), link(2, 1, 3, 0), link(3, 1, 1, 0);
    return true;
  }

  Vec3<double> least_of(const Vec3<double>& s, const Vec3<double>& t) const {
    Vec3<double> best = s;
    double least = std::numeric_limits<double>::infinity();
    for (const Vec3<double>& n : {s, -s, t, -t}) {
      const double h = dot(n, support_difference(a_, b_, n));
      if (h < least) least = h, best = n;
    }
    return best;
  }

  int new_face(int i, int j, int k) {
    PolytopeFace& face = face_[faces_];
    face.v[0] = i, face.v[1] = j, face.v[2] = k;
    face.alive = true;
    const Vec3<double> ij = p_[j] - p_[i], ik = p_[k] - p_[i];
    Vec3<double> normal = cross(ij, ik);
    const double length = length_of(normal);
    if (length <= 1e-14 * length_of(ij) * length_of(ik) || length == 0) {
      face.n = {0, 0, 0};
      face.d = std::numeric_limits<double>::infinity();
    } else {
      face.n = normal / length;
      face.d = dot(face.n, p_[i]);
    }
    return faces_++;
  }

  void link(int f, int e, int g, int k) {
    face_[f].across[e] = g, face_[f].edge[e] = k;
    face_[g].across[k] = f, face_[g].edge[k] = e;
  }

  /// Faces that see the new point go, from `first` on over their edges; the edges of the hole are kept in their order.
  bool add(int first, const Vec3<double>& w) {
    p_[points_] = w;
    edges_ = 0;
    face_[first].alive = false;
    for (int e = 0; e < 3; ++e) hole(face_[first].across[e], face_[first].edge[e]);
    if (edges_ < 3) return false;
    for (int k = 0; k < edges_; ++k) {
      // rounding can tear a hole in two
      const int* one = hole_[k];
      const int* before = hole_[k > 0 ? k - 1 : edges_ - 1];
      if (face_[one[0]].v[(one[1] + 1) % 3] != face_[before[0]].v[before[1]]) return false;
    }
    const int begin = faces_;
    for (int k = 0; k < edges_; ++k) {
      const int f = hole_[k][0], e = hole_[k][1];
      const int g = new_face(face_[f].v[(e + 1) % 3], face_[f].v[e], points_);
      link(g, 0, f, e);
      if (k > 0) link(g, 2, g - 1, 1);
    }
    link(begin, 2, faces_ - 1, 1);
    points_ += 1;
    return true;
  }

  void hole(int f, int e) {
    PolytopeFace& face = face_[f];
    if (!face.alive) return;
    if (!(dot(face.n, p_[points_]) > face.d)) {
      hole_[edges_][0] = f, hole_[edges_][1] = e;
      edges_ += 1;
      return;
    }
    face.alive = false;
    const int next = (e + 1) % 3, last = (e + 2) % 3;
    hole(face.across[next], face.edge[next]);
    hole(face.across[last], face.edge[last]);
  }

  const PlacedConvex& a_;
  const PlacedConvex& b_;
  double size_;
  Vec3<double> p_[kMostCorners + 1];
  int points_ = 0;
  PolytopeFace face_[kMostFaces];
  int faces_ = 0;
  int hole_[kMostFaces][2];
  int edges_ = 0;
};

/// What is tried beside a direction.
class Polish {
 public:
  Polish(const PlacedConvex& a, const PlacedConvex& b, double size) : a_(a), b_(b), slack_(kRoundingOfSize * size) {}

  Separation around(const Vec3<double>& start) {
    n_ = start;
    h_ = dot(start, support_difference(a_, b_, start));
    given_ = true;
    // what is found first need not be what lies beside it
    for (int round = 0; round < 3; ++round) {
      const double before = h_;
      const Vec3<double> from = n_;
      once(from);
      if (!(h_ < before - slack_)) break;
    }
    return {n_, -h_, false};
  }

 private:
  void once(const Vec3<double>& from) {
    Kinks kinks_a, kinks_b;
    kinks_near(a_, from, kinks_a);
    kinks_near(b_, -from, kinks_b);
    for (std::size_t k = 0; k < kinks_a.face_count; ++k) consider(kinks_a.faces[k]);
    for (std::size_t k = 0; k < kinks_b.face_count; ++k) consider(-kinks_b.faces[k]);
    for (std::size_t i = 0; i < kinks_a.edge_count; ++i) {
      for (std::size_t j = 0; j < kinks_b.edge_count; ++j) {
        const Vec3<double> normal = cross(kinks_a.edges[i], kinks_b.edges[j]);
        const double length = length_of(normal);
        if (length < 1e-12) continue;
        const Vec3<double> n = std::copysign(1.0, dot(normal, from)) * at_right_angles(normal, kinks_a.edges[i]);
        if (dot(n, from) > 0.9) consider(n);
      }
    }
    for (std::size_t k = 0; k < kinks_a.edge_count; ++k) along(kinks_a.edges[k], from);
    for (std::size_t k = 0; k < kinks_b.edge_count; ++k) along(kinks_b.edges[k], from);
    smooth(from);
  }

  bool consider(const Vec3<double>& n) {
    const double h = dot(n, support_difference(a_, b_, n));
    // a direction that is exact stands before the one that was given
    if (!(h < h_ - (given_ ? -slack_ : slack_))) return false;
    h_ = h, n_ = n, given_ = false;
    return true;
  }

  Vec3<double> bend_of_both(const Vec3<double>& n, const Vec3<double>& t) const { return bend(a_, n, t) + bend(b_, -n, t); }

  void along(const Vec3<double>& edge, Vec3<double> n) {
    n = n - dot(n, edge) * edge;
    n = n / length_of(n);
    double h = 0;
    for (int step = 0; step < 8; ++step) {
      const Vec3<double> t = cross(edge, n), w = support_difference(a_, b_, n);
      h = dot(n, w);
      const double slope = dot(w, t), curve = dot(t, bend_of_both(n, t)) - h;
      if (!(curve > 0)) break;
      const double turn = -slope / curve;
      if (!(std::abs(turn) < 0.5)) break;
      Vec3<double> next = n + turn * t;
      next = next - dot(next, edge) * edge;
      n = next / length_of(next);
      if (std::abs(turn) < 1e-9) break;  // what is left of it is its square
    }
    consider(n);
  }

  void smooth(Vec3<double> n) {
    for (int step = 0; step < 10; ++step) {
      Vec3<double> s, t;
      directions_across(n, s, t);
      const Vec3<double> w = support_difference(a_, b_, n);
      const double h = dot(n, w);
      const Vec3<double> bend_s = bend_of_both(n, s), bend_t = bend_of_both(n, t);
      const double ss = dot(s, bend_s) - h, tt = dot(t, bend_t) - h, st = dot(s, bend_t);
      const double det = ss * tt - st * st;
      if (!(ss + tt > 0 && det > 0)) break;
      const double gs = dot(w, s), gt = dot(w, t);
      const double xs = -(tt * gs - st * gt) / det, xt = -(ss * gt - st * gs) / det;
      const double turn = std::sqrt(xs * xs + xt * xt);
      if (!(turn < 0.5)) break;
      const Vec3<double> next = n + xs * s + xt * t;
      n = next / length_of(next);
      if (turn < 1e-9) break;
    }
    consider(n);
  }

  const PlacedConvex& a_;
  const PlacedConvex& b_;
  double slack_;
  Vec3<double> n_{};
  double h_ = 0;
  bool given_ = false;
};

}  // namespace

double distance_along(const PlacedConvex& a, const PlacedConvex& b, const Vec3<double>& n) { return -dot(n, support_difference(a, b, n)); }

Separation polished(const PlacedConvex& a, const PlacedConvex& b, const Vec3<double>& n, double size) { return Polish(a, b, size).around(n); }

Separation separation(const PlacedConvex& a, const PlacedConvex& b, double size, double margin) {
  const bool polyhedra = is_polyhedron(a.shape) && is_polyhedron(b.shape);
  const double close = polyhedra ? 1e-15 : 1e-9;  // of v.v: where a step brings no more than this; the polish does the rest
  Vec3<double> start = b.p - a.p;
  if (dot(start, start) == 0) start = {1, 0, 0};
  Simplex simplex;
  Vec3<double> v = support_difference(a, b, start);
  simplex.w[0] = v;
  simplex.count = 1;
  bool apart = true;
  for (int step = 0; step < kMostNearer; ++step) {
    const double vv = dot(v, v);
    if (!(vv > kTouchingOfSize * kTouchingOfSize * size * size)) {
      apart = false;
      break;
    }
    const Vec3<double> w = support_difference(a, b, -v);
    const double bound = dot(v, w);  // |v| times a bound below the distance
    if (bound > 0 && bound * bound > margin * margin * vv && margin >= 0) return {-v / std::sqrt(vv), bound / std::sqrt(vv), true};
    if (vv - bound <= close * vv) break;
    bool known = false;
    for (int k = 0; k < simplex.count; ++k) known = known || same_place(w, simplex.w[k]);
    if (known) break;
    Simplex next = simplex;
    next.w[next.count++] = w;
    const Vec3<double> nearer = nearest_of(next);
    if (next.count == 4 && nearer.x == 0 && nearer.y == 0 && nearer.z == 0) {
      simplex = next;
      apart = false;
      break;
    }
    if (!(dot(nearer, nearer) < vv)) break;  // rounding
    simplex = next;
    v = nearer;
  }
  if (apart) return polished(a, b, -v / length_of(v), size);
  Polytope polytope(a, b, size);
  return polished(a, b, polytope.deepest(simplex, polyhedra ? 1e-14 * size : 1e-10 * size), size);
}

Separation box_separation(const PlacedConvex& a, const PlacedConvex& b, double size) {
  const auto& s = a.shape.half;
  const auto& t = b.shape.half;
  const Mat3<double> A = transpose(a.R), B = transpose(b.R);  // axes as rows
  const Vec3<double> axes_a[3] = {A.x, A.y, A.z}, axes_b[3] = {B.x, B.y, B.z};
  const Vec3<double> d = b.p - a.p;
  double c[3][3], far[3][3];  // cosines between the axes
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) c[i][j] = dot(axes_a[i], axes_b[j]), far[i][j] = std::abs(c[i][j]);
  }
  const double ta[3] = {dot(d, axes_a[0]), dot(d, axes_a[1]), dot(d, axes_a[2])};
  const double tb[3] = {dot(d, axes_b[0]), dot(d, axes_b[1]), dot(d, axes_b[2])};
  Separation best{{0, 0, 1}, -std::numeric_limits<double>::infinity(), false};
  const auto consider = [&](double apart, double side, const Vec3<double>& axis) {
    if (apart > best.distance + kRoundingOfSize * size) best.distance = apart, best.n = side < 0 ? -axis : axis;
  };
  for (int i = 0; i < 3; ++i) {
    const auto k = static_cast<std::size_t>(i);
    consider(std::abs(ta[i]) - s[k] - (t[0] * far[i][0] + t[1] * far[i][1] + t[2] * far[i][2]), ta[i], axes_a[i]);
  }
  for (int j = 0; j < 3; ++j) {
    const auto k = static_cast<std::size_t>(j);
    consider(std::abs(tb[j]) - t[k] - (s[0] * far[0][j] + s[1] * far[1][j] + s[2] * far[2][j]), tb[j], axes_b[j]);
  }
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      // a_i x b_j: d.(a_i x b_j) = t_(i+2) c_(i+1)j - t_(i+1) c_(i+2)j; it is as long as the sine between them
      const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
      const Vec3<double> axis = cross(axes_a[i], axes_b[j]);
      const double sine = length_of(axis);
      if (sine < 1e-12) continue;  // parallel edges: a face parts as well
      const double along = dot(d, axis);
      const auto k = [](int m) { return static_cast<std::size_t>(m); };
      const double reach = s[k(i1)] * far[i2][j] + s[k(i2)] * far[i1][j] + t[k(j1)] * far[i][j2] + t[k(j2)] * far[i][j1];
      if ((std::abs(along) - reach) / sine + 1e-14 * size / sine <= best.distance) continue;
      const Vec3<double> n = std::copysign(1.0, along) * at_right_angles(axis, axes_a[i]);
      consider(distance_along(a, b, n), 1, n);
    }
  }
  return best;
}

}  // namespace linden

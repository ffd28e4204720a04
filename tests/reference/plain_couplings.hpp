// tests/reference/plain_couplings.hpp
// Couplings as the plain simulator sees them: gaps from 4 x 4 poses, their derivatives by automatic differentiation, dense multipliers.
//
//   u' = A^-1 (f - C^T lambda),   C A^-1 C^T lambda = C A^-1 f + C' u      the pseudo-inverse: rows may follow from others
//   positions and velocities are put back onto the gaps, least in A, after every step
//   rows that give way: f = -C^T (k g + d C v)
//
// source  Featherstone, Rigid Body Dynamics Algorithms, 8.1; Hairer, Wanner, Solving Ordinary Differential Equations II, VII.2 (projection)
#pragma once

#include <algorithm>
#include <vector>

#include "layout/couplings.hpp"
#include "tests/reference/plain_tree.hpp"

namespace linden::reference {

/// Which rows of couplings are meant.
enum class Rows { rigid, giving_way };

class PlainCouplings {
 public:
  PlainCouplings(const PlainTree& tree, std::vector<Coupling> couplings, Rows which = Rows::rigid) : tree_(tree), couplings_(std::move(couplings)) {
    Eigen::Index at = 0;
    for (const Coupling& one : couplings_) {
      for (const GapRow& row : rows_of(one)) {
        const Compliance& law = compliance_of(one, row);
        if (law.gives_way() == (which == Rows::giving_way)) {
          rows_.push_back(at);
          laws_.push_back(law);
        }
        ++at;
      }
    }
  }

  bool empty() const { return rows_.empty(); }
  /// Of each row.
  const std::vector<Compliance>& laws() const { return laws_; }

  /// -C^T (k g + d C v), of rows that give way.
  VectorXd force(const VectorXd& q, const VectorXd& v) const {
    const MatrixXd C = opening(q);
    VectorXd pull = gaps(q);
    const VectorXd rate = C * v;
    for (std::size_t k = 0; k < laws_.size(); ++k) {
      const auto row = static_cast<Eigen::Index>(k);
      pull[row] = laws_[k].stiffness * pull[row] + laws_[k].damping * rate[row];
    }
    return -(C.transpose() * pull);
  }

  /// Gaps of positions q varied by eps.
  template <class T>
  VectorX<T> gaps(const VectorXd& q, const VectorX<T>& eps) const {
    const std::vector<Matrix4<T>> pose = poses<T>(tree_, q, eps);
    std::vector<T> all;
    for (const Coupling& one : couplings_) {
      if (one.kind == CouplingKind::gear) {
        T sum(one.offset);
        for (const GearTerm& term : one.terms) sum += T(term.ratio) * (T(q[term.q_row]) + eps[term.v_row]);
        all.push_back(sum);
        continue;
      }
      if (one.kind == CouplingKind::cable) {
        using std::sqrt;
        const auto at = [&](const CablePoint& point) {
          const Vector3<T> in_body(T(point.at[0]), T(point.at[1]), T(point.at[2]));
          const Matrix4<T>& body = pose[static_cast<std::size_t>(point.slot)];
          return Vector3<T>(body.template topRightCorner<3, 1>() + body.template topLeftCorner<3, 3>() * in_body);
        };
        T length(0);
        for (std::size_t k = 1; k < one.points.size(); ++k) {
          const Vector3<T> apart = at(one.points[k]) - at(one.points[k - 1]);
          length += sqrt(T(apart.dot(apart)));
        }
        const GearTerm& term = one.terms.front();
        all.push_back(length - (T(q[term.q_row]) + eps[term.v_row]));
        continue;
      }
      const Matrix4<T> A = pose[static_cast<std::size_t>(one.slot_a)] * matrix_of(one.frame_a).template cast<T>();
      const Matrix4<T> B = pose[static_cast<std::size_t>(one.slot_b)] * matrix_of(one.frame_b).template cast<T>();
      const Matrix3<T> a = A.template topLeftCorner<3, 3>(), b = B.template topLeftCorner<3, 3>();
      const Vector3<T> apart = B.template topRightCorner<3, 1>() - A.template topRightCorner<3, 1>(), d = a.transpose() * apart;
      const auto cosine = [&](int i, int j) { return T(a.col(i).dot(b.col(j))); };
      const auto add = [&](std::initializer_list<T> numbers) { all.insert(all.end(), numbers); };
      switch (one.kind) {
        case CouplingKind::ball: add({d[0], d[1], d[2]}); break;
        case CouplingKind::hinge: add({d[0], d[1], d[2], cosine(0, 2), cosine(1, 2)}); break;
        case CouplingKind::universal: add({d[0], d[1], d[2], cosine(0, 1)}); break;
        case CouplingKind::cylindrical: add({d[0], d[1], cosine(0, 2), cosine(1, 2)}); break;
        case CouplingKind::slider: add({d[0], d[1], cosine(0, 2), cosine(1, 2), cosine(0, 1)}); break;
        case CouplingKind::weld: add({d[0], d[1], d[2], cosine(0, 2), cosine(1, 2), cosine(0, 1)}); break;
        case CouplingKind::point_on_line: add({d[0], d[1]}); break;
        case CouplingKind::point_on_plane: add({d[2]}); break;
        case CouplingKind::rod: {
          using std::sqrt;
          add({sqrt(apart.dot(apart)) - T(one.length)});
          break;
        }
        case CouplingKind::bushing: {
          using std::atan2, std::sqrt;
          const Matrix3<T> turn = a.transpose() * b;
          const Vector3<T> shifts = half_of(turn).transpose() * d;
          const T level = sqrt(T(turn(0, 0) * turn(0, 0) + turn(1, 0) * turn(1, 0)));
          const Vector3<T> angles(atan2(turn(2, 1), turn(2, 2)), atan2(T(-turn(2, 0)), level), atan2(turn(1, 0), turn(0, 0)));
          for (const GapRow& row : rows_of(one)) all.push_back((row.kind == GapKind::angle ? angles : shifts)[row.a]);
          break;
        }
        case CouplingKind::gear:
        case CouplingKind::cable:
        case CouplingKind::face_contact:
        case CouplingKind::round_contact: break;
      }
    }
    VectorX<T> result(static_cast<Eigen::Index>(rows_.size()));
    for (std::size_t k = 0; k < rows_.size(); ++k) result[static_cast<Eigen::Index>(k)] = all[static_cast<std::size_t>(rows_[k])];
    return result;
  }
  VectorXd gaps(const VectorXd& q) const { return gaps<double>(q, VectorXd::Zero(tree_.velocities)); }

  /// How velocities open them: C [rows x nv].
  MatrixXd opening(const VectorXd& q) const {
    MatrixXd C(gaps(q).size(), tree_.velocities);
    each_direction<8>(tree_.velocities, [&](Index first, Index count, const VectorX<Dual<8>>& eps) {
      const VectorX<Dual<8>> gap = gaps<Dual<8>>(q, eps);
      for (Eigen::Index row = 0; row < gap.size(); ++row) {
        for (Index k = 0; k < count; ++k) C(row, first + k) = gap[row].slope[static_cast<std::size_t>(k)];
      }
    });
    return C;
  }

  /// C' v: how fast opening rates change at steady v, by differences of fourth order.
  VectorXd bend(const VectorXd& q, const VectorXd& v) const {
    const double fast = v.cwiseAbs().maxCoeff(), dt = fast > 0 ? 1e-3 / fast : 0;
    if (dt == 0) return VectorXd::Zero(gaps(q).size());
    const auto rate = [&](double t) { return VectorXd(opening(advanced(tree_, q, t * v)) * v); };
    return (8 * (rate(dt) - rate(-dt)) - (rate(2 * dt) - rate(-2 * dt))) / (12 * dt);
  }

  /// Of rows whose matrix is D: the share of right sides that they can take, least in size. free: how far each would move were no joint's motion
  /// given. What moves less than 1e-8 of that is rounding, also where nothing moves more.
  static VectorXd multipliers(const MatrixXd& D, const VectorXd& right, const VectorXd& free) {
    const VectorXd scale = free.cwiseSqrt().cwiseInverse();
    Eigen::CompleteOrthogonalDecomposition<MatrixXd> solve;
    const MatrixXd moved = scale.asDiagonal() * D * scale.asDiagonal();
    solve.setThreshold(1e-8 / std::clamp(moved.colwise().norm().maxCoeff(), 1e-8, 1.0));  // of the largest column
    solve.compute(moved);
    return scale.cwiseProduct(solve.solve(scale.cwiseProduct(right)));
  }

 private:
  /// The root of a rotation of less than half a turn: the mean of none and all of it, made orthonormal (Newton's iteration for the polar factor).
  template <class T>
  static Matrix3<T> half_of(const Matrix3<T>& turn) {
    Matrix3<T> half = Matrix3<T>::Identity() + turn;
    for (int k = 0; k < 20; ++k) half = Matrix3<T>(T(0.5) * (half + half.inverse().transpose()));
    return half;
  }
  static Matrix4<double> matrix_of(const Pose& pose) {
    Matrix4<double> m = Matrix4<double>::Identity();
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) m(row, column) = pose.rotation[static_cast<std::size_t>(3 * row + column)];
      m(row, 3) = pose.shift[static_cast<std::size_t>(row)];
    }
    return m;
  }

  const PlainTree& tree_;
  std::vector<Coupling> couplings_;
  std::vector<Eigen::Index> rows_;  // those that are meant, among all
  std::vector<Compliance> laws_;
};

}  // namespace linden::reference
